"""One-to-one correspondences of close surfaces: what the README shows and claims."""

import json
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch4_matching"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]
ROWS = FULL["points"]
DELTAS = ("0.04", "0.02", "0.01")
LAW, LESS, LEAST = "(log n)^(3/4) / √n", "(log n)^(1/2) / √n", "1 / √n"


def test_the_text_says_the_expected_figures():
    text = (FOLDER / "README.md").read_text()
    graph = FULL["the graph itself"]
    assert f"{graph['longest move / δ']:.1f} δ" in text
    assert f"{graph['bottleneck / δ']:.1f} δ" in text


@pytest.mark.long
def test_close_surfaces_of_another_topology_correspond_from_few_points_on(quick_form):
    found = quick_form("ch4_matching/run.py")
    assert found["genus"] == 12
    assert found["ρ"] == pytest.approx(4.257, abs=1e-3)
    deltas, rows = ("0.08", "0.04"), found["points"]
    assert found["δ of the pair"] <= min(map(float, deltas))
    for delta in deltas:
        shares = [row[f"δ = {delta}"]["probability"] for row in rows.values()]
        assert shares == sorted(shares)
        enough = next(int(n) for n, row in rows.items() if row[f"δ = {delta}"]["probability"] == 1)
        assert enough < 1e-6 * float(delta) ** -8
    # handles do not change the bottleneck, and the graph is generous
    for row in rows.values():
        assert row["bottleneck"][0] == pytest.approx(row["bottleneck, unchanged"][0], rel=0.15)
    assert -0.55 < found["rate"]["slope"] < -0.35
    graph = found["the graph itself"]
    assert graph["unmatched"] == 0
    assert (
        graph["bottleneck / δ"]
        < graph["longest move / δ"]
        <= graph["longest edge / δ"]
        <= found["ρ"] + 4
    )
