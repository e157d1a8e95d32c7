import { expect, test } from "vitest";
import { markCreases } from "../src/core/creases";

/** A roof of two pairs of faces that meet at vertices 2 and 3; `height` is that of the ridge. */
function roof(height: number) {
  const points = [-1, 0, 0, -1, 1, 0, 0, 0, height, 0, 1, height, 1, 0, 0, 1, 1, 0];
  return Float32Array.from(points);
}
const faces = Uint32Array.from([0, 2, 1, 1, 2, 3, 2, 4, 3, 3, 4, 5]);

test("the ends of an edge that turns by 90 degrees are at a crease, those of a flat roof are not", () => {
  expect([...markCreases(roof(1), faces)]).toEqual([0, 0, 1, 1, 0, 0]);
  expect([...markCreases(roof(0.2), faces)]).toEqual([0, 0, 0, 0, 0, 0]);
});

test("a shape that is nowhere flat has no creases", () => {
  const tetrahedron = Float32Array.from([1, 1, 1, 1, -1, -1, -1, 1, -1, -1, -1, 1]);
  const sides = Uint32Array.from([0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2]);
  expect([...markCreases(tetrahedron, sides)]).toEqual([0, 0, 0, 0]);
});
