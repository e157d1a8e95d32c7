"""The unit of length of a part that is searched for."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.matching import scale
from eigenshape.matching.pieces import split_pieces
from eigenshape.matching.target import prepare_target


def test_a_part_is_described_in_units_of_its_own_size(monkeypatch):
    mesh = es.make_creature("fish", n_vertices=500)
    target = prepare_target(mesh)
    monkeypatch.setattr(scale, "patch_differences", lambda *_: None)
    monkeypatch.setattr(scale, "plan_fit", lambda *_: None)
    monkeypatch.setattr(scale, "fitted_maps", lambda *_: [])
    units: list[float] = []
    monkeypatch.setattr(scale, "describe_surface", lambda _mesh, unit, _count: units.append(unit))

    def units_at(size):
        units.clear()
        [piece] = split_pieces(es.TriangleMesh(size * mesh.vertices, mesh.faces), 0.0, np.inf)
        scale._find_factor(piece, target)
        return np.array(units)

    found = units_at(1.0)
    assert found[0] == pytest.approx(target.pieces[0].unit)  # larger, it would exceed the whole
    assert found[1:] == pytest.approx(1.25 * found[:-1])
    assert units_at(1000.0) == pytest.approx(1000 * found)
