"""Points of a shape as points of the spectral domain, and distances there (thesis 1.2.1, 1.2.2)."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.distance import cdist

from eigenshape._arguments import require_type
from eigenshape._arrays import (
    SHARE_OF_ARRAYS,
    positive_values,
    real_numbers,
    whole_number,
    whole_numbers,
)
from eigenshape._errors import InvalidParameterError
from eigenshape._memory import require_memory
from eigenshape._threads import one_blas_thread
from eigenshape._typing import ArrayLike
from eigenshape.spectral.diffusion.decay import exponential_decay
from eigenshape.spectral.spectrum import Spectrum, count_zero_modes, require_lowest

# Cosine of the angle between rows of the constant modes above which two points are of one
# component. It is 1 inside a component and 0 between components; the solvers err by 1e-3 at most.
ONE_COMPONENT = 0.5
BYTES_OF_PAIR = 9.0  # memory for each distance: a float, and whether the pair is apart


@one_blas_thread()
def spectral_embedding(
    spectrum: Spectrum, n_dims: int | None = None, *, power: float = 0.0
) -> Float[np.ndarray, "n d"]:
    """Map each point to its values in the lowest eigenvectors that are not constant.

    Point x goes to (λ_1^p φ_1(x), ..., λ_d^p φ_d(x)), with p one of the scalings of thesis 1.2.1:

    - p = 0: none, the spectral embedding;
    - p = -1/2: 1/√λ, the global point signature (Rustamov 2007), whose Euclidean distances are
      commute-time distances;
    - p = -1: 1/λ, whose Euclidean distances are biharmonic distances (Lipman, Rustamov and
      Funkhouser 2010);
    - p = 2: λ², as in thesis reference 13, where eigenvalues are those of an affinity.

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

    Returns
    -------
    (n, d) float
        In length^(-2p - m/2) for shapes of dimension m.

    Raises
    ------
    InvalidParameterError
        If the spectrum does not begin with the lowest eigenvalue, has fewer modes that are not
        constant, `n_dims` is not a whole number, or the power is not finite.

    See Also
    --------
    diffusion_map : The embedding of heat.
    commute_time_distances, biharmonic_distances, diffusion_distances : Distances.
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
    return spectrum.eigenvectors[:, chosen] * spectrum.eigenvalues[chosen] ** float(exponent)


def global_point_signature(
    spectrum: Spectrum, n_dims: int | None = None
) -> Float[np.ndarray, "n d"]:
    """Compute the global point signature: modes divided by the roots of their eigenvalues.

    Point x goes to (φ_1(x)/√λ_1, ..., φ_d(x)/√λ_d) (Rustamov 2007). This is `spectral_embedding`
    with power -1/2. It keeps which points of a shape are close, however the shape bends.

    Parameters
    ----------
    spectrum : Spectrum
        Of n points.
    n_dims : int, optional
        Number of coordinates d. By default all modes of the spectrum that are not constant.

    Returns
    -------
    (n, d) float
        In length^(1 - m/2) for shapes of dimension m; without unit on a surface.

    Raises
    ------
    InvalidParameterError
        If the spectrum does not begin with the lowest eigenvalue, or has fewer modes that are not
        constant.

    Examples
    --------
    Distances between signatures are commute-time distances:

    >>> import numpy as np, eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.shapes.torus(24, 12)), 20)
    >>> signature = es.spectral.global_point_signature(spectrum)
    >>> apart = np.linalg.norm(signature[0] - signature[7])
    >>> distances = es.spectral.commute_time_distances(spectrum, [0])
    >>> bool(abs(distances[7, 0] - apart) < 1e-12)
    True
    """
    return spectral_embedding(spectrum, n_dims, power=-0.5)


@one_blas_thread()
def diffusion_map(
    spectrum: Spectrum, t: float, n_dims: int | None = None
) -> Float[np.ndarray, "n d"]:
    """Map each point to the modes, weighted by how much of each is left after heat has flowed.

    Point x goes to (exp(-tλ_1) φ_1(x), ..., exp(-tλ_d) φ_d(x)) (Coifman and Lafon 2006). Modes of
    eigenvalue 0 are left out: heat never changes them.

    Parameters
    ----------
    spectrum : Spectrum
        Of n points.
    t : float
        Diffusion time, in length² (in 1/weight on a graph with B = I), > 0.
    n_dims : int, optional
        Number of coordinates d. By default all modes of the spectrum that are not constant.

    Returns
    -------
    (n, d) float
        In length^(-m/2) for shapes of dimension m.

    Raises
    ------
    InvalidParameterError
        If t is not positive and finite, the spectrum does not begin with the lowest eigenvalue, or
        has fewer modes that are not constant.

    See Also
    --------
    diffusion_distances : Distances between the images.

    Examples
    --------
    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.shapes.torus(24, 12)), 20)
    >>> es.spectral.diffusion_map(spectrum, 0.5, 3).shape
    (288, 3)
    """
    time = _one_time(t)
    embedded = spectral_embedding(spectrum, n_dims)
    first = count_constant_modes(spectrum)
    values = spectrum.eigenvalues[first : first + embedded.shape[1]]
    return embedded * exponential_decay(values, time)[:, 0]


@one_blas_thread()
def commute_time_distances(
    spectrum: Spectrum, points: ArrayLike | None = None
) -> Float[np.ndarray, "n q"]:
    """Compute commute-time distances, from some points or between all pairs.

    d(x, y)² = Σ_i (φ_i(x) - φ_i(y))² / λ_i over the modes that are not constant (Qiu and Hancock
    2007). On a graph d² is the effective resistance between x and y, and d² times the sum of the
    degrees is the mean time of a random walk from x to y and back. On surfaces d grows without
    bound with k, as √log k, because resistance between points of a plate is infinite: compare
    distances of one number of modes, or use biharmonic distances.

    Distances use the k modes of the spectrum. What the others would add to d² lies between 0 and
    (1/b_x + 1/b_y - Σ_i (φ_i(x) - φ_i(y))²) / λ_k, summed over the k modes, with b the masses of
    the points (a diagonal B).

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs on the n points of a mesh, a cloud or a graph, from the lowest on.
    points : (q,) int, optional
        Points from which to measure. By default all n points, so the result has n² entries.

    Returns
    -------
    (n, q) float
        Column j has the distances from `points[j]` to all points; infinite between components. In
        length^(1 - m/2) for shapes of dimension m.

    Raises
    ------
    InvalidParameterError
        If a point does not exist, all modes are constant, the spectrum does not begin with the
        lowest eigenvalue, or the result does not fit into memory.

    See Also
    --------
    biharmonic_distances : Converge with k on surfaces.
    diffusion_distances : At a scale of your choice.

    Examples
    --------
    Resistors of 1 ohm in a row add up:

    >>> import numpy as np, eigenshape as es
    >>> from scipy.sparse import diags_array
    >>> row = diags_array([np.ones(3), np.ones(3)], offsets=[-1, 1]).tocsr()
    >>> spectrum = es.solve_spectrum(es.operators.graph_laplacian(row), 4)
    >>> (es.spectral.commute_time_distances(spectrum, [0])[:, 0] ** 2).round(9).tolist()
    [0.0, 1.0, 2.0, 3.0]
    """
    embedded = spectral_embedding(spectrum, power=-0.5)
    return _distances_apart(embedded, spectrum, points)


@one_blas_thread()
def biharmonic_distances(
    spectrum: Spectrum, points: ArrayLike | None = None
) -> Float[np.ndarray, "n q"]:
    """Compute biharmonic distances, from some points or between all pairs.

    d(x, y)² = Σ_i (φ_i(x) - φ_i(y))² / λ_i² over the modes that are not constant (Lipman, Rustamov
    and Funkhouser 2010). On a surface the sum converges as k grows: d is smooth, nearly geodesic
    close to a point, and aware of the whole shape far from it.

    Distances use the k modes of the spectrum. What the others would add to d² lies between 0 and
    (1/b_x + 1/b_y - Σ_i (φ_i(x) - φ_i(y))²) / λ_k², summed over the k modes, with b the masses of
    the points (a diagonal B).

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs on the n points of a mesh, a cloud or a graph, from the lowest on.
    points : (q,) int, optional
        Points from which to measure. By default all n points, so the result has n² entries.

    Returns
    -------
    (n, q) float
        Column j has the distances from `points[j]` to all points; infinite between components. In
        length^(2 - m/2) for shapes of dimension m, length on a surface.

    Raises
    ------
    InvalidParameterError
        If a point does not exist, all modes are constant, the spectrum does not begin with the
        lowest eigenvalue, or the result does not fit into memory.

    See Also
    --------
    commute_time_distances, diffusion_distances : Other distances.

    Examples
    --------
    The farthest point of a sphere is the one across:

    >>> import numpy as np, eigenshape as es
    >>> mesh = es.icosphere(3)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(mesh), 50)
    >>> distances = es.spectral.biharmonic_distances(spectrum, [0])[:, 0]
    >>> bool(np.allclose(mesh.vertices[distances.argmax()], -mesh.vertices[0]))
    True
    """
    embedded = spectral_embedding(spectrum, power=-1.0)
    return _distances_apart(embedded, spectrum, points)


@one_blas_thread()
def diffusion_distances(
    spectrum: Spectrum, t: float, points: ArrayLike | None = None
) -> Float[np.ndarray, "n q"]:
    """Compute diffusion distances, from some points or between all pairs.

    d(x, y)² = Σ_i exp(-2tλ_i) (φ_i(x) - φ_i(y))² (Coifman and Lafon 2006): the distance between
    the heat that has spread from x and the heat that has spread from y after time t, in the norm of
    B. Points of different components stay apart by their constant modes.

    Distances use the k modes of the spectrum. What the others would add to d² lies between 0 and
    (1/b_x + 1/b_y - Σ_i (φ_i(x) - φ_i(y))²) exp(-2tλ_k), summed over the k modes, with b the masses
    of the points (a diagonal B).

    Parameters
    ----------
    spectrum : Spectrum
        k eigenpairs on the n points of a mesh, a cloud or a graph, from the lowest on.
    t : float
        Diffusion time, in length² (in 1/weight on a graph with B = I), > 0.
    points : (q,) int, optional
        Points from which to measure. By default all n points, so the result has n² entries.

    Returns
    -------
    (n, q) float
        Column j has the distances from `points[j]` to all points, in length^(-m/2) for shapes of
        dimension m.

    Raises
    ------
    InvalidParameterError
        If t is not positive and finite, a point does not exist, the spectrum does not begin with
        the lowest eigenvalue, or the result does not fit into memory.

    See Also
    --------
    diffusion_map : The embedding with these distances.

    Examples
    --------
    After a long time the heat from all points is the same:

    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 20)
    >>> early, late = (es.spectral.diffusion_distances(spectrum, t, [0]).max() for t in (0.1, 10))
    >>> bool(early > 0.1 and late < 1e-8)
    True
    """
    require_type(spectrum, Spectrum, "spectrum")
    require_lowest(spectrum, "spectrum")
    decay = exponential_decay(spectrum.eigenvalues, _one_time(t))[:, 0]
    return _distances(spectrum.eigenvectors * decay, points)


def count_constant_modes(spectrum: Spectrum) -> int:
    """Return the number of eigenvalues that count as 0, one for each component of the shape.

    Raises
    ------
    InvalidParameterError
        If all are 0, or the spectrum does not begin with the lowest eigenvalue.
    """
    require_lowest(spectrum, "spectrum")
    values = spectrum.eigenvalues
    n_zero = count_zero_modes(spectrum)
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
    rows = rows / np.linalg.norm(rows, axis=1)[:, None]
    labels[:] = -1
    for number in range(rows.shape[1]):
        left = np.flatnonzero(labels < 0)
        if not left.size:
            break
        labels[left[rows[left] @ rows[left[0]] > ONE_COMPONENT]] = number
    return labels


def _distances_apart(
    embedded: Float[np.ndarray, "n d"], spectrum: Spectrum, points: ArrayLike | None
) -> Float[np.ndarray, "n q"]:
    """Return distances between rows, infinite between components."""
    distances = _distances(embedded, points)
    labels = component_labels(spectrum)
    if labels.any():
        apart: Bool[np.ndarray, "n q"] = (
            labels[:, None] != labels[_target_points(points, len(labels))]
        )
        distances[apart] = np.inf
    return distances


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
    return np.asarray(cdist(embedded, embedded[chosen]))


def _target_points(points: ArrayLike | None, n: int) -> Int[np.ndarray, " q"]:
    """Return the points to measure distances from, by default all."""
    if points is None:
        return np.arange(n)
    return whole_numbers(points, "A point", 0, n - 1)


def _one_time(t: ArrayLike) -> float:
    times = positive_values(t, "t")
    if len(times) != 1:
        raise InvalidParameterError(f"t must be one diffusion time; there are {len(times)}.")
    return float(times[0])
