"""eigenshape fuse: frames become one surface, and what fits nowhere is named."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scans")
    whole = es.make_creature("quadruped", n_vertices=3000)
    paths = [folder / "front.ply", folder / "beside.ply", folder / "ball.ply"]
    for number, view in enumerate(([0, 0, 1], [0.5, 0, 1])):
        scan = es.scans.simulate_scan(whole, np.random.default_rng(number), view=view)
        es.write_mesh(scan.mesh, paths[number])
    es.write_mesh(es.icosphere(3), paths[2])
    return paths


@pytest.mark.long
def test_frames_are_fused_and_a_stranger_is_named(scans, tmp_path):
    output = tmp_path / "whole.ply"
    arguments = ["fuse", *map(str, scans), "-o", str(output), "--json"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 3, done.output
    facts = json.loads(done.stdout)
    assert [scan["joined"] for scan in facts["scans"]] == [True, True, False]
    assert facts["scans"][0]["rotation"] == np.eye(3).tolist()
    assert es.read_mesh(output).n_faces == facts["faces"]
    assert "ball.ply fits no other scan" in done.stderr


@pytest.mark.long
def test_all_that_fits_is_done(scans, tmp_path):
    output = tmp_path / "one.ply"
    done = CliRunner().invoke(app, ["fuse", str(scans[0]), "-o", str(output)])
    assert done.exit_code == 0, done.output
    assert "joined 1 of 1 scans" in done.stdout
