"""The benchmark of cortices runs from end to end, and what it compares agrees."""

import pytest


def test_the_script_runs_and_all_answers_agree(run_quick):
    pytest.importorskip("neuromodes")
    rows, printed, page = run_quick("bench_cortex.py")
    assert {row["library"] for row in rows} >= {"eigenshape", "LaPy", "neuromodes", "on eigenshape"}
    for row in rows:
        assert row["cpu"] >= 0
        # Eigenvalues and answers to rounding; means of nulls within standard errors.
        assert row["difference"] < (6 if row["case"].startswith("nulls") else 1e-7)
        assert row["case"] in printed
    assert "| human, 20 modes | eigenshape |" in page
    assert "certified" in page
