"""Meshes of one genus 3 surface: what the folder says is what comes out, and what its text claims."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from quick_forms import run_quickly

import eigenshape as es

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_genus3"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
ERRORS, MESHES = EXPECTED["full"]["errors"], EXPECTED["full"]["meshes"]
README = (FOLDER / "README.md").read_text()
OTHER = runpy.run_path(str(FOLDER / "meshes.py"))


def test_the_readme_shows_the_expected_figures():
    for name, row in ERRORS.items():
        cells = (f"{median:.4f} / {worst:.4f}" for median, worst in row.values())
        assert f"| {name} | " + " | ".join(cells) + " |" in README
    for name, row in MESHES.items():
        numbers = f"{row['n']} | {row['edge / e']:.3f} | {row['area']:.3f} | {row['volume']:.3f}"
        assert f"| {name} | {numbers} | {row['longest / shortest edge']:.1f} | {row['crossings']} |" in README


def test_every_mesh_is_one_of_the_surface():
    for name, row in MESHES.items():
        assert row["closed manifold of genus 3"], name
        assert row["volume"] == pytest.approx(1, abs=0.01), name


def test_density_does_no_harm():
    for name in ("coarser", "non-uniform"):
        for form, (median, worst) in ERRORS[name].items():
            assert median < 0.008, (name, form)
            assert worst < 0.04, (name, form)


def test_only_the_random_walk_form_bears_much_noise():
    strong = {form: median for form, (median, _) in ERRORS["noise, .5 edge"].items()}
    assert strong.pop("mesh, random-walk") < 0.02
    assert min(strong.values()) > 0.3
    assert max(median for median, _ in ERRORS["noise, .1 edge"].values()) < 0.03


def test_faces_are_cut_without_a_gap_and_nothing_moves():
    sphere = es.icosphere(2)
    for seed in range(3):
        cut = OTHER["denser"](sphere, np.random.default_rng(seed).random(len(sphere.faces)) < 0.3)
        assert es.is_manifold(cut)
        assert es.is_closed(cut)
        assert es.surface_area(cut) == pytest.approx(es.surface_area(sphere), rel=1e-12)
        assert es.enclosed_volume(cut) == pytest.approx(es.enclosed_volume(sphere), rel=1e-12)


def test_a_collapsed_torus_is_still_a_torus():
    torus = es.torus(60, 30)
    coarse = OTHER["coarser"](torus, 900)
    assert coarse.n_vertices == 900
    assert es.is_manifold(coarse)
    assert es.is_closed(coarse)
    assert es.euler_characteristic(coarse) == 0
    assert es.enclosed_volume(coarse) == pytest.approx(es.enclosed_volume(torus), rel=0.1)
    assert len(es.self_intersections(coarse)) == 0


@pytest.mark.slow
@pytest.mark.data
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    found, expected = run_quickly(FOLDER, tmp_path), EXPECTED["quick"]
    for name, row in expected["meshes"].items():
        assert found["meshes"][name] == pytest.approx(row, rel=1e-3), name
    for name, row in expected["errors"].items():
        for form, values in row.items():
            assert found["errors"][name][form] == pytest.approx(values, rel=1e-2), (name, form)
