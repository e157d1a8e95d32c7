"""The functions that all shapes of a collection share, and how the shapes differ in them."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
import scipy.linalg as sl
from jaxtyping import Float
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from certeig.kit.arguments import describe_value, require_choice, require_type
from certeig.kit.arrays import ReadOnly, freeze, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.memory import require_memory
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import finite_rows
from eigenshape.spectral.maps.functional_map import LOST, FunctionalMap, unit_modes
from eigenshape.spectral.spectrum import Spectrum

Kind = Literal["area", "conformal"]  # of shape differences
COPIES = 4  # of the matrix of the network while its eigenvectors are computed


@record
class LatentBasis(ReadOnly):
    """Functions that s shapes share, as modes of their limit shape (Huang and others 2019).

    The limit shape, or mean shape, has no points. It is given by its inner products, the means of
    those of the shapes: ∫ f g, and ∫ ⟨∇f, ∇g⟩. Its m modes are orthonormal in the first and
    orthogonal in the second, as those of any shape. Size drops out, as for functional maps.

    Attributes
    ----------
    matrices : (s, k, m) float
        Y_i for each shape: maps coefficients in the modes of the limit shape to coefficients in the
        k modes of shape i, of area 1.
    eigenvalues : (m,) float
        Eigenvalues of the limit shape of area 1, in ascending order.
    spectra : tuple of s Spectrum
    misfits : dict
        For the map C of each pair (i, j), |C Y_i - Y_j| / |Y_j|: 0 if it agrees with the other maps.

    See Also
    --------
    latent_basis : Compute one.

    Examples
    --------
    Two equal spheres differ from their limit shape in nothing:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(ball), 16)
    >>> same = es.spectral.map_from_points(spectrum, spectrum, range(ball.n_vertices), n_modes=16)
    >>> latent = es.spectral.latent_basis({(0, 1): same})
    >>> bool(np.allclose(latent.differences("area"), np.eye(8), atol=1e-6))
    True
    """

    matrices: Float[np.ndarray, "s k m"]
    eigenvalues: Float[np.ndarray, " m"]
    spectra: tuple[Spectrum, ...]
    misfits: dict[tuple[int, int], float]

    @one_blas_thread()
    def map_between(self, source: Integer, target: Integer) -> FunctionalMap:
        """Return the consistent map Y_j Y_i⁺ from one shape to another, by way of the limit shape.

        Such maps compose exactly: from i to j and on to l is from i to l.

        Parameters
        ----------
        source, target : int
            Numbers of shapes, i and j.

        Returns
        -------
        FunctionalMap

        Raises
        ------
        InvalidParameterError
            If there is no shape of that number.
        """
        last = len(self.spectra) - 1
        i, j = whole_number(source, "source", 0, last), whole_number(target, "target", 0, last)
        matrix = self.matrices[j] @ np.linalg.pinv(self.matrices[i])
        return FunctionalMap(matrix, self.spectra[i], self.spectra[j])

    def differences(self, kind: str = "area") -> Float[np.ndarray, "s m m"]:
        """Return how each shape differs from the limit shape; see `shape_difference`.

        Their mean is the identity. As vectors of m² numbers they serve principal components and
        other statistics of shapes; signs and rotations of eigenvectors change no distance.

        Parameters
        ----------
        kind : "area" or "conformal"

        Returns
        -------
        (s, m, m) float

        Raises
        ------
        InvalidParameterError
            If `kind` is neither.
        """
        values = np.stack([_unit_values(each, self.matrices.shape[1]) for each in self.spectra])
        return freeze(_difference(self.matrices, self.eigenvalues, values, kind))


@one_blas_thread()
def latent_basis(
    maps: Mapping[tuple[int, int], FunctionalMap], *, n_functions: Integer | None = None
) -> LatentBasis:
    """Make the functional maps of a collection consistent, by functions that all shapes share.

    Coefficients Y_i of one function on all shapes i should be mapped into each other: the sum over
    all maps of |C_ij Y_i - Y_j|², with Σ_i Y_iᵀY_i = s I, is least for eigenvectors of a matrix of
    s × s blocks (Wang, Huang and Guibas 2013, section 4). Of the k best functions, the smoothest
    ones are kept, as modes of the limit shape (Huang, Achlioptas, Guibas and Ovsjanikov 2019,
    "Limit Shapes").

    Parameters
    ----------
    maps : mapping from (i, j) to FunctionalMap
        From shape i to shape j, of s shapes numbered from 0: one map to each from a common shape,
        maps of all pairs, or any that connect the shapes. All have k modes of both shapes.
    n_functions : int, optional
        Number m of functions. The default is k // 2, because the image of a high mode lies partly
        beyond the k modes of another shape.

    Returns
    -------
    LatentBasis

    Raises
    ------
    InvalidParameterError
        If `maps` is no such mapping, the maps do not connect the shapes, disagree in the number of
        modes or in the spectrum of a shape, or do not preserve constant functions; or their
        equations do not fit into memory.

    See Also
    --------
    difference_regions : Show where shapes differ.
    map_from_points : Compute a functional map from corresponding vertices, such as `match_shapes` finds.

    Notes
    -----
    The time is that of a dense eigenproblem of order s k: a second for 30 shapes of 60 modes.

    Examples
    --------
    Three balls, of which the last one has a dent at the first vertex:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> near = np.exp(-4 * ((ball.vertices - ball.vertices[0]) ** 2).sum(axis=1))
    >>> dented = es.TriangleMesh(ball.vertices * (1 - 0.5 * near[:, None]), ball.faces)
    >>> spectra = [
    ...     es.solve_spectrum(es.cotangent_laplacian(each), 25) for each in (ball, ball, dented)
    ... ]
    >>> maps = {
    ...     (0, j): es.spectral.map_from_points(
    ...         spectra[0], spectra[j], range(ball.n_vertices), n_modes=25
    ...     )
    ...     for j in (1, 2)
    ... }
    >>> latent = es.spectral.latent_basis(maps)
    >>> areas = latent.differences("area")
    >>> region = es.spectral.difference_regions(latent, 0, areas[2] - areas[0])
    >>> bool(region.min() == region[0])  # most area is lost at the dent
    True
    """
    spectra, k = _shapes_of(maps)
    s = len(spectra)
    m = max(k // 2, 2) if n_functions is None else whole_number(n_functions, "n_functions", 2, k)
    require_memory(
        "The equations of a collection",
        f"{s} shapes of {k} modes",
        {"equations": COPIES * 8.0 * (s * k) ** 2},
        "Take fewer modes.",
    )
    network = np.zeros((s, k, s, k))
    for (i, j), mapping in maps.items():
        matrix = mapping.matrix
        network[i, :, i] += matrix.T @ matrix
        network[j, :, j] += np.eye(k)
        network[i, :, j] -= matrix.T
        network[j, :, i] -= matrix
    _, columns = sl.eigh(network.reshape(s * k, s * k), subset_by_index=[0, k - 1])
    shared = np.sqrt(s) * columns.reshape(s, k, k)
    # Any rotation of these functions is as good. That is taken which makes them the modes of the
    # limit shape, so that nothing depends on a choice of eigenvectors.
    values = np.stack([_unit_values(each, k) for each in spectra])
    energies = np.einsum("sia,si,sib->ab", shared, values, shared) / s
    limit, rotation = sl.eigh(energies)
    matrices = shared @ rotation[:, :m]
    tall = matrices.reshape(s * k, m)
    matrices = matrices * np.sign(tall[np.abs(tall).argmax(axis=0), np.arange(m)])
    misfits = {
        (i, j): float(
            np.linalg.norm(mapping.matrix @ matrices[i] - matrices[j]) / np.linalg.norm(matrices[j])
        )
        for (i, j), mapping in maps.items()
    }
    return LatentBasis(freeze(matrices), freeze(limit[:m]), spectra, misfits)


def _shapes_of(
    maps: Mapping[tuple[int, int], FunctionalMap],
) -> tuple[tuple[Spectrum, ...], int]:
    """Return the spectra of all shapes, and the number of modes, of maps that fit each other."""
    if not isinstance(maps, Mapping) or not maps:
        raise InvalidParameterError(
            f"maps must be a mapping from pairs (i, j) to functional maps, at least one; it is "
            f"{describe_value(maps)}. Pass {{(0, 1): es.functional_map(source, target, pairs)}}."
        )
    spectra: dict[int, Spectrum] = {}
    k = 0
    for key, mapping in maps.items():
        require_type(mapping, FunctionalMap, f"maps[{key!r}]")
        if not isinstance(key, tuple) or len(key) != 2 or key[0] == key[1]:
            raise InvalidParameterError(
                f"Keys of maps must be pairs of different numbers of shapes; one is {key!r}."
            )
        _require_constant(mapping, f"maps[{key!r}]")
        k = k or len(mapping.matrix)
        if mapping.matrix.shape != (k, k):
            raise InvalidParameterError(
                f"All maps must have as many modes of both shapes as the first one, {k}; the shape of maps[{key!r}] "
                f"is {mapping.matrix.shape}. Pass n_modes={k} to the call that makes it."
            )
        for number, spectrum in zip(key, (mapping.source, mapping.target), strict=True):
            shape = whole_number(number, "A number of a shape", 0)
            known = spectra.setdefault(shape, spectrum)
            if known is not spectrum and not np.array_equal(
                known.eigenvectors[:, :k], spectrum.eigenvectors[:, :k]
            ):
                raise InvalidParameterError(
                    f"Maps must agree in the spectrum of each shape; in maps[{key!r}] that of shape {shape} has other "
                    "modes than before. Solve for the spectrum of each shape once."
                )
    ends = np.array([list(key) for key in maps])
    missing = sorted(set(range(int(ends.max()) + 1)) - set(spectra))
    if missing:
        raise InvalidParameterError(
            f"Shapes must be numbered from 0 to {ends.max()} without gaps; no map has shape {missing[0]}."
        )
    s = len(spectra)
    _, group = connected_components(csr_array((np.ones(len(ends)), ends.T), (s, s)), directed=False)
    apart = np.flatnonzero(group)
    if apart.size:
        raise InvalidParameterError(
            f"Maps must connect all shapes; none leads from shape 0 to shape {apart[0]}, not even by way of others."
        )
    return tuple(spectra[number] for number in range(s)), k


def _require_constant(mapping: FunctionalMap, name: str) -> None:
    """Raise an error unless a map preserves constant functions."""
    first = mapping.matrix[:, 0]
    if ((first - np.eye(len(first))[0]) ** 2).sum() > LOST:
        raise InvalidParameterError(
            f"A map must preserve constant functions; the first column of {name} begins with {first[:2].tolist()} in "
            "place of [1.0, 0.0]."
        )


def _unit_values(spectrum: Spectrum, k: int) -> Float[np.ndarray, " k"]:
    """Return the k lowest eigenvalues of a shape scaled to area 1."""
    return spectrum.eigenvalues[:k] * spectrum.point_areas.sum()


def shape_difference(mapping: FunctionalMap, kind: str = "area") -> Float[np.ndarray, "k1 k1"]:
    """Compute how the target of a functional map differs from its source, as an operator.

    The operator V measures on the source what functions f and g have on the target as an inner
    product: ∫ f V g = ∫ Cf Cg for "area", and ∫ ⟨∇f, ∇Vg⟩ = ∫ ⟨∇Cf, ∇Cg⟩ for "conformal"
    (Rustamov and others 2013, section 4). A function that lies where the target is larger is an
    eigenvector of an eigenvalue above 1. Both are the identity if and only if the shapes are
    isometric, up to size.

    Parameters
    ----------
    mapping : FunctionalMap
        Preserves constant functions, as all maps do that the library computes.
    kind : "area" or "conformal"
        "area": where areas differ. "conformal": where angles differ.

    Returns
    -------
    (k1, k1) float
        Symmetric. In the modes of the source, φ_i √A, CᵀC; or in φ_i / √λ_i, which are orthonormal
        in ∫ ⟨∇f, ∇g⟩. There the constant function, which has no gradient, counts as unchanged.

    Raises
    ------
    InvalidParameterError
        If `kind` is neither, or the map does not preserve constant functions.

    Examples
    --------
    A ball and an egg:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> egg = es.TriangleMesh(ball.vertices * [1, 1, 1.5], ball.faces)
    >>> source, target = (
    ...     es.solve_spectrum(es.cotangent_laplacian(each), 9) for each in (ball, egg)
    ... )
    >>> mapping = es.spectral.map_from_points(source, target, range(162), n_modes=9)
    >>> difference = es.spectral.shape_difference(mapping, "conformal")
    >>> np.round(np.linalg.eigvalsh(difference[1:4, 1:4]), 1).tolist()  # along the egg, and around
    [0.7, 1.2, 1.2]
    """
    require_type(mapping, FunctionalMap, "mapping")
    _require_constant(mapping, "mapping")
    k2, k1 = mapping.matrix.shape
    before, after = _unit_values(mapping.source, k1), _unit_values(mapping.target, k2)
    return freeze(_difference(mapping.matrix, before, after, kind))


def _difference(
    matrix: Float[np.ndarray, "... k2 k1"],
    before: Float[np.ndarray, " k1"],
    after: Float[np.ndarray, "... k2"],
    kind: str,
) -> Float[np.ndarray, "... k1 k1"]:
    """Return the difference from a shape with these eigenvalues to one, or some, with others."""
    require_choice(kind, Kind, "kind")
    if kind == "area":
        return np.einsum("...ia,...ib->...ab", matrix, matrix)
    scaled = matrix[..., 1:] / np.sqrt(before[1:])
    found = np.zeros((*matrix.shape[:-2], len(before), len(before)))
    found[..., 0, 0] = 1
    found[..., 1:, 1:] = np.einsum("...ia,...i,...ib->...ab", scaled, after, scaled)
    return found


@one_blas_thread()
def difference_regions(
    latent: LatentBasis, shape: Integer, difference: ArrayLike, kind: str = "area"
) -> Float[np.ndarray, " n"]:
    """Show on a shape of a collection where a difference of shapes lies.

    At each point x the value is ⟨b, Δb⟩ / ⟨b, b⟩ for the narrowest bump around x that the latent
    functions ψ can form, b = Σ_i ψ_i(x) ψ_i. For "area" and the difference of two shapes, it is the
    difference of their relative areas around the point, each as a share of that of the limit shape:
    0.2 where the first has 20 % of it more. For "conformal" it is that of the energies ∫ |∇b|².

    Parameters
    ----------
    latent : LatentBasis
    shape : int
        Number of the shape on which to show it.
    difference : (m, m) float
        Δ, symmetric: a difference or sum of `latent.differences(kind)`, such as the mean of a group
        minus that of another one, or a principal component.
    kind : "area" or "conformal"
        Kind of these differences.

    Returns
    -------
    (n,) float
        For each vertex of the shape. Details finer than √(area / m) are lost.

    Raises
    ------
    InvalidParameterError
        If there is no such shape, `difference` is not a finite matrix of m rows and columns, or
        `kind` is neither.

    Examples
    --------
    A shape in its usual form, and with another height of its upper half:

    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> tall = es.TriangleMesh(ball.vertices * (1 + (ball.vertices > 0) * [0, 0, 0.5]), ball.faces)
    >>> spectra = [es.solve_spectrum(es.cotangent_laplacian(each), 25) for each in (ball, tall)]
    >>> mapping = es.spectral.map_from_points(*spectra, range(ball.n_vertices), n_modes=25)
    >>> latent = es.spectral.latent_basis({(0, 1): mapping})
    >>> areas = latent.differences("area")
    >>> region = es.spectral.difference_regions(latent, 0, areas[1] - areas[0])
    >>> top, bottom = ball.vertices[:, 2].argmax(), ball.vertices[:, 2].argmin()
    >>> bool(region[bottom] < -0.1)  # a smaller share of the whole area
    True
    """
    require_type(latent, LatentBasis, "latent")
    number = whole_number(shape, "shape", 0, len(latent.spectra) - 1)
    m = len(latent.eigenvalues)
    operator = finite_rows(difference, "difference", m)
    if len(operator) != m:
        raise InvalidParameterError(
            f"difference must have {m} rows, one for each latent function; it has {len(operator)}."
        )
    require_choice(kind, Kind, "kind")
    k = latent.matrices.shape[1]
    bumps = unit_modes(latent.spectra[number], k) @ latent.matrices[number]
    if kind == "conformal":
        # Their coefficients in the functions that are orthonormal in ∫ ⟨∇f, ∇g⟩; constants drop out.
        bumps = bumps * np.sqrt(np.maximum(latent.eigenvalues, 0))
    changes = np.einsum("na,ab,nb->n", bumps, operator, bumps, optimize=True)
    return freeze(changes / (bumps**2).sum(axis=1))
