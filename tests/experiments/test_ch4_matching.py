"""One-to-one correspondences of close surfaces: what the folder says is what comes out, and what its text claims."""

import json
from pathlib import Path

import pytest
from quick_forms import run_quickly

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_matching"
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
FULL = EXPECTED["full"]
ROWS = FULL["points"]
DELTAS = ("0.04", "0.02", "0.01")
LAW, LESS, LEAST = "(log n)^(3/4) / √n", "(log n)^(1/2) / √n", "1 / √n"


def test_the_readme_shows_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    for n, row in ROWS.items():
        cells = [row["bottleneck"][0], row["bottleneck, unchanged"][0]]
        line = f"| {n} | " + " | ".join(f"{cell:.4f}" for cell in cells) + " | "
        line += " | ".join(f"{row[f'δ = {d}']['probability']:.2f}" for d in DELTAS) + " | "
        assert line + " | ".join(f"{row[f'δ = {d}']['least reach / δ']:.2f}" for d in DELTAS) + " |" in text
    for law in (LAW, LESS, LEAST):
        fit = FULL["rate"][law]
        assert f"| {law} | {fit['constant']:.2f} | {100 * fit['unequal']:.0f} % |" in text
    graph = FULL["the graph itself"]
    assert f"{graph['longest move / δ']:.1f} δ" in text
    assert f"{graph['bottleneck / δ']:.1f} δ" in text


def test_the_pair_is_close_and_of_another_topology():
    assert FULL["genus"] == 12
    assert FULL["δ of the pair"] <= min(map(float, DELTAS))
    assert FULL["ρ"] == pytest.approx(4.257, abs=1e-3)


def test_enough_points_correspond_always_and_far_fewer_than_the_theorem_asks_for():
    for delta in DELTAS:
        shares = [row[f"δ = {delta}"]["probability"] for row in ROWS.values()]
        assert shares == sorted(shares)
        enough = next(int(n) for n, row in ROWS.items() if row[f"δ = {delta}"]["probability"] == 1)
        assert enough < 1e-6 * float(delta) ** -8
    assert ROWS["31"]["δ = 0.01"]["probability"] == 0


def test_handles_do_not_change_the_bottleneck():
    for row in ROWS.values():
        assert row["bottleneck"][0] == pytest.approx(row["bottleneck, unchanged"][0], rel=0.1)


def test_the_rate_is_near_the_known_one():
    assert -0.5 < FULL["rate"]["slope"] < -0.4
    assert max(FULL["rate"][LAW]["unequal"], FULL["rate"][LESS]["unequal"]) < FULL["rate"][LEAST]["unequal"]


def test_the_graph_is_generous():
    graph = FULL["the graph itself"]
    assert graph["unmatched"] == 0
    assert graph["bottleneck / δ"] < graph["longest move / δ"] <= graph["longest edge / δ"] <= FULL["ρ"] + 4


def test_the_quick_form_gives_the_expected_figures(tmp_path):
    found, expected = run_quickly(FOLDER, tmp_path), EXPECTED["quick"]
    for n, row in expected["points"].items():
        for name, value in row.items():
            assert found["points"][n][name] == pytest.approx(value, rel=1e-3), (n, name)
    assert found["the graph itself"] == pytest.approx(expected["the graph itself"], rel=1e-3)
    assert found["δ of the pair"] == pytest.approx(expected["δ of the pair"], rel=1e-3)
