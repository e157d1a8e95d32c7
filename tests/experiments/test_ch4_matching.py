"""One-to-one correspondences of close surfaces: what the README claims."""

import pytest


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
