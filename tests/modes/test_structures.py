"""Surfaces of the structures of a labeled volume, and what BrainPrint makes of them."""

import re

import brainprint.surfaces
import numpy as np
import pytest

import eigenshape as es
from eigenshape import InvalidParameterError
from eigenshape.modes import brain_print, structure_surfaces
from eigenshape.modes.structures import FREESURFER_STRUCTURES


def volume():
    """Return labels of a caudate on both sides, mirror images, and a larger thalamus."""
    labels = np.zeros((40, 24, 24), dtype=np.int32)
    x, y, z = np.indices((18, 24, 24)) - np.array([9, 12, 12])[:, None, None, None]
    caudate = (x / 5) ** 2 + (y / 9) ** 2 + ((z - x**2 / 9) / 6) ** 2 < 1
    labels[1:19][caudate] = 11
    labels[21:39][caudate[::-1]] = 50
    labels[21:39][(x**2 + y**2 + z**2 < 16)] = 49
    return labels


def test_structures_are_surfaces_by_name_and_have_a_print():
    labels = volume()
    to_space = np.diag([-2.0, 2, 2, 1])
    found = structure_surfaces(labels, to_space)
    assert set(found) == {
        "Left-Striatum",
        "Left-Caudate",
        "Right-Striatum",
        "Right-Caudate",
        "Right-Thalamus-Proper",
    }
    left = found["Left-Caudate"]
    surface = es.calculus.voxel_surface(labels == 11, to_space)
    assert np.array_equal(left.vertices, surface.vertices)
    values = brain_print(found, 20)
    assert values.values.shape == (5, 20)


def test_mirrored_structures_have_nearly_one_print():
    labels = np.where(volume() == 11, 11, 0)
    both = np.concatenate([labels, np.where(labels[::-1] == 11, 50, 0)])
    found = brain_print(structure_surfaces(both, structures={"lh": 11, "rh": [50, 51]}), 20)
    # Tetrahedra between voxels have diagonals, which are not mirrored: 0.2 % of the print
    assert found.asymmetry()["lh"] < 0.005 * np.linalg.norm(found.values[0])


def test_structures_are_those_of_brainprint(monkeypatch):
    calls = {}
    monkeypatch.setattr(
        brainprint.surfaces, "create_aseg_surface", lambda subject, target, numbers: numbers
    )
    calls = brainprint.surfaces.create_aseg_surfaces(None, None)
    assert {name: tuple(map(int, numbers)) for name, numbers in calls.items()} == (
        FREESURFER_STRUCTURES
    )


@pytest.mark.parametrize(
    ("labels", "structures", "message"),
    [
        (np.ones((3, 3)), None, "whole numbers in three dimensions; the shape is (3, 3)"),
        (np.full((3, 3, 3), 0.5), None, "whole numbers in three dimensions; there is 0.5"),
        (np.ones((3, 3, 3)), None, "none is there. The volume holds 1."),
        (np.ones((3, 3, 3)), {"a": 2}, "'a' has none of the labels [2]. The volume holds 1."),
        (np.arange(27).reshape(3, 3, 3), {"a": 99}, "18, 19, ... (27 labels)."),
    ],
)
def test_what_is_not_there_is_named(labels, structures, message):
    with pytest.raises(InvalidParameterError, match=re.escape(message)):
        structure_surfaces(labels, structures=structures)
