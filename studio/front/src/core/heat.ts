/** Heat out of eigenpairs, in the browser. Modes are k rows of n numbers, orthonormal in the areas. */

const NULL = 1e-9; // eigenvalues below this share of the largest count as 0, as in the library

/** Σ w_i φ_i(x)^power over the first weights.length modes. */
function sumModes(modes: Float32Array, weights: Float64Array, n: number, power = 1): Float32Array {
  const sum = new Float64Array(n);
  weights.forEach((weight, i) => {
    for (let x = 0; x < n; x++) sum[x]! += weight * modes[i * n + x]! ** power;
  });
  return Float32Array.from(sum);
}

/** h_t(x, x) = Σ exp(-t λ_i) φ_i(x)²: the heat kernel signature, in 1/length². */
export function heatKernelSignature(
  modes: Float32Array,
  eigenvalues: Float64Array,
  time: number,
): Float32Array {
  const decays = eigenvalues.map((value) => Math.exp(-time * value));
  return sumModes(modes, decays, modes.length / eigenvalues.length, 2);
}

/** h_t(x, y) = Σ exp(-t λ_i) φ_i(x) φ_i(y): the heat at x after time t of a unit of heat at y. */
export function heatFromSource(
  modes: Float32Array,
  eigenvalues: Float64Array,
  time: number,
  source: number,
): Float32Array {
  const n = modes.length / eigenvalues.length;
  const weights = eigenvalues.map((value, i) => Math.exp(-time * value) * modes[i * n + source]!);
  return sumModes(modes, weights, n);
}

/** The shape that the first modes express: Σ φ_i c_i, with three coefficients c_i for each mode. */
export function lowpass(
  modes: Float32Array,
  coefficients: Float32Array,
  count: number,
): Float32Array<ArrayBuffer> {
  const n = modes.length / (coefficients.length / 3);
  const smooth = new Float32Array(3 * n);
  for (let axis = 0; axis < 3; axis++) {
    const weights = new Float64Array(count).map((_, i) => coefficients[3 * i + axis]!);
    sumModes(modes, weights, n).forEach((value, x) => (smooth[3 * x + axis] = value));
  }
  return smooth;
}

/** Times from exp(-tλ) = 1e-4 at the last eigenvalue to the same at the first above 0 (`default_times`). */
export function findTimeRange(eigenvalues: Float64Array): [number, number] | null {
  const last = eigenvalues.at(-1) ?? 0;
  const first = eigenvalues.find((value) => value > NULL * last);
  return first ? [(4 * Math.LN10) / last, (4 * Math.LN10) / first] : null;
}
