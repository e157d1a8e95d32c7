import { expect, test } from "vitest";
import { colorMap, findRange, formatNumber, partColors } from "../src/core/colors";

test("a map has 256 colors, all opaque", () => {
  const colors = colorMap("viridis");
  expect(colors.length).toBe(1024);
  expect([...colors.slice(0, 4)]).toEqual([68, 1, 84, 255]);
  expect(colors.filter((_, i) => i % 4 === 3).every((opacity) => opacity === 255)).toBe(true);
});

test("part colors repeat after 18, all different", () => {
  const colors = Array.from({ length: 19 }, (_, i) => partColors(19).slice(3 * i, 3 * i + 3).join());
  expect(colors[0]).toBe("31,119,180");
  expect(colors[18]).toBe(colors[0]);
  expect(new Set(colors).size).toBe(18);
});

test("the range of values", () => {
  expect(findRange(Float32Array.of(2, -1, 3))).toEqual([-1, 3]);
});

test("numbers are short and plain", () => {
  const pairs: [number, string][] = [
    [0, "0"], [1234.56, "1235"], [-0.5, "−0.5"], [0.00012, "1.20e−4"], [2.5e7, "2.50e+7"], [Infinity, "∞"], [-Infinity, "−∞"],
  ];
  for (const [value, text] of pairs) expect(formatNumber(value)).toBe(text);
  expect(formatNumber(1e-17, 4)).toBe("0");
});
