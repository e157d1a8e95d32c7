"""Shapes: points of specimens without place, turn and size, and with semilandmarks slid."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import lstsq
from scipy.spatial.distance import cdist

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import ReadOnly, real_numbers, record, whole_numbers
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._vectors import nearest_rotations, rotations_and_stretches
from eigenshape.morphometrics.landmarks import Specimens, as_curves, complete_points
from eigenshape.morphometrics.splines import bending_matrix

TOLERANCE, MOST_ROUNDS = 1e-10, 200  # 31 skulls of mice rest after 6 rounds
# Semilandmarks slide until the squared length of the sum of all shapes, divided by their number,
# changes by less, or for as many rounds: with more they would all drift along their curves together,
# which changes shapes no more. Both are the defaults of `gpagen` in geomorph 4.0 (`tol`, `max.iter`).
LEAST_CHANGE, MOST_SLIDES = 1e-4, 9
# Points that span the plane in which one of them slides, itself among them; `gpagen`
N_SPANNING = 5
# Interquartile ranges above the upper quartile, beyond which Tukey calls a value far out
FENCE = 1.5


@record
class ProcrustesFit(ReadOnly):
    """Specimens laid on their mean shape.

    Attributes
    ----------
    mean : (k, 3) float
        The mean shape, of centroid size 1 about the origin.
    shapes : (n, k, 3) float
        The specimens, of centroid size 1 about the origin, turned to the mean. Semilandmarks then
        slid, by which size and middle change a little.
    sizes : (n,) float
        Centroid sizes: roots of the sums of squared distances from the middle, in length, of the
        points that were given.

    See Also
    --------
    fit_procrustes

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> shape = np.random.default_rng(0).standard_normal((10, 3))
    >>> fit = es.morphometrics.fit_procrustes([shape, 2 * shape[:, [1, 2, 0]] + 5])
    >>> bool(np.allclose(fit.shapes[0], fit.shapes[1]))
    True
    >>> print(round(fit.sizes[1] / fit.sizes[0], 6))
    2.0
    """

    mean: Float[np.ndarray, "k 3"]
    shapes: Float[np.ndarray, "n k 3"]
    sizes: Float[np.ndarray, " n"]

    @one_blas_thread()
    def distances(self) -> Float[np.ndarray, "n n"]:
        """Return the Procrustes distances of all pairs, each pair turned on one another anew."""
        # With the best turn, |x - R y|² = |x|² + |y|² - 2 (sum of the signed stretches of xᵀy).
        shapes = _flattened(self.shapes)
        products = np.tensordot(shapes, shapes, axes=(1, 1)).swapaxes(1, 2)
        lengths = np.sum(shapes**2, axis=(1, 2))
        squares = np.add.outer(lengths, lengths)
        squares -= 2 * rotations_and_stretches(products)[1].sum(axis=-1)
        np.fill_diagonal(squares, 0)
        return np.sqrt(np.maximum(squares, 0))

    def outliers(self) -> Int[np.ndarray, " m"]:
        """Return specimens far from the mean, the farthest first, by Tukey's rule.

        Far is more than 1.5 interquartile ranges above the upper quartile of all distances. Look at
        these first: exchanged or misplaced landmarks are among them.
        """
        distances = np.linalg.norm(self.shapes - self.mean, axis=(1, 2))
        lower, upper = np.quantile(distances, [0.25, 0.75])
        far = distances > upper + FENCE * (upper - lower)
        order = np.argsort(-distances, kind="stable")
        return order[far[order]]


@one_blas_thread()
def fit_procrustes(
    specimens: Specimens,
    *,
    curves: Sequence[Sequence[int]] = (),
    surfaces: Sequence[int] = (),
    normals: ArrayLike | None = None,
    minimize: Literal["bending", "distance"] = "bending",
) -> ProcrustesFit:
    """Remove place, turn and size from specimens of corresponding points.

    Each is divided by its centroid size and turned on the mean, which is computed anew until it
    rests (generalized Procrustes analysis: Gower 1975; Dryden and Mardia 1998, section 5.4, partial
    fits). Nothing is reflected. If the points of each specimen have one z, they turn in their plane.

    Semilandmarks slide along tangents of the curve or the surface, to where the thin-plate spline
    from the mean has the least bending energy (Bookstein 1997; Gunz, Mitteroecker and Bookstein 2005),
    or to where the Procrustes distance from the mean is least (Rohlf 2010). After each step tangents
    and mean are computed anew, 9 times at most. Steps, tangents and rounds are those of `gpagen` in
    the R package geomorph 4.0 with Proj = FALSE and PrinAxes = FALSE, and so are the results.

    Parameters
    ----------
    specimens : (n, k, 3) float, or Landmarks of n specimens
        At least 3 points, none missing.
    curves : sequence of sequences of int, optional
        Rows of the points of curves, as `Landmarks.curves`: all but the first and last one slide,
        along the line from their neighbor to the next.
    surfaces : sequence of int, optional
        Rows of points that slide on the surface, in the plane through the point and its four nearest
        ones, or across its normal.
    normals : (n, k, 3) float, optional
        Normals of the surface at points that slide on it; rows of NaN for all others.
    minimize : {"bending", "distance"}, optional
        The bending energy, or the Procrustes distance, where neighbors may pass one another.

    Returns
    -------
    ProcrustesFit

    Raises
    ------
    InvalidParameterError
        If a point is missing or infinite, all points of a specimen coincide, landmarks of
        specimens, curves, surfaces or normals do not fit together, or `minimize` is another word.
    ConvergenceError
        If the mean does not rest after 200 rounds.

    See Also
    --------
    estimate_missing : Fill in points that are missing.
    resample_curves : Space semilandmarks evenly first.
    principal_components : The modes in which shapes vary.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> triangles = np.random.default_rng(0).standard_normal((5, 3, 3))
    >>> fit = es.morphometrics.fit_procrustes(triangles)
    >>> fit.distances().shape, np.linalg.norm(fit.shapes, axis=(1, 2)).round(6).tolist()
    ((5, 5), [1.0, 1.0, 1.0, 1.0, 1.0])
    """
    require_choice(minimize, Literal["bending", "distance"], "minimize")
    points = complete_points(specimens)
    sliders, normals = _sliders(points, curves, surfaces, normals)
    places = points if len(sliders.patch) else _flattened(points)
    centered = places - places.mean(axis=1, keepdims=True)
    sizes = np.linalg.norm(centered, axis=(1, 2))
    shapes, normals = _turn(centered / sizes[:, None, None], normals, centered[0])
    mean = shapes.mean(axis=0)  # of which `gpagen` does not take the size in the first round
    length = np.sum(mean**2)
    for number in range(MOST_ROUNDS):
        last, last_length = mean, length
        if len(sliders.rows):
            weights = bending_matrix(mean) if minimize == "bending" else np.eye(len(mean))
            pairs = zip(shapes, normals, strict=True)
            shapes = np.stack([sliders.slide(*pair, mean, weights) for pair in pairs])
            length = np.sum(shapes.mean(axis=0) ** 2)
        shapes, normals = _turn(shapes, normals, mean)
        mean = shapes.mean(axis=0)
        mean /= np.linalg.norm(mean - mean.mean(axis=0))
        if len(sliders.rows):
            change = len(shapes) * abs(length - last_length)
            rests = number + 1 == MOST_SLIDES or change <= LEAST_CHANGE
        else:
            rests = np.linalg.norm(mean - last) < TOLERANCE
        if rests:
            mean = mean - mean.mean(axis=0)
            lacking = ((0, 0), (0, 3 - mean.shape[1]))
            return ProcrustesFit(np.pad(mean, lacking), np.pad(shapes, ((0, 0), *lacking)), sizes)
    raise ConvergenceError(
        f"The mean shape must rest; after {MOST_ROUNDS} rounds it moves by "
        f"{np.linalg.norm(mean - last):.1g} of its size. The specimens are not alike: "
        "landmarks may be exchanged."
    )


def _flattened(points: Float[np.ndarray, "n k 3"]) -> Float[np.ndarray, "n k d"]:
    """Return points without z if that of each specimen is one: a turn in space could reflect them."""
    return points if np.ptp(points[..., 2], axis=1).any() else points[..., :2]


def _turn(
    shapes: Float[np.ndarray, "n k d"],
    normals: Float[np.ndarray, "n u 3"],
    goal: Float[np.ndarray, "k d"],
) -> tuple[Float[np.ndarray, "n k d"], Float[np.ndarray, "n u 3"]]:
    """Give each shape the best turn onto another one, without reflection (Kabsch 1976)."""
    turns = nearest_rotations(np.einsum("nki,kj->nij", shapes, goal))
    return shapes @ turns, normals @ turns if normals.size else normals


class _Sliders(NamedTuple):
    """Rows of semilandmarks: first those of curves, between two neighbors, then twice each of a patch."""

    rows: Int[np.ndarray, " s"]
    before: Int[np.ndarray, " t"]
    after: Int[np.ndarray, " t"]
    patch: Int[np.ndarray, " u"]

    def slide(
        self,
        shape: Float[np.ndarray, "k d"],
        normals: Float[np.ndarray, "u 3"],
        mean: Float[np.ndarray, "k d"],
        weights: Float[np.ndarray, "k k"],
    ) -> Float[np.ndarray, "k d"]:
        """Move points along tangents U to the least (Y - M)ᵀ B (Y - M): by -(Uᵀ B U)⁻¹ Uᵀ B (Y - M).

        B is the bending matrix of the mean M, or for the Procrustes distance the identity (Gunz,
        Mitteroecker and Bookstein 2005).
        """
        rows = self.rows
        chords = shape[self.after] - shape[self.before]
        lengths = np.linalg.norm(chords, axis=1, keepdims=True)
        tangents = chords / np.where(lengths > 0, lengths, 1)
        if len(self.patch):
            tangents = np.concatenate([tangents, self._planes(shape, normals)])
        system = weights[np.ix_(rows, rows)] * (tangents @ tangents.T)
        forces = np.sum(tangents * (weights @ (shape - mean))[rows], axis=1)
        # Where nothing holds a semilandmark, the shortest of all solutions
        steps = lstsq(system, -forces, lapack_driver="gelsy")[0]
        slid = shape.copy()
        np.add.at(slid, rows, steps[:, None] * tangents)
        return slid

    def _planes(
        self, shape: Float[np.ndarray, "k 3"], normals: Float[np.ndarray, "u 3"]
    ) -> Float[np.ndarray, "v 3"]:
        """Return two directions for each point of a patch: across its normal if it is known."""
        order = np.argsort(cdist(shape[self.patch], shape), axis=1, kind="stable")
        nearest = shape[order[:, :N_SPANNING]]
        spokes = nearest - nearest.mean(axis=1, keepdims=True)
        guessed = np.linalg.svd(spokes)[2][:, 2]
        across = np.where(np.isfinite(normals), normals, guessed)
        # The two singular vectors beside the normal span the tangent plane.
        return np.linalg.svd(across[:, None])[2][:, 1:].reshape(-1, 3)


def _sliders(
    points: Float[np.ndarray, "n k 3"],
    curves: Sequence[Sequence[int]],
    surfaces: Sequence[int],
    normals: ArrayLike | None,
) -> tuple[_Sliders, Float[np.ndarray, "n u 3"]]:
    """Return what slides, and the normals of points in patches, NaN where they are not known."""
    n_points = points.shape[1]
    patch = whole_numbers(np.asarray(surfaces), "surfaces", 0, n_points - 1)
    across = np.full(points.shape, np.nan)
    if normals is not None:
        across = real_numbers(normals, "normals").astype(np.float64)
        if across.shape != points.shape:
            raise InvalidParameterError(
                f"normals must have the shape of the specimens, {points.shape}; it is {across.shape}."
            )
    is_known = np.isfinite(across).all(axis=(0, 2))
    patch = np.union1d(patch, np.flatnonzero(is_known)).astype(np.int64)
    threes = [
        three
        for curve in as_curves(curves, n_points)
        for three in zip(curve[:-2], curve[1:-1], curve[2:], strict=True)
    ]
    before, along, after = np.reshape(threes, (-1, 3)).astype(np.int64).T
    rows = np.concatenate([along, np.repeat(patch, 2)])
    return _Sliders(rows, before, after, patch), across[:, patch]
