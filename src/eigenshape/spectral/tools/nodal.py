"""Nodal domains: the regions of a mesh in which a function has one sign."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import label_components, vertex_values
from eigenshape.calculus.level_sets import LevelSet, level_set
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.operators.graph import edge_graph
from eigenshape.spectral.spectrum import Spectrum

# Values of at most this share of the largest count as zero. An eigenvector that vanishes on a plane
# of symmetry is 1e-12 to 1e-15 of its largest value there, with signs that the CPU decides.
ZERO_SHARE = 1e-9


@record
class NodalDomains(ReadOnly):
    """The nodal domains of a function on the vertices of a mesh.

    Attributes
    ----------
    labels : (n,) int
        Domain of each vertex, or -1 where the function is zero. Domains are numbered by their
        lowest vertex.
    signs : (c,) int
        1 or -1: the sign of the function in each domain.
    sizes : (c,) int
        Number of vertices in each domain.

    See Also
    --------
    nodal_domains

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> domains = es.spectral.nodal_domains(ball, ball.vertices[:, 2])
    >>> domains.n_domains, sorted(domains.signs.tolist())
    (2, [-1, 1])
    """

    labels: Int[np.ndarray, " n"]
    signs: Int[np.ndarray, " c"]
    sizes: Int[np.ndarray, " c"]

    @property
    def n_domains(self) -> int:
        """Number of domains."""
        return len(self.signs)


def nodal_domains(mesh: MeshLike, values: ArrayLike, *, zero: float = ZERO_SHARE) -> NodalDomains:
    """Find the nodal domains of a function: the connected regions in which it has one sign.

    Two neighboring vertices belong to one domain if the function is positive at both, or negative
    at both. Vertices where it is zero belong to no domain. These are the strong nodal domains of
    Davies, Gladwell, Leydold and Stadler (2001), to which `courant_bounds` applies.

    Parameters
    ----------
    mesh : MeshLike
        Of any dimension.
    values : (n,) float
        A function on the vertices, such as a column of `Spectrum.eigenvectors`.
    zero : float
        Values of at most this share of the largest absolute value count as zero, 0 to 1 (without
        1). Where an eigenfunction is zero, an eigenvector has rounding errors of either sign.

    Returns
    -------
    NodalDomains

    Raises
    ------
    InvalidParameterError
        If there is not one finite value for each vertex, or `zero` is not in 0..1.
    InvalidShapeError
        If a simplex has a corner twice.

    See Also
    --------
    courant_bounds : The largest number of domains that an eigenvector can have.
    nodal_set : The lines between the domains, and their length.

    Examples
    --------
    The height is positive on one half of a sphere and negative on the other:

    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> domains = es.spectral.nodal_domains(ball, ball.vertices[:, 2])
    >>> domains.n_domains, domains.signs.tolist()
    (2, [-1, 1])
    """
    mesh = as_simplicial(mesh)
    heights = vertex_values(values, "values", mesh.n_points)
    signs = np.sign(_without_noise(heights, zero)).astype(np.int64)
    edges = edge_graph(mesh).tocoo()
    joined = (signs[edges.row] == signs[edges.col]) & (signs[edges.row] != 0)
    _, pieces = label_components(mesh.n_points, edges.row[joined], edges.col[joined])

    # Vertices at zero are pieces of their own and drop out; the rest is numbered in the order of
    # its lowest vertices.
    inside = np.flatnonzero(signs)
    _, firsts, found = np.unique(pieces[inside], return_index=True, return_inverse=True)
    number = np.argsort(np.argsort(firsts))
    labels = np.full(mesh.n_points, -1)
    labels[inside] = number[found]
    return NodalDomains(
        labels,
        signs[inside[np.sort(firsts)]],
        np.bincount(labels[inside], minlength=len(firsts)),
    )


def courant_bounds(spectrum: Spectrum) -> Int[np.ndarray, " k"]:
    """Return the largest number of nodal domains that each eigenvector can have.

    Courant's theorem on graphs (Davies, Gladwell, Leydold and Stadler 2001): if the eigenvalue
    number j (from 1) has r copies that begin there, its eigenvectors have at most j + r - 1 strong
    nodal domains. It holds if B is diagonal and W has negative entries on edges of the mesh and no
    positive ones off the diagonal: for `graph_laplacian`, and for `cotangent_laplacian` on a
    Delaunay mesh. On other meshes a count beyond the bound points to elements of bad shape.

    Parameters
    ----------
    spectrum : Spectrum
        Certified or not; in an interval, `certificate.first` eigenvalues below are counted.

    Returns
    -------
    (k,) int

    Examples
    --------
    On a sphere the eigenvalues 2, 2, 2 are copies of one, and so are the five that follow:

    >>> import eigenshape as es
    >>> spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(2)), 9)
    >>> es.spectral.courant_bounds(spectrum).tolist()
    [1, 4, 4, 4, 9, 9, 9, 9, 9]
    """
    require_type(spectrum, Spectrum, "spectrum")
    proof = spectrum.certificate
    sizes = np.array(proof.clusters or (1,) * proof.n_pairs)
    lasts = proof.first + np.cumsum(sizes)
    lasts[-1] += proof.n_split
    return np.repeat(lasts, sizes)


def nodal_set(mesh: MeshLike, values: ArrayLike, *, zero: float = ZERO_SHARE) -> LevelSet:
    """Find the nodal set of a function: the lines on a surface where it is zero.

    The function is linear on each face. Where it is zero at a vertex, the line passes through the
    vertex, or just beside it if the function is zero in a region.

    Parameters
    ----------
    mesh : MeshLike
        Triangles, or tetrahedra: there the nodal set is a surface.
    values : (n,) float
    zero : float
        As for `nodal_domains`.

    Returns
    -------
    LevelSet
        Its `polylines()` are the nodal lines, `size` is their length.

    Raises
    ------
    InvalidParameterError
        If there is not one finite value for each vertex, or `zero` is not in 0..1.
    InvalidShapeError
        If the mesh consists neither of triangles nor of tetrahedra.

    See Also
    --------
    nodal_domains : The regions between the lines.

    Examples
    --------
    The height on a unit sphere is zero along the equator, of length 2π = 6.283:

    >>> import eigenshape as es
    >>> ball = es.icosphere(4)
    >>> equator = es.spectral.nodal_set(ball, ball.vertices[:, 2])
    >>> len(equator.polylines()), round(equator.size, 2)
    (1, 6.28)
    """
    mesh = as_simplicial(mesh)
    heights = vertex_values(values, "values", mesh.n_points)
    return level_set(mesh, _without_noise(heights, zero), 0.0)


def _without_noise(values: Float[np.ndarray, " n"], zero: float) -> Float[np.ndarray, " n"]:
    """Return values with 0 in place of those of at most the share `zero` of the largest."""
    if not 0 <= zero < 1:
        raise InvalidParameterError(f"zero must be at least 0 and less than 1; it is {zero}.")
    return np.where(np.abs(values) > zero * np.abs(values).max(), values, 0.0)
