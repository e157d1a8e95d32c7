import { expect, test } from "vitest";
import { orderFaces } from "../src/core/order";

/** Return how many vertices a face costs where the last 64 are kept, each in a place of its own. */
function misses(faces: Uint32Array): number {
  const kept = new Array<number>(64).fill(-1);
  let count = 0;
  for (const vertex of faces) {
    if (kept[vertex % 64] !== vertex) count++;
    kept[vertex % 64] = vertex;
  }
  return (3 * count) / faces.length;
}

test("faces stay the same, and neighbors follow each other", () => {
  // A grid, whose faces are shuffled by a step that has no divisor in common with their number
  const side = 60;
  const grid: [number, number, number][] = [];
  for (let row = 0; row < side; row++)
    for (let column = 0; column < side; column++) {
      const corner = row * (side + 1) + column;
      grid.push([corner, corner + 1, corner + side + 1]);
      grid.push([corner + 1, corner + side + 2, corner + side + 1]);
    }
  const shuffled = grid.map((_, i) => grid[(i * 3571) % grid.length]!);
  const faces = Uint32Array.from(shuffled.flat());
  const ordered = orderFaces(faces, (side + 1) ** 2);
  const rows = (corners: Uint32Array) =>
    shuffled.map((_, i) => corners.subarray(3 * i, 3 * i + 3).join()).sort();
  expect(rows(ordered)).toEqual(rows(faces));
  expect(misses(faces)).toBeGreaterThan(2.5);
  expect(misses(ordered)).toBeLessThan(1);
});

test("vertices without faces, and no faces at all, are in order", () => {
  expect([...orderFaces(Uint32Array.of(4, 2, 7), 9)]).toEqual([4, 2, 7]);
  expect([...orderFaces(new Uint32Array(0), 0)]).toEqual([]);
});
