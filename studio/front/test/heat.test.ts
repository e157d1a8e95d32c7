import { expect, test } from "vitest";
import { findTimeRange, heatFromSource, heatKernelSignature, lowpass } from "../src/core/heat";
import cases from "./cases.json";

const { heat } = cases;
const modes = Float32Array.from(heat.modes);
const eigenvalues = Float64Array.from(heat.eigenvalues);

function expectClose(found: ArrayLike<number>, expected: number[]): void {
  const scale = Math.max(...expected.map(Math.abs));
  const errors = expected.map((value, i) => Math.abs(value - found[i]!) / scale);
  expect(found.length).toBe(expected.length);
  expect(Math.max(...errors)).toBeLessThan(2e-6); // single precision
}

test("heat kernel signature equals the library's", () => {
  heat.times.forEach((time, i) => expectClose(heatKernelSignature(modes, eigenvalues, time), heat.signatures[i]!));
});

test("heat from a source equals the heat kernel", () => {
  expectClose(heatFromSource(modes, eigenvalues, heat.times[0]!, heat.source), heat.kernel);
});

test("heat from a source keeps its amount", () => {
  const spread = heatFromSource(modes, eigenvalues, 3.7, 5);
  const amount = spread.reduce((sum, value, x) => sum + value * heat.areas[x]!, 0);
  expect(amount).toBeCloseTo(1, 5);
});

test("the times of the slider are the library's default times", () => {
  expectClose(findTimeRange(eigenvalues)!, heat.times);
  expect(findTimeRange(Float64Array.of(0))).toBeNull();
});

test("lowpass keeps what the first modes express", () => {
  const [areas, points] = [Float32Array.from(heat.areas), Float32Array.from(heat.vertices)];
  const project = (mode: Float32Array, axis: number) =>
    mode.reduce((sum, value, x) => sum + value * areas[x]! * points[3 * x + axis]!, 0);
  const coefficients = [...eigenvalues.keys()].flatMap((i) => {
    const mode = modes.subarray(i * areas.length, (i + 1) * areas.length);
    return [0, 1, 2].map((axis) => project(mode, axis));
  });
  expectClose(lowpass(modes, Float32Array.from(coefficients), 5), heat.lowpass5);
});
