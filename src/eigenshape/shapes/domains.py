"""Synthetic domains of dimension 1 to 3 whose spectra are known (`shapes.exact`)."""

from collections.abc import Sequence
from itertools import permutations

import numpy as np
from scipy.spatial import Delaunay

from certeig.kit.arguments import require_type
from certeig.kit.arrays import positive_values, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh

MOST_SEGMENTS = 10**6  # of an interval or circle: more than any solve in this library can use


def interval(n: Integer = 50, length: float = 1.0) -> SimplicialMesh:
    """Make a mesh of an interval, of n equal segments.

    Parameters
    ----------
    n : int
        Number of segments, 1 to 10⁶.
    length : float
        Length of the interval.

    Returns
    -------
    SimplicialMesh
        Of dimension 1 in R¹, from 0 to `length`.

    Raises
    ------
    InvalidParameterError
        If `n` is out of range or `length` is not positive.

    See Also
    --------
    box_eigenvalues : The exact eigenvalues, with sides [length].

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.interval(4).points.ravel().tolist()
    [0.0, 0.25, 0.5, 0.75, 1.0]
    """
    count = whole_number(n, "n", 1, MOST_SEGMENTS)
    positive_values(length, "length")
    steps = np.arange(count)
    return SimplicialMesh(
        np.linspace(0, length, count + 1)[:, None], np.column_stack([steps, steps + 1])
    )


def circle(n: Integer = 50, radius: float = 1.0) -> SimplicialMesh:
    """Make a mesh of a circle: a regular polygon of n segments with its points on the circle.

    Parameters
    ----------
    n : int
        Number of segments, 3 to 10⁶.
    radius : float
        Radius of the circle, in length.

    Returns
    -------
    SimplicialMesh
        Of dimension 1 in R².

    Raises
    ------
    InvalidParameterError
        If `n` is out of range or `radius` is not positive.

    See Also
    --------
    sphere_eigenvalues : The exact eigenvalues, with ``dim=1``, divided by radius².

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.circle(12)
    SimplicialMesh(12 points in R^2, 12 simplices of dimension 1)
    """
    count = whole_number(n, "n", 3, MOST_SEGMENTS)
    positive_values(radius, "radius")
    steps = np.arange(count)
    angles = 2 * np.pi * steps / count
    points = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return SimplicialMesh(points, np.column_stack([steps, (steps + 1) % count]))


def disc(n_rings: Integer = 10, radius: float = 1.0) -> TriangleMesh:
    """Make a triangle mesh of a flat disc, with 6j vertices on ring j.

    Parameters
    ----------
    n_rings : int
        Number of rings around the center, 1 to 1000.
    radius : float
        Radius of the disc, in length.

    Returns
    -------
    TriangleMesh
        In the plane z = 0, facing +z.

    Raises
    ------
    InvalidParameterError
        If `n_rings` is out of range or `radius` is not positive.

    See Also
    --------
    disc_eigenvalues : The exact eigenvalues, divided by radius².

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.disc(3)
    TriangleMesh(37 vertices, 54 faces)
    """
    count = whole_number(n_rings, "n_rings", 1, 1000)
    positive_values(radius, "radius")
    rings, faces = [np.zeros((1, 2))], []
    for j in range(1, count + 1):
        angles = 2 * np.pi * np.arange(6 * j) / (6 * j)
        rings.append(j / count * radius * np.column_stack([np.cos(angles), np.sin(angles)]))
        # Between ring j - 1 and ring j, each sixth has j triangles that point inward and j - 1 that
        # point outward.
        inner, outer = 1 + 3 * (j - 2) * (j - 1) if j > 1 else 0, 1 + 3 * (j - 1) * j
        sector, step = (index.ravel() for index in np.indices((6, j)))
        out = outer + sector * j + step
        out_next = outer + (sector * j + step + 1) % (6 * j)
        n_inner = max(6 * (j - 1), 1)
        below = inner + (sector * (j - 1) + step) % n_inner
        below_next = inner + (sector * (j - 1) + step + 1) % n_inner
        faces.append(np.column_stack([out, out_next, below]))
        faces.append(np.column_stack([out_next, below_next, below])[step < j - 1])
    flat = np.concatenate(rings)
    return TriangleMesh(np.pad(flat, ((0, 0), (0, 1))), np.concatenate(faces))


def irregular_grid(
    n_x: Integer = 20,
    n_y: Integer = 20,
    *,
    jitter: float = 0.3,
    rng: np.random.Generator,
) -> TriangleMesh:
    """Make a triangle mesh of the unit square with randomly moved inner vertices.

    Parameters
    ----------
    n_x, n_y : int
        Number of cells of the grid along x and y, 1 to 2000 each.
    jitter : float
        Largest move of an inner vertex along x and y, in cells, at least 0 and less than 0.5.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    TriangleMesh
        Delaunay triangles in the plane z = 0, facing +z.

    Raises
    ------
    InvalidParameterError
        If a number is out of range.

    See Also
    --------
    grid : A regular grid.
    box_eigenvalues : The exact eigenvalues.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> es.shapes.irregular_grid(4, 4, rng=np.random.default_rng(0))
    TriangleMesh(25 vertices, 32 faces)
    """
    require_type(rng, np.random.Generator, "rng")
    counts = whole_number(n_x, "n_x", 1, 2000), whole_number(n_y, "n_y", 1, 2000)
    if not 0 <= jitter < 0.5:
        raise InvalidParameterError(f"jitter must be at least 0 and less than 0.5; it is {jitter}.")
    x, y = np.meshgrid(*(np.linspace(0, 1, count + 1) for count in counts), indexing="ij")
    flat = np.column_stack([x.ravel(), y.ravel()])
    inside = ((flat > 0) & (flat < 1)).all(axis=1)
    flat[inside] += rng.uniform(-jitter, jitter, (int(inside.sum()), 2)) / counts
    corners = Delaunay(flat).simplices
    sides = flat[corners[:, 1:]] - flat[corners[:, :1]]
    doubled = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    # Points on one side of the square make triangles without area.
    sound = np.abs(doubled) > 1e-12 / (counts[0] * counts[1])
    corners[doubled < 0] = corners[doubled < 0][:, ::-1]
    return TriangleMesh(np.pad(flat, ((0, 0), (0, 1))), corners[sound])


def box(
    n_x: Integer = 6,
    n_y: Integer = 6,
    n_z: Integer = 6,
    *,
    sides: Sequence[float] = (1.0, 1.0, 1.0),
) -> SimplicialMesh:
    """Make a mesh of tetrahedra of a box, of six tetrahedra per cell.

    Parameters
    ----------
    n_x, n_y, n_z : int
        Number of cells along each axis, 1 to 500.
    sides : sequence of 3 float
        Lengths of the sides along each axis.

    Returns
    -------
    SimplicialMesh
        Of dimension 3 in R³, with one corner at the origin.

    Raises
    ------
    InvalidParameterError
        If a number is out of range, or `sides` are not three positive lengths.

    See Also
    --------
    box_eigenvalues : The exact eigenvalues.
    boundary_surface : The surface of the box.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.box(2, 2, 2)
    SimplicialMesh(27 points in R^3, 48 simplices of dimension 3)
    """
    counts = tuple(
        whole_number(n, name, 1, 500) for n, name in ((n_x, "n_x"), (n_y, "n_y"), (n_z, "n_z"))
    )
    lengths = positive_values(list(sides), "sides")
    if len(lengths) != 3:
        raise InvalidParameterError(f"sides must be three lengths; there are {len(lengths)}.")
    points = np.stack(
        np.meshgrid(*(np.arange(count + 1) for count in counts), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    return SimplicialMesh(points / np.array(counts) * lengths, _kuhn(counts))


def _kuhn(counts: tuple[int, ...], turned: int = 0) -> np.ndarray:
    """Split each cell into six tetrahedra along a main diagonal (Kuhn's subdivision).

    Along each axis the diagonal points forward, but backward in the first `turned` layers.
    Neighbors match nevertheless: the cut of the square between two cells depends only on the other
    two axes, along which both cells are in the same layer.
    """
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    cells = np.moveaxis(np.indices(counts), 0, -1).reshape(-1, 3)
    steps = np.where(cells < turned, -strides, strides)
    starts = cells @ strides + np.maximum(-steps, 0).sum(axis=1)
    walks = [
        np.cumsum(np.column_stack([starts, steps[:, order]]), axis=1)
        for order in permutations(range(3))
    ]
    return np.concatenate(walks)


def ball(n: Integer = 8) -> SimplicialMesh:
    """Make a mesh of tetrahedra of the unit ball.

    Parameters
    ----------
    n : int
        Number of cells along each axis, 2 to 200.

    Returns
    -------
    SimplicialMesh
        Of dimension 3 in R³, with its boundary points on the unit sphere.

    Raises
    ------
    InvalidParameterError
        If `n` is out of range.

    See Also
    --------
    ball_eigenvalues : The exact eigenvalues.

    Notes
    -----
    A grid of n³ cubes is scaled along its rays to the ball. Each cube is split along the diagonal
    that points outward, so that no tetrahedron has two facets on the boundary: at the edges of the
    cube, which become smooth, such a tetrahedron would be flat.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.ball(2)
    SimplicialMesh(27 points in R^3, 48 simplices of dimension 3)
    """
    count = whole_number(n, "n", 2, 200)
    cube = box(count, count, count)
    points = 2 * cube.points - 1
    largest = np.abs(points).max(axis=1, keepdims=True)
    length = np.linalg.norm(points, axis=1, keepdims=True)
    factor = np.divide(largest, length, out=np.ones_like(length), where=length > 0)
    return SimplicialMesh(points * factor, _kuhn((count,) * 3, turned=count // 2))
