"""Building an index: bad files, workers, parts and readers, from end to end on something small."""

import pytest


@pytest.mark.long
def test_nothing_is_lost_and_nothing_is_half(run_quick):
    rows, printed, page = run_quick("bench_build.py")
    figures = {(row["case"], row["figure"]): row["value"] for row in rows}
    assert figures["bad", "good files that are not indexed"] == 0
    assert figures["bad", "bad files"] == 23
    assert figures["bad", "bad files that are not named"] == 0
    assert figures["bad", "exit code"] == 3
    assert figures["workers", "CPU, 2 at work"] > 0
    assert figures["parts", "answers of the merged parts that differ"] == 0
    assert figures["readers", "readers"] == 16
    assert figures["readers", "queries"] > 16
    assert figures["readers", "changes"] > 3
    assert figures["readers", "errors and states that are not whole"] == 0
    assert figures["readers", "damages at the end"] == 0
    assert printed.count("none") == page.count("none") == 5
