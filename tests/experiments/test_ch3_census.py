"""The census of wrong spectra: the folder says what its run counted, ours is never wrong, and what is wrong is seen."""

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es
from certeig.solver import strategy as roads

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_census"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


@pytest.fixture
def census(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    yield runpy.run_path(str(FOLDER / "run.py"))
    for name in ("census_shapes", "census_solvers"):
        sys.modules.pop(name, None)


def total(result, solver, what):
    return result["table"][solver]["all"][what]


@pytest.mark.long
@pytest.mark.data
def test_ours_is_never_wrong_and_peers_are(quick_form):
    found = quick_form("ch3_census/run.py")
    assert found["failures of ours"] == []
    assert total(found, "eigenshape", "wrong") == 0
    assert total(found, "eigenshape", "solves") - found["dense"] > 200
    assert total(found, "ARPACK, σ = -0.01", "absent") > 0
    assert found["table"].keys() == FULL["table"].keys()


def test_a_missing_copy_is_counted(census):
    case = census["Case"]("one", "one", es.cotangent_laplacian(es.shapes.torus(12, 8)))
    values = census["dense"](case)
    right = es.solve_spectrum(case.laplacian, 9).eigenvalues
    longer = es.solve_spectrum(case.laplacian, 10).eigenvalues

    def verdict(found):
        return census["verdict"](lambda *_: found, case, 9, 0, values)[0]

    assert verdict(right) == verdict(right[::-1]) == "right"
    assert verdict(right + 1e-7 * right[-1]) == "wrong"
    assert verdict(np.delete(longer, 1)) == "absent"
    assert verdict(np.full(9, np.nan)) == "absent"
    assert (
        census["verdict"](lambda *_: 1 / 0, case, 9, 0, values)[0] == "refused: ZeroDivisionError"
    )


def test_numbers_k_cut_clusters_and_keep_them(census):
    copies = np.repeat([0.0, 1.0, 2.0, 3.0], [1, 3, 5, 91])
    assert census["sizes"](copies, (4,)) == [4, 6]  # whole at 4; 9 is the next, and 6 cuts it
    assert census["sizes"](copies, (1,)) == [2]  # one alone is no spectrum
    rounding = np.random.default_rng(0).uniform(-1e-14, 1e-14, 100)
    assert census["sizes"](np.sort(copies + rounding), (4,)) == [4, 6]
    assert census["sizes"](np.sort(np.repeat([0.0, 1.0], [20, 80]) + rounding), (6,)) == [10]
    assert census["sizes"](np.arange(100.0), (3, 6, 30)) == [3, 6]
    assert census["sizes"](np.repeat([0.0, 1.0], [1, 99]), (3, 50)) == [24]


def test_the_sparse_road_is_taken(census, monkeypatch):
    switches = census["always_sparse"].__globals__["DENSE_SWITCHES"]
    for name in switches:
        monkeypatch.setattr(roads, name, getattr(roads, name))  # to be put back
    census["always_sparse"]()
    ours = type(census["SOLVERS"]["eigenshape"])()
    case = census["Case"]("one", "one", es.cotangent_laplacian(es.icosphere(2)))
    ours(case, 9, 0)
    assert ours.dense == 0
