"""The benchmark of approximate spectra runs from end to end, and its figures hold together."""


def test_the_quick_case_has_an_exact_row_and_one_for_each_accuracy(run_quick):
    (exact, *rough), printed, page = run_quick(
        "bench_approximate.py", "--accuracies", "0.1", "1e-4"
    )
    assert printed.count("icosphere, n = 2,562, k = 20") == 3
    assert page.count("| icosphere, n = 2,562, k = 20 | exact |") == 1
    assert exact["complete"]
    assert exact["true"] == 0.0
    assert [row["accuracy"] for row in rough] == [0.1, 1e-4]
    for row in rough:
        assert not row["complete"]
        assert row["true"] <= row["estimated"] <= row["accuracy"]
        assert row["true"] <= row["bound"]
        assert row["cpu"] > 0
