"""The experiment on parts: what the README claims."""

import pytest


@pytest.mark.long
@pytest.mark.data
def test_the_default_beats_every_other_way(quick_form):
    found = quick_form("ch5_parts/run.py")
    errors = {way: halves["all"] for way, halves in found["error"].items()}
    assert min(errors, key=errors.get) == "default"
    largest = found["largest part of the default, median"]
    assert all(largest[cls] < 0.5 for cls in ("armadillo", "human", "teddy", "ant"))
