import { expect, test } from "vitest";
import { cutParts } from "../src/core/parts";

// Three regions, of which at least two stay apart.
const cuts = Int32Array.of(0, 1, 0, 0, 1, 2);
const finest = Int32Array.of(2, 0, 1, 2);

test("a cut unites the finest regions, and there are not fewer or more parts than possible", () => {
  expect([...cutParts(finest, cuts, 3, 2)]).toEqual([0, 0, 1, 0]);
  expect([...cutParts(finest, cuts, 3, 3)]).toEqual([2, 0, 1, 2]);
  expect(cutParts(finest, cuts, 3, 1)).toEqual(cutParts(finest, cuts, 3, 2));
  expect(cutParts(finest, cuts, 3, 9)).toEqual(cutParts(finest, cuts, 3, 3));
});
