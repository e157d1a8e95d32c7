import { expect, test } from "vitest";
import { cutTree, findLevels, relabel } from "../src/core/parts";
import cases from "./cases.json";

for (const [number, tree] of cases.trees.entries()) {
  const merges = { count: tree.count, rows: Float64Array.from(tree.rows) };
  const finest = Int32Array.from(tree.labels);
  for (const [name, cuts] of Object.entries({ number: tree.by_count, persistence: tree.by_persistence }))
    test(`tree ${number} cut by ${name} equals segment`, () => {
      expect(cuts.length).toBeGreaterThan(2);
      for (const cut of cuts) {
        const { parts, kept } = cutTree(merges, cut);
        expect(kept.map((region) => tree.maxima[region])).toEqual(cut.vertices);
        expect(Array.from(relabel(finest, parts))).toEqual(cut.labels);
      }
    });

  test(`tree ${number}: each level adds a part`, () => {
    const levels = findLevels(merges);
    const roots = tree.count - levels.length;
    expect([...levels]).toEqual([...levels].sort((a, b) => b - a));
    levels.forEach((persistence, i) => expect(cutTree(merges, { persistence }).kept.length).toBeGreaterThan(roots + i));
  });
}

test("what has no region stays without", () => {
  expect([...relabel(Int32Array.of(-1, 1, 0), Int32Array.of(0, 0))]).toEqual([-1, 0, 0]);
});
