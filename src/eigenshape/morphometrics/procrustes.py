"""Shapes: points of specimens without place, turn and size, and with semilandmarks slid."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import lstsq
from scipy.stats import iqr

from certeig.kit.arrays import ReadOnly, real_numbers, record
from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._vectors import nearest_rotations, rotations_and_stretches
from eigenshape.morphometrics.landmarks import Specimens, as_curves, complete_points
from eigenshape.morphometrics.splines import bending_matrix

TOLERANCE, MOST_ROUNDS = 1e-10, 200  # 31 skulls of mice rest after 6 rounds
# Semilandmarks slide as long as a round takes this share off their energy, one to four rounds. After
# that they would all drift along their curves together, which changes shapes no more.
LEAST_GAIN = 0.01
FENCE = (
    1.5  # interquartile ranges above the upper quartile, beyond which Tukey calls a value far out
)


@record
class ProcrustesFit(ReadOnly):
    """Specimens laid on their mean shape.

    Attributes
    ----------
    mean : (k, 3) float
        The mean shape, of centroid size 1 about the origin.
    shapes : (n, k, 3) float
        The specimens, of centroid size 1 about the origin, turned to the mean.
    sizes : (n,) float
        Centroid sizes: roots of the sums of squared distances from the middle, in length, of what
        semilandmarks slid to.

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
        # With the best turn, |x - R y|² = 2 - 2 (sum of the signed stretches of xᵀy).
        products = np.tensordot(self.shapes, self.shapes, axes=(1, 1)).swapaxes(1, 2)
        squares = 2 - 2 * rotations_and_stretches(products)[1].sum(axis=-1)
        np.fill_diagonal(squares, 0)
        return np.sqrt(np.maximum(squares, 0))

    def outliers(self) -> Int[np.ndarray, " m"]:
        """Return specimens far from the mean, the farthest first, by Tukey's rule.

        Far is more than 1.5 interquartile ranges above the upper quartile of all distances. Look at
        these first: exchanged or misplaced landmarks are among them.
        """
        distances = np.linalg.norm(self.shapes - self.mean, axis=(1, 2))
        far = distances > np.quantile(distances, 0.75) + FENCE * iqr(distances)
        order = np.argsort(-distances, kind="stable")
        return order[far[order]]


@one_blas_thread()
def fit_procrustes(
    specimens: Specimens,
    *,
    curves: Sequence[Sequence[int]] = (),
    normals: ArrayLike | None = None,
) -> ProcrustesFit:
    """Remove place, turn and size from specimens of corresponding points.

    Each is divided by its centroid size and turned on the mean, which is computed anew until it
    rests (generalized Procrustes analysis: Gower 1975; Dryden and Mardia 1998, section 5.4, partial
    fits). Nothing is reflected.

    Semilandmarks slide along tangents of the curve or the surface, to where the thin-plate spline
    from the mean has the least bending energy (Gunz, Mitteroecker and Bookstein 2005). They stay on
    the tangents of where they were given.

    Parameters
    ----------
    specimens : (n, k, 3) float, or Landmarks of n specimens
        At least 3 points, none missing.
    curves : sequence of sequences of int, optional
        Rows of the points of curves, as `Landmarks.curves`: all but the first and last one slide,
        along the line from their neighbor to the next.
    normals : (n, k, 3) float, optional
        Normals of the surface at points that slide on it; rows of NaN for all others.

    Returns
    -------
    ProcrustesFit

    Raises
    ------
    InvalidParameterError
        If a point is missing or infinite, all points of a specimen coincide, or landmarks of
        specimens, curves or normals do not fit together.
    ConvergenceError
        If the mean does not rest after 200 rounds.

    See Also
    --------
    estimate_missing : Fill in points that are missing.
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
    points = complete_points(specimens)
    rows, tangents = _tangents(points, curves, normals)
    slid, mean, energy = points, None, np.inf
    is_sliding = len(rows) > 0
    for _ in range(MOST_ROUNDS):
        centered = slid - slid.mean(axis=1, keepdims=True)
        sizes = np.linalg.norm(centered, axis=(1, 2))
        shapes = centered / sizes[:, None, None]
        last = shapes[0] if mean is None else mean
        # The best turn of each (Kabsch 1976), without reflection
        shapes = shapes @ nearest_rotations(np.einsum("nki,kj->nij", shapes, last))
        mean = shapes.mean(axis=0)
        mean /= np.linalg.norm(mean)
        if np.linalg.norm(mean - last) < TOLERANCE and not is_sliding:
            return ProcrustesFit(mean, shapes, sizes)
        if is_sliding:
            bending = bending_matrix(mean)
            slid = np.stack(
                [_slide(*each, rows, bending) for each in zip(points, tangents, strict=True)]
            )
            highest = (1 - LEAST_GAIN) * energy
            energy = np.sum(slid * (bending @ slid) / sizes[:, None, None] ** 2)
            is_sliding = energy < highest
    raise ConvergenceError(
        f"The mean shape must rest; after {MOST_ROUNDS} rounds it moves by "
        f"{np.linalg.norm(mean - last):.1g} of its size. The specimens are not alike: "
        "landmarks may be exchanged."
    )


def _tangents(
    points: Float[np.ndarray, "n k 3"], curves: Sequence[Sequence[int]], normals: ArrayLike | None
) -> tuple[Int[np.ndarray, " t"], Float[np.ndarray, "n t 3"]]:
    """Return rows of points that slide, and a direction for each; two for points of a surface."""
    rows: list[int] = []
    tangents = []
    for curve in as_curves(curves, points.shape[1]):
        rows += curve[1:-1]
        along = points[:, curve[2:]] - points[:, curve[:-2]]
        lengths = np.linalg.norm(along, axis=2, keepdims=True)
        tangents.append(along / np.where(lengths > 0, lengths, 1))
    if normals is not None:
        given = real_numbers(normals, "normals").astype(np.float64)
        if given.shape != points.shape:
            raise InvalidParameterError(
                f"normals must have the shape of the specimens, {points.shape}; it is {given.shape}."
            )
        on_surface = np.flatnonzero(np.isfinite(given).all(axis=(0, 2)))
        # The two singular vectors beside the normal span the tangent plane.
        planes = np.linalg.svd(given[:, on_surface, None])[2][:, :, 1:]
        rows += np.repeat(on_surface, 2).tolist()
        tangents.append(planes.reshape(len(points), -1, 3))
    directions = np.concatenate(tangents, axis=1) if tangents else np.empty((len(points), 0, 3))
    return np.array(rows, dtype=np.int64), directions


def _slide(
    points: Float[np.ndarray, "k 3"],
    tangents: Float[np.ndarray, "t 3"],
    rows: Int[np.ndarray, " t"],
    bending: Float[np.ndarray, "k k"],
) -> Float[np.ndarray, "k 3"]:
    """Return points moved along tangents to the least bending energy, tr(Yᵀ L Y)."""
    system = bending[np.ix_(rows, rows)] * (tangents @ tangents.T)
    forces = np.sum(tangents * (bending @ points)[rows], axis=1)
    # Where nothing holds a semilandmark, the shortest of all solutions
    steps = lstsq(system, -forces, lapack_driver="gelsy")[0]
    slid = points.copy()
    np.add.at(slid, rows, steps[:, None] * tangents)
    return slid
