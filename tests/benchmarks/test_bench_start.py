"""The benchmarks of starting, of single calls and of kernels run from end to end."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.long
def test_the_script_runs(run_quick):
    rows, printed, page = run_quick("bench_start.py")
    assert [row["start"] for row in rows] == ["import eigenshape", "eigenshape --help"]
    assert rows[0]["ratio"] == 1
    for row in rows:
        assert 0 < row["cpu"] < 60
        assert row["start"] in printed
    assert "| import eigenshape |" in page


@pytest.mark.long
def test_the_size_of_an_installation_is_measured(run_quick):
    ((row,), printed, page) = run_quick("bench_size.py")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert row["packages"] > len(project["dependencies"])
    assert 0.1 < row["packed"] < 5 < row["whole"]
    assert "eigenshape" in printed
    assert "| eigenshape |" in page


@pytest.mark.long
def test_single_calls_are_timed(run_quick):
    rows, _, page = run_quick("bench_calls.py", "--only", "brackets")
    assert [row["call"] for row in rows] == ["20 certified pairs", "20 brackets"]
    assert all(0 < row["cpu"] < 60 for row in rows)
    assert "| sphere, 3,500 points, smaller | 20 certified pairs |" in page


@pytest.mark.long
def test_all_methods_assemble_the_same_kernel(run_quick):
    rows, _, _ = run_quick("bench_kernel.py")
    assert len(rows) == 3
    for row in rows[1:]:
        assert row["trace"] == pytest.approx(rows[0]["trace"], rel=1e-12)
        assert row["entries"] == rows[0]["entries"]


@pytest.mark.long
def test_all_libraries_solve_the_same_tetrahedra(run_quick):
    rows, _, page = run_quick("bench_tetrahedra.py")
    errors = {}
    for row in rows:
        errors.setdefault(row["order"], {})[row["library"]] = row["error"]
    assert errors[1].keys() >= {"eigenshape", "ARPACK", "LaPy"}
    for found in errors.values():
        ours = found["eigenshape"]
        assert list(found.values()) == pytest.approx([ours] * len(found), rel=1e-4)
    linear, quadratic, cubic = (errors[order]["eigenshape"] for order in (1, 2, 3))
    assert cubic < quadratic / 10 < linear / 100
    assert "| P3 | eigenshape | 4,096 |" in page
