/** Unite the finest regions of a merge tree: what `eigenshape.segment` does, at once in the browser. */

export interface Merges {
  count: number; // of the finest regions, numbered by falling persistence
  rows: Float64Array; // (m, 3): region that ends, region that absorbs it, persistence
}

export type Rule = { count: number } | { persistence: number };

/** Return the part of each finest region, and the region that each part is named after. */
export function cutTree(merges: Merges, rule: Rule): { parts: Int32Array; kept: number[] } {
  const into = Int32Array.from({ length: merges.count }, (_, region) => region);
  const findRoot = (region: number): number =>
    into[region] === region ? region : findRoot(into[region]!);
  for (let row = 0; row < merges.rows.length; row += 3) {
    const [region, target, persistence] = merges.rows.subarray(row, row + 3);
    const ends = "count" in rule ? region! >= rule.count : persistence! < rule.persistence;
    if (!ends) continue;
    // Union of two sets; the lower number, which is the more persistent region, gives its name.
    const [one, two] = [findRoot(region!), findRoot(target!)];
    into[Math.max(one, two)] = Math.min(one, two);
  }
  const kept = [...into.keys()].filter((region) => into[region] === region);
  return { parts: into.map((_, region) => kept.indexOf(findRoot(region))), kept };
}

/** Return the part of each vertex (or face), out of its finest region; below 0 stays. */
export function relabel(labels: Int32Array, parts: Int32Array): Int32Array<ArrayBuffer> {
  return labels.map((region) => parts[region] ?? region);
}

/** The persistences at which the number of parts changes, falling: entry i leaves one part more than i - 1. */
export function findLevels(merges: Merges): Float64Array<ArrayBuffer> {
  return merges.rows.filter((_, i) => i % 3 === 2).sort().reverse();
}
