"""The benchmark of bending runs from end to end."""


def test_the_script_runs(run_quick):
    (row,), printed, page = run_quick("bench_deform.py")
    assert row["what"] == "2,500, half"
    assert row["modes"] == 8
    assert 0 < row["free"] < 1
    steps = ("rig", "bind", "detail", "drag", "thesis", "graded", "arap", "igl_ready", "igl")
    assert all(row[step] > 0 for step in steps)
    assert row["drag"] < row["graded"] < row["rig"]
    assert "step 3, graded" in page
    assert "2,500, half" in printed
