/** Smooth borders of parts: the colors near them are softened, and the shader cuts them sharply. */

const ROUNDS = 3; // in which neighbors are averaged, and as many edges from a border it is known

export interface Borders {
  soft: Uint8Array; // colors of the vertices, averaged with those of neighbors
  beyond: Uint8Array; // color on the other side of the nearest border; where none is near, its own
}

/**
 * A face of two colors shows the line where the softened color is halfway between them. That line is
 * straight in each face and goes on in the next one, where a whole face of one color leaves a tooth.
 */
export function softenBorders(faces: Uint32Array, labels: Int32Array, paint: Uint8Array): Borders {
  const nearest = Int32Array.from(labels.keys()); // a vertex across the nearest border, or itself
  let soft = Float32Array.from(paint);
  for (let round = 0; round < ROUNDS; round++) {
    const before = nearest.slice();
    const sums = soft.slice();
    const counts = new Uint16Array(labels.length).fill(1);
    for (let place = 0; place < faces.length; place++) {
      const first = place - (place % 3);
      for (const step of [1, 2]) {
        const [a, b] = [faces[place]!, faces[first + ((place - first + step) % 3)]!];
        counts[a]! += 1;
        for (let i = 0; i < 3; i++) sums[3 * a + i]! += soft[3 * b + i]!;
        if (nearest[a] !== a) continue;
        if (labels[a] !== labels[b]) nearest[a] = b;
        else if (before[b] !== b) nearest[a] = before[b]!;
      }
    }
    soft = sums.map((sum, i) => sum / counts[Math.floor(i / 3)]!);
  }
  const beyond = paint.slice();
  nearest.forEach((vertex, i) => beyond.set(paint.subarray(3 * vertex, 3 * vertex + 3), 3 * i));
  return { soft: Uint8Array.from(soft, Math.round), beyond };
}
