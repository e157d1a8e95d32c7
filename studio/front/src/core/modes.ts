/** Modes of variation of a collection: changes of all vertices, added up in the browser. */

/** Return Σ amount · mode; the modes, of `size` numbers each, follow each other. */
export function bendByModes(modes: Float32Array, amounts: number[], size: number): Float32Array {
  const change = new Float32Array(size);
  amounts.forEach((amount, mode) => {
    if (amount) for (let i = 0; i < size; i++) change[i]! += amount * modes[mode * size + i]!;
  });
  return change;
}

/** Return how far each vertex moves along its normal, outward positive. */
export function alongNormals(change: Float32Array, normals: Float32Array): Float32Array {
  return new Float32Array(change.length / 3).map((_, vertex) => {
    const at = 3 * vertex;
    return [0, 1, 2].reduce((sum, axis) => sum + change[at + axis]! * normals[at + axis]!, 0);
  });
}
