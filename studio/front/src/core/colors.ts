/** Colors of values and parts: the same tables as the library's pictures (eigenshape.plot). */

import tables from "./color_tables.json";
import { h } from "./dom";

function bytes(base64: string): Uint8Array {
  return Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
}

/** 256 colors of a color map of matplotlib, red, green, blue: "viridis", "inferno" or "RdBu_r". */
export function colorMap(name: string): Uint8Array {
  const table = (tables.maps as Record<string, string>)[name];
  if (!table) throw new Error(`There is no color map ${name}.`);
  return bytes(table);
}

const PARTS = bytes(tables.parts); // 18 colors; then they repeat, as in eigenshape.plot

/** Colors of the parts 0 .. count - 1, red, green, blue. */
export function partColors(count: number): Uint8Array {
  return Uint8Array.from({ length: 3 * count }, (_, i) => PARTS[i % PARTS.length]!);
}

/** A number with four digits, short enough for a legend; 0 for what is only rounding beside `scale`. */
export function formatNumber(value: number, scale = Math.abs(value)): string {
  if (!Number.isFinite(value)) return value > 0 ? "∞" : value < 0 ? "−∞" : "–";
  if (Math.abs(value) <= 1e-9 * scale) return "0";
  const size = Math.abs(value);
  const text = size >= 1e-3 && size < 1e6 ? `${Number(value.toPrecision(4))}` : value.toExponential(2);
  return text.replaceAll("-", "−");
}

export function findRange(values: ArrayLike<number>): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (let i = 0; i < values.length; i++) {
    const value = values[i]!;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : [0, 0];
}

/** The bar of a color map with its title and unit, and the numbers at its ends and in the middle. */
export function buildLegend(title: string, unit: string, map: string, range: [number, number]): HTMLElement {
  const bar = h("canvas", { class: "bar", width: 256, height: 1 });
  const colors = colorMap(map);
  const image = new ImageData(256, 1);
  for (let i = 0; i < 256; i++) image.data.set([...colors.subarray(3 * i, 3 * i + 3), 255], 4 * i);
  bar.getContext("2d")?.putImageData(image, 0, 0);
  const scale = Math.max(...range.map(Math.abs));
  const numbers = [range[0], (range[0] + range[1]) / 2, range[1]];
  const texts = numbers.map((number) => h("span", {}, formatNumber(number, scale)));
  const heading = h("div", {}, unit ? `${title}, ${unit}` : title);
  return h("div", { class: "legend", "data-test": "legend" }, heading, bar, h("div", { class: "numbers" }, ...texts));
}
