"""A query beside its matches, with corresponding parts in one color."""

import warnings
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Int

from certeig.kit.arguments import require_each, require_type
from certeig.kit.arrays import record
from certeig.kit.errors import CerteigError, InvalidParameterError
from certeig.kit.progress import Progress
from certeig.kit.text import literal
from eigenshape._errors import StoreError
from eigenshape._vectors import nearest_rotations, size_one
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.geodesic import geodesic_distances
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.surface_files import read_surface
from eigenshape.plot.camera import Up, View, aim_camera
from eigenshape.plot.figure import Figure
from eigenshape.plot.sheet import Panel, figure_contact_sheet
from eigenshape.retrieval.heat.features import find_heat_features, find_view_features
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.retrieval.search.matches import Match

MEANING = (
    "equal colors: corresponding parts; gray: no correspondence; red points: points that correspond\n"
    "lower score: more similar; turned: drawn from the same side as the query"
)
N_CELLS = 12  # of the query by patches
FEWEST_TO_TURN = 4  # pairs of points that determine how a match is turned
N_EXPLAINED = 12  # pairs of points of one match: as many colors as people tell apart
# times what a patch has of the surface, in length: farther from a matched patch nothing is known
REACH = 3.0

Meshes = Mapping[str, MeshLike]


@record
class ColoredQuery:
    """A query with the colors of its parts.

    Attributes
    ----------
    mesh : TriangleMesh
    vertices : (m,) int
        Vertex of each feature or patch.
    labels : (f,) int
        Color of each face.
    colors : (m,) int
        Color of each feature or patch.
    dots : (p,) int
        Features or patches to mark.
    """

    mesh: TriangleMesh
    vertices: Int[np.ndarray, " m"]
    labels: Int[np.ndarray, " f"]
    colors: Int[np.ndarray, " m"]
    dots: Int[np.ndarray, " p"]


def figure_matches(  # noqa: PLR0913 - what is drawn, and one keyword for each choice of how
    query: MeshLike,
    matches: Match | Sequence[Match],
    *,
    meshes: Meshes | None = None,
    repair: Sequence[str] = (),
    title: str = "query",
    caption: str = "",
    view: View = "auto",
    up: Up = "auto",
    progress: Progress | None = None,
) -> Figure:
    """Draw a query beside what `ShapeIndex.query` found for it.

    The parts of the query have colors of their own. A part of a match has the color of the part of
    the query that it corresponds to, and is gray where there is none. Matches are turned so that
    they are seen from the side of the query. A match whose mesh cannot be read is named by a
    warning, and its place stays empty.

    Of one match, which is not in a sequence, the 12 surest pairs of corresponding points are drawn,
    each with its surroundings in one color.

    Parameters
    ----------
    query : MeshLike
        The mesh that was searched for.
    matches : Match or sequence of Match
        Best first.
    meshes : mapping of str to MeshLike, optional
        Meshes by the names of matches. The others are read from their files, `Match.source`.
    repair : sequence of str
        Names of repairs of meshes that are read: those with which they were indexed.
    title : str
        Of the query.
    caption : str
        Of the whole figure, above what colors and points mean.
    view : str or (3,) float
        The side from which the query is drawn, as in `aim_camera`.
    up : str or (3,) float
        The upward direction of the query, as in `aim_camera`.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidParameterError
        If there is no match, or the query is not the mesh that was searched for.
    StoreError, OSError
        If the mesh of a single match cannot be read, or is not the one that was indexed.

    See Also
    --------
    figure_contact_sheet : Draw shapes in colors of your own.

    Examples
    --------
    >>> import eigenshape as es
    >>> index, stored = es.ShapeIndex.create(None), {}
    >>> for kind in ("fish", "bird"):
    ...     stored[kind] = es.make_creature(kind, n_vertices=500)
    ...     index.add(kind, stored[kind], n_views=0)
    >>> scan = es.make_creature("fish", 1, n_vertices=500)
    >>> figure = es.plot.figure_matches(scan, index.query(scan), meshes=stored)
    >>> [axes.get_title().split()[0] for axes in figure.axes]
    ['query', 'fish', 'bird']
    """
    require_type(meshes, Mapping | None, "meshes")
    mesh, meshes = as_mesh(query, "query"), meshes or {}
    alone = isinstance(matches, Match)
    every = [matches] if isinstance(matches, Match) else list(matches)
    require_each(every, Match, "matches")
    if not every:
        raise InvalidParameterError("matches must hold a match to draw; it is empty.")
    last = int(every[0].query.vertices.max(initial=-1))
    if last >= mesh.n_vertices:
        raise InvalidParameterError(
            f"query must be the mesh that was searched for, which had a vertex {last}; it has "
            f"{mesh.n_vertices} vertices."
        )
    # Matches are turned to the side of the query.
    _, down, towards = aim_camera(mesh, view=view, up=up).rotation
    if alone:
        panels = _explain(mesh, title, every[0], _mesh_of(every[0], meshes, repair))
        n_pairs = len(every[0].correspondences)
        meaning = (
            f"The {min(n_pairs, N_EXPLAINED)} surest of {n_pairs} pairs of corresponding points: "
            "their surroundings have one color"
        )
    else:
        meaning = MEANING
        colored = _color_query(mesh, every[0])
        dots = colored.vertices[colored.dots]
        panels = [Panel(mesh, title, colored.labels, dots)]
        for number, match in enumerate(every):
            if progress:
                progress(number / len(every), match.name)
            panels.append(_panel(colored, match, meshes, repair))
    lines = f"{caption}\n{meaning}" if caption else meaning
    return figure_contact_sheet(panels[0], panels[1:], caption=lines, view=towards, up=-down)


def _color_query(mesh: TriangleMesh, match: Match) -> ColoredQuery:
    """Cut a query into parts: around its features, or around the first of its patches."""
    vertices, recipe = match.query.vertices, match.query.recipe
    every = np.arange(len(vertices))
    if isinstance(recipe, HeatRecipe):
        labels = find_heat_features(mesh, recipe).parts.labels
        return ColoredQuery(mesh, vertices, labels, every, every)
    cells = geodesic_distances(mesh, vertices[:N_CELLS]).argmin(axis=0)
    return ColoredQuery(mesh, vertices, cells[mesh.faces[:, 0]], cells[vertices], every[:N_CELLS])


def _explain(query: TriangleMesh, title: str, match: Match, mesh: TriangleMesh) -> list[Panel]:
    """Return the query and the match, with the points that correspond."""
    ours, theirs = match.correspondences[:N_EXPLAINED].T
    vertices = match.query.vertices[ours], match.vertices[theirs]
    labels = [
        _cells(surface, places, np.arange(len(places)), len(match.vertices))
        for surface, places in zip((query, mesh), vertices, strict=True)
    ]
    first = Panel(query, title, labels[0], vertices[0])
    return [first, _match_panel(query, match, mesh, labels[1], vertices[1])]


def _match_panel(
    query: TriangleMesh,
    match: Match,
    mesh: TriangleMesh,
    labels: Int[np.ndarray, " f"],
    vertices: Int[np.ndarray, " p"],
) -> Panel:
    """Return a match with its score, turned to the side of the query if enough points correspond."""
    title = f"{literal(match.name)}\nscore {match.score:.3f}"
    if match.mirrored:
        title += ", mirror image"
    ours, theirs = match.correspondences.T
    if len(ours) >= FEWEST_TO_TURN:
        targets = query.vertices[match.query.vertices[ours]]
        points = mesh.vertices[match.vertices[theirs]]
        targets, points = (size_one(each - each.mean(axis=0))[0] for each in (targets, points))
        rotation = nearest_rotations((targets.T @ points)[None])[0]
        mesh = TriangleMesh(mesh.vertices @ rotation.T, mesh.faces)
        title += ", turned"
    return Panel(mesh, title, labels, vertices)


def _panel(query: ColoredQuery, match: Match, meshes: Meshes, repair: Sequence[str]) -> Panel:
    try:
        mesh = _mesh_of(match, meshes, repair)
    except (CerteigError, OSError) as error:
        warnings.warn(f"not drawn: {match.name}: {error}", stacklevel=3)
        nothing = np.zeros(0, dtype=np.int64)
        return Panel(None, f"{literal(match.name)}\nscore {match.score:.3f}", nothing, nothing)
    ours, theirs = match.correspondences.T
    recipe = match.query.recipe
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
        labels = _cells(mesh, match.vertices[theirs], query.colors[ours], len(match.vertices))
    marked = theirs[np.isin(ours, query.dots)]
    return _match_panel(query.mesh, match, mesh, labels, match.vertices[marked])


def _mesh_of(match: Match, meshes: Meshes, repair: Sequence[str]) -> TriangleMesh:
    """Return the mesh of a match, given or read; raise StoreError if it is not the one of the index."""
    if match.name in meshes:
        mesh = as_mesh(meshes[match.name], f"meshes[{match.name!r}]")
    elif match.source is None:
        raise StoreError(
            "A match is drawn from its mesh file; it was added to the index without one. Pass "
            "meshes={name: mesh}."
        )
    else:
        mesh = read_surface(match.source, repair=repair).mesh
    last = int(match.vertices.max(initial=-1))
    if last >= mesh.n_vertices:
        raise StoreError(
            f"A match is drawn from the mesh that was indexed; that had a vertex {last}, and {match.source} now has "
            f"{mesh.n_vertices} vertices. Give the same --repair as to `eigenshape index add`, or index the file again."
        )
    return mesh


def _cells(
    mesh: TriangleMesh,
    vertices: Int[np.ndarray, " p"],
    colors: Int[np.ndarray, " p"],
    n_patches: int,
) -> Int[np.ndarray, " f"]:
    """Give each face the color of the matched patch that is nearest, -1 where none of all is near."""
    if not len(vertices):
        return np.full(mesh.n_faces, -1)
    reach = REACH * np.sqrt(surface_area(mesh) / n_patches)
    distances = geodesic_distances(mesh, vertices)
    labels = np.where(distances.min(axis=0) < reach, colors[distances.argmin(axis=0)], -1)
    return labels[mesh.faces[:, 0]]
