"""Repair a shape by names, choose repairs automatically, and suggest them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, overload

import numpy as np

from eigenshape._corners import scaled_corners
from eigenshape._errors import InvalidShapeError, count_nouns
from eigenshape._vectors import size_one, triangle_areas
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import MeshLike, ShapeLike, as_shape
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.holes import fill_holes
from eigenshape.geometry.repairs.one_sided import cut_one_sided
from eigenshape.geometry.repairs.orient import orient
from eigenshape.geometry.repairs.repair_names import (
    CLOUD_REPAIRS,
    MESH_REPAIRS,
    SURFACE_REPAIRS,
    require_repairs,
)
from eigenshape.geometry.repairs.repair_report import MeshT, RepairedCloud, RepairedMesh
from eigenshape.geometry.repairs.repair_steps import (
    collapse_needles,
    drop_degenerate,
    drop_duplicate_faces,
    drop_duplicate_points,
    drop_unreferenced,
    largest_component,
    weld,
    weld_seams,
)
from eigenshape.geometry.topology import boundary_loops, non_manifold_edges, vertex_components

# Shares of the area of a surface up to which `suggest_repairs` takes something for a fault of the
# scan rather than for a part of the shape or its boundary.
LARGEST_SPECK = 0.01  # a component other than the largest
ALL_SPECKS = 0.2  # all these components together
LARGEST_HOLE = 0.05  # a hole; for comparison, the open side of half a ball has 0.5


def repair_as_needed(mesh: MeshT) -> RepairedMesh[MeshT]:
    """Apply the repairs of `AUTO` in turn until none of them changes the mesh, and report what is left.

    Raise InvalidShapeError if no face would remain.
    """
    done = _until_sound(mesh, AUTO)[0]
    if not isinstance(done.mesh, TriangleMesh):
        return done
    left = {
        "with more than two faces": non_manifold_edges(done.mesh),
        "of pieces with one side only (cut_one_sided opens them)": inconsistent_edges(done.mesh),
    }
    report = [
        f"auto left {count_nouns(len(edges), 'edge')} {which}, the first at vertices {edges[0].tolist()}"
        for which, edges in left.items()
        if len(edges)
    ]
    return replace(done, report=(*done.report, *report))


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


def _start_report(mesh: MeshT) -> RepairedMesh[MeshT]:
    return RepairedMesh(mesh, (), np.arange(mesh.n_points))


Step = Callable[[Any], RepairedMesh[Any]]
# The function of each name in `MESH_REPAIRS`. Readers drop missing points: a mesh cannot hold them.
REPAIRS: dict[str, Step] = {
    "auto": repair_as_needed,
    "drop_missing": _start_report,
    "weld": weld,
    "weld_seams": weld_seams,
    "collapse_needles": collapse_needles,
    "drop_degenerate": drop_degenerate,
    "drop_duplicate_faces": drop_duplicate_faces,
    "drop_unreferenced": drop_unreferenced,
    "orient": orient,
    "largest_component": largest_component,
    "fill_holes": fill_holes,
    "cut_one_sided": cut_one_sided,
}


def names_of_repairs(shape: Shape) -> tuple[str, ...]:
    """Return the names of the repairs that a shape can be given."""
    if isinstance(shape, PointCloud):
        return CLOUD_REPAIRS
    if isinstance(shape, TriangleMesh):
        return MESH_REPAIRS
    return tuple(name for name in MESH_REPAIRS if name not in SURFACE_REPAIRS)


@overload
def repair(shape: PointCloud, names: Sequence[str]) -> RepairedCloud: ...
@overload
def repair(
    shape: MeshT, names: Sequence[str], *, tolerance: float = ..., most_edges: int = ...
) -> RepairedMesh[MeshT]: ...
@overload
def repair(
    shape: MeshLike, names: Sequence[str], *, tolerance: float = ..., most_edges: int = ...
) -> RepairedMesh[Any]: ...
def repair(
    shape: ShapeLike, names: Sequence[str], *, tolerance: float = 0.0, most_edges: int = 1000
) -> RepairedMesh[Any] | RepairedCloud:
    """Apply named repairs to a shape, one after the other, and report what they changed.

    Parameters
    ----------
    shape : MeshLike or PointCloud
        The shape to repair. It is not modified.
    names : sequence of str
        Names of the repairs, in the order in which they are applied. For meshes of any dimension:
        "auto", `weld`, `weld_seams`, `collapse_needles`, `drop_degenerate`, `drop_duplicate_faces`,
        `drop_unreferenced`. For triangle meshes also `orient`, `largest_component`, `fill_holes`,
        `cut_one_sided`.
        For clouds: "auto", `drop_duplicate_points`. `drop_missing` acts when a file is read, as
        `read_mesh(path, drop_missing=True)`, and changes no shape that was read.
    tolerance : float
        Of `weld`: the largest distance between vertices at the same place, as a share of the
        diagonal of the bounding box, 0 to 0.1. Vertices linked by a chain of such distances are all
        joined. With 0, coordinates must be equal.
    most_edges : int
        Of `fill_holes`: holes with more edges are left open. The time grows with the third power of
        the number of edges; 1,000 edges take about a second.

    Returns
    -------
    RepairedMesh or RepairedCloud
        The repaired shape, with one sentence of report for each repair that "auto" or the caller
        applied, and for what "auto" leaves.

    Raises
    ------
    InvalidParameterError
        If a name is not the name of a repair for this kind of shape, `tolerance` is not in 0..0.1,
        or `most_edges` is less than 3.
    InvalidShapeError
        If no face would remain.

    See Also
    --------
    suggest_repairs : The names of the repairs that would help.

    Notes
    -----
    "auto" applies whichever of `drop_duplicate_faces`, `weld_seams`, `collapse_needles`,
    `drop_degenerate`, `drop_unreferenced` and, on surfaces, `orient` change the mesh, until none
    does. On a cloud it is `drop_duplicate_points`. It fills no hole and removes no component, and
    it leaves edges with more than two faces and pieces with one side only, which the report names.

    `weld` joins vertices at the same place, and so closed pieces that touch; `weld_seams` joins
    only boundary edges that lie on each other, up to the rounding of stored coordinates: of single
    precision, of decimals in text, or of double precision. `collapse_needles` joins the ends of
    sides shorter than a millionth of the longest side of their face, or a billionth of the longest
    side of the mesh. `drop_degenerate` removes faces without area and splits the neighbor on their
    longest side, so that no slit opens. `drop_duplicate_faces` and `drop_duplicate_points` keep the
    first of equal ones. `orient` turns faces so that neighbors agree, closed pieces face outward
    and those inside an odd number of others inward, as cavities do; a piece that has one side only
    is left, until `cut_one_sided` cuts it open. `largest_component` keeps the component with the
    most area. `fill_holes` closes boundary loops by faces with the least sum of areas (Barequet and
    Sharir 1995), without new vertices.

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
    names = require_repairs(names, names_of_repairs(shape), f"Repairs of {shape!r}")
    if isinstance(shape, PointCloud):
        if set(names) <= {"drop_missing"}:
            return RepairedCloud(shape, (), np.arange(shape.n_points))
        return drop_duplicate_points(shape)  # which is also all that auto does
    steps: dict[str, Step] = {
        **REPAIRS,
        "weld": partial(weld, tolerance=tolerance),
        "fill_holes": partial(fill_holes, most_edges=most_edges),
    }
    result = _start_report(shape)
    for name in names:
        result = _combine(result, steps[name](result.mesh))
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
    done = _start_report(mesh)
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
            dropped = after.n_points < before.n_points
            if dropped or not np.array_equal(before.simplices, after.simplices):
                done = _combine(done, step)
                applied.append(name)
    return done, tuple(applied)


def _combine(done: RepairedMesh[MeshT], step: RepairedMesh[MeshT]) -> RepairedMesh[MeshT]:
    return RepairedMesh(
        step.mesh, done.report + step.report, done.source_vertices[step.source_vertices]
    )


def has_specks(mesh: TriangleMesh) -> bool:
    """Tell whether all components but the largest have little area, each and together."""
    _, labels = vertex_components(mesh)
    areas = triangle_areas(scaled_corners(mesh)[0])
    others = np.sort(np.bincount(labels[mesh.faces[:, 0]], weights=areas / areas.sum()))[:-1]
    return bool(others.max(initial=0.0) <= LARGEST_SPECK and others.sum() <= ALL_SPECKS)


def has_small_holes(mesh: TriangleMesh) -> bool:
    """Tell whether each hole has little area: that of a disc with the same length of boundary."""
    points, _ = size_one(mesh.vertices)
    rims = [points[loop] for loop in boundary_loops(mesh)]
    lengths = [np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum() for rim in rims]
    area = triangle_areas(points[mesh.faces]).sum()
    return bool(max(lengths, default=0.0) ** 2 / (4 * np.pi) <= LARGEST_HOLE * area)


# Repairs that `suggest_repairs` names only if a condition holds.
CONDITIONS: dict[str, Callable[[Any], bool]] = {
    "largest_component": has_specks,
    "fill_holes": has_small_holes,
}
