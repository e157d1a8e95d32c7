"""The unit sphere by eight operators (Figure 3.2): what the folder says is what comes out, and what its text claims."""

import json
import runpy
from pathlib import Path

import pytest
from quick_forms import run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_sphere"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
OPERATORS, NOISE = EXPECTED["full"]["operators"], EXPECTED["full"]["noise"]
MESHES = ("mesh, literal", "mesh, corrected", "mesh, random-walk")


def medians(name, what):
    return [row[what][0] for size, row in OPERATORS[name].items() if size != "order"]


def test_the_readme_shows_the_full_figures(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER.parent)
    module, text = runpy.run_path(str(FOLDER / "run.py")), (FOLDER / "README.md").read_text()
    for what in ("values", "vectors"):
        assert module["markdown"](OPERATORS, what) in text
    for name, (median, worst) in NOISE.items():
        assert f"| {name} | {median:.4f} | {worst:.4f} |" in text


def test_the_printed_form_is_far_too_low_and_the_corrected_one_is_not():
    last = "n = 16000"
    assert OPERATORS["mesh, literal"][last]["values"][0] == pytest.approx(0.070, abs=0.01)
    assert OPERATORS["mesh, corrected"][last]["values"][0] <= 0.002
    assert OPERATORS["mesh, corrected"][last]["values"][1] <= 0.01
    for name in ("mesh, literal", "mesh, corrected"):
        for what in ("values", "vectors"):
            found = medians(name, what)
            assert found == sorted(found, reverse=True), (name, what)


def test_the_random_walk_form_bears_noise():
    assert NOISE["mesh, random-walk"][0] <= 0.02
    assert NOISE["cotangent, lumped"][0] > 0.2
    assert NOISE["mesh, corrected"][0] > 0.2


def test_linear_elements_have_order_two_in_eigenvalues_and_eigenspaces():
    for mass in ("lumped", "consistent"):
        assert OPERATORS[f"cotangent, {mass}"]["order"]["values"] == pytest.approx(2, abs=0.25)
        assert OPERATORS[f"cotangent, {mass}"]["order"]["vectors"] == pytest.approx(2, abs=0.25)


def test_correction_leaves_eigenvectors_as_they_are():
    assert medians("mesh, corrected", "vectors") == pytest.approx(medians("mesh, literal", "vectors"), rel=1e-3)


def test_uneven_weights_are_what_turns_eigenspaces_of_the_mesh_laplacian():
    for of_triangles, of_cells in EXPECTED["full"]["scatter"]:
        assert 0.035 < of_triangles < 0.075
        assert 0.0015 < of_cells < 0.0075
    for name in MESHES:
        for mesh, points in zip(medians(name, "vectors"), medians("points, corrected", "vectors"), strict=True):
            assert mesh > 5 * points


def test_the_plain_product_makes_next_to_no_difference():
    for size, row in OPERATORS["mesh, literal"].items():
        if size != "order":
            assert row["plain"] == pytest.approx(row["vectors"][0], rel=0.02)


@pytest.mark.slow
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    found = run_quickly(FOLDER, tmp_path)
    expected = EXPECTED["quick"]
    for found_row, row in zip(found["scatter"], expected["scatter"], strict=True):
        assert found_row == pytest.approx(row, rel=2e-3)
    assert found["edges"] == pytest.approx(expected["edges"], rel=1e-3)
    assert found["operators"].keys() == expected["operators"].keys()
    for name, rows in expected["operators"].items():
        for row, figures in rows.items():
            for what, value in figures.items():
                assert found["operators"][name][row][what] == pytest.approx(value, rel=2e-3), (name, row, what)
    for name, value in expected["noise"].items():
        assert found["noise"][name] == pytest.approx(value, rel=2e-3), name
