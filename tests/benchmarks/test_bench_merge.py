"""The benchmark of region merging runs from end to end, and GUDHI finds the pairs that we do."""


def test_the_script_runs_and_all_methods_agree(run_quick):
    rows, printed, page = run_quick("bench_merge.py")
    assert [row["function"] for row in rows] == ["waves"] * 4 + ["noise"] * 4
    assert {row["method"] for row in rows if row["equals_ours"]} == {"GUDHI, whole mesh"}
    for row in rows:
        assert row["n"] == 588
        assert row["cpu"] > 0
        assert row["wall"] > 0
        assert row["memory"] >= 0
        assert row["maxima"] == rows[4 * (row["function"] == "noise")]["maxima"]
        assert row["method"] in printed
    assert "| 588, waves | eigenshape |" in page
    assert "|  | GUDHI, whole mesh (same pairs) |" in page
