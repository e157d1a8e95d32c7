"""Poses and families of poses: what the folder says is what comes out, and what its text claims."""

import json
from pathlib import Path

import pytest
from quick_forms import run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_poses"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]
README = (FOLDER / "README.md").read_text()
KINDS = ("poses of one shape", "other individuals", "other species")


@pytest.mark.data
def test_the_quick_form_gives_the_expected_figures(tmp_path):
    found = run_quickly(FOLDER, tmp_path)
    quick = json.loads((FOLDER / "expected.json").read_text())["quick"]
    for name, row in quick["families"].items():
        assert found["families"][name].pop("nearest") == row.pop("nearest"), name
        assert found["families"][name] == pytest.approx(row, rel=1e-3), name
    for name, row in quick["separation"].items():
        assert found["separation"][name] == pytest.approx(row, rel=1e-3), name


def test_the_readme_shows_the_cats():
    for name, row in FULL["differences"].items():
        assert f"| {name} | " + " | ".join(f"{value:.4f}" for value in row.values()) + " |" in README


def test_the_readme_shows_the_families():
    for name, row in FULL["families"].items():
        shown = f"{row['mean']:.4f} | {row['worst pair']:.4f} | {row['nearest']} | {row['its mean']:.4f}"
        assert f"| {name} | {shown} | {row['ratio']:.2f} |" in README
    separation = FULL["separation"]
    for name in KINDS:
        number, *values = separation[name].values()
        assert f"| {name} | {number} | " + " | ".join(f"{value:.4f}" for value in values) + " |" in README
    assert f"threshold of {separation['threshold']:.4f}" in README
    assert f"{100 * separation['right']:.2f} %" in README
    assert f"{separation['AUC, individuals']:.4f}" in README


def test_the_readme_shows_the_kernels():
    for name, row in FULL["kernels"].items():
        assert f"| {name} | " + " | ".join(f"{value:.4f}" for value in row.values()) + " |" in README


def test_poses_differ_little_and_other_species_more():
    for name, row in FULL["families"].items():
        assert row["mean"] <= 0.03, name
        assert row["ratio"] >= 1.5, name


def test_pairs_of_poses_are_told_from_other_species_and_not_from_other_people():
    separation = FULL["separation"]
    assert separation["AUC, species"] > 0.999
    assert separation["right"] > 0.99
    assert separation["AUC, individuals"] < 0.95


def test_the_geodesic_kernel_is_nearly_as_stable_as_linear_elements():
    rows = FULL["differences"]
    for measure in ("median", "90 %"):
        assert rows["mesh, geodesic"][measure] - rows["cotangent, lumped"][measure] < 0.05
        assert rows["mesh, Euclidean"][measure] - rows["cotangent, lumped"][measure] > 0.05


def test_the_mass_matters_little():
    lumped, averaged = (FULL["differences"][f"cotangent, {mass}"] for mass in ("lumped", "averaged"))
    assert averaged["median"] == pytest.approx(lumped["median"], rel=0.1)


def test_kernels_confuse_a_cat_and_a_man_only_through_space():
    through, along = (FULL["kernels"][f"mesh, {distance}"] for distance in ("Euclidean", "geodesic"))
    assert through["cat"] > 0.9 * through["cat and david"]
    assert along["cat"] < 0.4 * along["cat and david"]
    for row in (through, along):
        assert row["horse, lowest eigenvalue"] < 0.1
