"""Level sets of piecewise linear functions: polylines on surfaces, triangles in solids."""

import numpy as np
from jaxtyping import Float, Int

from certeig.kit.arrays import ReadOnly, finite_number, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import point_functions, vertex_values
from eigenshape._corners import cut_tetrahedra, in_length, volumes
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import area_vectors, row_dots, size_one
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.mesh import TriangleMesh


@record
class LevelSet(ReadOnly):
    """The points where a piecewise linear function has a value, as segments or triangles.

    Attributes
    ----------
    level : float
    points : (p, d) float
        Where the level set crosses the edges of the mesh, one point per crossed edge.
    pieces : (q, m) int
        Points of each piece: segments on a surface, triangles in a solid. On a consistently
        oriented surface larger values are on the left of segments; in a solid they are on the outer
        side of triangles, from which their corners are seen counter-clockwise.
    edges : (p, 2) int
        The two mesh vertices of the edge of each point.
    shares : (p,) float
        How far the point is along its edge, in 0..1.

    See Also
    --------
    es.calculus.level_set : Makes it.

    Examples
    --------
    The equator of a sphere, and a function along it:

    >>> import eigenshape as es
    >>> x, y, z = es.icosphere(4).vertices.T
    >>> equator = es.calculus.level_set(es.icosphere(4), z, 0.1)
    >>> bool(abs(equator.points[:, 2] - 0.1).max() < 1e-12)
    True
    >>> along = equator.interpolate(x)
    >>> round(float(along.min()), 2), round(float(along.max()), 2)
    (-0.99, 0.99)
    >>> [len(line) > 100 for line in equator.polylines()]  # one closed curve
    [True]
    """

    level: float
    points: Float[np.ndarray, "p d"]
    pieces: Int[np.ndarray, "q m"]
    edges: Int[np.ndarray, "p 2"]
    shares: Float[np.ndarray, " p"]

    @property
    def size(self) -> float:
        """Length on a surface, area in a solid; in length^(m-1)."""
        if not len(self.pieces):
            return 0.0
        corners, scale = size_one(self.points[self.pieces])
        return float(in_length(volumes(corners), scale, self.pieces.shape[1] - 1).sum())

    def interpolate(self, values: ArrayLike) -> Float[np.ndarray, "p ..."]:
        """Interpolate a function on the mesh at the points of the level set.

        Parameters
        ----------
        values : (n,) or (n, k) float
            At the vertices of the mesh.

        Returns
        -------
        (p,) or (p, k) float

        Raises
        ------
        InvalidParameterError
            If a crossed edge has a vertex that `values` does not have, or a value is not finite.
        """
        functions = point_functions(values, "values", len(np.atleast_1d(np.asarray(values))))
        largest = int(self.edges.max(initial=-1))
        if len(functions) <= largest:
            raise InvalidParameterError(
                "values must have one row per vertex of the mesh; the level set crosses an edge of "
                f"vertex {largest}, and there are {len(functions)} rows."
            )
        one, two = functions[self.edges[:, 0]], functions[self.edges[:, 1]]
        shares = self.shares.reshape(-1, *[1] * (functions.ndim - 1))
        return (1 - shares) * one + shares * two

    def polylines(self) -> list[Float[np.ndarray, "k d"]]:
        """Chain the segments of a level set on a surface.

        Returns
        -------
        list of (k, d) float
            Points along each line, longest list first. A closed line ends with its first point.
            Lines end at the boundary, and where more than two faces meet.

        Raises
        ------
        InvalidShapeError
            If the level set is one in a solid.
        """
        if self.pieces.shape[1] != 2:
            raise InvalidShapeError(
                "Only level sets on surfaces are lines; this one has "
                f"{len(self.pieces)} triangles. Use surface()."
            )
        # Follow segments from point to point; lines from their ends first, then closed ones.
        links: dict[int, list[int]] = {}
        for number, (start, stop) in enumerate(self.pieces.tolist()):
            links.setdefault(start, []).append(number)
            links.setdefault(stop, []).append(number)
        ends = {point for point, numbers in links.items() if len(numbers) != 2}
        unused = np.ones(len(self.pieces), dtype=bool)
        # Segments that leave an end come first, then those that arrive at one, then all others.
        leaving = [row for row, (start, _) in enumerate(self.pieces.tolist()) if start in ends]
        arriving = [row for row, (_, stop) in enumerate(self.pieces.tolist()) if stop in ends]
        lines = []
        for number in [*leaving, *arriving, *range(len(self.pieces))]:
            if not unused[number]:
                continue
            line = self.pieces[number].tolist()
            if line[1] in ends and line[0] not in ends:
                line.reverse()
            unused[number] = False
            while line[-1] not in ends and line[-1] != line[0]:
                following = next(each for each in links[line[-1]] if unused[each])
                unused[following] = False
                start, stop = self.pieces[following].tolist()
                line.append(stop if start == line[-1] else start)
            lines.append(np.array(line, dtype=np.int64))
        lines.sort(key=lambda line: (-len(line), int(line[0])))
        return [self.points[line] for line in lines]

    def surface(self) -> TriangleMesh:
        """Return a level set in a solid in R³ as a triangle mesh.

        Returns
        -------
        TriangleMesh
            With faces of zero area where the level set passes through a vertex of the solid;
            `repair(mesh, ["drop_degenerate"])` removes them.

        Raises
        ------
        InvalidShapeError
            If the level set is one on a surface, or empty.
        """
        if self.pieces.shape[1] != 3:
            raise InvalidShapeError(
                "Only level sets in solids are surfaces; this one has "
                f"{len(self.pieces)} segments. Use polylines()."
            )
        return TriangleMesh(self.points, self.pieces)


def level_set(mesh: MeshLike, values: ArrayLike, level: float) -> LevelSet:
    """Find where a piecewise linear function has a given value, on triangles or tetrahedra.

    A vertex exactly at the level counts as above it. So every triangle is crossed at two edges or
    at none, lines on a manifold never branch, and the length is right: where the level set runs
    along mesh edges it is found once.

    Parameters
    ----------
    mesh : MeshLike
        Triangles or tetrahedra, in R^d.
    values : (n,) float
        At the vertices.
    level : float

    Returns
    -------
    LevelSet
        Empty if no edge crosses the level.

    Raises
    ------
    InvalidParameterError
        If `values` does not have one number per vertex, or a number is not finite.
    InvalidShapeError
        If the mesh consists neither of triangles nor of tetrahedra.

    Examples
    --------
    The circle of height 0.5 on a sphere has length 2π √0.75 = 5.441.

    >>> import eigenshape as es
    >>> ball = es.icosphere(4)
    >>> circle = es.calculus.level_set(ball, ball.vertices[:, 2], 0.5)
    >>> round(circle.size, 2)
    5.44
    >>> len(circle.polylines())
    1
    """
    mesh = as_simplicial(mesh)
    if mesh.dim not in (2, 3):
        raise InvalidShapeError(
            f"Level sets are found on triangles and tetrahedra; the mesh is a {mesh!r}."
        )
    heights = vertex_values(values, "values", mesh.n_points)
    wanted = finite_number(level, "level")
    above = heights >= wanted
    crossed = np.flatnonzero(above[mesh.simplices].any(axis=1) & ~above[mesh.simplices].all(axis=1))
    corners = mesh.simplices[crossed]
    inside = above[corners]
    # (q, m, 2): the crossed edge of each corner of each piece.
    if mesh.dim == 2:
        # From the lone corner to the two others, with larger values left of the segment.
        is_above = inside.sum(axis=1, keepdims=True) == 1
        lone = np.argmax(inside == is_above, axis=1)
        rows = np.arange(len(corners))
        tip, following, before = (corners[rows, (lone + turn) % 3] for turn in range(3))
        first, second = np.stack([tip, following], axis=1), np.stack([tip, before], axis=1)
        ends = np.stack([first, second], axis=1)
        ends = np.where(is_above[:, None], ends, ends[:, ::-1])
    else:
        ends = cut_tetrahedra(corners, inside)

    # Points are numbered by their edges, the lower vertex first, so that neighbors share them.
    ends = np.sort(ends, axis=2)
    keys, pieces = np.unique(ends[..., 0] * mesh.n_points + ends[..., 1], return_inverse=True)
    edges = np.stack([keys // mesh.n_points, keys % mesh.n_points], axis=1)
    pieces = pieces.reshape(ends.shape[:2])
    # Halves first: the difference of two large values may overflow.
    low, high = heights[edges[:, 0]] / 2, heights[edges[:, 1]] / 2
    shares = np.clip((wanted / 2 - low) / (high - low), 0.0, 1.0)
    one, two = mesh.points[edges[:, 0]], mesh.points[edges[:, 1]]
    points = (1 - shares)[:, None] * one + shares[:, None] * two
    if mesh.dim == 3 and mesh.points.shape[1] == 3:
        # Values grow along the normals: the upper end of the first corner's edge is ahead.
        normals = area_vectors(size_one(points)[0][pieces])
        one, two = edges[pieces[:, 0]].T
        is_upper = heights[one] > heights[two]
        upper, lower = np.where(is_upper, one, two), np.where(is_upper, two, one)
        place, _ = size_one(mesh.points)
        wrong = row_dots(normals, place[upper] - place[lower]) < 0
        pieces = np.where(wrong[:, None], pieces[:, ::-1], pieces)
    return LevelSet(wanted, points, pieces, edges, shares)
