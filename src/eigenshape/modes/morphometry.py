"""Differences between two groups of maps or surfaces, mode by mode."""

import numpy as np
from jaxtyping import Float

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, real_numbers, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.spectral.spectrum import Spectrum
from eigenshape.spectral.tools.filters import project

MOST_PERMUTATIONS = 100_000  # p values to three digits; a billion would run for weeks

# Statistics that differ by less than this share are equal: permutations that leave the groups as
# they are sum in another order.
EQUAL = 1e-9


@record
class ModeComparison(ReadOnly):
    """How two groups of shapes differ in each eigenmode.

    Attributes
    ----------
    differences : (k,) or (k, d) float
        Mean coefficients of the second group minus those of the first. `es.spectral.reconstruct`
        makes a map of all or of some.
    statistics : (k,) float
        Squared length of the difference over its variance if the groups were alike; t² of Student
        for maps of one number.
    p_values : (k,) float
        Share of permutations with a statistic at least as large in this mode, the given order
        counted as one.
    family_p_values : (k,) float
        Share of permutations in which any mode has a statistic as large: controls the chance of a
        single false mode among all (Westfall and Young 1993).

    See Also
    --------
    compare_modes

    Examples
    --------
    >>> import numpy as np, eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 9)
    >>> maps = np.random.default_rng(0).normal(size=(8, 162))
    >>> found = es.modes.compare_modes(
    ...     maps[:4], maps[4:], spectrum, rng=np.random.default_rng(1)
    ... )
    >>> bool((found.family_p_values >= found.p_values).all())
    True
    """

    differences: Float[np.ndarray, "k ..."]
    statistics: Float[np.ndarray, " k"]
    p_values: Float[np.ndarray, " k"]
    family_p_values: Float[np.ndarray, " k"]


@one_blas_thread()
def compare_modes(
    one: ArrayLike,
    two: ArrayLike,
    spectrum: Spectrum,
    *,
    n_permutations: Integer = 1000,
    rng: np.random.Generator,
) -> ModeComparison:
    """Test in which eigenmodes two groups of subjects differ (mode-based morphometry).

    Cao and others (2024): maps of all subjects, such as thickness or the positions of vertices, are
    expanded in the modes of one template, and each coefficient is compared between the groups.
    Significance is by permutation of subjects, so no distribution is assumed.

    Parameters
    ----------
    one, two : (subjects, n) or (subjects, n, d) float
        A map of each subject on the points of the template: one number per point, or d such as
        three coordinates of registered surfaces. At least 2 subjects each.
    spectrum : Spectrum
        k eigenpairs of the template.
    n_permutations : int
        1..100,000
    rng : numpy.random.Generator

    Returns
    -------
    ModeComparison

    Raises
    ------
    InvalidParameterError
        If the groups do not hold finite numbers on the points of the template, in one shape, for at
        least 2 subjects each.

    Examples
    --------
    The second group has a bump of degree 1 along z:

    >>> import numpy as np, eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 16)
    >>> maps = np.random.default_rng(0).normal(size=(20, mesh.n_vertices))
    >>> maps[10:] += 0.5 * mesh.vertices[:, 2]
    >>> found = es.modes.compare_modes(
    ...     maps[:10], maps[10:], spectrum, rng=np.random.default_rng(1)
    ... )
    >>> bool(found.family_p_values[1:4].min() < 0.01)
    True
    """
    require_type(spectrum, Spectrum, "spectrum")
    require_type(rng, np.random.Generator, "rng")
    rounds = whole_number(
        n_permutations, "n_permutations", 1, MOST_PERMUTATIONS, "no p value needs more"
    )
    n = len(spectrum.eigenvectors)
    groups = []
    for name, given in (("one", one), ("two", two)):
        maps = real_numbers(given, name).astype(np.float64)
        if maps.ndim not in (2, 3) or maps.shape[1] != n or len(maps) < 2:
            raise InvalidParameterError(
                f"{name} must hold a map on {n} points for each of 2 or more subjects, shape "
                f"(subjects, {n}) or (subjects, {n}, d); the shape is {maps.shape}."
            )
        groups.append(maps)
    if groups[0].shape[2:] != groups[1].shape[2:]:
        raise InvalidParameterError(
            f"one and two must have equally many numbers per point; the shapes are {groups[0].shape} and "
            f"{groups[1].shape}."
        )
    subjects = np.concatenate(groups)
    columns = np.moveaxis(subjects.reshape(len(subjects), n, -1), 0, 2)  # (n, d, subjects)
    k, width = len(spectrum.eigenvalues), columns.shape[1]
    coefficients = project(columns.reshape(n, -1), spectrum).reshape(k, width, len(subjects))
    # Sums of squares are of deviations: a large mean of all would cost digits.
    deviations = coefficients - coefficients.mean(axis=2, keepdims=True)
    in_two = np.arange(len(subjects)) >= len(groups[0])
    difference, measured = _differences(deviations, in_two)
    alone = np.ones(k)
    family = np.ones(k)
    for _ in range(rounds):
        _, drawn = _differences(deviations, rng.permutation(in_two))
        threshold = measured * (1 - EQUAL)
        alone += drawn >= threshold
        family += drawn.max() >= threshold
    flat = subjects.ndim == 2
    return ModeComparison(
        difference[:, 0] if flat else difference,
        measured,
        alone / (1 + rounds),
        family / (1 + rounds),
    )


def _differences(
    deviations: Float[np.ndarray, "k d s"], in_two: np.ndarray
) -> tuple[Float[np.ndarray, "k d"], Float[np.ndarray, " k"]]:
    """Return the differences of the means of two groups, and their statistics."""
    n_two = np.count_nonzero(in_two)
    n_one = len(in_two) - n_two
    sum_two = deviations @ in_two
    # The sum over both groups is 0.
    difference = sum_two * (1 / n_two + 1 / n_one)
    squared = np.sum(difference**2, axis=1)
    total = np.sum(deviations**2, axis=(1, 2))
    within = total - squared / (1 / n_two + 1 / n_one)
    variance = np.maximum(within, 0.0) / (len(in_two) - 2) * (1 / n_two + 1 / n_one)
    # Subjects that are all alike have no difference; groups that are, an infinite one.
    with np.errstate(divide="ignore", invalid="ignore"):
        return difference, np.nan_to_num(squared / variance, nan=0.0, posinf=np.inf)
