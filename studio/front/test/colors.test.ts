import { expect, test } from "vitest";
import { colorIndex, colorMap, cssColor, findRange, formatNumber, partColors } from "../src/core/colors";
import cases from "./cases.json";

test("values have the library's colors", () => {
  const { values, viridis } = cases.colors;
  const table = colorMap("viridis");
  const range = findRange(values);
  const found = values.flatMap((value) => {
    const index = colorIndex(value, range);
    return [...table.slice(3 * index, 3 * index + 3)];
  });
  expect(found).toEqual(viridis);
});

test("an unknown map is refused", () => expect(() => colorMap("jet")).toThrow("no color map jet"));

test("part colors repeat after 18, and gray is not among them", () => {
  const colors = partColors(19);
  expect(cssColor(colors, 0)).toBe("rgb(31 119 180)");
  expect(cssColor(colors, 18)).toBe(cssColor(colors, 0));
  expect(new Set(Array.from({ length: 18 }, (_, i) => cssColor(colors, i))).size).toBe(18);
});

test("a constant has one color", () => expect(colorIndex(3, findRange([3, 3]))).toBe(0));

test("numbers are short and plain", () => {
  const pairs: [number, string][] = [
    [0, "0"], [1234.56, "1235"], [-0.5, "−0.5"], [0.00012, "1.20e−4"], [2.5e7, "2.50e+7"], [Infinity, "∞"], [NaN, "–"],
  ];
  for (const [value, text] of pairs) expect(formatNumber(value)).toBe(text);
  expect(formatNumber(1e-17, 4)).toBe("0");
});
