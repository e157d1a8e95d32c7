"""Brackets held against what is known."""

import numpy as np

from eigenshape.geometry.resolution.subdivision import subdivide


def finer(mesh, times):
    for _ in range(times):
        mesh = subdivide(mesh)
    return mesh


def assert_around(found, known):
    assert (found.lower <= known).all()
    assert (known <= found.upper).all()
    assert (np.diff(found.lower) >= 0).all()
    positive = known > 0
    assert (found.lower[positive] > 0).all()
    assert (found.lower[~positive] == 0).all()
    assert (found.upper[~positive] == 0).all()
