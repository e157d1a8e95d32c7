"""Columns that are interpolated when they are needed, beside the same columns in memory."""

import numpy as np
from pencils import graph, hypercube

from certeig.kit.progress import silent
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import torus
from eigenshape.spectral.multilevel import approximate
from eigenshape.spectral.multilevel.approximate import climb
from eigenshape.spectral.multilevel.davidson import misses_pairs
from eigenshape.spectral.multilevel.residuals import Interpolated, Stored
from eigenshape.spectral.pencils import normalize

TORUS = cotangent_laplacian(torus(120, 50))


def interpolated_pairs(laplacian):
    start = climb(normalize(laplacian), 12, silent)
    return Interpolated(start.tower, start.below[0].astype(np.float32)), start.below[1]


def test_what_aggregates_cannot_see_is_missed(monkeypatch):
    columns, values = interpolated_pairs(TORUS)
    assert not misses_pairs(columns, values, 12, 0.02 * values[11])
    monkeypatch.setattr(approximate, "EXACT_POINTS", 0)
    monkeypatch.setattr(approximate, "COARSENED", 3)
    columns, values = interpolated_pairs(graph(hypercube(10)))  # bits that change within aggregates
    assert values[10] > 1.5 * values[9]  # nine copies of the second eigenvalue, of ten
    assert misses_pairs(columns, values, 12, 0.02 * values[11])


def test_interpolated_columns_are_those_in_memory():
    interpolated, _ = interpolated_pairs(TORUS)
    tower = interpolated.tower
    columns = tower.levels[0].prolong @ interpolated.below
    stored = Stored(tower, columns)
    few = slice(100, 120)
    np.testing.assert_allclose(interpolated.rows(few), stored.rows(few), atol=1e-6)
    some = np.array([0, 3, 11])
    np.testing.assert_allclose(interpolated.pick(some), stored.pick(some), atol=1e-6)
    block = np.random.default_rng(0).standard_normal((len(columns), 2)).astype(np.float32)
    one, two = block.copy(), block.copy()
    interpolated.keep_outside(one)
    stored.keep_outside(two)
    np.testing.assert_allclose(one, two, atol=1e-5 * np.abs(block).max())
    weighed = tower.levels[0].weights * columns
    inside, before = weighed.T @ one, weighed.T @ block
    assert np.abs(inside).max() < 1e-5 * np.abs(before).max()
