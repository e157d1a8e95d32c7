"""Clusters of points by their values in the lowest eigenvectors (thesis 1.2.2)."""

from typing import Literal

import numpy as np
import scipy.linalg as sl
from jaxtyping import Int
from scipy.cluster.vq import vq

from certeig.kit.arguments import require_choice, require_type
from certeig.kit.arrays import TINY, as_array, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._vectors import sum_rows
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.requirements import require_matrix
from eigenshape.spectral.requirements import require_lowest
from eigenshape.spectral.spectrum import Spectrum
from eigenshape.spectral.tools.embedding import count_constant_modes

ClusterMethod = Literal["k-means", "normalized-cut"]

# Rounds after which the assignment of rows to clusters stops where it has not settled: k-means
# and the rotation settle in fewer than 30 on all data sets of the tests.
MAX_ROUNDS = 300


@one_blas_thread()
def spectral_clusters(
    spectrum: Spectrum,
    n_clusters: int | None = None,
    *,
    method: ClusterMethod = "k-means",
) -> Int[np.ndarray, " n"]:
    """Divide the points of a graph, a cloud or a mesh into clusters.

    Each point is a row of the c lowest eigenvectors, constants included, divided by its length, so
    that the points lie on a sphere. Rows of one cluster are close together there.

    - "k-means" groups them by k-means (Ng, Jordan and Weiss 2001). It starts at the c rows that are
      most orthogonal to each other, chosen by a pivoted QR factorization (Damle, Minden and Ying
      2019). So there is no random start, and the same input gives the same clusters.
    - "normalized-cut" rotates the rows towards the coordinate axes and assigns each to the closest
      axis: the nearest discrete solution of the relaxed normalized cut (Yu and Shi 2003).

    Parameters
    ----------
    spectrum : Spectrum
        Of at least c pairs, from the lowest on. For a graph take that of
        `graph_laplacian(graph, "normalized")`.
    n_clusters : int, optional
        Number of clusters c. The default is `count_clusters(spectrum)`.
    method : {"k-means", "normalized-cut"}

    Returns
    -------
    (n,) int
        The cluster of each point, from 0; numbered in the order in which they first occur. A
        cluster can stay empty, and then its number is not used, if fewer than c rows differ.

    Raises
    ------
    InvalidParameterError
        If there are more clusters than eigenpairs, or fewer clusters than components; the spectrum
        does not begin with the lowest eigenvalue; or the method is neither of the two.

    See Also
    --------
    count_clusters : Guess the number of clusters.
    normalized_cut : Measure how well clusters are separated.
    find_parts : Divide a surface into the parts that people see.

    Examples
    --------
    Two groups of three, joined by a weak edge:

    >>> import numpy as np, eigenshape as es
    >>> from scipy.sparse import block_array, csr_array
    >>> group = np.ones((3, 3)) - np.eye(3)
    >>> bridge = np.zeros((3, 3))
    >>> bridge[2, 0] = 0.1
    >>> graph = csr_array(np.block([[group, bridge], [bridge.T, group]]))
    >>> spectrum = es.solve_spectrum(es.operators.graph_laplacian(graph, "normalized"), 4)
    >>> es.spectral.count_clusters(spectrum)
    2
    >>> es.spectral.spectral_clusters(spectrum).tolist()
    [0, 0, 0, 1, 1, 1]
    """
    require_lowest(spectrum, "spectrum")
    require_choice(method, ClusterMethod, "method")
    k = len(spectrum.eigenvalues)
    if n_clusters is None:
        n_clusters = count_clusters(spectrum)
    n_clusters = whole_number(n_clusters, "n_clusters", 1, k)
    # The lowest modes must at least tell the components apart.
    if n_clusters < k and n_clusters < (n_components := count_constant_modes(spectrum)):
        raise InvalidParameterError(
            f"n_clusters must be at least the number of components, {n_components}; it is "
            f"{n_clusters}. Pass n_clusters={n_components}, or keep one component."
        )
    if n_clusters == 1:
        return np.zeros(len(spectrum.eigenvectors), dtype=np.int64)
    modes = spectrum.eigenvectors[:, :n_clusters]
    lengths = np.linalg.norm(modes, axis=1)[:, None]
    rows = modes / np.maximum(lengths, TINY)
    # Start from rows that are long and nearly orthogonal to each other.
    weighted = modes * np.sqrt(spectrum.mass.diagonal())[:, None]
    _, pivots = sl.qr(weighted.T, mode="r", pivoting=True)
    centers = rows[pivots[:n_clusters]]
    # Alternate between the closest center of each row and the best centers, until none changes.
    labels = np.full(len(rows), -1)
    for _ in range(MAX_ROUNDS + 1):
        before = labels
        is_mean = method == "k-means"
        labels = vq(rows, centers)[0] if is_mean else np.argmax(rows @ centers.T, axis=1)
        if np.array_equal(before, labels):
            break
        sums = sum_rows(labels, rows, len(centers))
        if is_mean:
            # Centers move to the mean of their rows; one that has lost all rows stays.
            counts = np.bincount(labels, minlength=len(centers))[:, None]
            centers = np.where(counts > 0, sums / np.maximum(counts, 1), centers)
        else:
            # The rotation of the axes that is closest to the sums of their rows (Procrustes).
            left, _, right = sl.svd(sums)
            centers = left @ right
    # Label 0 is that of point 0, 1 that of the next point with another one, and so on.
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    ranks = np.argsort(np.argsort(first))
    return ranks[inverse]


def count_clusters(spectrum: Spectrum, most: int | None = None) -> int:
    """Guess the number of clusters: that of the eigenvalues before the largest relative gap.

    If a graph falls into c clusters that are hardly joined, its c lowest eigenvalues are close to 0
    and the next one is not (von Luxburg 2007, section 8.3). This is the c ≥ 2 with the largest
    λ_{c+1} / λ_c, or the number of components if there are several. Differences instead of ratios
    would depend on how many eigenvalues there are, because these grow apart: on the five toy data
    sets of scikit-learn, at four seeds each, ratios find the number 12 times and differences 5
    times.

    It is a guess. A connected shape is taken to have at least two clusters, and neighboring
    clusters that overlap are often counted as one.

    Parameters
    ----------
    spectrum : Spectrum
        k ≥ 3 eigenpairs from the lowest on, more than there are clusters.
    most : int, optional
        Largest number of clusters to consider, 2 to k - 1. By default k - 1.

    Returns
    -------
    int
        At least 2.

    Raises
    ------
    InvalidParameterError
        If there are fewer than 3 eigenvalues or all are 0, the spectrum does not begin with the
        lowest one, or `most` is not in 2..k-1, or is less than the number of components.

    Examples
    --------
    Three separate edges are three clusters:

    >>> import eigenshape as es
    >>> from scipy.sparse import block_diag, csr_array
    >>> edge = csr_array([[0, 1], [1, 0]])
    >>> graph = csr_array(block_diag(3 * [edge]))
    >>> laplacian = es.operators.graph_laplacian(graph, "normalized")
    >>> es.spectral.count_clusters(es.solve_spectrum(laplacian, 6))
    3
    """
    require_type(spectrum, Spectrum, "spectrum")
    k = len(spectrum.eigenvalues)
    if k < 3:
        raise InvalidParameterError(
            f"A gap after two clusters needs at least 3 eigenvalues; the spectrum has {k}. "
            "Compute more eigenpairs."
        )
    limit = k - 1 if most is None else whole_number(most, "most", 2, k - 1)
    n_components = count_constant_modes(spectrum)
    if n_components > limit:
        raise InvalidParameterError(
            f"most must be at least the number of components, {n_components}; it is {limit}. Pass "
            f"most={n_components}, or keep fewer components."
        )
    if n_components > 1:
        return n_components
    ratios = spectrum.eigenvalues[2 : limit + 1] / spectrum.eigenvalues[1:limit]
    return int(np.argmax(ratios)) + 2


def normalized_cut(laplacian: Laplacian, labels: ArrayLike) -> float:
    """Measure how well clusters are separated: what is cut over what is kept, summed over clusters.

    Σ_c 1_cᵀW 1_c / 1_cᵀB 1_c, with 1_c the indicator of cluster c. For
    `graph_laplacian(graph, "normalized")` this is the normalized cut of Shi and Malik (2000): the
    weight of the edges that leave a cluster over the sum of its degrees. The sum of the c lowest
    eigenvalues is a lower bound for all divisions into c clusters.

    Parameters
    ----------
    laplacian : Laplacian
        Of n points.
    labels : (n,) int
        The cluster of each point.

    Returns
    -------
    float
        In the unit of the eigenvalues: none for a normalized graph Laplacian, 1/length² on a shape.

    Raises
    ------
    InvalidParameterError
        If there is not one whole number per point, or the operator has `correct="log"`.

    See Also
    --------
    spectral_clusters : Find clusters whose cut is small.

    Examples
    --------
    A path of four points cut in the middle: each half has one edge cut and degrees 1 + 2.

    >>> import numpy as np, eigenshape as es
    >>> from scipy.sparse import diags_array
    >>> path = diags_array([np.ones(3), np.ones(3)], offsets=[-1, 1]).tocsr()
    >>> laplacian = es.operators.graph_laplacian(path, "normalized")
    >>> round(es.spectral.normalized_cut(laplacian, [0, 0, 1, 1]), 9)
    0.666666667
    """
    require_matrix(laplacian)
    names = as_array(labels, "labels")
    if names.shape != (laplacian.n_points,) or names.dtype.kind not in "biu":
        raise InvalidParameterError(
            f"labels must hold one whole number per point, shape ({laplacian.n_points},); the "
            f"shape is {names.shape} and the type {names.dtype}."
        )
    cut = 0.0
    for name in np.unique(names):
        inside = (names == name).astype(np.float64)
        leaving = inside @ (laplacian.stiffness @ inside)
        cut += float(leaving / (inside @ (laplacian.mass @ inside)))
    return cut
