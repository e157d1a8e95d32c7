"""The benchmark of starting runs from end to end."""

import pytest


@pytest.mark.long
def test_the_script_runs(run_quick):
    rows, printed, page = run_quick("bench_start.py")
    assert [row["start"] for row in rows] == ["import eigenshape", "eigenshape --help"]
    assert rows[0]["ratio"] == 1
    for row in rows:
        assert 0 < row["cpu"] < 60
        assert row["start"] in printed
    assert "| import eigenshape |" in page
