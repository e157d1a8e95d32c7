"""Landmarks by coherent point drift, as ALPACA and MALPACA carry them.

The transformation is that of Myronenko and Song (2010) with the settings of ALPACA (Porto et al. 2021):
5,000 points, clouds scaled to 25, alpha 2, beta 2. Correspondences are those of the 30 nearest
points, and displacements are sums of kernels on a grid of centers, which takes seconds in place of
minutes. The start is the similarity of `es.collections.align_surfaces`.
"""

import numpy as np
from scipy.spatial import cKDTree

import eigenshape as es

N_POINTS = 5000
SIZE = 25.0  # longest side of the clouds
ALPHA, BETA = 2.0, 2.0
NEIGHBORS, ROUNDS, TOLERANCE = 30, 40, 1e-3


def kernel(points: np.ndarray, centers: np.ndarray) -> np.ndarray:
    """Return the Gaussian kernel of width beta."""
    squares = np.sum(points**2, axis=1)[:, None] + np.sum(centers**2, axis=1)
    return np.exp((squares - 2 * points @ centers.T) / (-2 * BETA**2))


def drift(moving: np.ndarray, fixed: np.ndarray, carried: np.ndarray) -> np.ndarray:
    """Return where points go when one cloud drifts onto another that it lies on roughly."""
    middle, unit = fixed.mean(axis=0), SIZE / np.ptp(fixed, axis=0).max()
    start, ends, carried = ((points - middle) * unit for points in (moving, fixed, carried))
    cells = np.floor(start / BETA).astype(np.int64)
    centers = start[np.unique(cells, axis=0, return_index=True)[1]]
    at_start, at_centers = kernel(start, centers), kernel(centers, centers)
    now = start
    variance = np.mean(cKDTree(now).query(ends)[0] ** 2)
    for _ in range(ROUNDS):
        distances, nearest = cKDTree(now).query(ends, k=NEIGHBORS)
        shares = np.exp((distances[:, :1] ** 2 - distances**2) / (2 * variance))
        shares /= shares.sum(axis=1, keepdims=True)
        total = np.bincount(nearest.ravel(), shares.ravel(), len(now))
        sums = [
            np.bincount(nearest.ravel(), (shares * ends[:, i : i + 1]).ravel(), len(now))
            for i in range(3)
        ]
        pull = np.column_stack(sums) - total[:, None] * start
        system = at_start.T @ (at_start * total[:, None]) + ALPHA * variance * at_centers
        system[np.diag_indices_from(system)] += 1e-9
        shifts = np.linalg.solve(system, at_start.T @ pull)
        now = start + at_start @ shifts
        squares = np.sum((ends[:, None] - now[nearest]) ** 2, axis=2)
        before, variance = variance, float(np.mean(np.sum(shares * squares, axis=1)) / 3)
        if abs(before - variance) < TOLERANCE * before:
            break
    return middle + (carried + kernel(carried, centers) @ shifts) / unit


def drifted_landmarks(
    template: es.TriangleMesh, landmarks: np.ndarray, target: es.TriangleMesh
) -> np.ndarray:
    """Carry landmarks of a template to the surface of a target, as ALPACA does."""
    draw = np.random.default_rng(0)
    placing = es.collections.align_surfaces(target, template).inverse()
    moving = es.geometry.sample_surface(template, N_POINTS, rng=draw).points
    fixed = es.geometry.sample_surface(target, N_POINTS, rng=draw).points
    found = drift(placing.move(moving), fixed, placing.move(landmarks))
    return es.geometry.closest_points(target, found).points
