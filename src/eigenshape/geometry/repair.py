"""Repairs of meshes and clouds. Each is requested by name and reports what it did."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, overload

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import MeshLike, ShapeLike, as_mesh, as_shape, as_simplicial
from eigenshape.geometry.flat_faces import flip_flat_faces
from eigenshape.geometry.holes import triangulate_holes
from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import faces_to_turn
from eigenshape.geometry.simplices import MEASURES, degenerate_simplices, scaled_corners, size_one
from eigenshape.geometry.simplicial import Mesh
from eigenshape.geometry.topology import (
    boundary_loops,
    repeated_simplices,
    seams,
    submesh,
    unreferenced_vertices,
    vertex_components,
    with_turned_faces,
)

MeshT = TypeVar("MeshT", bound=Mesh)

# Shares of the area of a surface up to which `suggest_repairs` takes something for a fault of the
# scan rather than for a part of the shape or its rim.
LARGEST_SPECK = 0.01  # a component other than the largest
ALL_SPECKS = 0.2  # all these components together
LARGEST_HOLE = 0.05  # a hole; for comparison, the open side of half a ball has 0.5
# A face is a needle if one of its sides is shorter than this share of another. Cotangents of 1e6
# are the largest that solvers handled beside ordinary ones in every mesh that was tried; with 1e9
# they lost the eigenvalue 0 in meshes of many parts.
NEEDLE = 1e-6


# Nouns of reports whose plural is not formed with an s.
PLURALS = {"vertex": "vertices", "tetrahedron": "tetrahedra", "simplex": "simplices"}


@dataclass(frozen=True, eq=False)
class RepairedMesh(Generic[MeshT]):
    """A mesh after one or more repairs, and a report of what they changed.

    Attributes
    ----------
    mesh : TriangleMesh or SimplicialMesh
        The mesh after the repairs.
    report : tuple of str
        One sentence for each repair, such as "drop_degenerate removed 2 faces without area".
    source_vertices : (n,) int
        For each vertex of `mesh`, its index in the original mesh.
    """

    mesh: MeshT
    report: tuple[str, ...]
    source_vertices: Int[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class RepairedCloud:
    """A point cloud after one or more repairs, and a report of what they changed.

    Attributes
    ----------
    cloud : PointCloud
        The cloud after the repairs.
    report : tuple of str
        One sentence for each repair, such as "drop_duplicate_points removed 2 points at the places
        of others".
    source_points : (n,) int
        For each point of `cloud`, its index in the original cloud.
    """

    cloud: PointCloud
    report: tuple[str, ...]
    source_points: Int[np.ndarray, " n"]


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
        joined, (report.format(_count(mesh.n_points - joined.n_points, "vertex")),), first[order]
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
    report = f"drop_degenerate removed {_count(n_flat, _noun(mesh))} without {measure}"
    if n_split:
        report += f", and split {_count(n_split, 'neighbor')} at their vertices"
    return _keep_simplices(mesh, keep, report)


def collapse_needles(mesh: MeshLike) -> RepairedMesh[Any]:
    """Collapse sides shorter than a millionth of the longest side of their face or simplex.

    Such a face has area, but its cotangents are so large that the entries of other faces are lost
    in rounding, and its eigenvalues hide those of the shape. No point moves by more than the length
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
    short = (lengths > 0) & (lengths < NEEDLE * lengths.max(axis=1, keepdims=True))
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
    report = f"{joined.report[0]}, and removed {_count(int(collapsed.sum()), _noun(mesh))}"
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
    report = f"drop_duplicate_faces removed {_count(int((~keep).sum()), _noun(mesh))}"
    report += " with the corners of an earlier one"
    return _keep_simplices(mesh, keep, report)


def _keep_simplices(mesh: MeshT, keep: Bool[np.ndarray, " s"], report: str) -> RepairedMesh[MeshT]:
    kept = type(mesh)(mesh.points, mesh.simplices[keep])
    return RepairedMesh(kept, (report,), np.arange(mesh.n_points))


def _noun(mesh: Mesh) -> str:
    return MEASURES[mesh.dim][1] if mesh.dim in MEASURES else "simplex"


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
    report = f"drop_unreferenced removed {_count(n_loose, 'vertex')} without a {noun}"
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
    report = f"orient turned {_count(int(turned.sum()), 'face')} over"
    if one_sided.any():
        # The report names the first face of each of the first nine such pieces.
        first = np.flatnonzero(one_sided)[np.unique(piece[one_sided], return_index=True)[1]]
        names = ", ".join(map(str, first[:9]))
        report += f", left {_count(len(first), 'piece')} with one side only, of face {names}"
        report += " and others" if len(first) > 9 else ""
    return RepairedMesh(with_turned_faces(mesh, turned), (report,), np.arange(mesh.n_vertices))


def _count(number: int, noun: str) -> str:
    return f"{number} {noun if number == 1 else PLURALS.get(noun, noun + 's')}"


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
    removed = f"{_count(count - 1, 'component')} with {_count(int((~keep).sum()), 'face')}"
    report = f"largest_component removed {removed}"
    return RepairedMesh(kept, (report,), source)


def faces_of_largest(mesh: TriangleMesh) -> Bool[np.ndarray, " f"]:
    """Mark the faces of the component that `largest_component` keeps."""
    _, labels = vertex_components(mesh)
    of_face = np.unique(labels[mesh.faces[:, 0]], return_inverse=True)[1]
    areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    return np.asarray(of_face == np.argmax(np.bincount(of_face, weights=areas)))


def fill_holes(mesh: MeshLike, *, most_edges: int = 1000) -> RepairedMesh[TriangleMesh]:
    """Fill every hole with faces between the vertices around it; no vertex is added.

    An open surface is closed along its rim too. A hole is left open, and the report says so, if it
    has too many edges, or if filling it would need a face without area, a face that exists already,
    or an edge with three faces.

    Parameters
    ----------
    mesh : MeshLike
    most_edges : int
        Holes with more edges are left open. The time grows with the third power of the number of
        edges; 1,000 edges take about a second.

    Returns
    -------
    RepairedMesh

    Raises
    ------
    InvalidParameterError
        If `most_edges` is less than 3.

    See Also
    --------
    boundary_loops : The holes.

    Notes
    -----
    Each boundary loop gets the triangulation with the least sum of areas (Barequet and Sharir,
    "Filling gaps in the boundary of a polyhedron", 1995), plus a small multiple of the squared
    sides, which avoids slivers.

    Examples
    --------
    >>> import eigenshape as es
    >>> sphere = es.icosphere(1)
    >>> es.geometry.fill_holes((sphere.vertices, sphere.faces[1:])).report
    ('fill_holes closed 1 hole with 1 face',)
    """
    mesh = as_mesh(mesh)
    if most_edges < 3:
        raise InvalidParameterError(
            f"most_edges must be at least 3, the edges of a triangle; it is {most_edges}."
        )
    found = triangulate_holes(mesh, most_edges)
    sealed = TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, *found.faces]))
    n_faces = sealed.n_faces - mesh.n_faces
    report = f"fill_holes closed {_count(len(found.faces), 'hole')} with {_count(n_faces, 'face')}"
    if found.n_long:
        report += f", left {found.n_long} of more than {most_edges} edges"
    if found.n_open:
        report += f", left {found.n_open} that good faces do not close"
    return RepairedMesh(sealed, (report,), np.arange(mesh.n_vertices))


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
    removed = _count(cloud.n_points - len(source), "point")
    report = f"drop_duplicate_points removed {removed} at the places of others"
    return RepairedCloud(PointCloud(cloud.points[source], cloud.dim), (report,), source)


def repair_as_needed(mesh: MeshT) -> RepairedMesh[MeshT]:
    """Apply the repairs of `AUTO` in turn until none of them changes the mesh.

    Raises
    ------
    InvalidShapeError
        If no face would remain.
    """
    return _until_sound(mesh, AUTO)[0]


# Duplicate faces hide seams, and welding a seam can create duplicates, so both are handled first.
# Faces without area follow, when their neighbors are known.
AUTO = (
    "drop_duplicate_faces",
    "weld_seams",
    "drop_duplicate_faces",
    "collapse_needles",
    "drop_degenerate",
    "drop_unreferenced",
    "orient",
)

REPAIRS: dict[str, Callable[[Any], RepairedMesh[Any]]] = {
    "auto": repair_as_needed,
    "weld": weld,
    "weld_seams": weld_seams,
    "collapse_needles": collapse_needles,
    "drop_degenerate": drop_degenerate,
    "drop_duplicate_faces": drop_duplicate_faces,
    "drop_unreferenced": drop_unreferenced,
    "orient": orient,
    "largest_component": largest_component,
    "fill_holes": fill_holes,
}
SURFACE_REPAIRS = ("orient", "largest_component", "fill_holes")
CLOUD_REPAIRS = {"auto": drop_duplicate_points, "drop_duplicate_points": drop_duplicate_points}


def names_of_repairs(shape: Shape) -> tuple[str, ...]:
    """Return the names of the repairs that a shape can be given."""
    if isinstance(shape, PointCloud):
        return tuple(CLOUD_REPAIRS)
    of_any = tuple(name for name in REPAIRS if name not in SURFACE_REPAIRS)
    return tuple(REPAIRS) if isinstance(shape, TriangleMesh) else of_any


@overload
def repair(shape: PointCloud, names: Sequence[str]) -> RepairedCloud: ...
@overload
def repair(shape: MeshT, names: Sequence[str]) -> RepairedMesh[MeshT]: ...
@overload
def repair(shape: MeshLike, names: Sequence[str]) -> RepairedMesh[Any]: ...
def repair(shape: ShapeLike, names: Sequence[str]) -> RepairedMesh[Any] | RepairedCloud:
    """Apply named repairs to a shape, one after the other, and report what they changed.

    Parameters
    ----------
    shape : MeshLike or PointCloud
        The shape to repair. It is not modified.
    names : sequence of str
        Names of the repairs, in the order in which they are applied. For meshes of any dimension:
        "auto", `weld`, `weld_seams`, `collapse_needles`, `drop_degenerate`, `drop_duplicate_faces`,
        `drop_unreferenced`. For triangle meshes also `orient`, `largest_component`, `fill_holes`.
        For clouds: "auto", `drop_duplicate_points`.

    Returns
    -------
    RepairedMesh or RepairedCloud
        The repaired shape, with one sentence of report for each repair that "auto" or the caller
        applied.

    Raises
    ------
    InvalidParameterError
        If a name is not the name of a repair for this kind of shape.
    InvalidShapeError
        If no face would remain.

    See Also
    --------
    suggest_repairs : The names of the repairs that would help.

    Notes
    -----
    "auto" applies whichever of `drop_duplicate_faces`, `weld_seams`, `collapse_needles`,
    `drop_degenerate`, `drop_unreferenced` and, on surfaces, `orient` change the mesh, until none
    does. On a cloud it is `drop_duplicate_points`. It fills no hole and removes no component.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(1)
    >>> inverted = es.TriangleMesh(ball.vertices, [*ball.faces[:, ::-1], ball.faces[3]])
    >>> for sentence in es.repair(inverted, ["auto"]).report:
    ...     print(sentence)
    drop_duplicate_faces removed 1 face with the corners of an earlier one
    orient turned 80 faces over
    """
    shape = as_shape(shape)
    known = names_of_repairs(shape)
    for index, name in enumerate(names):
        if name not in known:
            raise InvalidParameterError(
                f"Repairs of {shape!r} must be among {', '.join(known)}; name {index} is {name!r}."
            )
    if isinstance(shape, PointCloud):
        done = RepairedCloud(shape, (), np.arange(shape.n_points))
        for name in names:
            step = CLOUD_REPAIRS[name](done.cloud)
            source = done.source_points[step.source_points]
            done = RepairedCloud(step.cloud, done.report + step.report, source)
        return done
    result = _unchanged(shape)
    for name in names:
        result = _combine(result, REPAIRS[name](result.mesh))
    return result


def suggest_repairs(shape: ShapeLike) -> tuple[str, ...]:
    """Return the names of the repairs that would help a shape, in the order to apply them.

    After these repairs, no further repair is suggested.

    Parameters
    ----------
    shape : MeshLike or PointCloud

    Returns
    -------
    tuple of str
        Names to pass to `repair`; a name can occur twice. Empty for a sound shape, and for a mesh
        of which no face would remain.

    See Also
    --------
    repair : Apply the repairs.

    Notes
    -----
    Suggestions are the repairs that "auto" would apply. On surfaces `largest_component` is added if
    each other component has at most 1 % of the area and all of them together have at most 20 %.
    `fill_holes` is added if each hole has at most 5 % of the area, as a disc with the length of its
    rim.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(2)
    >>> es.suggest_repairs(es.TriangleMesh(ball.vertices, ball.faces[1:, ::-1]))
    ('fill_holes', 'orient')
    """
    shape = as_shape(shape)
    if isinstance(shape, PointCloud):
        return (
            ("drop_duplicate_points",)
            if drop_duplicate_points(shape).cloud.n_points < shape.n_points
            else ()
        )
    try:
        return _until_sound(shape, (*AUTO, *CONDITIONS))[1]
    except InvalidShapeError:  # no face has area
        return ()


def _until_sound(mesh: MeshT, names: Sequence[str]) -> tuple[RepairedMesh[MeshT], tuple[str, ...]]:
    """Apply repairs in turn until none changes the mesh; return the result and what was applied."""
    done = _unchanged(mesh)
    applied: list[str] = []
    known = names_of_repairs(mesh)
    n_before = -1
    while len(applied) > n_before:
        n_before = len(applied)
        for name in names:
            if name not in known or (name in CONDITIONS and not CONDITIONS[name](done.mesh)):
                continue
            step = REPAIRS[name](done.mesh)
            before, after = done.mesh, step.mesh
            same_points = before.n_points == after.n_points
            if not (same_points and np.array_equal(before.simplices, after.simplices)):
                done = _combine(done, step)
                applied.append(name)
    return done, tuple(applied)


def _unchanged(mesh: MeshT) -> RepairedMesh[MeshT]:
    return RepairedMesh(mesh, (), np.arange(mesh.n_points))


def _combine(done: RepairedMesh[MeshT], step: RepairedMesh[MeshT]) -> RepairedMesh[MeshT]:
    return RepairedMesh(
        step.mesh, done.report + step.report, done.source_vertices[step.source_vertices]
    )


def has_specks(mesh: TriangleMesh) -> bool:
    """Tell whether all components but the largest have little area, each and together."""
    _, labels = vertex_components(mesh)
    areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    shares = np.sort(np.bincount(labels[mesh.faces[:, 0]], weights=areas / areas.sum()))
    return bool(shares[:-1].max(initial=0.0) <= LARGEST_SPECK and shares[:-1].sum() <= ALL_SPECKS)


def has_small_holes(mesh: TriangleMesh) -> bool:
    """Tell whether each hole has little area: that of a disc with the same length of rim."""
    points, _ = size_one(mesh.vertices)
    rims = [points[loop] for loop in boundary_loops(mesh)]
    lengths = [np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum() for rim in rims]
    area = np.linalg.norm(area_vectors(points[mesh.faces]), axis=1).sum()
    return bool(max(lengths, default=0.0) ** 2 / (4 * np.pi) <= LARGEST_HOLE * area)


# Repairs that `suggest_repairs` names only if a condition holds.
CONDITIONS: dict[str, Callable[[Any], bool]] = {
    "largest_component": has_specks,
    "fill_holes": has_small_holes,
}
