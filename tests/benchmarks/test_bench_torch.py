"""The benchmark of gradients, operators and encodings runs from end to end, and its figures hold together."""

import pytest


def test_each_group_has_its_rows(run_quick):
    pytest.importorskip(
        "torch.nn", reason="torch is not installed: pip install 'eigenshape[torch]'"
    )
    rows, printed, page = run_quick("bench_torch.py")
    found = {row["figure"]: row for row in rows}
    assert found["time of heat kernel signature"]["ours"] > 0
    assert found["operators of creatures"]["failures"] == [0, 0]
    assert found["repeated"]["worst"] < 1e-12
    assert found["repeated"]["different"] > 50
    assert printed.count("backward of") == 4
    assert page.count("| encodings by projectors |") == 1
