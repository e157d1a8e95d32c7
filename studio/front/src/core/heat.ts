/** Heat out of eigenpairs, in the browser. Modes are k rows of n numbers, orthonormal in the areas. */

const NULL = 1e-9; // eigenvalues below this share of the largest count as 0, as in the library

/** h_t(x, x) = Σ exp(-t λ_i) φ_i(x)²: the heat kernel signature, in 1/length². */
export function heatKernelSignature(modes: Float32Array, eigenvalues: ArrayLike<number>, time: number): Float32Array {
  const n = modes.length / eigenvalues.length;
  const heat = new Float64Array(n);
  for (let i = 0; i < eigenvalues.length; i++) {
    const decay = Math.exp(-time * eigenvalues[i]!);
    for (let x = 0, at = i * n; x < n; x++, at++) heat[x]! += decay * modes[at]! * modes[at]!;
  }
  return Float32Array.from(heat);
}

/** h_t(x, y) = Σ exp(-t λ_i) φ_i(x) φ_i(y): the heat at x after time t of a unit of heat at y. */
export function heatFromSource(
  modes: Float32Array, eigenvalues: ArrayLike<number>, time: number, source: number,
): Float32Array {
  const n = modes.length / eigenvalues.length;
  const weights = Float64Array.from(eigenvalues, (value, i) => Math.exp(-time * value) * modes[i * n + source]!);
  return combineModes(modes, weights, n);
}

/** Σ w_i φ_i over the first weights.length modes. */
function combineModes(modes: Float32Array, weights: Float64Array, n: number): Float32Array {
  const sum = new Float64Array(n);
  weights.forEach((weight, i) => {
    for (let x = 0, at = i * n; x < n; x++, at++) sum[x]! += weight * modes[at]!;
  });
  return Float32Array.from(sum);
}

/** The part of a vector function that the first `count` modes express: Σ φ_i ⟨φ_i, f⟩, weighted by areas. */
export function lowpass(
  values: Float32Array, modes: Float32Array, areas: Float32Array, count: number,
): Float32Array {
  const n = areas.length;
  const width = values.length / n;
  const smooth = new Float32Array(values.length);
  for (let axis = 0; axis < width; axis++) {
    const weights = new Float64Array(count);
    for (let i = 0; i < count; i++)
      for (let x = 0; x < n; x++) weights[i]! += areas[x]! * modes[i * n + x]! * values[x * width + axis]!;
    combineModes(modes, weights, n).forEach((value, x) => (smooth[x * width + axis] = value));
  }
  return smooth;
}

/** Times from exp(-tλ) = 1e-4 at the last eigenvalue to the same at the first above 0 (`default_times`). */
export function findTimeRange(eigenvalues: ArrayLike<number>): [number, number] | null {
  const last = eigenvalues[eigenvalues.length - 1] ?? 0;
  const first = Array.from(eigenvalues).find((value) => value > NULL * last);
  return first ? [(4 * Math.LN10) / last, (4 * Math.LN10) / first] : null;
}
