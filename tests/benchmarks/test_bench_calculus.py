"""The benchmark of Poisson and heat solves runs from end to end, and all libraries agree."""

import pytest


@pytest.mark.long
def test_the_script_runs_and_all_libraries_agree(run_quick):
    rows, printed, page = run_quick("bench_calculus.py", "--repeats", "1")
    assert [row["count"] for row in rows] == [1] * 3 + [100] * 3 + [1, 1, 100, 100] * 2
    assert {row["library"] for row in rows} == {"eigenshape", "LaPy", "libigl", "potpourri3d"}
    for row in rows:
        assert row["n"] == 600
        assert row["cpu"] > 0
        assert row["library"] in printed
    same = [row["difference"] for row in rows if row["task"] != "distances by heat"]
    assert max(same) < 1e-9
    assert "| 1, Poisson | eigenshape |" in page
