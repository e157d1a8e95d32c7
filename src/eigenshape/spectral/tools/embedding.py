"""Points of a shape as points of the spectral domain, and distances there (thesis 1.2.1, 1.2.2)."""

from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.distance import cdist

from certeig.kit.arguments import require_type
from certeig.kit.arrays import (
    SHARE_OF_ARRAYS,
    positive_number,
    real_numbers,
    whole_number,
    whole_numbers,
)
from certeig.kit.errors import InvalidParameterError
from certeig.kit.memory import require_memory
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._vectors import unit_vectors
from eigenshape.spectral.diffusion.decay import exponential_decay
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum

DistanceMethod = Literal["biharmonic", "commute-time", "diffusion"]
# Cosine of the angle between rows of the constant modes above which two points are of one
# component. It is 1 inside a component and 0 between components; the solvers err by 1e-3 at most.
ONE_COMPONENT = 0.5
# Exponents of the eigenvalues whose Euclidean distances give each method its name.
POWERS = {"biharmonic": -1.0, "commute-time": -0.5}
BYTES_OF_PAIR = 9.0  # memory for each distance: a float, and whether the pair is apart


@one_blas_thread()
def spectral_embedding(
    spectrum: Spectrum, n_dims: int | None = None, *, power: float = 0.0, t: float | None = None
) -> Float[np.ndarray, "n d"]:
    """Map each point to its values in the lowest eigenvectors that are not constant.

    Point x goes to (λ_1^p φ_1(x), ..., λ_d^p φ_d(x)), with p one of the scalings of thesis 1.2.1:

    - p = 0: none, the spectral embedding;
    - p = -1/2: 1/√λ, the global point signature (Rustamov 2007), whose Euclidean distances are
      commute-time distances;
    - p = -1: 1/λ, whose Euclidean distances are biharmonic distances (Lipman, Rustamov and
      Funkhouser 2010);
    - p = 2: λ², as in thesis reference 13, where eigenvalues are those of an affinity.

    With a time t, coordinate i is also multiplied by exp(-tλ_i), what is left of the mode after heat
    has flowed: with p = 0 this is the diffusion map (Coifman and Lafon 2006), whose distances are
    diffusion distances.

    Modes of eigenvalue 0 are constant on each component of a shape and are left out. Eigenvectors
    are determined up to sign, and up to rotation if an eigenvalue is multiple. So compare distances
    between points, and coordinates only of one spectrum. If the d-th eigenvalue is multiple,
    include all its eigenvectors.

    Parameters
    ----------
    spectrum : Spectrum
        Of a mesh, a point cloud or a graph with n points.
    n_dims : int, optional
        Number of coordinates d. By default all modes of the spectrum that are not constant.
    power : float
        Exponent p of the eigenvalues.
    t : float, optional
        Diffusion time, in length² (in 1/weight on a graph with B = I), > 0.

    Returns
    -------
    (n, d) float
        In length^(-2p - m/2) for shapes of dimension m.

    Raises
    ------
    InvalidParameterError
        If the spectrum does not begin with the lowest eigenvalue, has fewer modes that are not
        constant, `n_dims` is not a whole number, the power is not finite, or t is not positive and
        finite.

    See Also
    --------
    spectral_distances : Distances between the images.
    spectral_clusters : Divide the points into clusters by their embedding.

    Examples
    --------
    The three lowest functions on a sphere map it to a sphere:

    >>> import numpy as np, eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(3)), 4)
    >>> radii = np.linalg.norm(es.spectral.spectral_embedding(spectrum), axis=1)
    >>> bool(np.ptp(radii) < 0.01 * radii.mean())
    True
    """
    require_type(spectrum, Spectrum, "spectrum")
    exponent = real_numbers(power, "power").astype(np.float64)
    if exponent.ndim or not np.isfinite(exponent):
        raise InvalidParameterError(f"power must be one finite number; it is {power!r}.")
    first = count_constant_modes(spectrum)
    most = len(spectrum.eigenvalues) - first
    n_wanted = most if n_dims is None else whole_number(n_dims, "n_dims", 1)
    if n_wanted > most:
        raise InvalidParameterError(
            f"n_dims must lie in 1..{most}, the number of modes that are not constant "
            f"({first} of {len(spectrum.eigenvalues)} are); it is {n_wanted}. Compute more eigenpairs."
        )
    chosen = slice(first, first + n_wanted)
    values = spectrum.eigenvalues[chosen]
    with np.errstate(over="ignore"):
        weights = values ** float(exponent)
    if not np.isfinite(weights).all():
        raise InvalidParameterError(
            f"power must leave powers of eigenvalues finite; those of {values[0]:.4g} to "
            f"{values[-1]:.4g} are not with {power!r}."
        )
    embedded = spectrum.eigenvectors[:, chosen] * weights
    return (
        embedded
        if t is None
        else embedded * exponential_decay(values, positive_number(t, "t"))[:, 0]
    )


@one_blas_thread()
def spectral_distances(
    spectrum: Spectrum,
    points: ArrayLike | None = None,
    *,
    method: DistanceMethod = "biharmonic",
    t: float | None = None,
) -> Float[np.ndarray, "n q"]:
    """Compute distances in the spectral domain, from some points or between all pairs.

    d(x, y)² = Σ_i w(λ_i) (φ_i(x) - φ_i(y))², with a weight w for each method:

    - "biharmonic": 1/λ² (Lipman, Rustamov and Funkhouser 2010). On a surface the sum converges as k
      grows: d is smooth, nearly geodesic close to a point, and aware of the whole shape far from it.
    - "commute-time": 1/λ (Qiu and Hancock 2007). On a graph d² is the effective resistance between
      x and y, and d² times the sum of the degrees is the mean time of a random walk from x to y and
      back. On surfaces d grows without bound with k, as √log k, because resistance between points
      of a plate is infinite: compare distances of one number of modes.
    - "diffusion": exp(-2tλ) (Coifman and Lafon 2006). The distance between the heat that has spread
      from x and the heat that has spread from y after time t, in the norm of B.

    Distances use the k modes of the spectrum. What the others would add to d² lies between 0 and
    w(λ_k) (1/b_x + 1/b_y - Σ_i (φ_i(x) - φ_i(y))²), summed over the k modes, with b the masses of
    the points (a diagonal B).

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs on the n points of a mesh, a cloud or a graph, from the lowest on.
    points : (q,) int, optional
        Points from which to measure. By default all n points, so the result has n² entries.
    method : {"biharmonic", "commute-time", "diffusion"}
    t : float, optional
        Of "diffusion": the diffusion time, in length² (in 1/weight on a graph with B = I), > 0.

    Returns
    -------
    (n, q) float
        Column j has the distances from `points[j]` to all points. For shapes of dimension m in
        length^(2 - m/2), length^(1 - m/2) and length^(-m/2), in the order above. Between components
        the first two are infinite; diffusion distances are not, since the constant modes count.

    Raises
    ------
    InvalidParameterError
        If the method is not one of the three, t is not positive and finite, is missing or is given
        to another method, a point does not exist, all modes are constant, the spectrum does not
        begin with the lowest eigenvalue, or the result does not fit into memory.

    See Also
    --------
    spectral_embedding : The embeddings with these distances.

    Examples
    --------
    The farthest point of a sphere is the one across:

    >>> import numpy as np, eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 50)
    >>> distances = es.spectral.spectral_distances(spectrum, [0])[:, 0]
    >>> bool(np.allclose(mesh.vertices[distances.argmax()], -mesh.vertices[0]))
    True

    Resistors of 1 ohm in a row add up:

    >>> from scipy.sparse import diags_array
    >>> row = diags_array([np.ones(3), np.ones(3)], offsets=[-1, 1]).tocsr()
    >>> spectrum = es.solve_spectrum(es.operators.graph_laplacian(row), 4)
    >>> found = es.spectral.spectral_distances(spectrum, [0], method="commute-time")
    >>> (found[:, 0] ** 2).round(9).tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    require_type(spectrum, Spectrum, "spectrum")
    if (method == "diffusion") == (t is None):
        raise InvalidParameterError(
            "Diffusion distances, and no others, take a time t, in length²; "
            f"method is {method!r} and t is {t}."
        )
    if t is not None:
        require_lowest(spectrum, "spectrum")
        decay = exponential_decay(spectrum.eigenvalues, positive_number(t, "t"))[:, 0]
        return _distances(spectrum.eigenvectors * decay, points)
    if method not in POWERS:
        raise InvalidParameterError(
            f"method must be one of {', '.join([*POWERS, 'diffusion'])}; it is {method!r}."
        )
    distances = _distances(spectral_embedding(spectrum, power=POWERS[method]), points)
    labels = component_labels(spectrum)
    if labels.any():
        apart: Bool[np.ndarray, "n q"] = (
            labels[:, None] != labels[_target_points(points, len(labels))]
        )
        distances[apart] = np.inf
    return distances


def count_constant_modes(spectrum: Spectrum) -> int:
    """Return the number of eigenvalues that count as 0, one for each component of the shape.

    Raise InvalidParameterError if all are 0, or the spectrum does not begin with the lowest
    eigenvalue.
    """
    require_lowest(spectrum, "spectrum")
    values = spectrum.eigenvalues
    n_zero = spectrum.n_zero_modes
    # A lone eigenvalue of rounding size is not below its own multiple.
    if n_zero == len(values) or len(values) == 1:
        raise InvalidParameterError(
            f"The spectrum must have a mode that is not constant; its {len(values)} are constant "
            "on each component of the shape. Compute more eigenpairs."
        )
    return n_zero


def component_labels(spectrum: Spectrum) -> Int[np.ndarray, " n"]:
    """Return the number of the component of each point, from its values in the constant modes.

    The rows of two points are equal if they are of one component, and orthogonal otherwise,
    whichever basis of the constant modes a solver has chosen.
    """
    rows = spectrum.eigenvectors[:, : count_constant_modes(spectrum)]
    labels = np.zeros(len(rows), dtype=np.int64)
    if rows.shape[1] < 2:
        return labels
    rows = unit_vectors(rows)
    labels[:] = -1
    for number in range(rows.shape[1]):
        left = np.flatnonzero(labels < 0)
        if not left.size:
            break
        labels[left[rows[left] @ rows[left[0]] > ONE_COMPONENT]] = number
    return labels


def _distances(
    embedded: Float[np.ndarray, "n d"], points: ArrayLike | None
) -> Float[np.ndarray, "n q"]:
    """Return the Euclidean distances of all rows to some.

    Coordinates are subtracted, not multiplied: |x|² + |y|² - 2xᵀy loses half of the digits of the
    distances between near points.
    """
    n = len(embedded)
    chosen = _target_points(points, n)
    require_memory(
        "Distances",
        f"{n} × {len(chosen)} pairs of points",
        {"distances": BYTES_OF_PAIR * n * len(chosen)},
        "Pass fewer points.",
        share=SHARE_OF_ARRAYS,
    )
    return cdist(embedded, embedded[chosen])


def _target_points(points: ArrayLike | None, n: int) -> Int[np.ndarray, " q"]:
    """Return the points to measure distances from, by default all."""
    if points is None:
        return np.arange(n)
    return whole_numbers(points, "A point", 0, n - 1)
