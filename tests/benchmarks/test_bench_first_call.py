"""The benchmark of first calls runs from end to end, and tells imports from work."""


def test_the_script_runs_and_tells_imports_from_work(run_quick):
    rows, printed, page = run_quick("bench_first_call.py")
    assert [row["library"] for row in rows] == ["eigenshape", "LaPy", "robust_laplacian"]
    for row in rows:
        assert row["call"] == "solve"
        assert row["library"] in printed
        assert row["both"] == row["import"] + row["first"]
        assert row["second"] > 0  # a loaded machine decides which of the two is longer
    assert "| solve | eigenshape |" in page
