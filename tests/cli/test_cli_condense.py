"""eigenshape condense: regions of like heat of many shapes, in one table."""

import csv
import sys

import numpy as np
import pytest
from running import run, run_json

import eigenshape as es


@pytest.fixture
def shapes(tmp_path):
    folder = tmp_path / "shapes"
    folder.mkdir()
    for name, factor in (("one", 1.0), ("two", 1.5)):
        ball = es.icosphere(2)
        es.write_mesh(
            es.TriangleMesh(ball.vertices * [1, 1, factor], ball.faces), folder / f"{name}.ply"
        )
    (folder / "worse.off").write_text("OFF\n1 1 0\n0 0 0\n3 0 1 2\n")
    return folder


@pytest.mark.long
def test_a_table_has_the_regions_of_all_shapes(shapes, tmp_path):
    output = tmp_path / "table.csv"
    found = run_json("condense", shapes, "--times", "0.1,0.3", "-n", 30, "-o", output, code=3)
    assert [each["shape"] for each in found["shapes"]] == ["one", "two"]
    assert all(each["lost"] <= 0.05 and each["heat_error"] == 0 for each in found["shapes"])
    assert list(found["failures"]) == ["worse"]
    with output.open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(each["n_regions"] for each in found["shapes"])
    mesh = es.read_mesh(shapes / "two.ply")
    heat = es.heat_kernel_signature(es.solve_spectrum(es.cotangent_laplacian(mesh), 30), [0.1, 0.3])
    regions = es.features.condense(mesh, np.log(heat))
    of_two = [row for row in rows if row["shape"] == "two"]
    assert [float(row["log_heat_0.3"]) for row in of_two] == regions.values[:, 1].tolist()
    assert [float(row["area"]) for row in of_two] == regions.areas.tolist()
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    run(
        "condense", shapes / "two.ply", "--times", "0.1,0.3", "-n", 30, "-o", tmp_path / "t.parquet"
    )
    table = parquet.read_table(tmp_path / "t.parquet")
    assert table["log_heat_0.3"].to_pylist() == regions.values[:, 1].tolist()


@pytest.mark.long
def test_too_few_modes_are_named(shapes, tmp_path):
    done = run(
        "condense", shapes / "one.ply", "--times", "0.001", "-n", 9, "-o", tmp_path / "t.csv"
    )
    assert "9 modes end too early for the time 0.001" in done.stderr
    done = run("condense", shapes, "--times", "soon", "-o", tmp_path / "t.csv", code=2)
    assert "--times takes numbers separated by commas" in done.stderr


def test_a_missing_pyarrow_is_named_before_anything_is_read(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.delitem(sys.modules, "pyarrow.parquet", raising=False)
    done = run("condense", "absent.ply", "--times", "1", "-o", tmp_path / "t.parquet", code=1)
    assert "pyarrow must be installed" in done.stderr
