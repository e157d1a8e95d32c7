"""Shapes to bend: a tube with open ends, a closed lump without symmetries, and their rigs."""

from functools import lru_cache

import numpy as np

from eigenshape.deformation.rig import rig_shape
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.surfaces import icosphere


def tube(n_around=12, n_along=40, radius=0.5, length=6.0):
    """A tube about the z axis; vertex row * n_around + column."""
    row, column = (index.ravel() for index in np.indices((n_along + 1, n_around)))
    angle = 2 * np.pi * (column + 0.5 * row) / n_around
    points = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), length * row / n_along]
    )
    row, column = (index.ravel() for index in np.indices((n_along, n_around)))
    here, right = row * n_around + column, row * n_around + (column + 1) % n_around
    faces = np.vstack([np.column_stack([here, right, here + n_around]),
                       np.column_stack([right, right + n_around, here + n_around])])  # fmt: skip
    return TriangleMesh(points, faces)


def lump(level=3):
    """A closed surface without symmetries."""
    x, y, z = icosphere(level).vertices.T
    size = 1 + 0.3 * np.sin(2 * x + 1) * np.cos(3 * y + 0.4) + 0.2 * np.sin(4 * z + x + 0.5 * y)
    return TriangleMesh(
        np.column_stack([1.5 * x, 0.9 * y, 0.7 * z]) * size[:, None], icosphere(level).faces
    )


def bumpy(mesh, size=0.03, seed=0):
    """Move the vertices of a mesh a little."""
    return TriangleMesh(
        mesh.vertices + size * np.random.default_rng(seed).standard_normal(mesh.vertices.shape),
        mesh.faces,
    )


@lru_cache
def tube_rig():
    return rig_shape(tube())


@lru_cache
def lump_rig():
    return rig_shape(lump())
