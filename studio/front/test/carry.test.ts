import { expect, test } from "vitest";
import { carry, coverWith } from "../src/core/carry";
import { alongNormals, bendByModes } from "../src/core/modes";

test("values are carried to the vertices that correspond; others have none", () => {
  const partners = Int32Array.of(2, -1, 0, 2);
  expect([...carry(Float32Array.of(5, 6, 7), partners)]).toEqual([7, 0, 5, 7]);
  expect([...carry(Int32Array.of(5, 6, 7), partners, 1, -1)]).toEqual([7, -1, 5, 7]);
  expect([...carry(Uint8Array.of(1, 2, 3, 4, 5, 6), partners, 2)]).toEqual([5, 6, 0, 0, 1, 2, 5, 6]);
});

test("colors become marks that cover what is below", () => {
  expect([...coverWith(Uint8Array.of(1, 2, 3, 4, 5, 6))]).toEqual([1, 2, 3, 255, 4, 5, 6, 255]);
});

test("modes are added by their amounts, and measured along normals", () => {
  const modes = Float32Array.of(1, 0, 0, 0, 1, 0, /* second */ 0, 0, 2, 0, 0, 0);
  const change = bendByModes(modes, [3, -1], 6);
  expect([...change]).toEqual([3, 0, -2, 0, 3, 0]);
  expect([...alongNormals(change, Float32Array.of(0, 0, 1, 0, 1, 0))]).toEqual([-2, 3]);
});
