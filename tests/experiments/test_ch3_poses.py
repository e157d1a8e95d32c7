"""Poses and families of poses: what the README claims."""

import runpy
from pathlib import Path

import pytest

import eigenshape as es

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_poses"


@pytest.mark.long
@pytest.mark.data
def test_poses_differ_little_and_other_species_more(quick_form):
    found = quick_form("ch3_poses/run.py")
    for name, row in found["families"].items():
        assert row["mean"] <= 0.05, name
        assert row["ratio"] >= 1.5, name
    assert found["separation"]["right"] == 1


@pytest.mark.long
def test_a_kernel_leaks_through_space_where_a_shape_is_thin(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    leaks = runpy.run_path(str(FOLDER / "run.py"))["leaks"]
    sphere = es.icosphere(3)
    thin = es.TriangleMesh(sphere.vertices * [1, 1, 0.02], sphere.faces)
    assert leaks(sphere).max() < 1e-3
    assert leaks(thin).max() > 0.4
