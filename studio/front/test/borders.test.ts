import { expect, test } from "vitest";
import { softenBorders } from "../src/core/borders";
import { findEdges } from "../src/core/edges";

/** A strip of squares, each cut into two faces; three rows of vertices. */
function strip(columns: number) {
  const faces: number[] = [];
  for (let row = 0; row < 2; row++)
    for (let column = 0; column + 1 < columns; column++) {
      const corner = row * columns + column;
      faces.push(corner, corner + 1, corner + columns);
      faces.push(corner + 1, corner + columns + 1, corner + columns);
    }
  return Uint32Array.from(faces);
}

test("the softened color is halfway at a straight border, and pure away from it", () => {
  const columns = 12;
  const labels = Int32Array.from({ length: 3 * columns }, (_, i) => Number(i % columns >= 6));
  const paint = Uint8Array.from({ length: 9 * columns }, (_, i) => 200 * labels[Math.floor(i / 3)]!);
  const { soft, beyond } = softenBorders(strip(columns), labels, paint);
  const row = (values: Uint8Array) =>
    Array.from({ length: columns }, (_, i) => values[3 * (columns + i)]!);
  const middle = row(soft);
  expect(middle.slice(0, 3)).toEqual([0, 0, 0]);
  expect(middle.slice(9)).toEqual([200, 200, 200]);
  for (let i = 1; i < columns; i++) expect(middle[i]).toBeGreaterThanOrEqual(middle[i - 1]!);
  expect(middle[5]! + middle[6]!).toBeCloseTo(200, -1);
  expect(row(beyond)).toEqual([0, 0, 0, 200, 200, 200, 0, 0, 0, 200, 200, 200]);
});

test("each edge is found once", () => {
  const edges = findEdges(Uint32Array.from([0, 1, 2, 2, 1, 3]));
  const pairs = Array.from({ length: edges.length / 2 }, (_, i) => [...edges.slice(2 * i, 2 * i + 2)]);
  expect(pairs.sort().join(" ")).toBe("0,1 0,2 1,2 1,3 2,3");
});
