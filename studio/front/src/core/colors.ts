/** Colors of values and parts: the same tables as the library's pictures (eigenshape.plot). */

import tables from "./color_tables.json";
import { h } from "./dom";

/** How the values of a function are colored, and what its legend says. */
export interface Scale {
  map: string;
  range: [number, number];
  title: string;
  unit?: string;
  nodal?: boolean; // whether a line marks where the function is zero
  partial?: boolean; // whether some vertices have no value, and are gray
}

const bytesOf = (base64: string) =>
  Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));

/** Return the 256 colors of "viridis", "inferno" or "RdBu_r": red, green, blue, opacity. */
export function colorMap(name: string): Uint8Array<ArrayBuffer> {
  const colors = bytesOf((tables.maps as Record<string, string>)[name]!);
  return new Uint8Array(1024).map((_, i) => (i % 4 === 3 ? 255 : colors[3 * (i >> 2) + (i % 4)]!));
}

const PARTS = bytesOf(tables.parts); // 18 colors; then they repeat, as in eigenshape.plot

/** Return the colors of the parts 0 .. count - 1: red, green, blue. */
export function partColors(count: number): Uint8Array {
  return new Uint8Array(3 * count).map((_, i) => PARTS[i % PARTS.length]!);
}

/** Return the three bytes of a color such as "#cdc8c0". */
export function rgbOf(color: string): [number, number, number] {
  const number = parseInt(color.slice(1), 16);
  return [number >> 16, (number >> 8) & 255, number & 255];
}

/** Write a number with four digits; 0 for what is only rounding beside `scale`. */
export function formatNumber(value: number, scale = Math.abs(value)): string {
  const size = Math.abs(value);
  if (size === Infinity) return value > 0 ? "∞" : "−∞";
  if (size <= 1e-9 * scale) return "0";
  const plain = size >= 1e-3 && size < 1e6;
  const text = plain ? String(Number(value.toPrecision(4))) : value.toExponential(2);
  return text.replaceAll("-", "−");
}

export function findRange(values: Float32Array): [number, number] {
  return values.reduce(
    ([low, high], value) => [Math.min(low, value), Math.max(high, value)],
    [Infinity, -Infinity],
  );
}

const MAPS = { viridis: "Viridis", inferno: "Inferno", RdBu_r: "Blue to red" };

/**
 * Return the bar of a color map with its title and unit, and the numbers below it. Opened, it lets
 * another map and range be chosen.
 */
export function buildLegend(
  { title, unit, map, range: [low, high], partial }: Scale,
  open: boolean,
  choose: (choice: Partial<Scale>) => void,
): HTMLDetailsElement {
  const bar = h("canvas", { class: "bar", width: 256, height: 1 });
  const image = new ImageData(new Uint8ClampedArray(colorMap(map)), 256, 1);
  bar.getContext("2d")!.putImageData(image, 0, 0);
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const numbers = [low, (low + high) / 2, high].map((number) =>
    h("span", {}, formatNumber(number, largest)),
  );
  const heading = h("div", {}, unit ? `${title}, ${unit}` : title);
  const scale = h("div", { class: "numbers" }, ...numbers);
  const select = h(
    "select",
    { "aria-label": "Colors", "data-test": "map", change: () => choose({ map: select.value }) },
    ...Object.entries(MAPS).map(([value, name]) =>
      h("option", { value, selected: value === map }, name),
    ),
  );
  const read = () => {
    const [from, to] = ends.map((end) => end.valueAsNumber);
    if (from! < to!) choose({ range: [from!, to!] });
  };
  const ends = [low, high].map((value, i) => {
    const label = ["Lowest value of the colors", "Highest value of the colors"][i];
    const names = { "aria-label": label, title: label, "data-test": `range-${i}` };
    const number = Number(value.toPrecision(4));
    return h("input", { type: "number", step: "any", value: number, ...names, change: read });
  });
  const summary = h("summary", { title: "Choose colors and range" }, heading, bar, scale, partial && h("div", {}, "gray: no value"));
  const form = h("div", { class: "row tight" }, select, ...ends);
  return h("details", { class: "legend", "data-test": "legend", open }, summary, form);
}
