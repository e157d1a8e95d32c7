"""The same shape, told otherwise: moved, mirrored, renumbered, turned over, in another unit, twice."""

from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from certeig.kit.arrays import EPS
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.conversion import ShapeLike, as_shape
from eigenshape.geometry.simplicial import Mesh

Subject: TypeAlias = Shape | sp.csr_array

APART = 16  # diameters between a shape and its copy


def as_subject(shape: ShapeLike | sp.sparray) -> Subject:
    """Return the shape, an adjacency matrix in the one sparse form that all functions here know."""
    return sp.csr_array(shape) if isinstance(shape, sp.sparray) else as_shape(shape)


def with_points(shape: Shape, points: Float[np.ndarray, "n d"]) -> Shape:
    """Return the shape with other coordinates."""
    if isinstance(shape, PointCloud):
        return PointCloud(points, shape.dim)
    return type(shape)(points, shape.simplices)


def with_simplices(mesh: Mesh, simplices: Int[np.ndarray, "s corners"]) -> Mesh:
    """Return the mesh with other simplices."""
    return type(mesh)(mesh.points, simplices)


def jiggle(shape: Shape, rng: np.random.Generator) -> Shape:
    """Move each coordinate as far as rounding would, were the shape turned and moved by its own size."""
    reach = 8 * EPS * np.abs(shape.points).max()
    return with_points(shape, shape.points + reach * rng.uniform(-1, 1, shape.points.shape))


def move(shape: Shape, rng: np.random.Generator) -> Shape:
    """Turn the shape about the origin at random, and move it by about its own size."""
    points = shape.points
    step = np.abs(points).max() * rng.uniform(-1, 1, points.shape[1])
    return with_points(shape, points @ random_rotation(points.shape[1], rng).T + step)


def random_rotation(d: int, rng: np.random.Generator) -> Float[np.ndarray, "d d"]:
    """Return a rotation of R^d, each as likely as any other (Stewart 1980)."""
    turn, triangle = np.linalg.qr(rng.standard_normal((d, d)))
    turn = turn * np.sign(np.diag(triangle))
    turn[0] *= np.sign(np.linalg.det(turn))
    return turn


def mirror(shape: Shape) -> Shape:
    """Mirror the shape at the plane x = 0, so that what was outside stays outside."""
    signs = np.append(-1.0, np.ones(shape.points.shape[1] - 1))
    mirror = with_points(shape, shape.points * signs)
    if isinstance(mirror, PointCloud):
        return mirror
    return with_simplices(mirror, _turn_over(mirror.simplices))


def turn_over(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """Swap two corners in a random half of the simplices, the first among them."""
    chosen = np.append(True, rng.random(len(mesh.simplices) - 1) < 0.5)
    return with_simplices(
        mesh, np.where(chosen[:, None], _turn_over(mesh.simplices), mesh.simplices)
    )


def _turn_over(simplices: Int[np.ndarray, "s corners"]) -> Int[np.ndarray, "s corners"]:
    return np.column_stack([simplices[:, 1], simplices[:, 0], simplices[:, 2:]])


def renumber(subject: Subject, old_of_new: Int[np.ndarray, " n"]) -> Subject:
    """Give the points new numbers: new point i is point old_of_new[i]."""
    if isinstance(subject, sp.csr_array):
        return subject[old_of_new][:, old_of_new]
    if isinstance(subject, PointCloud):
        return PointCloud(subject.points[old_of_new], subject.dim)
    return type(subject)(subject.points[old_of_new], np.argsort(old_of_new)[subject.simplices])


def reorder(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """Shuffle the simplices, and turn three corners of each round, which keeps its orientation."""
    simplices = mesh.simplices[rng.permutation(len(mesh.simplices))]
    if mesh.dim > 1:
        turns = rng.integers(0, 3, len(simplices))
        corners = (np.arange(3) + turns[:, None]) % 3
        simplices = np.column_stack(
            [np.take_along_axis(simplices, corners, axis=1), simplices[:, 3:]]
        )
    return with_simplices(mesh, simplices)


def rescale(subject: Subject, factor: float) -> Subject:
    """Multiply coordinates, or the weights of a graph."""
    return (
        subject * factor
        if isinstance(subject, sp.csr_array)
        else with_points(subject, subject.points * factor)
    )


def double(subject: Subject) -> Subject:
    """Put a copy beside the shape, 16 diameters away."""
    if isinstance(subject, sp.csr_array):
        return sp.csr_array(sp.block_diag([subject, subject]))
    step = np.zeros(subject.points.shape[1])
    step[0] = APART * float(np.linalg.norm(np.ptp(subject.points, axis=0)))
    points = np.concatenate([subject.points, subject.points + step])
    if isinstance(subject, PointCloud):
        return PointCloud(points, subject.dim)
    return type(subject)(
        points, np.concatenate([subject.simplices, subject.simplices + subject.n_points])
    )
