"""eigenshape tetrahedralize: the inside of a surface."""

import pytest
from running import run, run_json

import eigenshape as es

pytest.importorskip("netgen.meshing", reason="the extra tetrahedralize is missing")


@pytest.mark.long
def test_tetrahedra_are_written_and_have_a_spectrum(tmp_path):
    es.write_mesh(es.icosphere(2), tmp_path / "ball.ply")
    done = run("tetrahedralize", tmp_path / "ball.ply", "-o", tmp_path / "ball.vtu")
    assert "tetrahedra of" in done.stdout
    found = run_json("spectrum", tmp_path / "ball.vtu", "-k", 5)
    assert found["certificate"]["complete"]
    finer = run_json(
        "tetrahedralize", tmp_path / "ball.ply", "--side-length", 0.15, "-o", tmp_path / "ball.vtu"
    )
    assert finer["n_points"] == es.io.read_shape(tmp_path / "ball.vtu").n_points > 250
