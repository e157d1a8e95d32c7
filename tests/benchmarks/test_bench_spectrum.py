"""The solver's benchmark runs from end to end, calls every library, and counts what is missing."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

import eigenshape as es

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def modules():
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import bench_spectrum
        import machine
        import report
        import spectrum_cases
        import spectrum_libraries
        import spectrum_tables
        import spectrum_worker

        yield {
            "bench": bench_spectrum,
            "cases": spectrum_cases,
            "libraries": spectrum_libraries,
            "machine": machine,
            "report": report,
            "tables": spectrum_tables,
            "worker": spectrum_worker,
        }
    finally:
        sys.path.remove(str(BENCHMARKS))


def shape_of(mesh, n_neighbors=8):
    return {
        "vertices": np.array(mesh.vertices),
        "faces": np.array(mesh.faces),
        "adjacency": es.operators.neighbor_graph(mesh.vertices, n_neighbors),
    }


def test_the_script_runs_and_its_json_has_what_it_should(tmp_path):
    report = tmp_path / "report.json"
    command = [
        sys.executable,
        BENCHMARKS / "bench_spectrum.py",
        "--quick",
        "--cases",
        "torus",
        "-k",
        "12",
    ]
    more = ["--libraries", "lumped", "--repeats", "2", "--json", report]
    wide = {**os.environ, "COLUMNS": "200"}  # so that no name is broken
    done = subprocess.run([*command, *more], capture_output=True, text=True, check=True, env=wide)
    assert "LaPy, lumped" in " ".join(done.stdout.split())
    found = json.loads(report.read_text())
    assert {"cpu", "cores", "memory_gib", "load", "blas", "versions"} <= found["machine"].keys()
    assert found["machine"]["versions"]["lapy"]
    assert [row["library"] for row in found["rows"]] == ["eigenshape", "LaPy, lumped"]
    for row in found["rows"]:
        assert (row["status"], row["n"], row["k"]) == ("ok", 864, 12)
        assert row["cpu"] > 0
        assert row["wall"] > 0
        assert row["memory_peak"] > row["memory"] >= 0
        assert len(row["cpu_runs"]) == 2
        assert row["residual"] < 1e-9
        assert row["wrong"] == row["missing"] == row["missing_by_inertia"] == 0
    assert found["rows"][0]["ratio"] == 1.0
    assert [row[:2] for row in found["table"]] == [
        ["torus, n = 864, k = 12, 2 runs", "eigenshape"],
        ["torus, n = 864, k = 12, 2 runs", "LaPy, lumped"],
    ]


def is_installed(library):
    """Return whether a library is here; the two that only benchmarks use need not be."""
    optional = library.package in ("cholespy", "pypardiso")
    return not optional or find_spec(library.package) is not None


def test_every_library_solves_the_pencil_that_it_says(modules):
    shape = shape_of(es.shapes.torus(24, 16))
    shape["vertices"] *= [1.0, 1.1, 0.9]  # no symmetry left: nothing to be missed
    libraries = modules["libraries"].LIBRARIES
    for name in [name for name in libraries if is_installed(libraries[name])]:
        library = libraries[name]
        found, (values, vectors), matrices = modules["worker"].measured(library, shape, 10)
        expected = modules["worker"].reference(matrices, 10)
        np.testing.assert_allclose(values, expected, atol=1e-6 * expected[-1], err_msg=name)
        assert modules["worker"].worst_residual(values, vectors, matrices) < 1e-6, name
        assert found["cpu"] > 0


def test_a_wrong_list_is_counted(modules):
    worker = modules["worker"]
    laplacian = es.cotangent_laplacian(es.shapes.torus(16, 12))
    matrices = laplacian.stiffness.tocsc(), laplacian.mass.tocsc()
    spectrum = es.solve_spectrum(laplacian, 20)
    np.testing.assert_allclose(worker.reference(matrices, 20), spectrum.eigenvalues, atol=1e-12)
    longer = es.solve_spectrum(laplacian, 21).eigenvalues
    lacking = np.delete(longer, 1)  # one of two copies
    assert worker.missing(spectrum.eigenvalues, spectrum.eigenvalues) == 0
    assert worker.missing(lacking, spectrum.eigenvalues) == 1
    assert worker.wrong(spectrum.eigenvalues, spectrum.eigenvalues) == 0
    assert worker.wrong(lacking, spectrum.eigenvalues) > 0
    assert worker.wrong(np.full(20, np.nan), spectrum.eigenvalues) == 20
    assert worker.missing_by_inertia(spectrum.eigenvalues, matrices) == 0
    assert worker.missing_by_inertia(lacking, matrices) == 1


def test_a_library_that_fails_or_never_ends_is_shown(modules, tmp_path, monkeypatch):
    bench = modules["bench"]
    path = tmp_path / "broken.npz"
    np.savez(path, vertices=np.zeros((3, 3)), faces=np.array([[0, 1, 9]]))
    task = {"shape": str(path), "library": "eigenshape", "k": 1, "core": 0, "check": False}
    failed = bench.run_worker(task, 60.0)
    assert failed["status"] == "failed"
    assert "faces must index vertices 0..2" in failed["reason"]
    assert bench.run_worker(task, 0.01)["status"] == "over the limit"
    row = bench.with_ratios(
        [{"library": "eigenshape", "case": "a", "title": "A", "n": 3, "k": 1} | failed]
    )[0]
    assert "failed" in modules["tables"].cells(row)[1]
    monkeypatch.setattr(bench, "WORKER", tmp_path / "absent.py")
    assert "process ended with 2" in bench.run_worker(task, 60.0)["reason"]


def test_the_residual_is_relative_to_the_last_eigenvalue(modules):
    matrices = (
        sp.csc_array(np.diag([0.0, 4.0])),
        sp.csc_array(np.diag([1.0, 4.0])),
    )  # eigenvalues 0 and 1
    assert modules["worker"].worst_residual(np.array([0.0, 1.0]), np.eye(2), matrices) == 0.0
    assert modules["worker"].worst_residual(
        np.array([0.0, 2.0]), np.eye(2), matrices
    ) == pytest.approx(0.5)


def test_the_memory_of_a_call_is_seen(modules):
    level = modules["machine"].memory_now()
    block = np.ones(2**23)  # 64 MiB
    del block
    assert 60 < modules["machine"].peak_memory() - level < 80


def test_cases_by_name_and_meshes_of_ones_own(modules, tmp_path):
    bench = modules["bench"]
    assert list(bench.chosen_cases(bench.arguments(["--quick", "--cases", "graph"]))) == ["graph"]
    with pytest.raises(SystemExit, match=r"'nothing' is not"):
        bench.chosen_cases(bench.arguments(["--cases", "nothing"]))
    es.write_mesh(es.icosphere(1), tmp_path / "own.off")
    case = bench.chosen_cases(bench.arguments([str(tmp_path / "own.off")]))["own.off"]
    assert case.save(tmp_path / "own.npz") == 42
    assert len(modules["worker"].load(tmp_path / "own.npz")["faces"]) == 80


def test_a_graph_comes_back_from_its_file(modules, tmp_path):
    case = modules["cases"].QUICK["graph"]
    n = case.save(tmp_path / "graph.npz")
    adjacency = modules["worker"].load(tmp_path / "graph.npz")["adjacency"]
    assert (adjacency != es.operators.neighbor_graph(case.make(), case.neighbors)).nnz == 0
    assert n == adjacency.shape[0] == 800
