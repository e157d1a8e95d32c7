"""A whole that many parts are matched to: what is computed once."""

from dataclasses import replace

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import record
from certeig.kit.text import html_repr
from certeig.kit.threads import map_in_threads, one_blas_thread
from eigenshape._corners import mean_normals
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.geodesic import unchecked_rows
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_describable, require_oriented
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import is_closed
from eigenshape.matching.pieces import Piece, longest_edge, report_left_out, split_pieces
from eigenshape.matching.spectral_refinement import Modes, lowest_modes
from eigenshape.matching.surface import (
    MATCHED_RADII,
    UNIT,
    Surface,
    View,
    describe_surface,
    whiten_discs,
)
from eigenshape.retrieval.patches.patches import describe_discs, whole_shares
from eigenshape.scans.partial import viewer

N_WHOLE = 500  # points of the whole; 1,000 take four times as long for the same error
# Pieces with less of the area of the whole are not matched: they have too few patches.
LEAST_AREA = 0.01
# Viewpoints around a whole. On 46 hard pairs of the tuning half, the five most similar points hold
# the right one for 0.37 of the points of scans without views, for 0.46 with six, 0.50 with 14.
N_VIEWS = 8


@record
class TargetPiece:
    """A connected piece of a whole, and what matching compares with it."""

    piece: Piece
    unit: float
    surface: Surface
    modes: Modes

    @property
    def area(self) -> float:
        """Area without noise."""
        return self.surface.area * self.unit**2


@record
class MatchTarget:
    """A whole, prepared so that many parts can be matched to it.

    Attributes
    ----------
    mesh : TriangleMesh
        The whole, as it was given.
    pieces : tuple
        What matching needs of each connected piece with 1 % of the area or more, the largest first.
    report : tuple of str
        Which loose pieces were left out.

    See Also
    --------
    prepare_target : Make one.

    Examples
    --------
    >>> import eigenshape as es
    >>> target = es.matching.prepare_target(es.make_creature("fish", n_vertices=500))
    >>> target.mesh.n_vertices
    500
    """

    mesh: TriangleMesh
    pieces: tuple[TargetPiece, ...]
    report: tuple[str, ...]

    _repr_html_ = html_repr

    @property
    def area(self) -> float:
        """Area of the pieces without noise."""
        return sum(piece.area for piece in self.pieces)

    def __repr__(self) -> str:
        return f"MatchTarget({self.mesh!r})"


@one_blas_thread()
def prepare_target(whole: MeshLike) -> MatchTarget:
    """Prepare a whole shape, once for all parts that are matched to it.

    It is turned outward and cleaned of noise, 500 points are described by patches, on the whole and
    on what eight viewpoints see of it, and distances from these to all vertices and 150
    eigenfunctions are computed: about 1 s for 5,000 vertices. A piece of more than 16,000 vertices, or with
    needles, is represented by a copy with fewer vertices and without needles, and a coarse one by a copy
    with shorter edges.

    Parameters
    ----------
    whole : MeshLike
        Closed or not. Each connected piece is prepared by itself; those with less than 1 % of the
        area are left out.

    Returns
    -------
    MatchTarget

    Raises
    ------
    InvalidShapeError
        If the mesh has a face without area or twice, a vertex without face, or neighboring faces that
        disagree in orientation.

    See Also
    --------
    match_shapes : Takes the target in place of the mesh.

    Examples
    --------
    >>> import eigenshape as es
    >>> whole = es.make_creature("fish", n_vertices=800)
    >>> target = es.matching.prepare_target(whole)
    >>> views = [es.partial_scan(whole, direction).mesh for direction in ([0, 0, 1], [1, 0, 0])]
    >>> matches = [es.match_shapes(view, target) for view in views]
    >>> [match.n_vertices == view.n_vertices for match, view in zip(matches, views)]
    [True, True]
    """
    mesh = as_mesh(whole, "whole")
    require_matchable(mesh)
    pieces = split_pieces(mesh, LEAST_AREA, longest_edge(mesh))
    prepared = []
    for piece in pieces:
        unit = UNIT * float(np.sqrt(piece.area))
        surface = describe_surface(piece.copy.clean, unit, N_WHOLE)
        surface = replace(surface, views=describe_views(surface.mesh, surface.points))
        prepared.append(TargetPiece(piece, unit, surface, lowest_modes(surface.mesh)))
    return MatchTarget(mesh, tuple(prepared), report_left_out(mesh, pieces, "whole"))


def describe_views(mesh: TriangleMesh, points: Int[np.ndarray, " m"]) -> tuple[View, ...]:
    """Describe those of some vertices that each viewpoint sees, by discs that end where the view ends.

    An open mesh has no views.
    """
    if not is_closed(mesh):
        return ()
    see = viewer(mesh)

    def describe_view(number: int) -> View:
        view = see(number)
        piece, sources = view.mesh, view.source_vertices
        seen = np.flatnonzero(np.isin(points, sources))
        chosen = np.searchsorted(sources, points[seen])  # sources ascend
        rows = unchecked_rows(piece)(chosen, np.arange(1, len(chosen) + 1), MATCHED_RADII[-1])
        normals, areas = mean_normals(piece), dual_volumes(piece)
        numbers = describe_discs(piece, chosen, rows, MATCHED_RADII, normals, areas)
        weights = whole_shares(piece, rows, MATCHED_RADII).astype(np.float32)
        return View(seen, whiten_discs(numbers), weights)

    views = map_in_threads(describe_view, list(range(N_VIEWS)))
    return tuple(view for view in views if len(view.points))


def require_matchable(mesh: TriangleMesh) -> None:
    """Raise an error if a mesh cannot be described by patches."""
    require_describable(mesh)
    require_oriented(mesh)
