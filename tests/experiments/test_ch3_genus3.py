"""Meshes of one genus 3 surface: what the README claims."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_genus3"
OTHER = runpy.run_path(str(FOLDER / "meshes.py"))


@pytest.mark.long
@pytest.mark.data
def test_density_does_no_harm_and_only_the_random_walk_form_bears_much_noise(quick_form):
    found = quick_form("ch3_genus3/run.py")
    for name, row in found["meshes"].items():
        assert row["closed manifold of genus 3"], name
        assert row["volume"] == pytest.approx(1, abs=0.03), name
    for name in ("coarser", "non-uniform"):
        for form, (median, worst) in found["errors"][name].items():
            assert median < 0.02, (name, form)
            assert worst < 0.06, (name, form)
    strong = {form: median for form, (median, _) in found["errors"]["noise, .5 edge"].items()}
    assert strong.pop("mesh, random-walk") < 0.05
    assert min(strong.values()) > 0.2
    assert max(median for median, _ in found["errors"]["noise, .1 edge"].values()) < 0.03


def test_faces_are_cut_without_a_gap_and_nothing_moves():
    sphere = es.icosphere(2)
    for seed in range(3):
        cut = OTHER["denser"](sphere, np.random.default_rng(seed).random(len(sphere.faces)) < 0.3)
        assert es.geometry.is_manifold(cut)
        assert es.geometry.is_closed(cut)
        assert es.geometry.surface_area(cut) == pytest.approx(
            es.geometry.surface_area(sphere), rel=1e-12
        )
        assert es.geometry.enclosed_volume(cut) == pytest.approx(
            es.geometry.enclosed_volume(sphere), rel=1e-12
        )


@pytest.mark.long
def test_a_collapsed_torus_is_still_a_torus():
    torus = es.shapes.torus(60, 30)
    coarse = OTHER["coarser"](torus, 900)
    assert coarse.n_vertices == 900
    assert es.geometry.is_manifold(coarse)
    assert es.geometry.is_closed(coarse)
    assert es.geometry.euler_characteristic(coarse) == 0
    assert es.geometry.enclosed_volume(coarse) == pytest.approx(
        es.geometry.enclosed_volume(torus), rel=0.1
    )
    assert len(es.geometry.self_intersections(coarse)) == 0


def test_last_digits_do_not_choose_the_edges_that_collapse():
    torus = es.shapes.torus(60, 30)  # full of edges of one length
    signs = np.random.default_rng(0).choice([-1.0, 1.0], torus.vertices.shape)
    nudged = es.TriangleMesh(np.nextafter(torus.vertices, np.inf * signs), torus.faces)
    one, other = OTHER["coarser"](torus, 900), OTHER["coarser"](nudged, 900)
    np.testing.assert_array_equal(other.faces, one.faces)
    np.testing.assert_allclose(other.vertices, one.vertices, rtol=0, atol=1e-14)
