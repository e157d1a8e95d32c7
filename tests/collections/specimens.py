"""Specimens without symmetry whose vertices correspond: balls with three unlike bumps."""

import numpy as np

import eigenshape as es

BUMPS = np.array([[1.0, 0.2, 0.1], [-0.3, 0.9, 0.3], [0.1, -0.5, 0.8]])
HEIGHTS, WIDTHS = np.array([0.9, 0.5, 0.35]), np.array([0.3, 0.15, 0.2])


def make_specimen(number: int) -> es.TriangleMesh:
    """Return the specimen of a number: bumps and sides of its own."""
    ball = es.icosphere(3)
    draw = np.random.default_rng(number)
    heights = HEIGHTS * (1 + 0.2 * draw.standard_normal(3))
    squares = np.sum((ball.vertices[:, None] - BUMPS) ** 2, axis=2)
    radii = 1 + np.exp(-squares / WIDTHS) @ heights
    sides = [1.0, 0.8, 0.6] * (1 + 0.05 * draw.standard_normal(3))
    return es.TriangleMesh(ball.vertices * radii[:, None] * sides, ball.faces)


def mirror(mesh: es.TriangleMesh) -> es.TriangleMesh:
    """Return the mirror image, facing outward."""
    return es.TriangleMesh(mesh.vertices * [-1, 1, 1], mesh.faces[:, ::-1])


def move(mesh: es.TriangleMesh, factor: float = 1.0) -> es.TriangleMesh:
    """Return a mesh turned, moved and in another unit."""
    return es.TriangleMesh(factor * mesh.vertices[:, [1, 2, 0]] + [5.0, 0, 0], mesh.faces)


def half(mesh: es.TriangleMesh) -> es.TriangleMesh:
    """Return the half of a mesh where z is positive."""
    above = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] > 0
    return es.repair(es.TriangleMesh(mesh.vertices, mesh.faces[above]), ["drop_unreferenced"]).mesh
