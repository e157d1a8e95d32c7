"""The experiment on parts that overlap: its quick form."""

import pytest


@pytest.mark.long
def test_lizards_share_what_they_do_and_nothing_where_they_do_not(quick_form):
    found = quick_form("ch7_overlap/run.py")
    assert found["0.8"]["intersection over union"] > 0.75
    assert found["0.8"]["error"] < 4
    assert found["disjoint parts"]["found"] == 0
