"""Work that takes seconds on 50,000 vertices says how far it has come."""

import numpy as np
import pytest

import eigenshape as es

BALL = es.icosphere(2)
RING = es.shapes.torus(12, 8)
CALLS = {
    "heat_distances": lambda report: es.calculus.heat_distances(BALL, range(20), progress=report),
    "prepare_vector_heat": lambda report: es.calculus.prepare_vector_heat(BALL, progress=report),
    "harmonic_fields": lambda report: es.calculus.harmonic_fields(RING, progress=report),
    "map_to_sphere": lambda report: es.calculus.map_to_sphere(BALL, progress=report),
    "mean_curvature_flow": lambda report: es.calculus.mean_curvature_flow(
        BALL, 0.01, progress=report
    ),
    "solve_heat": lambda report: es.calculus.solve_heat(
        es.cotangent_laplacian(BALL), BALL.points[:, 2], 0.1, 5, progress=report
    ),
}


@pytest.mark.parametrize("name", CALLS)
def test_fractions_grow_from_0_and_messages_change(name):
    reports = []
    CALLS[name](lambda fraction, message: reports.append((fraction, message)))
    fractions = [fraction for fraction, _ in reports]
    assert fractions[0] == 0
    assert max(fractions) <= 1
    assert (np.diff(fractions) > 0).all()
    assert len({message for _, message in reports}) == len(reports) > 1
