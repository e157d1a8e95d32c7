import { expect, test } from "vitest";
import { colorMap, findRange, formatNumber, partColors } from "../src/core/colors";

test("a map has 256 colors", () => expect(colorMap("viridis").length).toBe(768));

test("an unknown map is refused", () => expect(() => colorMap("jet")).toThrow("no color map jet"));

test("part colors repeat after 18, all different", () => {
  const colors = Array.from({ length: 19 }, (_, i) => partColors(19).slice(3 * i, 3 * i + 3).join());
  expect(colors[0]).toBe("31,119,180");
  expect(colors[18]).toBe(colors[0]);
  expect(new Set(colors).size).toBe(18);
});

test("the range of values", () => {
  expect(findRange([2, -1, 3])).toEqual([-1, 3]);
  expect(findRange([])).toEqual([0, 0]);
});

test("numbers are short and plain", () => {
  const pairs: [number, string][] = [
    [0, "0"], [1234.56, "1235"], [-0.5, "−0.5"], [0.00012, "1.20e−4"], [2.5e7, "2.50e+7"], [Infinity, "∞"], [NaN, "–"],
  ];
  for (const [value, text] of pairs) expect(formatNumber(value)).toBe(text);
  expect(formatNumber(1e-17, 4)).toBe("0");
});
