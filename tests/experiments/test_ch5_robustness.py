"""Changed queries: changes are what they are called, losses are of the same queries, the README shows the figures."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_retrieval"
FULL = json.loads((FOLDER / "expected_robustness.json").read_text())["full"]
sys.path[:0] = [str(FOLDER), str(FOLDER.parent)]
import draws  # noqa: E402
import methods  # noqa: E402
import perturbing  # noqa: E402
import robustness  # noqa: E402
from scores import Outcome  # noqa: E402

BALL = es.icosphere(3)


def test_noise_is_a_share_of_the_mean_edge():
    found = perturbing.changed_part(BALL, "noise .25", np.random.default_rng(0))
    moved = (found.vertices - BALL.vertices).std() / es.geometry.edge_lengths(BALL).mean()
    assert moved == pytest.approx(0.25, rel=0.05)
    assert np.array_equal(found.faces, BALL.faces)


def test_resolutions_are_half_and_double():
    half = perturbing.changed_whole(BALL, perturbing.HALF)
    assert half.n_faces == BALL.n_faces // 2
    assert es.geometry.is_closed(half)
    double = perturbing.changed_whole(BALL, perturbing.DOUBLE)
    assert es.geometry.mean_side_length(double) == pytest.approx(
        es.geometry.mean_side_length(BALL) / 2
    )


def test_turned_over_faces_in():
    rng = np.random.default_rng(0)
    assert es.geometry.enclosed_volume(perturbing.changed_part(BALL, perturbing.FLIPPED, rng)) < 0
    for change in (perturbing.CLEAN, perturbing.DOUBLE, *perturbing.SCANS):
        assert perturbing.changed_part(BALL, change, rng) is BALL
    for change in (perturbing.CLEAN, *perturbing.NOISES, perturbing.FLIPPED, *perturbing.SCANS):
        assert perturbing.changed_whole(BALL, change) is BALL


@pytest.mark.data
def test_a_change_keeps_side_planes_and_turn():
    one = next(one for one in draws.shapes() if one.path.endswith("psb122.ply"))
    for kind in ("partial", "incomplete"):
        clean = draws.make(draws.Version(one, kind, 1))
        noisy = draws.make(draws.Version(one, kind, 1, "noise .1"))
        assert np.array_equal(noisy.faces, clean.faces)
        assert np.abs(noisy.vertices - clean.vertices).max() < 0.1
        flipped = draws.make(draws.Version(one, kind, 1, perturbing.FLIPPED))
        assert np.array_equal(flipped.vertices, clean.vertices)
    scan = draws.make(draws.Version(one, "partial", 1, "scanner"))
    assert es.geometry.vertex_components(scan)[0] == 1
    assert not es.geometry.is_closed(scan)


def test_losses_are_of_the_same_queries():
    def outcome(kind, label):
        return Outcome(kind, "ant", (label,))

    clean = [outcome("partial", "ant"), outcome("incomplete", "cat"), outcome("partial", "ant")]
    changed = [outcome("partial", "ant"), outcome("incomplete", "cat"), outcome("partial", "cat")]
    assert robustness.loss(changed, clean, "noise .1")[0] == 33.3
    assert robustness.loss([changed[0], changed[2]], clean, "scanner")[0] == 50.0
    results = robustness.measure({"clean": {"as it is": clean}, "noise .1": {"as it is": changed}})
    assert results["noise .1"]["as it is"]["loss"][0] == 33.3


def test_faces_that_look_inward_cost_nothing():
    rates = FULL["rates"]
    assert rates["flipped"]["outward, denoised"] == rates["clean"]["outward, denoised"]


@pytest.mark.long
def test_queries_are_described_as_they_are_or_as_the_method_takes_them():
    method = methods.Patches("patches", recipe=es.retrieval.PatchRecipe())
    flipped = es.TriangleMesh(BALL.vertices, BALL.faces[:, ::-1])
    asking = [robustness.Asking(method, cure).describe(flipped) for cure in robustness.CURES]
    outward = es.describe(BALL, method.recipe)
    assert np.array_equal(asking[1].codes, outward.codes)
    assert not np.array_equal(asking[0].codes[0], outward.codes[0])
