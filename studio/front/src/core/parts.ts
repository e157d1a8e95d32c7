/** Parts out of the finest regions, as the library unites them for each number of parts. */

/** Return the part of each vertex; `cuts` has a row for each number of parts, the fewest first. */
export function cutParts(finest: Int32Array, cuts: Int32Array, nRegions: number, count: number) {
  const fewest = nRegions + 1 - cuts.length / nRegions;
  const row = Math.min(Math.max(count, fewest), nRegions) - fewest;
  const parts = cuts.subarray(row * nRegions, (row + 1) * nRegions);
  return finest.map((region) => parts[region]!);
}

/** Return for each part the parts that it touches; an edge between two parts makes them touch. */
export function touchingParts(faces: Uint32Array, labels: Int32Array, count: number): Set<number>[] {
  const touching = Array.from({ length: count }, () => new Set<number>());
  for (let place = 0; place < faces.length; place += 3) {
    const corners = [0, 1, 2].map((corner) => labels[faces[place + corner]!]!);
    corners.forEach((part, corner) => {
      const next = corners[(corner + 1) % 3]!;
      if (part === next) return;
      touching[part]!.add(next);
      touching[next]!.add(part);
    });
  }
  return touching;
}

/** Return a part and all that hangs on it: what is reached from the body only through this part. */
export function limbOf(part: number, body: number, touching: Set<number>[]): Set<number> {
  const reach = (start: number, barred: Set<number>) => {
    const reached = new Set([start]);
    // A set that grows while it is walked through is walked to its end.
    for (const each of reached)
      for (const next of touching[each]!) if (!barred.has(next)) reached.add(next);
    return reached;
  };
  return reach(part, reach(body, new Set([part])));
}
