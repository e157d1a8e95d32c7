"""Meshing of the zero set of a smooth function, as a closed surface of even triangles."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import TINY
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import row_dots, sum_rows
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import is_closed, is_manifold, vertex_components
from eigenshape.operators.graph import edge_graph

Points = Float[np.ndarray, "p 3"]
Field = Callable[[Points], Float[np.ndarray, " p"]]

# The quads are split into triangles N_STAGES times anew, with N_ROUNDS of smoothing along the
# surface before each. More of either makes triangles a little more even and takes longer.
N_STAGES = 3
N_ROUNDS = 5
SMOOTHING_STEP = 0.6  # share of the way to the mean of its neighbors that a vertex moves in a round
# Lattice points along a block. If the surface is far from a block, the field is evaluated at its
# middle only.
BLOCK = 3
STEEPEST_FIELD = 1.3  # largest slope of a field that is approximately a distance
POINTS_AT_ONCE = 1 << 16  # points at which a field is evaluated at a time, to bound memory
CLOSE_ENOUGH = 0.04  # relative error of the number of vertices that `find_spacing` accepts
# Offsets of the grid relative to the surface, in cells: a sequence without symmetric positions.
# Sheets that meet in one cell of a grid are apart in another grid.
OFFSETS = np.array([[0.5, 0.5, 0.5]]) + np.arange(12)[:, None] * np.array(
    [[0.7548777, 0.5698403, 0.3247180]]
)


def isosurface(
    field: Field, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"], spacing: float
) -> TriangleMesh:
    """Mesh the zero set of a field that is approximately a signed distance, negative inside.

    Surface nets (Gibson 1998) with one vertex for each sheet of the surface in a cell (Nielson
    2004) are projected onto the zero set and smoothed along it. Neighboring cells can still join
    sheets that are apart. So the result is checked, and if it is not a manifold, another offset of
    the grid is tried.

    Raise InvalidShapeError if no offset of the grid gives a closed connected manifold, because the
    surface has details finer than the grid.
    """
    for offset in OFFSETS % 1:
        points, quads = _nets(field, low - spacing * (1 + offset), high + 2 * spacing, spacing)
        if _is_sound(TriangleMesh(points, _split(points, quads))):
            points = _project(field, points, spacing)[0]
            for _ in range(N_STAGES):
                points = relax(field, TriangleMesh(points, _split(points, quads)), spacing).vertices
            mesh = TriangleMesh(points, _split(points, quads))
            if _is_sound(mesh):
                return mesh
    raise InvalidShapeError(
        "A surface must be smooth at the spacing of the grid; "
        f"at spacing {spacing:.3g} it is not. Use a smaller spacing."
    )


def find_spacing(
    field: Field, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"], n_vertices: int
) -> float:
    """Find the spacing at which surface nets have about `n_vertices` vertices."""
    spacing = float((high - low).max()) / 30
    # The number of vertices is proportional to 1 / spacing², so a few steps are enough.
    for _ in range(4):
        ratio = len(_nets(field, low - 1.5 * spacing, high + 2 * spacing, spacing)[0]) / n_vertices
        if abs(ratio - 1) < CLOSE_ENOUGH:
            break
        spacing *= float(np.sqrt(ratio))
    return spacing


def _is_sound(mesh: TriangleMesh) -> bool:
    return is_closed(mesh) and is_manifold(mesh) and vertex_components(mesh)[0] == 1


def _nets(
    field: Field, low: Float[np.ndarray, "3"], high: Float[np.ndarray, "3"], spacing: float
) -> tuple[Points, Int[np.ndarray, "q 4"]]:
    # Evaluate the field at the points of a lattice near its surface. In a block far from the surface
    # all points get the value at the middle of the block.
    blocks = tuple(-(-np.ceil((high - low) / spacing).astype(int) // BLOCK))
    middles = BLOCK * np.indices(blocks).reshape(3, -1).T + (BLOCK - 1) / 2
    values = _in_chunks(field, low + spacing * middles).reshape(blocks)
    near = np.abs(values) < STEEPEST_FIELD * spacing * np.sqrt(3) * (BLOCK + 1) / 2
    for axis in range(3):
        values, near = values.repeat(BLOCK, axis), near.repeat(BLOCK, axis)
    values[near] = _in_chunks(field, low + spacing * np.argwhere(near))
    # The surface crosses the cells with corners inside and outside. Count the inside corners of
    # pairs, then squares, then cubes of lattice points.
    counts = (values < 0).astype(np.int8)
    for axis in range(3):
        here, there = (counts.take(np.arange(s, counts.shape[axis] - 1 + s), axis) for s in (0, 1))
        counts = here + there
    cells = np.argwhere((counts > 0) & (counts < 8))
    corners = np.stack([values[tuple((cells + corner).T)] for corner in CORNERS], axis=1)
    number, points = _sheet_points(cells, corners)
    cell_number = np.full(np.array(values.shape) - 1, -1, dtype=np.int64)
    cell_number[tuple(cells.T)] = np.arange(len(cells))
    quads = np.concatenate([_quads(values, cell_number, number, axis) for axis in range(3)])
    return low + spacing * points, quads


def _in_chunks(field: Field, points: Points) -> Float[np.ndarray, " p"]:
    return np.concatenate(
        [
            field(points[start : start + POINTS_AT_ONCE])
            for start in range(0, len(points), POINTS_AT_ONCE)
        ]
    )


def _edge(axis: int, corner: tuple[int, ...]) -> int:
    """Return the number of the edge of a cell that runs along an axis from a corner: 0 to 11."""
    one, two = (corner[other] for other in range(3) if other != axis)
    return 4 * axis + 2 * one + two


def _face(normal: int, side: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the edges around a face of a cell, and the corners at which each of them begins."""
    p, q = (axis for axis in range(3) if axis != normal)

    def at(on_p: int, on_q: int) -> tuple[int, ...]:
        place = {normal: side, p: on_p, q: on_q}
        return tuple(place[axis] for axis in range(3))

    edges = (_edge(p, at(0, 0)), _edge(q, at(1, 0)), _edge(p, at(0, 1)), _edge(q, at(0, 0)))
    corners = (at(0, 0), at(1, 0), at(1, 1), at(0, 1))
    return edges, tuple(4 * x + 2 * y + z for x, y, z in corners)


UNIT_VECTORS = np.eye(3, dtype=np.int64)
# The corners, edges (directions and starts) and faces (edges and corners) of a cell, in the order of
# their numbers.
CORNERS = np.array(list(np.ndindex(2, 2, 2)))
DIRECTIONS = UNIT_VECTORS.repeat(4, axis=0)
STARTS = np.array([np.insert(shift, axis, 0) for axis in range(3) for shift in np.ndindex(2, 2)])
FACES = [_face(normal, side) for normal in range(3) for side in (0, 1)]


def _sheet_points(
    cells: Int[np.ndarray, "c 3"], corners: Float[np.ndarray, "c 8"]
) -> tuple[Int[np.ndarray, "c 12"], Points]:
    """Place a point on each sheet of the surface in each cell.

    The point is the mean of the crossings of the sheet with the edges of the cell. Returns the
    point of each edge of each cell, -1 where the surface does not cross the edge, and the points.
    """
    # Corner (x, y, z) has number 4x + 2y + z.
    here, there = (corners[:, ends @ [4, 2, 1]] for ends in (STARTS, STARTS + DIRECTIONS))
    crosses = (here < 0) != (there < 0)
    share = np.where(crosses, here / np.where(crosses, here - there, 1.0), 0.0)
    places = STARTS + share[..., None] * DIRECTIONS + cells[:, None, :]
    # Label the crossings of each cell by the sheet on which they lie (Nielson 2004). A sheet connects
    # two crossings of a face of the cell. If all four edges of a face are crossed, it connects the two
    # crossings next to a corner that is inside.
    sheet = np.broadcast_to(np.arange(12), crosses.shape).copy()
    # A sheet has at most 12 crossings, and labels travel around it in both directions.
    for _ in range(6):
        for edges, ends in FACES:
            plain = crosses[:, edges].sum(axis=1) == 2
            for one in range(4):
                for two in range(one):
                    around = ends[one] if one - two == 1 else ends[0]
                    joined = plain | (corners[:, around] < 0 if one - two != 2 else False)
                    linked = joined & crosses[:, edges[one]] & crosses[:, edges[two]]
                    least = np.minimum(sheet[:, edges[one]], sheet[:, edges[two]])
                    sheet[linked, edges[one]] = sheet[linked, edges[two]] = least[linked]
    sheets = 12 * np.arange(len(cells))[:, None] + sheet
    _, number = np.unique(sheets[crosses], return_inverse=True)
    points = sum_rows(number, places[crosses]) / np.bincount(number)[:, None]
    of_edge = np.full(crosses.shape, -1, dtype=np.int64)
    of_edge[crosses] = number
    return of_edge, points


def _quads(
    values: Float[np.ndarray, "x y z"],
    cell_number: Int[np.ndarray, "a b c"],
    number: Int[np.ndarray, "k 12"],
    axis: int,
) -> Int[np.ndarray, "q 4"]:
    """Make a quad around each lattice edge along `axis` that the surface crosses.

    Its corners are the points of the four cells at the edge.
    """
    n = values.shape[axis]
    here, there = values.take(np.arange(n - 1), axis), values.take(np.arange(1, n), axis)
    edges = np.argwhere((here < 0) != (there < 0))
    leaves = here[tuple(edges.T)] < 0
    one, two = UNIT_VECTORS[[(axis + 1) % 3, (axis + 2) % 3]]
    back = (one + two, two, 0 * one, one)
    quads = np.column_stack(
        [
            number[cell_number[tuple((edges - step).T)], _edge(axis, tuple(step.tolist()))]
            for step in back
        ]
    )
    return np.where(leaves[:, None], quads, quads[:, ::-1])


def _split(points: Points, quads: Int[np.ndarray, "q 4"]) -> Int[np.ndarray, "f 3"]:
    """Split each quad along the diagonal with the smaller opposite angles (Delaunay)."""
    a, b, c, d = points[quads].transpose(1, 0, 2)
    other_diagonal = _cotangent(b, a, c) + _cotangent(d, a, c) < 0
    quads = np.where(other_diagonal[:, None], np.roll(quads, -1, axis=1), quads)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _cotangent(
    apex: Float[np.ndarray, "q 3"], one: Float[np.ndarray, "q 3"], two: Float[np.ndarray, "q 3"]
) -> Float[np.ndarray, " q"]:
    one, two = one - apex, two - apex
    twice_area = np.linalg.norm(np.cross(one, two), axis=1)
    return row_dots(one, two) / np.maximum(twice_area, TINY)


def relax(field: Field, mesh: TriangleMesh, spacing: float) -> TriangleMesh:
    """Move vertices along the surface towards the mean of their neighbors."""
    links = edge_graph(mesh)
    degree = links.sum(axis=1)[:, None]
    points, normals = _project(field, mesh.vertices, spacing)
    for _ in range(N_ROUNDS):
        pull = links @ points / degree - points
        pull -= row_dots(pull, normals)[:, None] * normals
        points, normals = _project(field, points + SMOOTHING_STEP * pull, spacing)
    return TriangleMesh(points, mesh.faces)


def _project(field: Field, points: Points, spacing: float) -> tuple[Points, Points]:
    """Move points towards the zero set by one Newton step; return the points and the normals.

    A step is at most half a cell long.
    """
    width = 1e-3 * spacing
    values = field(points)
    slopes = np.column_stack(
        [(field(points + move) - values) / width for move in width * np.eye(3)]
    )
    slope = np.linalg.norm(slopes, axis=1, keepdims=True)
    step = np.clip(values[:, None] / slope, -0.5 * spacing, 0.5 * spacing)
    return points - step * slopes / slope, slopes / slope
