"""Compressed meshes beside gzip and Draco: what the README claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch1_compression"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_at_equal_error_coordinates_are_smaller_than_gzip_s_on_three_classics():
    assert len(FULL["at equal error"]) >= 3
    for name, row in FULL["at equal error"].items():
        assert row["coordinates, of gzip's"] < 1, name
        assert row["all, of gzip's coordinates"] < 1, name


@pytest.mark.long
def test_a_bumpy_sphere_is_smaller_than_gzip_s(quick_form):
    found = quick_form("ch1_compression/run.py")["at equal error"]["bumpy sphere"]
    assert found["all, of gzip's coordinates"] < 0.8
