import { expect, test } from "vitest";
import { cutParts, limbOf, touchingParts } from "../src/core/parts";

// Three regions, of which at least two stay apart.
const cuts = Int32Array.of(0, 1, 0, 0, 1, 2);
const finest = Int32Array.of(2, 0, 1, 2);

test("a cut unites the finest regions, and there are not fewer or more parts than possible", () => {
  expect([...cutParts(finest, cuts, 3, 2)]).toEqual([0, 0, 1, 0]);
  expect([...cutParts(finest, cuts, 3, 3)]).toEqual([2, 0, 1, 2]);
  expect(cutParts(finest, cuts, 3, 1)).toEqual(cutParts(finest, cuts, 3, 2));
  expect(cutParts(finest, cuts, 3, 9)).toEqual(cutParts(finest, cuts, 3, 3));
});

test("what hangs on a part moves with it, and what the body still holds does not", () => {
  // Body 0 with a thigh 1 that ends in a foot 2, a tail 3, and a ring of 4 and 5 that returns to the body.
  const pairs = [[0, 1], [1, 2], [0, 3], [0, 4], [4, 5], [5, 0]];
  const labels = Int32Array.from(pairs.flat());
  const faces = Uint32Array.from(pairs.flatMap((_, i) => [2 * i, 2 * i + 1, 2 * i + 1]));
  const touching = touchingParts(faces, labels, 6);
  expect([...limbOf(1, 0, touching)]).toEqual([1, 2]);
  expect([...limbOf(2, 0, touching)]).toEqual([2]);
  expect([...limbOf(4, 0, touching)]).toEqual([4]);
});
