"""The experiment on confidence: its quick form runs, a fragment of a flake has one place, and a biped two."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

PAIRS = Path(__file__).resolve().parents[2] / "experiments" / "ch7_matching" / "pairs.py"


@pytest.mark.long
@pytest.mark.data
def test_a_fragment_of_a_flake_is_placed_and_sure(quick_form):
    (row,) = quick_form("ch7_confidence/rows.py").values()
    assert row["right"] > 0.95
    assert row["places"] == 1
    assert row["said"] > 0.9


@pytest.mark.long
def test_a_cut_of_a_biped_that_fits_back_to_front_as_well_says_two_places():
    poses = [es.make_creature("biped", pose, individual=1, n_vertices=1000) for pose in (1, 2)]
    draw, sizes = np.random.default_rng([1, 4, 0]), (1000, 1000)
    pair = runpy.run_path(str(PAIRS))["pair_of"]("biped", poses, "cuts", draw, sizes=sizes)
    match = es.match_shapes(pair.part, pair.whole)
    assert match.n_equally_good == 2
    assert match.confidence.mean() < 0.6
