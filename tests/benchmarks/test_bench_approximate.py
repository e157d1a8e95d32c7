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


def test_the_peer_comes_below_the_accuracy_before_it_is_timed(run_quick):
    (exact, ours, peer), _, page = run_quick("bench_approximate.py", "--peers")
    assert page.count("| LOBPCG to 0.001 |") == 1
    assert exact["complete"]
    assert ours["true"] <= ours["accuracy"] == peer["accuracy"]
    assert peer["true"] <= peer["accuracy"]
    assert 1 <= peer["iterations"] < 20
    assert peer["cpu"] > 0
