"""The benchmark of feature points runs from end to end, and the libraries find the points that we do."""


def test_the_script_runs_and_all_methods_agree(run_quick):
    found, printed, _ = run_quick("bench_features.py")
    rows = {row["method"]: row for row in found}
    assert set(rows) == {
        "eigenshape, certified",
        "eigenshape",
        "eigenshape, 1e-3",
        "pyFM and ToMATo",
        "LaPy, NumPy and ToMATo",
    }
    for name, row in rows.items():
        assert row["cpu"] > 0
        assert row["memory"] >= 0
        assert row["features_off"] <= 3
        assert name in printed
    assert rows["eigenshape"]["true"] < 1e-12  # so few vertices are solved with proof
    assert rows["pyFM and ToMATo"]["true"] < 1e-6
    assert 0 < rows["LaPy, NumPy and ToMATo"]["true"] < 0.1
