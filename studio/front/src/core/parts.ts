/** Unite the finest regions of a merge tree: what `eigenshape.segment` does, at once in the browser. */

export interface Merges {
  count: number; // of the finest regions, numbered by falling persistence
  rows: Float64Array; // (m, 3): region that ends, region that absorbs it, persistence
}

export type Rule = { count: number } | { persistence: number };

/** Return the part of each finest region, and the region that each part is named after. */
export function cutTree(merges: Merges, rule: Rule): { parts: Int32Array; kept: number[] } {
  const into = Int32Array.from({ length: merges.count }, (_, region) => region);
  for (let row = 0; row < merges.rows.length; row += 3) {
    const [region, target, persistence] = merges.rows.subarray(row, row + 3) as unknown as [number, number, number];
    const ends = "count" in rule ? region >= rule.count : persistence < rule.persistence;
    if (!ends) continue;
    // Union of two sets; the lower number, which is the more persistent region, gives its name.
    const [one, two] = [findRoot(into, region), findRoot(into, target)];
    into[Math.max(one, two)] = Math.min(one, two);
  }
  const kept = Array.from(into.keys()).filter((region) => into[region] === region);
  const place = new Map(kept.map((region, part) => [region, part]));
  return { parts: into.map((_, region) => place.get(findRoot(into, region))!), kept };
}

function findRoot(into: Int32Array, region: number): number {
  while (into[region] !== region) region = into[region]!;
  return region;
}

/** Return the part of each vertex (or face), out of its finest region; below 0 stays. */
export function relabel(labels: Int32Array, parts: Int32Array): Int32Array {
  return labels.map((region) => (region < 0 ? region : parts[region]!));
}

/** The persistences at which the number of parts changes, falling: entry i leaves one part more than i - 1. */
export function findLevels(merges: Merges): Float64Array {
  return merges.rows.filter((_, i) => i % 3 === 2).sort().reverse();
}
