/** Parts out of the finest regions, as the library unites them for each number of parts. */

/** Return the part of each vertex; `cuts` has a row for each number of parts, the fewest first. */
export function cutParts(finest: Int32Array, cuts: Int32Array, nRegions: number, count: number) {
  const fewest = nRegions + 1 - cuts.length / nRegions;
  const row = Math.min(Math.max(count, fewest), nRegions) - fewest;
  const parts = cuts.subarray(row * nRegions, (row + 1) * nRegions);
  return finest.map((region) => parts[region]!);
}
