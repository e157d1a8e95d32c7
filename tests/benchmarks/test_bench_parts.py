"""The benchmarks of factors and of the parts of a solve run, and their tables go where they belong."""

import sys
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


def test_factors_are_measured_and_what_is_not_installed_is_shown(run_quick):
    rows, _, text = run_quick("bench_factor.py")
    assert [row["method"] for row in rows[:2]] == ["eigenshape, LDLᵀ", "SuperLU, LU"]
    for row in rows:
        assert row["status"] in ("ok", "absent")
        if row["status"] == "ok":
            assert row["n"] == 642
            assert row["error"] < 1e-10
            assert row["factor"] > 0
    assert rows[0]["status"] == rows[1]["status"] == "ok"
    assert rows[0]["entries"] > 642
    assert rows[0]["flops"] > rows[0]["entries"]
    assert "| icosphere, 642 | eigenshape, LDLᵀ |" in text
    assert text.count("| absent |") == sum(row["status"] == "absent" for row in rows)


def test_parts_sum_to_the_whole_and_none_beats_its_bound(run_quick):
    rows, _, text = run_quick("bench_parts.py")
    assert sum(row["share"] for row in rows) == pytest.approx(1.0, abs=1e-6)
    calls = {row["part"]: row["calls"] for row in rows}
    assert calls["order and analysis"] == calls["Ritz vectors"] == 1
    assert calls["solves"] > calls["orthogonalization"] / 2 > 1
    assert calls["factors"] >= 2
    for row in rows:
        assert row["bound"] is None or row["seconds"] > 0.2 * row["bound"], row[
            "part"
        ]  # caches are faster than memory
    assert f"| icosphere, n = 2,562, k = 40 | {rows[0]['part']} |" in text


def test_threads_are_measured_and_give_the_same_digits(run_quick):
    rows, _, text = run_quick("bench_threads.py")
    assert {"spectrum", "factor", "solves", "patches", "waves", "heat"} < {
        row["case"] for row in rows
    }
    assert all(seconds > 0 for row in rows for seconds in row["seconds"].values())
    assert "| spectrum |" in text


def test_growth_is_measured_and_exponents_are_fitted(run_quick):
    rows, _, text = run_quick("bench_growth.py")
    assert {row["series"] for row in rows} == {"points", "pairs", "kernel", "large kernel"}
    for first, last in ((0, 1), (2, 3)):
        grown = (rows[last]["n"] * rows[last]["k"]) / (rows[first]["n"] * rows[first]["k"])
        slope = np.log(rows[last]["cpu"] / rows[first]["cpu"]) / np.log(grown)
        assert rows[last]["exponent"] == pytest.approx(slope)
    assert "| points | 1,000 | 10 | 7 |" in text


def test_the_operations_of_a_factor_are_counted_by_columns():
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import bench_parts
    finally:
        sys.path.remove(str(BENCHMARKS))
    from eigenshape.spectral.pencils import normalize

    pencil = normalize(es.cotangent_laplacian(es.icosphere(0)))
    moved, operations = bench_parts._factor(pencil.shift_pattern.elimination, None)
    entries = np.zeros((12, 12))
    e = pencil.shift_pattern.elimination
    for front in range(len(e.first) - 1):
        rows = e.rows[e.begins[front] : e.begins[front + 1]]
        for column in range(e.first[front], e.first[front + 1]):
            entries[rows[rows >= column], column] = 1
    assert operations == (entries.sum(axis=0) ** 2).sum()
    assert moved == 8 * e.n_entries
