"""Synthetic surfaces whose spectra are known."""

from itertools import combinations

import numpy as np
from jaxtyping import Int

from certeig.kit.arrays import positive_values, whole_number
from eigenshape._vectors import unit_vectors
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import subdivide


def icosphere(level: int = 3) -> TriangleMesh:
    """Make a triangle mesh of the unit sphere by subdividing an icosahedron.

    Parameters
    ----------
    level : int
        Number of subdivisions, 0 to 9. The mesh has 10·4^level + 2 vertices.

    Returns
    -------
    TriangleMesh
        Closed, facing outward, with vertices on the unit sphere.

    Raises
    ------
    InvalidParameterError
        If `level` is out of range.

    See Also
    --------
    sphere_eigenvalues : The exact eigenvalues of the sphere.
    fibonacci_sphere : A sphere with any number of vertices.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.icosphere(3)
    TriangleMesh(642 vertices, 1280 faces)
    """
    whole_number(level, "level", 0, 9)
    mesh = _icosahedron()
    for _ in range(level):
        mesh = subdivide(mesh)
        mesh = TriangleMesh(unit_vectors(mesh.vertices), mesh.faces)
    return mesh


def _icosahedron() -> TriangleMesh:
    golden = (1 + 5**0.5) / 2
    signs = np.array([(a, b * golden) for a in (-1, 1) for b in (-1, 1)])
    points = np.concatenate(
        [np.roll(np.insert(signs, 0, 0.0, axis=1), turn, axis=1) for turn in range(3)]
    )
    points = points / np.linalg.norm(points[0])
    # The faces are the triangles of points that are nearest neighbors of each other.
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = (distance < 1.01 * distance[distance > 0].min()) & (distance > 0)
    triples = np.array(list(combinations(range(len(points)), 3)))
    a, b, c = triples.T
    faces = triples[near[a, b] & near[b, c] & near[a, c]]
    inward = np.linalg.det(points[faces]) < 0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    return TriangleMesh(points, faces)


def torus(
    n_around: int = 48, n_across: int = 24, *, outer: float = 1.0, inner: float = 0.4
) -> TriangleMesh:
    """Make a triangle mesh of a torus around the z axis, on a regular grid of its two angles.

    Parameters
    ----------
    n_around, n_across : int
        Number of vertices around the axis and across the tube, at least 3 each.
    outer, inner : float
        Radius of the circle in the middle of the tube, and radius of the tube, in length.

    Returns
    -------
    TriangleMesh
        n_around · n_across vertices; closed and facing outward.

    Raises
    ------
    InvalidParameterError
        If a number is out of range or a radius is not positive.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.torus(12, 6)
    TriangleMesh(72 vertices, 144 faces)
    """
    whole_number(n_around, "n_around", 3, 10**6)
    whole_number(n_across, "n_across", 3, 10**6)
    positive_values([outer, inner], "outer and inner")
    u = 2 * np.pi * np.arange(n_around)[:, None] / n_around
    v = 2 * np.pi * np.arange(n_across)[None, :] / n_across
    rim = outer + inner * np.cos(v)
    points = np.stack(
        [rim * np.cos(u), rim * np.sin(u), np.broadcast_to(inner * np.sin(v), (n_around, n_across))]
    )
    i, j = (index.ravel() for index in np.indices((n_around, n_across)))
    after, beside = (i + 1) % n_around * n_across, (j + 1) % n_across
    faces = _halve_cells(i * n_across + j, i * n_across + beside, after + j, after + beside)
    return TriangleMesh(points.reshape(3, -1).T, faces)


def _halve_cells(
    here: np.ndarray, right: np.ndarray, below: np.ndarray, across: np.ndarray
) -> Int[np.ndarray, "f 3"]:
    """Return the two triangles of each cell, given its four corners."""
    return np.concatenate(
        [np.column_stack([here, below, across]), np.column_stack([here, across, right])]
    )


def grid(n_x: int = 20, n_y: int = 20, *, width: float = 1.0, height: float = 1.0) -> TriangleMesh:
    """Make a triangle mesh of a flat rectangle, of n_x by n_y cells with two triangles each.

    Parameters
    ----------
    n_x, n_y : int
        Number of cells along x and y, at least 1 each.
    width, height : float
        Length of the sides along x and y.

    Returns
    -------
    TriangleMesh
        (n_x + 1)·(n_y + 1) vertices in the plane z = 0; vertex i·(n_y + 1) + j is the i-th along x
        and the j-th along y.

    Raises
    ------
    InvalidParameterError
        If a number is out of range or a side is not positive.

    See Also
    --------
    box_eigenvalues : The exact eigenvalues, with sides (width, height).
    irregular_grid : A square with randomly moved vertices.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.shapes.grid(4, 2)
    TriangleMesh(15 vertices, 16 faces)
    """
    n_x, n_y = whole_number(n_x, "n_x", 1, 10**6), whole_number(n_y, "n_y", 1, 10**6)
    positive_values([width, height], "width and height")
    x, y = np.meshgrid(
        np.linspace(0, width, n_x + 1), np.linspace(0, height, n_y + 1), indexing="ij"
    )
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    i, j = (index.ravel() for index in np.indices((n_x, n_y)))
    here = i * (n_y + 1) + j
    return TriangleMesh(points, _halve_cells(here, here + 1, here + n_y + 1, here + n_y + 2))
