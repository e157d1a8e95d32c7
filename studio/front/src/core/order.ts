/** The order in which faces are drawn. */

/**
 * Return the corners of the same faces, fan by fan: all faces around a vertex, then those around a
 * corner of the last of them. Graphics cards, and what takes their place in software, keep the last
 * vertices that the shader has moved, so neighbors should follow each other.
 */
export function orderFaces(faces: Uint32Array, nVertices: number): Uint32Array<ArrayBuffer> {
  // The faces around vertex v are around[start[v]] to around[start[v + 1] - 1].
  const start = new Uint32Array(nVertices + 1);
  for (const vertex of faces) start[vertex + 1]!++;
  for (let vertex = 0; vertex < nVertices; vertex++) start[vertex + 1]! += start[vertex]!;
  const around = new Uint32Array(faces.length);
  const filled = start.slice();
  faces.forEach((vertex, place) => (around[filled[vertex]!++] = Math.floor(place / 3)));

  const ordered = new Uint32Array(faces.length);
  const done = new Uint8Array(faces.length / 3);
  const stack = new Uint32Array(faces.length + 1);
  let end = 0;
  for (let seed = 0; seed < nVertices; seed++) {
    let height = 0;
    stack[height++] = seed;
    while (height) {
      const vertex = stack[--height]!;
      for (let place = start[vertex]!; place < start[vertex + 1]!; place++) {
        const face = around[place]!;
        if (done[face]) continue;
        done[face] = 1;
        const corners = faces.subarray(3 * face, 3 * face + 3);
        ordered.set(corners, end);
        stack.set(corners, height);
        end += 3;
        height += 3;
      }
    }
  }
  return ordered;
}
