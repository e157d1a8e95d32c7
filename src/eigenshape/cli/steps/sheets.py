"""A query beside its matches, with corresponding parts in one color."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int
from matplotlib.figure import Figure

from certeig.kit.arrays import record
from certeig.kit.errors import CerteigError
from certeig.kit.text import literal
from eigenshape._errors import StoreError
from eigenshape._vectors import nearest_rotations, size_one
from eigenshape.cli.console import err, escape_text, progress_bar
from eigenshape.cli.steps.writing import Side
from eigenshape.geometry.distances.geodesic import geodesic_distances
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.surface_files import read_surface
from eigenshape.plot.camera import aim_camera
from eigenshape.plot.sheet import Panel, figure_contact_sheet
from eigenshape.retrieval.heat.features import find_heat_features, find_view_features
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, describe
from eigenshape.retrieval.search.matches import Match

CAPTION = (
    "equal colors: corresponding parts; gray: no correspondence; red points: points that correspond\n"
    "lower score: more similar; turned: drawn from the same side as the query"
)
N_CELLS = 12  # of the query by patches
FEWEST_TO_TURN = 4  # pairs of points that determine how a match is turned
N_EXPLAINED = 12  # pairs of points of an explanation: as many colors as people tell apart
# times what a patch has of the surface, in length: farther from a matched patch nothing is known
REACH = 3.0


@record
class ColoredQuery:
    """A query with the colors of its parts.

    Attributes
    ----------
    mesh : TriangleMesh
    descriptor : HeatDescriptor or PatchDescriptor
    labels : (f,) int
        Color of each face.
    colors : (m,) int
        Color of each feature or patch.
    dots : (p,) int
        Features or patches to mark.
    """

    mesh: TriangleMesh
    descriptor: Descriptor
    labels: Int[np.ndarray, " f"]
    colors: Int[np.ndarray, " m"]
    dots: Int[np.ndarray, " p"]


def color_query(mesh: TriangleMesh, recipe: AnyRecipe) -> ColoredQuery:
    """Describe a query, and cut it into parts: around its features, or around the first of its patches."""
    if isinstance(recipe, HeatRecipe):
        shape = find_heat_features(mesh, recipe)
        every = np.arange(len(shape.descriptor.vertices))
        return ColoredQuery(shape.mesh, shape.descriptor, shape.parts.labels, every, every)
    descriptor = describe(mesh, recipe)
    distances = geodesic_distances(mesh, descriptor.vertices[:N_CELLS])
    cells = distances.argmin(axis=0)
    return ColoredQuery(
        mesh,
        descriptor,
        cells[mesh.faces[:, 0]],
        cells[descriptor.vertices],
        np.arange(len(distances)),
    )


def contact_sheet(
    query: ColoredQuery,
    title: str,
    matches: Sequence[Match],
    *,
    repairs: tuple[str, ...],
    caption: str,
    side: Side,
) -> Figure:
    """Draw a query beside its matches, read from their files.

    The parts of the query have colors of their own; a part of a match has the color of the query's
    part that it corresponds to, and is gray where there is none. Matches are turned so that they
    are seen from the side of the query. A match whose file cannot be read
    is named on stderr, and its place stays empty.
    """
    first = Panel(
        query.mesh, f"query: {title}", query.labels, query.descriptor.vertices[query.dots]
    )
    with progress_bar("draw") as progress:
        panels = []
        for done, match in enumerate(matches):
            progress(done / len(matches), match.name)
            panels.append(_panel(query, match, repairs))
    return figure_contact_sheet(first, panels, caption=caption, **_side_of(query, side))


def explanation(
    query: ColoredQuery,
    title: str,
    match: Match,
    *,
    repairs: tuple[str, ...],
    side: Side,
) -> Figure:
    """Draw a query beside one match, with the points that correspond, surest first.

    Raise StoreError or OSError if the file of the match cannot be read.
    """
    mesh = _read_match(match, repairs)
    ours, theirs = match.correspondences[:N_EXPLAINED].T
    vertices = query.descriptor.vertices[ours], match.vertices[theirs]
    labels = []
    for surface, places in zip((query.mesh, mesh), vertices, strict=True):
        reach = REACH * np.sqrt(surface_area(surface) / max(len(match.vertices), 1))
        labels.append(_cells(surface, places, np.arange(len(places)), reach))
    first = Panel(query.mesh, f"query: {title}", labels[0], vertices[0])
    second = _match_panel(query, match, mesh, labels[1], vertices[1])
    caption = (
        f"The {len(ours)} surest of {len(match.correspondences)} pairs of corresponding points: "
        "their surroundings have one color"
    )
    return figure_contact_sheet(first, [second], caption=caption, **_side_of(query, side))


def _side_of(query: ColoredQuery, side: Side) -> Side:
    """Return the side from which the query is drawn, as directions: matches are turned to it."""
    _, down, towards = aim_camera(query.mesh, **side).rotation
    return {"view": towards, "up": -down}


def _match_panel(
    query: ColoredQuery,
    match: Match,
    mesh: TriangleMesh,
    labels: Int[np.ndarray, " f"],
    vertices: Int[np.ndarray, " p"],
) -> Panel:
    """Return a match with its score, turned to the side of the query if enough points correspond."""
    title = f"{literal(match.name)}\nscore {match.score:.3f}"
    ours, theirs = match.correspondences.T
    if len(ours) >= FEWEST_TO_TURN:
        targets = query.mesh.vertices[query.descriptor.vertices[ours]]
        points = mesh.vertices[match.vertices[theirs]]
        targets, points = (size_one(each - each.mean(axis=0))[0] for each in (targets, points))
        rotation = nearest_rotations((targets.T @ points)[None])[0]
        mesh = TriangleMesh(mesh.vertices @ rotation.T, mesh.faces)
        title += ", turned"
    return Panel(mesh, title, labels, vertices)


def _panel(query: ColoredQuery, match: Match, repairs: tuple[str, ...]) -> Panel:
    try:
        mesh = _read_match(match, repairs)
    except (CerteigError, OSError) as error:
        err.print(f"[yellow]not drawn:[/] {escape_text(match.name)}: {escape_text(error)}")
        nothing = np.zeros(0, dtype=np.int64)
        return Panel(None, f"{literal(match.name)}\nscore {match.score:.3f}", nothing, nothing)
    ours, theirs = match.correspondences.T
    recipe = query.descriptor.recipe
    if isinstance(recipe, HeatRecipe):
        # The last color is for what no view of the match shows, and for fragments, which come last
        # among the parts and have no feature.
        colors = np.full(len(match.vertices) + 1, -1)
        colors[theirs] = query.colors[ours]
        if match.view == 0:
            parts = find_heat_features(mesh, recipe).parts.labels
            parts = np.where(parts < len(match.vertices), parts, -1)
        else:
            part, seen = find_view_features(mesh, recipe, match.view - 1)
            parts = np.full(mesh.n_faces, -1)
            parts[part.source_faces] = seen.parts.labels
        labels = colors[parts]
    else:
        reach = REACH * np.sqrt(surface_area(mesh) / len(match.vertices))
        labels = _cells(mesh, match.vertices[theirs], query.colors[ours], reach)
    marked = theirs[np.isin(ours, query.dots)]
    return _match_panel(query, match, mesh, labels, match.vertices[marked])


def _read_match(match: Match, repairs: tuple[str, ...]) -> TriangleMesh:
    if match.source is None:
        raise StoreError(
            "A match is drawn from its mesh file; it was added to the index without one."
        )
    mesh = read_surface(match.source, repair=repairs).mesh
    last = int(match.vertices.max(initial=-1))
    if last >= mesh.n_vertices:
        raise StoreError(
            f"A match is drawn from the mesh that was indexed; that had a vertex {last}, and {match.source} now has "
            f"{mesh.n_vertices} vertices. Give the same --repair as to `eigenshape index add`, or index the file again."
        )
    return mesh


def _cells(
    mesh: TriangleMesh, vertices: Int[np.ndarray, " p"], colors: Int[np.ndarray, " p"], reach: float
) -> Int[np.ndarray, " f"]:
    """Give each face the color of the matched patch that is nearest, -1 where none is near."""
    if not len(vertices):
        return np.full(mesh.n_faces, -1)
    distances = geodesic_distances(mesh, vertices)
    labels = np.where(distances.min(axis=0) < reach, colors[distances.argmin(axis=0)], -1)
    return labels[mesh.faces[:, 0]]
