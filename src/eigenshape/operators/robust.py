"""The robust Laplacian: weights ≥ 0 on any triangles, manifold or not."""

import numpy as np
import scipy.sparse as sp

from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape._corners import edge_keys, in_length, side_ends
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import MeshLike, ShapeLike, as_mesh
from eigenshape.geometry.requirements import (
    require_different_simplices,
    require_volumes,
    warn_of_seams,
)
from eigenshape.geometry.simplices import degenerate_simplices, require_span
from eigenshape.geometry.topology import require_simplices_everywhere
from eigenshape.operators import flip_loops
from eigenshape.operators.clouds.cloud_triangles import cloud_cover
from eigenshape.operators.graph import require_distinct_corners
from eigenshape.operators.laplacian import Laplacian
from eigenshape.operators.tufted import (
    MOLLIFY,
    Triangulation,
    flip_to_delaunay,
    mollify_lengths,
    tufted_cover,
)


def robust_laplacian(
    mesh: ShapeLike, *, mollify: float = MOLLIFY, n_neighbors: Integer | None = None
) -> Laplacian:
    """Build the Laplacian of a triangle mesh of any quality, manifold or not, or of points.

    This is the operator of Sharp and Crane, "A Laplacian for Nonmanifold Triangle Meshes" (2020).
    Edge lengths are mollified; each face gets a front and a back, which are glued into the tufted
    cover; edges are flipped until they are Delaunay; and the cotangent Laplacian of the cover is
    halved. No weight is negative, so there is a maximum principle. On a Delaunay mesh without
    obtuse angles opposite to boundary edges the result is `cotangent_laplacian(mesh, "lumped")`.
    Entries of W join the ends of intrinsic edges, which need not be edges of the mesh.

    An edge may have any number of faces, and faces may have any orientation (a Möbius strip, a
    soup). Faces may overlap if they do not have the same three vertices, and may have no area. A
    face without area has no angle around its edges: if more than two faces meet there, its place
    among them is given by its index. If both diagonals of a quadrilateral are Delaunay, as in a
    square, the diagonal of the mesh is kept; this choice affects B and not W.

    On a point cloud the triangles are those of `local_triangles`, Delaunay around each point.
    Nearly every triangle is there three times, once for each corner, so W and B are divided by
    three. `point_cloud_laplacian` is the kernel instead: for any dimension, and under noise.

    Parameters
    ----------
    mesh : ShapeLike
        A triangle mesh, or a point cloud of dimension 2 in R³.
    mollify : float
        ε ≥ 0, as a multiple of the mean edge length. All edges grow by the smallest length such
        that a + b ≥ c + ε in every triangle. With 0, faces without area are refused.
    n_neighbors : int, optional
        For a point cloud: neighbors of each point among which its triangles are sought, 30 by
        default, or all others of fewer points.

    Returns
    -------
    Laplacian
        W without unit, entries off the diagonal ≤ 0; B diagonal, in length².

    Raises
    ------
    InvalidShapeError
        If a face has a corner twice or the same corners as another, a vertex belongs to no face,
        all vertices lie on a line, no face has area, `mollify` is too small to give area to one
        that has none, or coordinates are beyond 1e±150; or for a cloud as in `local_triangles`.
    InvalidParameterError
        If `mollify` is negative or not finite, or 0 for a point cloud; or if `n_neighbors` is out
        of range, or given for a mesh.

    See Also
    --------
    cotangent_laplacian : Linear elements on the triangles as they are.

    Examples
    --------
    A sliver makes cotangent weights negative, and robust weights not:

    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [1, 0, 0], [0.5, 0.1, 0], [0.5, -0.1, 0]]
    >>> mesh = es.TriangleMesh(points, [[0, 1, 2], [1, 0, 3]])
    >>> es.cotangent_laplacian(mesh).stiffness[0, 1].item() > 0  # -w_ij
    True
    >>> es.robust_laplacian(mesh).stiffness[0, 1].item() > 0
    False
    """
    if isinstance(mesh, PointCloud):
        delaunay, scale = cloud_cover(mesh, mollify, n_neighbors)
        copies = 3
    else:
        mesh = as_mesh(mesh)
        if n_neighbors is not None:
            raise InvalidParameterError(
                f"n_neighbors must not be given for a mesh, which has its faces; it is "
                f"{n_neighbors}. Pass PointCloud(mesh.points) for its points alone."
            )
        delaunay, scale = delaunay_cover(mesh, mollify)
        warn_of_seams(mesh)
        copies = 1
    # The cover counts the surface twice: a half of each area, and a quarter of each sum of
    # cotangents instead of a half. What rounding leaves of such a sum below zero is zero.
    n, thirds = mesh.n_points, np.repeat(flip_loops.areas(delaunay.lengths) / 3, 3)
    areas = np.bincount(delaunay.tails, weights=thirds, minlength=n) / 2
    cotangents = flip_loops.cotangents(delaunay.lengths)
    once = np.flatnonzero(np.arange(len(delaunay.twins)) < delaunay.twins)
    twins = delaunay.twins[once]
    weights = np.maximum(cotangents[once] + cotangents[twins], 0.0) / 4
    ends = (delaunay.tails[once], delaunay.tails[twins])
    half = sp.csr_array((weights, ends), shape=(n, n))
    whole = (half + half.T).tocsr()
    whole.eliminate_zeros()
    # An edge from a vertex to itself cancels here.
    stiffness = (sp.diags_array(whole.sum(axis=1)) - whole).tocsr()
    masses = in_length(areas / copies, scale, 2)
    return Laplacian((stiffness / copies).tocsr(), sp.diags_array(masses).tocsr())


def delaunay_cover(mesh: MeshLike, mollify: float = MOLLIFY) -> tuple[Triangulation, float]:
    """Return the Delaunay triangles of the tufted cover, and the unit of their lengths.

    Errors are those of `robust_laplacian`.
    """
    mesh = as_mesh(mesh)
    if not 0 <= mollify < np.inf:
        raise InvalidParameterError(f"mollify must be finite and not negative; it is {mollify}.")
    require_distinct_corners(mesh)
    require_simplices_everywhere(mesh)
    require_different_simplices(mesh)
    require_span(mesh.vertices, 2, "The vertices of a mesh")
    # If no face has area, all area would be that of mollifying.
    if not mollify or len(degenerate_simplices(mesh)) == mesh.n_faces:
        require_volumes(mesh)
    points, scale = size_one(mesh.vertices)
    tails, heads = side_ends(mesh.faces)
    lengths = np.linalg.norm(points[tails] - points[heads], axis=1)
    lengths = mollify_lengths(lengths, edge_keys(mesh.faces, mesh.n_vertices), mollify)
    flat = np.flatnonzero(flip_loops.areas(lengths) == 0)
    if flat.size:
        sides = lengths.reshape(-1, 3)[flat[0]] * scale
        raise InvalidShapeError(
            f"Mollified faces must have area; face {flat[0]} has sides {sides.tolist()} ({flat.size} such). Choose "
            f"a larger mollify than {mollify}."
        )
    return flip_to_delaunay(tufted_cover(points, mesh.faces, lengths)), scale
