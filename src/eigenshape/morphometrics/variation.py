"""How shapes vary: principal components, groups, growth, and the sides of symmetric shapes."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from scipy.stats import permutation_test

from certeig.kit.arrays import (
    ReadOnly,
    as_array,
    positive_values,
    real_numbers,
    record,
    whole_numbers,
)
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import require_finite_rows
from eigenshape.morphometrics.landmarks import Specimens, as_configurations, complete_points
from eigenshape.morphometrics.procrustes import fit_procrustes
from eigenshape.morphometrics.splines import fit_spline

NO_VARIANCE = 1e-12  # singular values below this share of the largest are rounding errors
NEARLY = 1 - 1e-6  # share of the largest movement from which on a point counts among the largest
BATCH = 64  # permutations at once: as many times the memory of all scores


@record
class PrincipalComponents(ReadOnly):
    """The modes in which shapes vary, those with most variance first.

    Attributes
    ----------
    mean : (k, 3) float
    modes : (m, k, 3) float
        Orthogonal changes of all points, each of length 1. At most n - 1.
    variances : (m,) float
        Of the scores, with n - 1 as the denominator.
    scores : (n, m) float
        Coordinates of the specimens: shape = mean + Σ scores · modes.

    See Also
    --------
    principal_components

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> shapes = np.random.default_rng(0).standard_normal((6, 4, 3))
    >>> found = es.morphometrics.principal_components(shapes)
    >>> bool(np.allclose(found.shape(found.scores[2]), shapes[2]))
    True
    >>> print(round(found.shares.sum(), 9))
    1.0
    """

    mean: Float[np.ndarray, "k 3"]
    modes: Float[np.ndarray, "m k 3"]
    variances: Float[np.ndarray, " m"]
    scores: Float[np.ndarray, "n m"]

    @property
    def shares(self) -> Float[np.ndarray, " m"]:
        """Shares of the variance."""
        return self.variances / self.variances.sum()

    def shape(self, scores: ArrayLike) -> Float[np.ndarray, "k 3"]:
        """Return the shape with given scores in the first modes.

        Parameters
        ----------
        scores : (j,) float
            Of the first j modes; the others have score 0.
        """
        values = np.atleast_1d(real_numbers(scores, "scores"))
        if values.ndim != 1 or len(values) > len(self.modes):
            raise InvalidParameterError(
                f"scores must be a list of at most {len(self.modes)} numbers; the shape is "
                f"{values.shape}."
            )
        require_finite_rows(values, "scores", "mode")
        return self.mean + np.tensordot(values, self.modes[: len(values)], axes=1)


@one_blas_thread()
def principal_components(shapes: Specimens) -> PrincipalComponents:
    """Find the modes in which shapes vary, and the coordinates of each shape in them.

    Parameters
    ----------
    shapes : (n, k, 3) float
        `ProcrustesFit.shapes`, or other corresponding points in one frame; 2 or more.

    Returns
    -------
    PrincipalComponents
        The first of the points that move most in a mode moves in positive direction.

    Raises
    ------
    InvalidParameterError
        If a point is not finite, or all shapes are equal.

    See Also
    --------
    es.plot.figure_ordination : Draw the scores.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> ramp = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> shapes = [ramp + [[0, 0, 0], [0, 0, t], [0, 0, 0]] for t in (0, 1, 3)]
    >>> found = es.morphometrics.principal_components(shapes)
    >>> found.modes.round(6).tolist()
    [[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]]
    """
    points = complete_points(shapes)
    mean = points.mean(axis=0)
    left, values, modes = np.linalg.svd(
        (points - mean).reshape(len(points), -1), full_matrices=False
    )
    if len(points) < 2 or not values[0] > NO_VARIANCE * np.linalg.norm(mean):
        raise InvalidParameterError(
            f"Shapes must differ; there are {len(points)}, and their variance is {values[0] ** 2}."
        )
    n_modes = int(np.sum(values > NO_VARIANCE * values[0]))
    # Where left and right move alike, the first of both decides, and not the last digit.
    sizes = np.abs(modes)
    largest = (sizes > NEARLY * sizes.max(axis=1, keepdims=True)).argmax(axis=1)
    signs = np.sign(modes[np.arange(len(modes)), largest])[:n_modes]
    variances = values[:n_modes] ** 2 / (len(points) - 1)
    scores = left[:, :n_modes] * values[:n_modes] * signs
    modes = (modes[:n_modes] * signs[:, None]).reshape(n_modes, *mean.shape)
    return PrincipalComponents(mean, modes, variances, scores)


@record
class GroupComparison(ReadOnly):
    """Mean shapes of groups, and how far they are from each other.

    Attributes
    ----------
    names : tuple of str
        The g groups, sorted.
    means : (g, k, 3) float
    distances : (g, g) float
        Between the means.
    p_values : (g, g) float
        Share of random divisions of both groups whose means are at least as far from each other.

    See Also
    --------
    compare_groups

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> shapes = np.random.default_rng(0).standard_normal((6, 4, 3))
    >>> found = es.morphometrics.compare_groups(shapes, ["a", "a", "a", "b", "b", "b"])
    >>> found.names, found.distances.shape
    (('a', 'b'), (2, 2))
    """

    names: tuple[str, ...]
    means: Float[np.ndarray, "g k 3"]
    distances: Float[np.ndarray, "g g"]
    p_values: Float[np.ndarray, "g g"]


@one_blas_thread()
def compare_groups(shapes: Specimens, groups: ArrayLike) -> GroupComparison:
    """Compare the mean shapes of groups, with a permutation test of each pair.

    Parameters
    ----------
    shapes : (n, k, 3) float
        `ProcrustesFit.shapes`.
    groups : (n,) str or int
        The group of each specimen. There must be 2 groups or more, of 2 specimens or more.

    Returns
    -------
    GroupComparison
        p-values are of 9,999 random divisions, or of all if there are fewer. They are not corrected
        for the number of pairs: see `scipy.stats.false_discovery_control`.

    Raises
    ------
    InvalidParameterError
        If the numbers of shapes and groups differ, there are fewer than 2 groups, one has fewer
        than 2 specimens, or shapes are wrong as in `principal_components`.

    See Also
    --------
    warp_mesh : Show on a mesh how two means differ.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> shapes = np.random.default_rng(0).standard_normal((10, 4, 3))
    >>> shapes[5:, 0] += 5
    >>> found = es.morphometrics.compare_groups(shapes, list("aaaaabbbbb"))
    >>> print(found.names, round(found.p_values[0, 1], 3))
    ('a', 'b') 0.008
    """
    points = complete_points(shapes)
    for place, group in enumerate(np.asarray(groups, dtype=object).ravel()):
        if group is None or (isinstance(group, float) and np.isnan(group)):
            raise InvalidParameterError(
                f"groups must give the group of each specimen; entry {place} is {group}. Leave "
                "specimens without a group out."
            )
    labels = as_array(groups, "groups").astype(str)
    names, members, counts = np.unique(labels, return_inverse=True, return_counts=True)
    if labels.shape != (len(points),) or len(names) < 2 or counts.min() < 2:
        raise InvalidParameterError(
            f"groups must give the group of each of {len(points)} specimens, 2 groups or more of 2 "
            f"specimens or more; there are {labels.size} entries, and the groups have "
            f"{dict(zip(names.tolist(), counts.tolist(), strict=True))} specimens."
        )
    means = np.stack([points[members == group].mean(axis=0) for group in range(len(names))])
    distances = np.linalg.norm(means[:, None] - means, axis=(2, 3))
    # Distances of means are the same in the coordinates of the modes, which are fewer.
    scores = principal_components(points).scores

    def distance(one: np.ndarray, two: np.ndarray, axis: int) -> np.ndarray | np.float64:
        apart = [scores[rows.astype(int)].mean(axis=-2) for rows in (one, two)]
        return np.linalg.norm(apart[0] - apart[1], axis=-1)

    p_values = np.ones_like(distances)
    for one, two in zip(*np.triu_indices(len(names), 1), strict=True):
        rows = [np.flatnonzero(members == group) for group in (one, two)]
        p_values[one, two] = p_values[two, one] = _p_value(rows, distance, "independent")
    return GroupComparison(tuple(names.tolist()), means, distances, p_values)


@record
class Allometry(ReadOnly):
    """How shape changes with size: shape = mean + slope · (log size - mean log size).

    Attributes
    ----------
    mean : (k, 3) float
        The shape at the mean log size.
    slope : (k, 3) float
        Change of the shape for each unit of log size.
    mean_log_size : float
    share : float
        Of the variance of shapes that size explains, R².
    p_value : float
        Share of random orders of the sizes that explain at least as much.
    scores : (n,) float
        Coordinates of the specimens along the slope (Drake and Klingenberg 2008), to be drawn
        against log size.
    residuals : (n, k, 3) float
        The shapes less what size explains: mean + residuals are shapes at one size.

    See Also
    --------
    fit_allometry

    Examples
    --------
    Shapes that become longer as they grow:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> sizes = np.array([1.0, 1.2, 1.5, 2.0])
    >>> corners = es.shapes.box(1, 1, 1).points
    >>> shapes = np.array([corners * [1, 1, np.log(size)] for size in sizes])
    >>> growth = es.morphometrics.fit_allometry(shapes, sizes)
    >>> round(growth.share, 3), growth.shapes([1.5]).shape
    (1.0, (1, 8, 3))
    """

    mean: Float[np.ndarray, "k 3"]
    slope: Float[np.ndarray, "k 3"]
    mean_log_size: float
    share: float
    p_value: float
    scores: Float[np.ndarray, " n"]
    residuals: Float[np.ndarray, "n k 3"]

    def shapes(self, sizes: ArrayLike) -> Float[np.ndarray, "m k 3"]:
        """Return the shapes that are expected at centroid sizes.

        Parameters
        ----------
        sizes : (m,) float
            In length, each positive.
        """
        steps = np.log(positive_values(sizes, "sizes")) - self.mean_log_size
        return self.mean + steps[:, None, None] * self.slope


@one_blas_thread()
def fit_allometry(shapes: Specimens, sizes: ArrayLike) -> Allometry:
    """Fit a line to shapes over the logarithm of centroid size, with a permutation test.

    Parameters
    ----------
    shapes : (n, k, 3) float
        `ProcrustesFit.shapes`.
    sizes : (n,) float
        `ProcrustesFit.sizes`, in length.

    Returns
    -------
    Allometry
        The p-value is of 9,999 random orders, or of all if there are fewer.

    Raises
    ------
    InvalidParameterError
        If a size is not positive, all are equal, numbers of shapes and sizes differ, or shapes are
        wrong as in `principal_components`.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> mean, slope = np.random.default_rng(0).standard_normal((2, 5, 3))
    >>> sizes = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    >>> shapes = mean + np.log(sizes)[:, None, None] * slope
    >>> found = es.morphometrics.fit_allometry(shapes, sizes)
    >>> bool(np.allclose(found.slope, slope)), round(found.share, 6)
    (True, 1.0)
    """
    points = complete_points(shapes)
    logs = np.log(positive_values(sizes, "sizes"))
    if len(logs) != len(points) or np.ptp(logs) == 0:
        raise InvalidParameterError(
            f"sizes must be {len(points)} numbers, one for each shape, that differ; there are "
            f"{len(logs)}, between {np.exp(logs.min()):.6g} and {np.exp(logs.max()):.6g}."
        )
    found = principal_components(points)
    steps = logs - logs.mean()
    slope = np.tensordot(steps, points - found.mean, axes=1) / (steps @ steps)
    explained = (steps @ steps) * np.sum(slope**2)
    fitted = found.mean + steps[:, None, None] * slope

    return Allometry(
        found.mean,
        slope,
        float(logs.mean()),
        float(min(explained / np.sum(found.scores**2), 1.0)),  # not 1 + rounding errors
        _p_value([steps], _sum_length(found.scores), "pairings"),
        np.tensordot(points - found.mean, slope, axes=2) / np.linalg.norm(slope),
        points - fitted,
    )


@record
class SymmetricComponents(ReadOnly):
    """Shapes of two-sided specimens, divided into what their sides share and how they differ.

    Attributes
    ----------
    symmetric : (n, k, 3) float
        Means of each shape and its mirror image.
    asymmetric : (n, k, 3) float
        Half of their difference; symmetric + asymmetric is the shape.
    share_individual, share_directional, share_fluctuating : float
        Shares of the sum of squares: symmetric shapes of individuals, the mean difference of the
        sides, and what individuals add to it. They add up to 1.
    p_value : float
        Of directional asymmetry: share of random exchanges of the sides of individuals whose mean
        difference is at least as large.

    See Also
    --------
    symmetric_components

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> face = np.array([[-1, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 1.0]])
    >>> found = es.morphometrics.symmetric_components([face, face + [[0.1], [0], [0], [0]]], [[0, 1]])
    >>> round(found.share_individual + found.share_directional + found.share_fluctuating, 9)
    1.0
    """

    symmetric: Float[np.ndarray, "n k 3"]
    asymmetric: Float[np.ndarray, "n k 3"]
    share_individual: float
    share_directional: float
    share_fluctuating: float
    p_value: float


@one_blas_thread()
def symmetric_components(specimens: Specimens, pairs: ArrayLike) -> SymmetricComponents:
    """Divide shapes of two-sided specimens into symmetric and asymmetric components.

    Specimens and their mirror images, with left and right landmarks exchanged, are fitted together
    (object symmetry: Mardia, Bookstein and Moreton 2000; Klingenberg, Barluenga and Meyer 2002).

    Parameters
    ----------
    specimens : (n, k, 3) float, or Landmarks of n specimens
    pairs : (p, 2) int
        Rows of all left and right landmarks. All others are taken to lie in the middle: if a pair
        is forgotten, nearly all variance becomes directional asymmetry.

    Returns
    -------
    SymmetricComponents
        The p-value is of 9,999 random exchanges, or of all if there are fewer.

    Raises
    ------
    InvalidParameterError
        If a landmark does not exist or is in two pairs, or specimens are wrong as in
        `fit_procrustes`.

    Notes
    -----
    Whether fluctuating asymmetry is more than error of measurement needs specimens that were
    measured twice, and is not tested.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> face = np.array([[-1, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 1]])
    >>> found = es.morphometrics.symmetric_components([face, face * [1, 2, 1]], [[0, 1]])
    >>> bool(np.abs(found.asymmetric).max() < 1e-9)
    True
    """
    points = complete_points(specimens)
    rows = whole_numbers(pairs, "pairs", 0, points.shape[1] - 1)
    if not len(rows) or len(rows) % 2 or len(np.unique(rows)) < len(rows):
        raise InvalidParameterError(
            f"pairs must have rows of two landmarks, each of them once; there are {len(rows)} "
            f"numbers, {len(np.unique(rows))} of them different."
        )
    partners = np.arange(points.shape[1])
    partners[rows] = rows.reshape(-1, 2)[:, ::-1].ravel()
    mirrored = points[:, partners] * [-1, 1, 1]
    fit = fit_procrustes(np.concatenate([points, mirrored]))
    shapes, images = np.split(fit.shapes, 2)
    symmetric, asymmetric = (shapes + images) / 2, (shapes - images) / 2
    directional = asymmetric.mean(axis=0)
    squares = np.array(
        [
            np.sum((symmetric - symmetric.mean(axis=0)) ** 2),
            len(points) * np.sum(directional**2),
            np.sum((asymmetric - directional) ** 2),
        ]
    )
    shares = squares / (squares.sum() or 1.0)
    flat = asymmetric.reshape(len(points), -1)
    # One specimen has the same difference, whichever side is left.
    signs = np.ones(len(points))
    p_value = _p_value([signs], _sum_length(flat), "samples") if len(points) > 1 else 1.0
    individual, side, interaction = shares.tolist()
    return SymmetricComponents(symmetric, asymmetric, individual, side, interaction, p_value)


def _sum_length(rows: Float[np.ndarray, "n q"]) -> Callable[..., np.ndarray | np.float64]:
    """Return a statistic: the length of the sum of rows, each times a factor that is permuted."""
    return lambda factors, axis: np.linalg.norm(factors @ rows, axis=-1)


def _p_value(
    data: list[np.ndarray], statistic: Callable[..., np.ndarray | np.float64], permutation_type: str
) -> float:
    """Return the share of 9,999 permutations with a statistic at least as large, always the same ones."""
    found = permutation_test(
        data,
        statistic,
        permutation_type=permutation_type,
        vectorized=True,
        alternative="greater",
        batch=BATCH,
        random_state=np.random.default_rng(0),
    )
    return float(found.pvalue)


@one_blas_thread()
def estimate_missing(specimens: Specimens) -> Float[np.ndarray, "n k 3"]:
    """Fill in missing points by the thin-plate spline from the mean of the complete specimens.

    Parameters
    ----------
    specimens : (n, k, 3) float, or Landmarks of n specimens
        Missing points are NaN. Each specimen needs 4 points or more that lie in no plane, and one
        must be complete.

    Returns
    -------
    (n, k, 3) float
        Points that were there are unchanged.

    Raises
    ------
    InvalidParameterError
        If no specimen is complete, or one has too few points.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> shape = np.random.default_rng(0).standard_normal((6, 3))
    >>> broken = 2 * shape
    >>> broken[3] = np.nan
    >>> found = es.morphometrics.estimate_missing([shape, broken])
    >>> bool(np.allclose(found[1, 3], 2 * shape[3]))
    True
    """
    points = as_configurations(specimens).copy()
    known = np.isfinite(points).all(axis=2)
    if not known.all(axis=1).any():
        fullest = int(np.argmax(known.sum(axis=1)))
        raise InvalidParameterError(
            f"At least one specimen must be complete; specimen {fullest}, which has most points, "
            f"lacks point {int(np.argmin(known[fullest]))}."
        )
    mean = fit_procrustes(points[known.all(axis=1)]).mean
    for number in np.flatnonzero(~known.all(axis=1)):
        each, there = points[number], known[number]
        spline = fit_spline(mean[there], each[there], f"Known points of specimen {number}")
        each[~there] = spline(mean[~there])
    return points
