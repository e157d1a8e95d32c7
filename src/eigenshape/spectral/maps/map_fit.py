"""The functional map that fits pairs of points, descriptors and orientation best."""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float, Int

from certeig.kit.arguments import describe_value
from certeig.kit.arrays import as_array, finite_values
from certeig.kit.errors import InvalidParameterError
from certeig.kit.memory import require_memory
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.spectral.maps.descriptors import (
    descriptor_functions,
    orientation_operators,
    product_operators,
)
from eigenshape.spectral.maps.functional_map import (
    FunctionalMap,
    modes_of_both,
    unit_modes,
    unit_projector,
)
from eigenshape.spectral.spectrum import Spectrum

N_MODES = 20  # of each shape by default, for exact pairs; inexact ones need fewer
# Weight of the commutativity penalty relative to the pairs. A larger weight draws the map towards
# the identity of the spectra, a smaller one lets a few pairs determine many entries.
COMMUTING = 0.1
# Weights of products and of orientation. With 1, a pair of poses of a horse, a cat and a lion each
# had the smallest error or nearly so; the weight of the Laplacians then hardly matters.
PRODUCTS = 1.0
ORIENTATION = 1.0
_Term: TypeAlias = tuple[float, Float[np.ndarray, "q k k"], Float[np.ndarray, "q k k"]]
COPIES = 4  # of the matrix of the equations while they are set up and solved


@one_blas_thread()
def functional_map(  # noqa: PLR0913 - what is given, and the weight of each term
    source: Spectrum,
    target: Spectrum,
    pairs: ArrayLike | None = None,
    *,
    n_modes: Integer = N_MODES,
    descriptors: str | Sequence[ArrayLike] | None = None,
    meshes: Sequence[MeshLike] | None = None,
    commuting: float = COMMUTING,
    products: float = PRODUCTS,
    orientation: float = ORIENTATION,
) -> FunctionalMap:
    """Compute a functional map between two shapes from pairs of points, descriptors, or both.

    Minimizes over maps C that keep constants

    Σ_p |C a_p - b_p|² / α + μ Σ_ij (λ'_i - λ_j)² C_ij² +
    ν Σ_f |C M_f - M'_f C|² / β + ω Σ_f |C S_f - S'_f C|² / γ:

    - a_p and b_p are coefficients on source and target: of unit masses at the points of a pair,
      times (|a_p| |b_p|)^-½, and of descriptors f and f', made to have mean 0 and norm 1
      (Ovsjanikov and others 2012, section 4).
    - λ is an eigenvalue × area, relative to the largest one: C should commute with the Laplacians.
    - M_f g = f g: C should keep products with descriptors (Nogneng and Ovsjanikov 2017, eq. 6).
    - S_f g = ⟨∇f × ∇g, n⟩ with the outward normal n: C should keep orientation (Ren, Poulenard,
      Wonka and Ovsjanikov 2018, section 4).
    - α, β, γ are the sums of squares of all a_p, M_f, S_f, divided by the number of modes.

    All four terms are quadratic in C, so the minimum is the solution of one linear system. The
    products and orientation need descriptors; orientation also needs `meshes`.

    *Pairs* alone are enough if there are a few: the commutativity penalty determines the rest. In a
    comparison on nine pairs of poses of a horse, a cat and a lion (5,000 to 8,400 vertices, six
    pairs chosen by hand), wave functions at the points instead of unit masses were no better, and
    heat was worse. *Descriptors* alone cannot tell the left side of an animal from the right side,
    unless `meshes` are passed: then, without any pair, the poses of the horse and the cat have mean
    errors of 0.011 to 0.022 √area after `refine_map` to 100 modes, as with six pairs, and those of
    the lion 0.05 to 0.19. `es.match_shapes` needs neither pairs nor spectra, and takes
    parts.

    The shapes should be nearly isometric; maps of parts of shapes are not supported. If all pairs
    are mirrored, as those of `es.retrieval.match_patches` may be, the map is mirrored too.

    Parameters
    ----------
    source, target : Spectrum
        Of connected shapes of any size.
    pairs : (p, 2) int, optional
        A vertex of the source and the corresponding vertex of the target in each row; at least one
        pair, and more if the shape is symmetric.
    n_modes : int
        Number of modes of each shape. Use 10 for inexact pairs, such as those of `match_patches`,
        and 20 for exact ones. `refine_map` extends the map to more modes.
    descriptors : "waves", "heat" or pair of arrays, optional
        "waves" and "heat" are the wave and heat kernel signatures in 20 bands, from all eigenpairs
        that the spectra hold (100 are enough), and the same kernels from each point of `pairs`. A
        pair holds functions of your own, (n1, q) and (n2, q), in any unit.
    meshes : pair of MeshLike, optional
        Source and target, with vertices as in the spectra and outward faces. With the faces of one
        mesh turned inward, the map is mirrored.
    commuting, products, orientation : float
        The weights μ, ν and ω, at least 0.

    Returns
    -------
    FunctionalMap

    Raises
    ------
    InvalidParameterError
        If there are neither pairs nor descriptors, a pair names no vertex, descriptors or meshes do
        not fit the spectra, a weight is negative, the equations do not fit into memory, or a
        spectrum has too few modes or does not begin with one constant function.

    See Also
    --------
    es.match_shapes : Match shapes and parts without pairs.
    es.spectral.refine_map : Extend a map to more modes.
    es.spectral.point_map : Convert a map to corresponding vertices.
    es.spectral.transfer_function : Transfer functions by a map.

    Examples
    --------
    A shape and a larger copy of it, with three pairs:

    >>> import eigenshape as es
    >>> mesh = es.make_creature("quadruped", n_vertices=500)
    >>> copy = es.TriangleMesh(3 * mesh.vertices, mesh.faces)
    >>> source, target = (es.solve_spectrum(es.cotangent_laplacian(m), 20) for m in (mesh, copy))
    >>> pairs = [[0, 0], [100, 100], [200, 200]]
    >>> mapping = es.functional_map(source, target, pairs, n_modes=8)
    >>> mapping.matrix.shape
    (8, 8)
    >>> refined = es.spectral.refine_map(mapping, 20)
    >>> partners = es.spectral.point_map(refined)
    >>> bool((partners == range(len(mesh.vertices))).mean() > 0.9)
    True

    The same without pairs:

    >>> mapping = es.functional_map(
    ...     source, target, n_modes=8, descriptors="waves", meshes=(mesh, copy)
    ... )
    >>> partners = es.spectral.point_map(es.spectral.refine_map(mapping, 20))
    >>> bool((partners == range(len(mesh.vertices))).mean() > 0.9)
    True
    """
    k = modes_of_both(source, target, n_modes)
    if pairs is None and descriptors is None:
        raise InvalidParameterError(
            'A map needs pairs, descriptors or both; there are none. Pass descriptors="waves".'
        )
    faces = None if meshes is None else _faces_of_both(meshes, source, target)
    if faces is not None and descriptors is None:
        raise InvalidParameterError(
            'meshes serve the orientation of descriptors; there are none. Pass descriptors="waves".'
        )
    weights = []
    for value, name in (
        (commuting, "commuting"),
        (products, "products"),
        (orientation, "orientation"),
    ):
        weight = finite_values(value, name)
        if weight.size != 1 or weight[0] < 0:
            raise InvalidParameterError(f"{name} must be one number, at least 0; it is {value}.")
        weights.append(float(weight[0]))

    ends = np.empty((0, 2), dtype=np.int64)
    if pairs is not None:
        ends = _as_pairs(pairs, len(source.eigenvectors), len(target.eigenvectors))
    ours, theirs = unit_modes(source, k)[ends[:, 0]], unit_modes(target, k)[ends[:, 1]]
    scales = (np.linalg.norm(ours, axis=1) * np.linalg.norm(theirs, axis=1))[:, None] ** -0.5
    ours, theirs = scales * ours, scales * theirs
    terms: list[_Term] = []
    if descriptors is not None:
        one, two = descriptor_functions(source, target, descriptors, ends)
        ours = np.concatenate([ours, one.T @ unit_projector(source, k)])
        theirs = np.concatenate([theirs, two.T @ unit_projector(target, k)])
        if weights[1]:
            both = product_operators(source, one, k), product_operators(target, two, k)
            terms.append((weights[1], *both))
        if faces is not None and weights[2]:
            turns = orientation_operators(source, one, faces[0], k)
            turns_there = orientation_operators(target, two, faces[1], k)
            terms.append((weights[2], turns, turns_there))
    # λ'_i - λ_j, relative to the largest eigenvalue
    low, low_there = (each.eigenvalues[:k] * each.point_areas.sum() for each in (source, target))
    commutators = (low_there[:, None] - low) / max(low[-1], low_there[-1])
    penalties = weights[0] * commutators**2
    if not terms:
        return FunctionalMap(_solve_rows(ours, theirs, penalties), source, target)
    return FunctionalMap(_solve_all(ours, theirs, penalties, terms), source, target)


def _faces_of_both(
    meshes: Sequence[MeshLike], source: Spectrum, target: Spectrum
) -> list[Int[np.ndarray, "f 3"]]:
    if not isinstance(meshes, tuple | list) or len(meshes) != 2:
        raise InvalidParameterError(
            f"meshes must be a pair, the source and the target; the value is {describe_value(meshes)}."
        )
    faces = []
    for number, (value, spectrum) in enumerate(zip(meshes, (source, target), strict=True)):
        mesh = as_mesh(value, f"meshes[{number}]")
        if mesh.n_vertices != len(spectrum.eigenvectors):
            raise InvalidParameterError(
                f"meshes must have the vertices of their spectra; meshes[{number}] has {mesh.n_vertices}, and its "
                f"spectrum {len(spectrum.eigenvectors)}."
            )
        faces.append(mesh.faces)
    return faces


def _solve_rows(
    ours: Float[np.ndarray, "p k"],
    theirs: Float[np.ndarray, "p k"],
    penalties: Float[np.ndarray, "k k"],
) -> Float[np.ndarray, "k k"]:
    """Solve for each row of the map with its first column that of the identity."""
    matrix = np.eye(len(penalties))
    roots = np.sqrt(penalties * np.sum(ours**2) / len(penalties))
    for i, row in enumerate(roots):
        wanted = theirs[:, i] - matrix[i, 0] * ours[:, 0]
        system = np.concatenate([ours[:, 1:], np.diag(row[1:])])
        matrix[i, 1:] = sl.lstsq(system, np.concatenate([wanted, np.zeros(len(row) - 1)]))[0]
    return matrix


def _solve_all(
    ours: Float[np.ndarray, "p k"],
    theirs: Float[np.ndarray, "p k"],
    penalties: Float[np.ndarray, "k k"],
    terms: list[_Term],
) -> Float[np.ndarray, "k k"]:
    """Solve for all entries of the map at once, because operators couple its rows.

    `equations[i, a, j, b]` multiplies C_jb in the equation of C_ia, the derivative of the sum.
    """
    k, unit = len(penalties), np.eye(len(penalties))
    require_memory(
        "The equations of a map",
        f"{k} modes with descriptors",
        {"equations": COPIES * 8.0 * k**4},
        "Take fewer modes, and extend the map by es.spectral.refine_map.",
    )
    scale = np.sum(ours**2) / k
    equations = np.einsum("ij,ab->iajb", unit, ours.T @ ours / scale)
    equations += np.einsum("ij,ab,ia->iajb", unit, unit, penalties)
    for weight, first, second in terms:
        scale_of_term = np.sum(first**2) / k
        if scale_of_term == 0:
            continue
        factor = weight / scale_of_term
        equations += factor * np.einsum("ij,ab->iajb", unit, np.einsum("qac,qbc->ab", first, first))
        equations += factor * np.einsum(
            "ij,ab->iajb", np.einsum("qci,qcj->ij", second, second), unit
        )
        mixed = second.reshape(len(second), -1).T @ first.reshape(len(first), -1)
        mixed = factor * mixed.reshape(k, k, k, k)  # M'_ij M_ab, summed over functions
        equations -= mixed.transpose(0, 2, 1, 3) + mixed.transpose(1, 3, 0, 2)
    matrix = unit.copy()
    wanted = (theirs.T @ ours / scale)[:, 1:] - equations[:, 1:, 0, 0]
    system = equations[:, 1:, :, 1:].reshape(k * (k - 1), -1)
    # Of rank less than full where the data do not determine the map; then the least solution.
    solution = sl.lstsq(system, wanted.ravel(), lapack_driver="gelsy")[0]
    matrix[:, 1:] = solution.reshape(k, k - 1)
    return matrix


def _as_pairs(pairs: ArrayLike, n_source: int, n_target: int) -> Int[np.ndarray, "p 2"]:
    rows = as_array(pairs, "pairs")
    if rows.ndim != 2 or rows.shape[1] != 2 or not len(rows) or rows.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"pairs must be whole numbers in shape (p, 2), at least one row; the shape is {rows.shape} and the type "
            f"{rows.dtype}."
        )
    bad = np.flatnonzero(((rows < 0) | (rows >= [n_source, n_target])).any(axis=1))
    if bad.size:
        raise InvalidParameterError(
            f"pairs must name vertices 0..{n_source - 1} of the source and 0..{n_target - 1} of the target; pair "
            f"{bad[0]} is {rows[bad[0]].tolist()}."
        )
    return rows.astype(np.int64)
