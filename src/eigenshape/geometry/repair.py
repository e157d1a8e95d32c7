"""Repairs, each asked for by name, each saying what it did."""

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
from eigenshape.geometry.holes import fillings
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

# Shares of the area up to which `suggest_repairs` takes something for a fault of a scan and not for a part or a rim.
SPECK = 0.01  # of a component beside the largest
ALL_SPECKS = 0.2  # of all these together
HOLE = 0.05  # of a hole: the open side of half a ball has 0.5
# A side under this share of another side of the same face is a needle's. Cotangents of 1e6 are the most that solvers
# bear beside ordinary ones in every mesh that was tried; of 1e9 they lost the eigenvalue 0 in meshes of many parts.
NEEDLE = 1e-6


@dataclass(frozen=True, eq=False)
class RepairedMesh(Generic[MeshT]):
    """A mesh after one or more repairs, and what they did.

    Attributes
    ----------
    mesh : TriangleMesh or SimplicialMesh
    report : tuple of str
        One sentence a repair, such as "drop_degenerate removed 2 faces".
    source_vertices : (n,) int
        For each vertex of `mesh`, the vertex of the original that it was.
    """

    mesh: MeshT
    report: tuple[str, ...]
    source_vertices: Int[np.ndarray, " n"]


@dataclass(frozen=True, eq=False)
class RepairedCloud:
    """A cloud after its repair, and what that did.

    Attributes
    ----------
    cloud : PointCloud
    report : tuple of str
        One sentence, such as "drop_duplicate_points removed 2 points at the places of others".
    source_points : (n,) int
        For each point of `cloud`, the point of the original that it was.
    """

    cloud: PointCloud
    report: tuple[str, ...]
    source_points: Int[np.ndarray, " n"]


def weld(mesh: MeshLike, *, tolerance: float = 0.0) -> RepairedMesh[Any]:
    """Make one vertex of all that lie at the same place.

    Where closed pieces touch, this joins them too; `weld_seams` does not.

    Parameters
    ----------
    mesh : MeshLike
        Of triangles, or of simplices of any dimension.
    tolerance : float
        Vertices at most this share of the bounding box' diagonal apart are the same place, chains of them too. At 0
        coordinates must be equal.

    Raises
    ------
    InvalidParameterError
        If the tolerance is not within 0..0.1.
    """
    mesh = as_simplicial(mesh)
    if not 0 <= tolerance <= 0.1:
        raise InvalidParameterError(
            f"tolerance must lie in 0..0.1 of the bounding box' diagonal; it is {tolerance}."
        )
    if tolerance == 0:
        group = _places(mesh.points)
    else:
        points, _ = size_one(mesh.points)
        points, _ = size_one(points - points.mean(axis=0))
        radius = tolerance * float(np.linalg.norm(np.ptp(points, axis=0)))
        group = _linked(cKDTree(points).query_pairs(radius, output_type="ndarray"), mesh.n_points)
    return _joined(mesh, group, "weld joined {} vertices to others at the same place")


def weld_seams(mesh: MeshLike) -> RepairedMesh[Any]:
    """Join sides on the boundary that lie on each other: the seams of a cut surface, or all sides of a soup.

    No edge gets worse: one with a single face becomes one with two or more. Where pieces touch without such a seam,
    as closed ones do, they stay apart.
    """
    mesh = as_simplicial(mesh)
    one, two = seams(mesh).transpose(1, 0, 2).reshape(2, -1)
    group = _linked(np.column_stack([one, two]), mesh.n_points)
    return _joined(mesh, group, "weld_seams joined {} vertices along seams")


def _places(points: Float[np.ndarray, "n d"]) -> Int[np.ndarray, " n"]:
    """Return the number of each point's place."""
    # Adding 0.0 makes -0.0 equal to 0.0 also where bytes are compared.
    _, place = np.unique(points + 0.0, axis=0, return_inverse=True)
    return place.ravel().astype(np.int64)


def _linked(pairs: Int[np.ndarray, "k 2"], n: int) -> Int[np.ndarray, " n"]:
    """Return for each of n points the number of its group, where pairs belong together."""
    graph = sp.coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _joined(mesh: MeshT, group: Int[np.ndarray, " n"], report: str) -> RepairedMesh[MeshT]:
    """Make one vertex of each group, the first of it, in the order in which these appear."""
    _, first, renumbered = np.unique(group, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    joined = type(mesh)(mesh.points[first[order]], rank[renumbered[mesh.simplices]])
    return RepairedMesh(joined, (report.format(mesh.n_points - joined.n_points),), first[order])


def drop_degenerate(mesh: MeshLike) -> RepairedMesh[Any]:
    """Remove faces without area, or simplices without volume; their vertices stay.

    Where a vertex of such a face lies on its longest side, the face beyond that side is split there, so that no slit is
    left: a closed surface stays closed.

    Raises
    ------
    InvalidShapeError
        If no face is left.
    """
    mesh = as_simplicial(mesh)
    n_flat = len(degenerate_simplices(mesh))
    n_split = 0
    if n_flat and isinstance(mesh, TriangleMesh):
        mesh, n_split = flip_flat_faces(mesh)
    keep = np.ones(len(mesh.simplices), dtype=bool)
    keep[degenerate_simplices(mesh)] = False
    measure = MEASURES.get(mesh.dim, MEASURES[3])[2]
    report = f"drop_degenerate removed {n_flat} {_plural(mesh)} without {measure}"
    report += f", and split {_count(n_split, 'neighbor')} at their vertices" if n_split else ""
    return _kept(mesh, keep, report)


def collapse_needles(mesh: MeshLike) -> RepairedMesh[Any]:
    """Join the ends of sides under a millionth of the longest side of their face, or simplex.

    Such a face has area, but next to its angle the others round to nothing, and its eigenvalues hide those of the
    shape. Nothing moves by more than the length of the sides that go; faces that lose a side go with them. A mesh
    that has nothing but such faces is left as it is.
    """
    mesh = as_simplicial(mesh)
    corners, _ = scaled_corners(mesh)
    one, two = np.triu_indices(mesh.dim + 1, 1)
    lengths = np.linalg.norm(corners[:, one] - corners[:, two], axis=2)
    # Sides of length 0 belong to faces without area, which are `drop_degenerate`'s.
    short = (lengths > 0) & (lengths < NEEDLE * lengths.max(axis=1, keepdims=True))
    in_simplex, side = np.nonzero(short)
    if short.any(axis=1).all():
        in_simplex, side = in_simplex[:0], side[:0]
    ends = np.column_stack(
        [mesh.simplices[in_simplex, one[side]], mesh.simplices[in_simplex, two[side]]]
    )
    joined = _joined(
        mesh,
        _linked(ends, mesh.n_points),
        "collapse_needles joined {} vertices to others beside them",
    )
    ordered = np.sort(joined.mesh.simplices, axis=1)
    whole = (ordered[:, 1:] != ordered[:, :-1]).all(axis=1)
    kept = _kept(joined.mesh, whole | ~short.any(axis=1), "")
    report = (
        f"{joined.report[0]}, and removed {int((~whole & short.any(axis=1)).sum())} {_plural(mesh)}"
    )
    return RepairedMesh(kept.mesh, (report,), joined.source_vertices)


def drop_duplicate_faces(mesh: MeshLike) -> RepairedMesh[Any]:
    """Keep the first of all faces, or simplices, with the same corners, whatever their order."""
    mesh = as_simplicial(mesh)
    keep = np.ones(len(mesh.simplices), dtype=bool)
    keep[repeated_simplices(mesh)[:, 1]] = False
    report = f"drop_duplicate_faces removed {int((~keep).sum())} {_plural(mesh)} that repeat an earlier one"
    return _kept(mesh, keep, report)


def _kept(mesh: MeshT, keep: Bool[np.ndarray, " s"], report: str) -> RepairedMesh[MeshT]:
    kept = type(mesh)(mesh.points, mesh.simplices[keep])
    return RepairedMesh(kept, (report,), np.arange(mesh.n_points))


def _plural(mesh: Mesh) -> str:
    return MEASURES[mesh.dim][0].lower() if mesh.dim in MEASURES else "simplices"


def drop_unreferenced(mesh: MeshLike) -> RepairedMesh[Any]:
    """Remove vertices that no face, or simplex, uses."""
    mesh = as_simplicial(mesh)
    n_loose = len(unreferenced_vertices(mesh))
    source, renumbered = np.unique(mesh.simplices, return_inverse=True)
    kept = type(mesh)(mesh.points[source], renumbered.reshape(mesh.simplices.shape))
    noun = "face" if mesh.dim == 2 else "simplex"
    return RepairedMesh(
        kept, (f"drop_unreferenced removed {n_loose} vertices without a {noun}",), source
    )


def orient(mesh: MeshLike) -> RepairedMesh[TriangleMesh]:
    """Turn faces over so that neighbors agree, and pieces face out.

    Of each piece the fewer faces are turned. Then a closed piece is turned as a whole if its signed volume is negative;
    one inside another turns with the outermost, since it may be a cavity. An open piece whose faces disagreed is turned
    by `orient_outward`; one whose faces agreed stays. Pieces end at edges with more than two faces. What cannot be
    oriented, such as a Möbius strip, is left, and the report names a face of each such piece.
    """
    mesh = as_mesh(mesh)
    turned, one_sided, piece = faces_to_turn(mesh)
    report = f"orient turned {_count(int(turned.sum()), 'face')} over"
    if one_sided.any():
        named = np.flatnonzero(one_sided)[np.unique(piece[one_sided], return_index=True)[1]]
        report += f", left {_count(len(named), 'piece')} with one side only, of face {', '.join(map(str, named[:9]))}"
        report += " and others" if len(named) > 9 else ""
    return RepairedMesh(with_turned_faces(mesh, turned), (report,), np.arange(mesh.n_vertices))


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def largest_component(mesh: MeshLike) -> RepairedMesh[TriangleMesh]:
    """Keep the connected component with the most area; of equal ones, the one with the lowest vertex."""
    mesh = as_mesh(mesh)
    count, _ = vertex_components(mesh)
    keep = faces_of_largest(mesh)
    kept, source = submesh(mesh, keep)
    report = f"largest_component removed {count - 1} components with {int((~keep).sum())} faces"
    return RepairedMesh(kept, (report,), source)


def faces_of_largest(mesh: TriangleMesh) -> Bool[np.ndarray, " f"]:
    """Mark the faces of the component that `largest_component` keeps."""
    _, labels = vertex_components(mesh)
    of_face = np.unique(labels[mesh.faces[:, 0]], return_inverse=True)[1]
    areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    return np.asarray(of_face == np.argmax(np.bincount(of_face, weights=areas)))


def fill_holes(mesh: MeshLike, *, most_edges: int = 1000) -> RepairedMesh[TriangleMesh]:
    """Close every hole by faces between the vertices around it; no vertex is added.

    Each boundary loop is triangulated with the least sum of areas (Barequet and Sharir, Filling gaps in the boundary of
    a polyhedron, 1995), to which a little of the sides' squares is added against slivers. An open surface is closed
    along its rim, too. What cannot be closed without a face that has no area, or is there already, or an edge of three
    faces, is left, and the report says so.

    Parameters
    ----------
    mesh : MeshLike
    most_edges : int
        Holes with more edges are left: work goes with the third power (1,000 take about a second).

    Raises
    ------
    InvalidParameterError
        If `most_edges` is under 3.
    """
    mesh = as_mesh(mesh)
    if most_edges < 3:
        raise InvalidParameterError(
            f"most_edges must be at least 3, the sides of a triangle; it is {most_edges}."
        )
    found = fillings(mesh, most_edges)
    sealed = TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, *found.faces]))
    n_faces = sealed.n_faces - mesh.n_faces
    report = f"fill_holes closed {_count(len(found.faces), 'hole')} with {_count(n_faces, 'face')}"
    report += f", left {found.n_long} of more than {most_edges} edges" if found.n_long else ""
    report += f", left {found.n_open} that good faces do not close" if found.n_open else ""
    return RepairedMesh(sealed, (report,), np.arange(mesh.n_vertices))


def drop_duplicate_points(cloud: PointCloud) -> RepairedCloud:
    """Keep the first of all points at the same place."""
    require_type(cloud, PointCloud, "cloud")
    _, source = np.unique(_places(cloud.points), return_index=True)
    source = np.sort(source)
    report = f"drop_duplicate_points removed {_count(cloud.n_points - len(source), 'point')} at the places of others"
    return RepairedCloud(PointCloud(cloud.points[source], cloud.dim), (report,), source)


def repair_as_needed(mesh: MeshT) -> RepairedMesh[MeshT]:
    """Apply each of `AUTO` that changes something, until none does.

    Raises
    ------
    InvalidShapeError
        If no face is left.
    """
    return _until_sound(mesh, AUTO)[0]


# Doubles hide seams, and seams doubles. Faces without area go after both, when it is known what lies beside them.
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
OF_SURFACES_ONLY = ("orient", "largest_component", "fill_holes")
CLOUD_REPAIRS = {"auto": drop_duplicate_points, "drop_duplicate_points": drop_duplicate_points}


def names_of_repairs(shape: Shape) -> tuple[str, ...]:
    """Name the repairs that there are for a kind of shape."""
    if isinstance(shape, PointCloud):
        return tuple(CLOUD_REPAIRS)
    of_any = tuple(name for name in REPAIRS if name not in OF_SURFACES_ONLY)
    return tuple(REPAIRS) if isinstance(shape, TriangleMesh) else of_any


@overload
def repair(shape: PointCloud, names: Sequence[str]) -> RepairedCloud: ...
@overload
def repair(shape: MeshT, names: Sequence[str]) -> RepairedMesh[MeshT]: ...
@overload
def repair(shape: MeshLike, names: Sequence[str]) -> RepairedMesh[Any]: ...
def repair(shape: ShapeLike, names: Sequence[str]) -> RepairedMesh[Any] | RepairedCloud:
    """Apply the named repairs one after the other.

    "auto" stands for whatever is needed of `drop_duplicate_faces`, `weld_seams`, `collapse_needles`, `drop_degenerate`,
    `drop_unreferenced` and, on surfaces, `orient`; on a cloud it is `drop_duplicate_points`. It fills no hole and drops
    no component.

    Parameters
    ----------
    shape : MeshLike or PointCloud
    names : sequence of str

    Returns
    -------
    RepairedMesh or RepairedCloud
        With one sentence of report for each repair; "auto" reports what it changed.

    Raises
    ------
    InvalidParameterError
        If there is no repair of such a name for such a shape.
    InvalidShapeError
        If a repair leaves no face.

    Examples
    --------
    >>> import eigenshape as es
    >>> ball = es.icosphere(1)
    >>> twice = es.TriangleMesh(ball.vertices, [*ball.faces[:, ::-1], ball.faces[3]])
    >>> es.repair(twice, ["auto"]).report
    ('drop_duplicate_faces removed 1 faces that repeat an earlier one', 'orient turned 80 faces over')
    """
    shape = as_shape(shape)
    known = names_of_repairs(shape)
    for index, name in enumerate(names):
        if name not in known:
            raise InvalidParameterError(
                f"repairs of {shape!r} must be among {', '.join(known)}; name {index} is {name!r}."
            )
    if isinstance(shape, PointCloud):
        done = RepairedCloud(shape, (), np.arange(shape.n_points))
        for name in names:
            step = CLOUD_REPAIRS[name](done.cloud)
            source = done.source_points[step.source_points]
            done = RepairedCloud(step.cloud, done.report + step.report, source)
        return done
    whole = _unchanged(shape)
    for name in names:
        whole = _followed(whole, REPAIRS[name](whole.mesh))
    return whole


def suggest_repairs(shape: ShapeLike) -> tuple[str, ...]:
    """Name the repairs that would help a shape, in an order in which they can be handed to `repair`.

    Those that "auto" stands for; on surfaces also `largest_component`, where each other component is a speck of at most
    1 % of the area and all specks have at most 20 %, and `fill_holes`, where each hole has at most 5 %: a disc with its
    length. Once these repairs have been applied, none is left to suggest.

    Parameters
    ----------
    shape : MeshLike or PointCloud

    Returns
    -------
    tuple of str
        Names, some perhaps twice; empty for a sound shape, and where no face would be left.

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
        return _until_sound(shape, (*AUTO, *HELPS))[1]
    except InvalidShapeError:  # no face has area
        return ()


def _until_sound(mesh: MeshT, names: Sequence[str]) -> tuple[RepairedMesh[MeshT], tuple[str, ...]]:
    """Apply in turn each of some repairs that helps, until none does; return the result and the names of these."""
    done = _unchanged(mesh)
    applied: list[str] = []
    known = names_of_repairs(mesh)
    n_before = -1
    while len(applied) > n_before:
        n_before = len(applied)
        for name in names:
            if name not in known or (name in HELPS and not HELPS[name](done.mesh)):
                continue
            step = REPAIRS[name](done.mesh)
            if not _same(done.mesh, step.mesh):
                done = _followed(done, step)
                applied.append(name)
    return done, tuple(applied)


def _unchanged(mesh: MeshT) -> RepairedMesh[MeshT]:
    return RepairedMesh(mesh, (), np.arange(mesh.n_points))


def _followed(done: RepairedMesh[MeshT], step: RepairedMesh[MeshT]) -> RepairedMesh[MeshT]:
    return RepairedMesh(
        step.mesh, done.report + step.report, done.source_vertices[step.source_vertices]
    )


def _same(one: MeshT, two: MeshT) -> bool:
    return one.n_points == two.n_points and np.array_equal(one.simplices, two.simplices)


def has_specks(mesh: TriangleMesh) -> bool:
    """Say whether each component but the largest has little area, and all of these together."""
    _, labels = vertex_components(mesh)
    areas = np.linalg.norm(area_vectors(scaled_corners(mesh)[0]), axis=1)
    shares = np.sort(np.bincount(labels[mesh.faces[:, 0]], weights=areas / areas.sum()))
    return bool(shares[:-1].max(initial=0.0) <= SPECK and shares[:-1].sum() <= ALL_SPECKS)


def has_small_holes(mesh: TriangleMesh) -> bool:
    """Say whether each hole has little area, taken to be that of a disc with its length."""
    points, _ = size_one(mesh.vertices)
    rims = [points[loop] for loop in boundary_loops(mesh)]
    lengths = [np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum() for rim in rims]
    area = np.linalg.norm(area_vectors(points[mesh.faces]), axis=1).sum()
    return bool(max(lengths, default=0.0) ** 2 / (4 * np.pi) <= HOLE * area)


HELPS: dict[str, Callable[[Any], bool]] = {
    "largest_component": has_specks,
    "fill_holes": has_small_holes,
}
