"""Principal axes of codes, by which a coarse scan compares shapes."""

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float32, Int8, Int16

from certeig.kit.arrays import ReadOnly, freeze, record
from certeig.kit.threads import one_blas_thread

# Axes kept at each base radius. With 64 the best ten were missed five times as often, and 256
# would double the memory (benchmarks/bench_search.py).
N_AXES = 128
LARGEST = 127  # the largest number of a coarse row, as int8 holds it
LARGEST_OF_QUERY = 8191  # the sum of 3 × 128 products with coarse rows stays below 2³¹


@record
class PatchAxes(ReadOnly):
    """Axes on which codes of one codebook vary most.

    Attributes
    ----------
    axes : (b, v, d) float32
        Columns of unit length, at each base radius.
    steps : (b, d) float32
        What 1 means in a coarse row, on each axis.
    """

    axes: Float32[np.ndarray, "b v d"]
    steps: Float32[np.ndarray, "b d"]

    @one_blas_thread()
    def coarse_rows(self, codes: Int8[np.ndarray, "n b s v"]) -> Int8[np.ndarray, "n s q"]:
        """Return short rows of n shapes: q = b × d numbers at each size."""
        steps = self._project(codes) / self.steps[:, None]
        rounded = np.rint(np.clip(steps, -LARGEST, LARGEST)).astype(np.int8)
        return _by_size(rounded)

    @one_blas_thread()
    def coarse_query(
        self, codes: Int8[np.ndarray, "b s v"]
    ) -> tuple[Int16[np.ndarray, "s q"], float]:
        """Return what to multiply coarse rows by, and the mean cosine that a product of 1 means."""
        weights = self._project(codes[None]) * self.steps[:, None]
        scale = LARGEST_OF_QUERY / (float(np.abs(weights).max()) or 1.0)
        rounded = np.rint(np.float32(scale) * weights).astype(np.int16)
        return _by_size(rounded)[0], 1 / (scale * len(codes))

    @one_blas_thread()
    def project_query(self, codes: Int8[np.ndarray, "b s v"]) -> Float32[np.ndarray, "s q"]:
        """Return the vectors of a query, each size one, whose products with others are cosines."""
        return _by_size(self._project(codes[None]))[0]

    def _project(self, codes: Int8[np.ndarray, "n b s v"]) -> Float32[np.ndarray, "n b s d"]:
        return np.asarray(unit_codes(codes) @ self.axes)


@one_blas_thread()
def fit_axes(codes: Int8[np.ndarray, "n b s v"]) -> PatchAxes:
    """Fit principal axes to codes, at each base radius and for all sizes together.

    Codes are not centered, since it is their cosines that are compared.
    """
    rows = unit_codes(codes).swapaxes(0, 1)  # of each base radius
    flat = rows.reshape(len(rows), -1, rows.shape[-1])
    axes = []
    for each in flat:
        _, vectors = sl.eigh(each.T @ each)
        axes.append(vectors[:, ::-1][:, :N_AXES])
    chosen = np.array(axes, dtype=np.float32)
    largest = np.abs(flat @ chosen).max(axis=1)
    steps = np.maximum(largest, np.finfo(np.float32).tiny) / np.float32(LARGEST)
    return PatchAxes(freeze(chosen), freeze(steps))


def unit_codes(codes: Int8[np.ndarray, "*k v"]) -> Float32[np.ndarray, "*k v"]:
    """Return codes of unit length; a code of zeros stays."""
    numbers = codes.astype(np.float32)
    squares = np.einsum("...v,...v->...", numbers, numbers)
    return np.asarray(numbers / np.sqrt(np.maximum(squares, 1))[..., None])


def _by_size(numbers: np.ndarray) -> np.ndarray:
    """Return (n, b, s, d) numbers as (n, s, b × d): what is compared at one step lies together."""
    return np.ascontiguousarray(numbers.swapaxes(1, 2)).reshape(len(numbers), numbers.shape[2], -1)
