"""Quadratures of surfaces that are known exactly."""

import numpy as np

from eigenshape.geometry.samples.quadrature import Quadrature


def sphere_quadrature(count):
    """Return a rule for the unit sphere that is exact for polynomials up to degree 2 count - 1."""
    heights, weights = np.polynomial.legendre.leggauss(count)
    angles = np.pi * np.arange(2 * count) / count
    z, angle = (grid.ravel() for grid in np.meshgrid(heights, angles, indexing="ij"))
    ring = np.sqrt(1 - z**2)
    points = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
    return Quadrature(points, np.repeat(weights * np.pi / count, 2 * count), 2)


def torus_quadrature(around, across, outer=1.0, inner=0.4):
    """Return a rule for a torus, with equal steps in both angles."""
    angles = np.meshgrid(
        2 * np.pi * np.arange(around) / around,
        2 * np.pi * np.arange(across) / across,
        indexing="ij",
    )
    u, v = (angle.ravel() for angle in angles)
    rim = outer + inner * np.cos(v)
    points = np.column_stack([rim * np.cos(u), rim * np.sin(u), inner * np.sin(v)])
    return Quadrature(points, rim * inner * (2 * np.pi) ** 2 / (around * across), 2)
