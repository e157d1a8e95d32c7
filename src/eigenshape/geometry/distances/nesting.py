"""Closed pieces of a surface that lie in each other, and which faces to turn so that solids face out."""

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arrays import ReadOnly, record
from eigenshape._corners import scaled_corners
from eigenshape._vectors import row_dots, size_one, triangle_areas
from eigenshape.geometry.distances.closest_loops import nearest_faces
from eigenshape.geometry.distances.crossing_loops import box_tree, curve_places, face_boxes
from eigenshape.geometry.distances.crossings import round_finely
from eigenshape.geometry.distances.nesting_loops import are_inside
from eigenshape.geometry.face_turns import FaceTurns, face_turns, turn_faces
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.topology import edge_table, submesh

# Signed volumes up to this share of area^1.5 are rounding, and do not tell which side is outside.
# A ball has 0.094.
NEGLIGIBLE_VOLUME = 1e-10
# A point nearer than this to a piece of size 1 may lie on it, up to rounding.
TOUCHING = 1e-9


@record
class Pieces(ReadOnly):
    """The pieces of a surface. They end at its boundary, and at edges with other pieces.

    Attributes
    ----------
    of_faces : (f,) int
        The piece of each face.
    closed : (p,) bool
        Whether each edge of the piece has two of its faces, and it has two sides.
    sides : (p,) int
        1 where a closed piece faces out of what it encloses, -1 where it faces in. 0 for others,
        and for those that enclose nothing.
    depths : (p,) int
        How many closed pieces lie around a closed piece.
    """

    of_faces: Int[np.ndarray, " f"]
    closed: Bool[np.ndarray, " p"]
    sides: Int[np.ndarray, " p"]
    depths: Int[np.ndarray, " p"]


def find_pieces(mesh: TriangleMesh, turns: FaceTurns) -> Pieces:
    """Find the pieces of a surface whose neighboring faces agree, and which lie in which."""
    _, of_faces = np.unique(turns.patches, return_inverse=True)
    table = edge_table(mesh)
    n_at_sides = table.n_faces[table.face_edges]
    # Where pieces touch along an edge, each has two faces of its own there.
    crowded = n_at_sides > 2
    own_edges = (of_faces[:, None] * len(table.edges) + table.face_edges)[crowded]
    _, place, count = np.unique(own_edges, return_inverse=True, return_counts=True)
    n_at_sides[crowded] = count[place]
    unfit = (n_at_sides != 2).any(axis=1) | ~turns.orientable
    closed = np.bincount(of_faces, weights=unfit) == 0
    sides, depths = np.zeros((2, len(closed)), dtype=np.int64)
    rows = np.argsort(of_faces, kind="stable")
    ordered = scaled_corners(mesh)[0][rows]
    starts = np.searchsorted(of_faces[rows], np.arange(len(closed)))
    faces = np.split(ordered, starts[1:])
    whole = np.flatnonzero(closed)
    low = np.minimum.reduceat(ordered.min(axis=1), starts)[whole]
    high = np.maximum.reduceat(ordered.max(axis=1), starts)[whole]
    sizes = (high - low).max(axis=1, keepdims=True)
    # A piece that touches another one from inside may stick out by rounding.
    low_around, high_around = low - TOUCHING * sizes, high + TOUCHING * sizes
    for number, piece in enumerate(whole):
        sides[piece] = _side(faces[piece])
        boxed = (low >= low_around[number]) & (high <= high_around[number])
        boxed[number] = False
        within = whole[boxed.all(axis=1)]
        if len(within):
            depths[within] += _lie_inside([faces[i] for i in within], faces[piece])
    return Pieces(of_faces, closed, sides, depths)


def faces_to_turn(
    mesh: TriangleMesh,
) -> tuple[Bool[np.ndarray, " f"], Bool[np.ndarray, " f"], Int[np.ndarray, " f"]]:
    """Find which faces to turn over so that neighbors agree and solids face outward.

    A closed piece inside an even number of others faces outward, by the sign of its volume. One
    inside an odd number of others is a cavity, and faces into it. An open piece whose faces agree
    is left as it is; any other open piece is turned as a whole by `orient_outward`.

    Returns
    -------
    turned : (f,) bool
        Whether to turn each face over.
    one_sided : (f,) bool
        Whether the piece of each face cannot be oriented, such as a Möbius strip. Such a piece is
        not turned.
    piece : (f,) int
        The piece of each face.
    """
    turns = face_turns(mesh)
    agreed = turn_faces(mesh, turns.turned)
    pieces = find_pieces(agreed, turns)
    over = pieces.sides * (-1) ** pieces.depths < 0
    disagreed = np.bincount(pieces.of_faces, weights=turns.turned) > 0
    for number in np.flatnonzero(disagreed & ~pieces.closed):
        part, _ = submesh(agreed, pieces.of_faces == number)
        over[number] = orient_outward(part) is not part
    return turns.turned ^ over[pieces.of_faces], ~turns.orientable, pieces.of_faces


def _side(corners: Float[np.ndarray, "f 3 3"]) -> int:
    """Return the sign of the volume in a closed piece, 0 where that is rounding."""
    # The piece gets size 1, so that the volume of a tiny one does not underflow.
    local, _ = size_one(corners - corners.mean(axis=(0, 1)))
    a, b, c = local.transpose(1, 0, 2)
    volume = float(row_dots(a, np.cross(b, c)).sum()) / 6
    area = float(triangle_areas(local).sum())
    return int(np.sign(volume)) if abs(volume) > NEGLIGIBLE_VOLUME * area**1.5 else 0


def _lie_inside(
    pieces: list[Float[np.ndarray, "_ 3 3"]], outer: Float[np.ndarray, "f 3 3"]
) -> Bool[np.ndarray, " c"]:
    """Tell which closed pieces lie inside another one, which they may touch but not cross.

    Of the middles of their faces, the one that is farthest from the other piece decides.
    """
    middle = outer.min(axis=(0, 1)) / 2 + outer.max(axis=(0, 1)) / 2
    outer, scale = size_one(outer - middle)
    boxes = face_boxes(outer.reshape(-1, 3))
    order = np.argsort(curve_places(boxes), kind="stable")
    outer, boxes = round_finely(outer[order]), boxes[order]
    tree = box_tree(boxes)
    deepest = np.zeros((len(pieces), 3))
    distances = np.zeros(len(pieces))
    for number, piece in enumerate(pieces):
        # The middle of one face is enough, unless it is near the other piece.
        for some in (piece[:1], piece):
            if distances[number] < TOUCHING:
                places = (some.mean(axis=1) - middle) / scale
                squares = nearest_faces(places, outer, *tree)[2]
                deepest[number] = places[squares.argmax()]
                distances[number] = np.sqrt(squares.max())
    points = np.concatenate([outer.reshape(-1, 3), round_finely(deepest)])
    return are_inside(points, boxes, *tree) & (distances > TOUCHING)
