"""The benchmark of first calls runs from end to end, and the first of ours is the one that compiles."""


def test_the_script_runs_and_tells_compilation_from_work(run_quick):
    rows, printed, page = run_quick("bench_first_call.py")
    assert [row["library"] for row in rows] == ["eigenshape", "LaPy", "robust_laplacian"]
    for row in rows:
        assert row["call"] == "solve"
        assert row["library"] in printed
        assert row["both"] == row["import"] + row["first"]
    ours = rows[0]
    assert ours["first"] > 4 * ours["kept"]
    assert ours["first"] > 10 * ours["second"]
    assert "| solve | eigenshape |" in page
