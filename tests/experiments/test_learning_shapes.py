"""Gradients of spectra at work: the quick form, and what the README claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "learning_shapes"
EXPECTED = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))


@pytest.mark.long
def test_the_quick_form_comes_as_far_as_it_should(quick_form):
    """Training takes other steps on another CPU, so figures are bounded, not compared."""
    pytest.importorskip(
        "torch.nn", reason="torch is not installed: pip install 'eigenshape[torch]'"
    )
    found = quick_form("learning_shapes/run.py")
    names = ("isospectralize", "denoise", "segment", "learn_maps")
    spectrum, noise, parts, maps = (found[name] for name in names)
    assert spectrum["error after"] < 0.2 * spectrum["error before"]
    assert noise["error of eigenvalues after"] < 0.2 * noise["error of eigenvalues before"]
    assert noise["angle of normals after"] < noise["angle of normals before"] - 1
    assert parts["accuracy on others"] > parts["accuracy of the largest part alone"] + 0.2
    assert maps["error after"] < 0.75 * maps["error before"]
    assert maps["error after"] < 0.5 * maps["error by wave kernel signatures"]


def test_a_spectrum_is_reached_parts_are_named_and_maps_are_learned():
    full = EXPECTED["full"]
    assert full["isospectralize"]["error after"] < 0.01
    assert full["denoise"]["angle of normals after"] < full["denoise"]["angle of normals before"]
    assert full["segment"]["accuracy on others"] > 0.8
    maps = full["learn_maps"]
    assert maps["error after"] < 0.8 * maps["error before"]
    assert maps["error after"] < 0.25 * maps["error by wave kernel signatures"]
