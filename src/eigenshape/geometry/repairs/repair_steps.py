"""The repairs of meshes and clouds, one function each; each reports what it did."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import MeshLike, as_mesh, as_simplicial
from eigenshape.geometry.face_turns import turn_faces
from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import faces_to_turn
from eigenshape.geometry.repairs.flat_faces import flip_flat_faces
from eigenshape.geometry.repairs.repair_report import (
    MeshT,
    RepairedCloud,
    RepairedMesh,
    count_nouns,
    simplex_noun,
)
from eigenshape.geometry.simplices import MEASURES, degenerate_simplices, scaled_corners, size_one
from eigenshape.geometry.topology import (
    repeated_simplices,
    seams,
    submesh,
    unreferenced_vertices,
    vertex_components,
)

# A face is a needle if one of its sides is shorter than this share of another. Cotangents of 1e6
# are the largest that solvers handled beside ordinary ones in every mesh that was tried; with 1e9
# they lost the eigenvalue 0 in meshes of many parts.
NEEDLE = 1e-6
# A side shorter than this share of the longest side of the whole mesh is collapsed too: the area
# there is below 1e-18 of others, and rounding hides one beside the other. Surfaces graded by tens
# from side to side are solved down to 1e-9, and no longer at 1e-10.
TINY = 1e-9


def weld(mesh: MeshLike, *, tolerance: float = 0.0) -> RepairedMesh[Any]:
    """Join all vertices that lie at the same place.

    Closed pieces that touch are joined too; `weld_seams` keeps them apart.

    Parameters
    ----------
    mesh : MeshLike
        Of triangles, or of simplices of any dimension.
    tolerance : float
        Largest distance between vertices at the same place, as a share of the diagonal of the
        bounding box, 0 to 0.1. Vertices linked by a chain of such distances are all joined. With 0,
        coordinates must be equal.

    Returns
    -------
    RepairedMesh

    Raises
    ------
    InvalidParameterError
        If `tolerance` is not in 0..0.1.

    See Also
    --------
    weld_seams : Join boundaries only.

    Examples
    --------
    >>> import eigenshape as es
    >>> grid = es.shapes.grid(1, 1)
    >>> es.geometry.weld(es.geometry.disjoint_union(grid, grid)).report
    ('weld joined 4 vertices to others at the same place',)
    """
    mesh = as_simplicial(mesh)
    if not 0 <= tolerance <= 0.1:
        raise InvalidParameterError(
            f"tolerance must lie in 0..0.1 of the diagonal of the bounding box; it is {tolerance}."
        )
    if tolerance == 0:
        group = _place_numbers(mesh.points)
    else:
        points, _ = size_one(mesh.points)
        points, _ = size_one(points - points.mean(axis=0))
        radius = tolerance * float(np.linalg.norm(np.ptp(points, axis=0)))
        group = _group_numbers(
            cKDTree(points).query_pairs(radius, output_type="ndarray"), mesh.n_points
        )
    return _merge_vertices(mesh, group, "weld joined {} to others at the same place")


def weld_seams(mesh: MeshLike) -> RepairedMesh[Any]:
    """Join boundary edges that lie on each other, such as the seams of a surface that was cut open.

    This also connects a soup of separate triangles. Pieces that touch without such a seam, as
    closed pieces do, stay apart. Only edges on the boundary change: they get two faces or more.

    Parameters
    ----------
    mesh : MeshLike
        Of triangles, or of simplices of any dimension.

    Returns
    -------
    RepairedMesh

    See Also
    --------
    weld : Join all vertices at the same place.

    Examples
    --------
    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> es.geometry.weld_seams((points, [[0, 1, 2], [3, 4, 5]])).report
    ('weld_seams joined 2 vertices along seams',)
    """
    mesh = as_simplicial(mesh)
    one, two = seams(mesh).transpose(1, 0, 2).reshape(2, -1)
    group = _group_numbers(np.column_stack([one, two]), mesh.n_points)
    return _merge_vertices(mesh, group, "weld_seams joined {} along seams")


def _place_numbers(points: Float[np.ndarray, "n d"]) -> Int[np.ndarray, " n"]:
    """Return for each point the number of its place; equal points have the same place."""
    # np.unique compares bytes; adding 0.0 turns -0.0 into 0.0.
    _, place = np.unique(points + 0.0, axis=0, return_inverse=True)
    return place.ravel().astype(np.int64)


def _group_numbers(pairs: Int[np.ndarray, "k 2"], n: int) -> Int[np.ndarray, " n"]:
    """Group n points that are linked by pairs; return the number of each point's group."""
    graph = sp.coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _merge_vertices(mesh: MeshT, group: Int[np.ndarray, " n"], report: str) -> RepairedMesh[MeshT]:
    """Replace each group of vertices by its first vertex; these keep their order."""
    _, first, renumbered = np.unique(group, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    joined = type(mesh)(mesh.points[first[order]], rank[renumbered[mesh.simplices]])
    return RepairedMesh(
        joined,
        (report.format(count_nouns(mesh.n_points - joined.n_points, "vertex")),),
        first[order],
    )


def drop_degenerate(mesh: MeshLike) -> RepairedMesh[Any]:
    """Remove faces without area, or simplices without volume; their vertices stay.

    If a vertex of such a face lies on its longest side, the face on the other side of that edge is
    split at the vertex. So no slit opens, and a closed surface stays closed.

    Parameters
    ----------
    mesh : MeshLike
        Of triangles, or of simplices of any dimension.

    Returns
    -------
    RepairedMesh

    Raises
    ------
    InvalidShapeError
        If no face would remain.

    See Also
    --------
    drop_unreferenced : Remove the vertices too.
    collapse_needles : Remove faces that are almost degenerate.

    Examples
    --------
    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [2, 0, 0], [0, 1, 0], [1, 0, 0]]
    >>> es.geometry.drop_degenerate((points, [[0, 1, 2], [0, 1, 3]])).report
    ('drop_degenerate removed 1 face without area, and split 1 neighbor at their vertices',)
    """
    mesh = as_simplicial(mesh)
    n_flat = len(degenerate_simplices(mesh))
    n_split = 0
    if n_flat and isinstance(mesh, TriangleMesh):
        mesh, n_split = flip_flat_faces(mesh)
    keep = np.ones(len(mesh.simplices), dtype=bool)
    keep[degenerate_simplices(mesh)] = False
    measure = MEASURES.get(mesh.dim, MEASURES[3])[2]
    report = f"drop_degenerate removed {count_nouns(n_flat, simplex_noun(mesh))} without {measure}"
    if n_split:
        report += f", and split {count_nouns(n_split, 'neighbor')} at their vertices"
    return _keep_simplices(mesh, keep, report)


def collapse_needles(mesh: MeshLike) -> RepairedMesh[Any]:
    """Collapse sides shorter than a millionth of the longest side of their face or simplex.

    Such a face has area, but its cotangents are so large that the entries of other faces are lost
    in rounding, and its eigenvalues hide those of the shape. Sides shorter than a billionth of the
    longest side of the mesh are collapsed for the same reason. No point moves by more than the length
    of the collapsed sides. Faces that lose a side are removed. A mesh in which every face is a
    needle is left as it is.

    Parameters
    ----------
    mesh : MeshLike
        Of triangles, or of simplices of any dimension.

    Returns
    -------
    RepairedMesh

    See Also
    --------
    drop_degenerate : Remove faces without any area.

    Examples
    --------
    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1e-8, 0]]
    >>> es.geometry.collapse_needles((points, [[0, 1, 2], [0, 1, 3]])).report
    ('collapse_needles joined 1 vertex to others beside them, and removed 1 face',)
    """
    mesh = as_simplicial(mesh)
    corners, _ = scaled_corners(mesh)
    one, two = np.triu_indices(mesh.dim + 1, 1)
    lengths = np.linalg.norm(corners[:, one] - corners[:, two], axis=2)
    # Sides of length 0 belong to faces without area, which `drop_degenerate` removes.
    least = np.maximum(NEEDLE * lengths.max(axis=1, keepdims=True), TINY * lengths.max())
    short = (lengths > 0) & (lengths < least)
    in_simplex, side = np.nonzero(short)
    if short.any(axis=1).all():
        in_simplex, side = in_simplex[:0], side[:0]
    ends = np.column_stack(
        [mesh.simplices[in_simplex, one[side]], mesh.simplices[in_simplex, two[side]]]
    )
    joined = _merge_vertices(
        mesh,
        _group_numbers(ends, mesh.n_points),
        "collapse_needles joined {} to others beside them",
    )
    ordered = np.sort(joined.mesh.simplices, axis=1)
    collapsed = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1) & short.any(axis=1)
    report = (
        f"{joined.report[0]}, and removed {count_nouns(int(collapsed.sum()), simplex_noun(mesh))}"
    )
    kept = _keep_simplices(joined.mesh, ~collapsed, report)
    return RepairedMesh(kept.mesh, kept.report, joined.source_vertices)


def drop_duplicate_faces(mesh: MeshLike) -> RepairedMesh[Any]:
    """Keep the first of all faces or simplices with the same corners, in any order.

    Parameters
    ----------
    mesh : MeshLike
        Of triangles, or of simplices of any dimension.

    Returns
    -------
    RepairedMesh

    Examples
    --------
    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> es.geometry.drop_duplicate_faces((points, [[0, 1, 2], [2, 1, 0]])).report
    ('drop_duplicate_faces removed 1 face with the corners of an earlier one',)
    """
    mesh = as_simplicial(mesh)
    keep = np.ones(len(mesh.simplices), dtype=bool)
    keep[repeated_simplices(mesh)[:, 1]] = False
    report = f"drop_duplicate_faces removed {count_nouns(int((~keep).sum()), simplex_noun(mesh))}"
    report += " with the corners of an earlier one"
    return _keep_simplices(mesh, keep, report)


def _keep_simplices(mesh: MeshT, keep: Bool[np.ndarray, " s"], report: str) -> RepairedMesh[MeshT]:
    kept = type(mesh)(mesh.points, mesh.simplices[keep])
    return RepairedMesh(kept, (report,), np.arange(mesh.n_points))


def drop_unreferenced(mesh: MeshLike) -> RepairedMesh[Any]:
    """Remove vertices without a face or simplex.

    Parameters
    ----------
    mesh : MeshLike
        Of triangles, or of simplices of any dimension.

    Returns
    -------
    RepairedMesh

    Examples
    --------
    >>> import eigenshape as es
    >>> points = [[0, 0, 0], [1, 0, 0], [5, 5, 5], [0, 1, 0]]
    >>> result = es.geometry.drop_unreferenced((points, [[0, 1, 3]]))
    >>> result.report
    ('drop_unreferenced removed 1 vertex without a face',)
    >>> result.source_vertices.tolist()
    [0, 1, 3]
    """
    mesh = as_simplicial(mesh)
    n_loose = len(unreferenced_vertices(mesh))
    source, renumbered = np.unique(mesh.simplices, return_inverse=True)
    kept = type(mesh)(mesh.points[source], renumbered.reshape(mesh.simplices.shape))
    noun = "face" if mesh.dim == 2 else "simplex"
    report = f"drop_unreferenced removed {count_nouns(n_loose, 'vertex')} without a {noun}"
    return RepairedMesh(kept, (report,), source)


def orient(mesh: MeshLike) -> RepairedMesh[TriangleMesh]:
    """Turn faces over so that neighbors agree and pieces face outward.

    In each piece the smaller group of faces is turned. Then each piece is turned as a whole if that
    makes it face outward. A piece that cannot be oriented, such as a Möbius strip, is left as it
    is, and the report names one of its faces.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    RepairedMesh

    See Also
    --------
    orient_outward : Turn all faces of a consistently oriented surface.

    Notes
    -----
    A closed piece faces outward if its signed volume is positive. A closed piece inside another one
    is turned together with the outermost, because it may be a cavity. An open piece whose faces
    disagreed is turned by `orient_outward`; an open piece whose faces agreed is left as it is.
    Pieces end at edges with more than two faces.

    Examples
    --------
    >>> import eigenshape as es
    >>> sphere = es.icosphere(0)
    >>> faces = sphere.faces.copy()
    >>> faces[3] = faces[3, ::-1]
    >>> es.geometry.orient((sphere.vertices, faces)).report
    ('orient turned 1 face over',)
    """
    mesh = as_mesh(mesh)
    turned, one_sided, piece = faces_to_turn(mesh)
    report = f"orient turned {count_nouns(int(turned.sum()), 'face')} over"
    if one_sided.any():
        # The report names the first face of each of the first nine such pieces.
        first = np.flatnonzero(one_sided)[np.unique(piece[one_sided], return_index=True)[1]]
        names = ", ".join(map(str, first[:9]))
        report += f", left {count_nouns(len(first), 'piece')} with one side only, of face {names}"
        report += " and others" if len(first) > 9 else ""
    return RepairedMesh(turn_faces(mesh, turned), (report,), np.arange(mesh.n_vertices))


def largest_component(mesh: MeshLike) -> RepairedMesh[TriangleMesh]:
    """Keep the connected component with the largest area.

    Of components with equal areas the one with the lowest vertex is kept.

    Parameters
    ----------
    mesh : MeshLike

    Returns
    -------
    RepairedMesh

    See Also
    --------
    vertex_components : The components.

    Examples
    --------
    >>> import eigenshape as es
    >>> two = es.geometry.disjoint_union(es.shapes.grid(1, 1), es.icosphere(0))
    >>> es.geometry.largest_component(two).report
    ('largest_component removed 1 component with 2 faces',)
    """
    mesh = as_mesh(mesh)
    count, _ = vertex_components(mesh)
    keep = faces_of_largest(mesh)
    kept, source = submesh(mesh, keep)
    removed = (
        f"{count_nouns(count - 1, 'component')} with {count_nouns(int((~keep).sum()), 'face')}"
    )
    report = f"largest_component removed {removed}"
    return RepairedMesh(kept, (report,), source)


def faces_of_largest(mesh: TriangleMesh) -> Bool[np.ndarray, " f"]:
    """Mark the faces of the component that `largest_component` keeps."""
    _, labels = vertex_components(mesh)
    of_face = np.unique(labels[mesh.faces[:, 0]], return_inverse=True)[1]
    areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    return np.asarray(of_face == np.argmax(np.bincount(of_face, weights=areas)))


def drop_duplicate_points(cloud: PointCloud) -> RepairedCloud:
    """Keep the first of all points of a cloud at the same place.

    Parameters
    ----------
    cloud : PointCloud

    Returns
    -------
    RepairedCloud

    See Also
    --------
    weld : The same for the vertices of a mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> cloud = es.PointCloud([[0, 0, 0], [1, 0, 0], [0, 0, 0]], dim=1)
    >>> es.geometry.drop_duplicate_points(cloud).report
    ('drop_duplicate_points removed 1 point at the places of others',)
    """
    require_type(cloud, PointCloud, "cloud")
    _, source = np.unique(_place_numbers(cloud.points), return_index=True)
    source = np.sort(source)
    removed = count_nouns(cloud.n_points - len(source), "point")
    report = f"drop_duplicate_points removed {removed} at the places of others"
    return RepairedCloud(PointCloud(cloud.points[source], cloud.dim), (report,), source)
