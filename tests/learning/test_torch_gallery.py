"""The scripts of the gallery that need torch, which the build of the site does not run."""

import runpy
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch.nn", reason="torch is not installed: pip install 'eigenshape[torch]'")
pytest.importorskip(
    "torch_geometric", reason="torch_geometric is not installed: pip install 'eigenshape[torch]'"
)
import matplotlib.pyplot as plt

import eigenshape as es

pytestmark = [
    pytest.mark.long,
    pytest.mark.filterwarnings("ignore::FutureWarning"),  # of torch_geometric
]
FOLDER = Path(__file__).resolve().parents[2] / "gallery" / "13_learning"


@pytest.fixture
def run_script():
    """Run a script of the gallery and return its names."""
    yield lambda name: runpy.run_path(str(FOLDER / name))
    plt.close("all")


def test_no_script_that_needs_torch_is_run_by_the_build():
    """The build runs those whose names begin with plot."""
    needing = {path.name for path in FOLDER.glob("*.py") if "import torch" in path.read_text()}
    assert needing == {path.name for path in FOLDER.glob("torch_*.py")}
    assert len(needing) == 4


def test_a_sphere_takes_the_spectrum_of_an_egg(run_script):
    names = run_script("torch_move_to_spectrum.py")
    assert names["loss"].item() ** 0.5 < 0.02
    found, egg = (
        es.solve_spectrum(es.cotangent_laplacian(names[each]), 12).eigenvalues[1:]
        for each in ("found", "egg")
    )
    assert np.abs(found / egg - 1).max() < 0.05


def test_normals_are_nearer_to_those_of_the_clean_shape(run_script):
    names = run_script("torch_denoise.py")
    normals = names["normals"]
    noisy, found = (
        np.arccos((es.geometry.face_normals(names[each]) * normals).sum(axis=1).clip(-1, 1)).mean()
        for each in ("noisy", "found")
    )
    assert found < 0.95 * noisy


def test_parts_are_named_better_than_by_the_largest_alone(run_script):
    names = run_script("torch_name_parts.py")
    labels, guess = names["shape"].labels, names["guess"]
    right = (guess == labels).float().mean().item()
    assert right > labels.bincount().max().item() / len(labels) + 0.15


def test_a_field_is_carried_between_poses(run_script):
    """Both poses have the same vertices, so the field at the rest is known."""
    names = run_script("torch_maps_without_labels.py")
    field, places = names["field"], names["places"]
    assert np.abs(field[places] - field).mean() < 0.1 * np.ptp(field)
