"""`eigenshape compress` and `eigenshape decompress`: there and back on the command line."""

import json

import numpy as np
import pytest
from running import run

import eigenshape as es


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "ball.off"
    es.write_mesh(es.icosphere(2), path)
    return path


def test_there_and_back(ball, tmp_path):
    small, again = tmp_path / "ball.esz", tmp_path / "again.ply"
    facts = json.loads(run("compress", ball, "-o", small, "--bits", "10", "--json").stdout)
    assert facts["bytes"] == small.stat().st_size < ball.stat().st_size / 5
    assert facts["connectivity_bytes"] + facts["geometry_bytes"] < facts["bytes"]
    run("decompress", small, "-o", again)
    radii = np.linalg.norm(es.read_mesh(again).vertices, axis=1)
    assert np.abs(radii - 1).max() <= facts["max_error"] + 1e-6


def test_the_text_says_what_is_lost(ball, tmp_path):
    text = " ".join(run("compress", ball, "-o", tmp_path / "b.esz").stdout.split())
    assert "bits a vertex (faces" in text
    assert "vertices move by" in text


def test_bad_files_and_paths_are_named(ball, tmp_path):
    assert (
        "must begin with the bytes"
        in run("decompress", ball, "-o", tmp_path / "x.ply", code=1).stderr
    )
    wrong = run("compress", ball, "-o", tmp_path / "ball.zip", code=2).stderr
    assert "must be written to a file that ends in .esz" in " ".join(wrong.split())
    missing = run("decompress", tmp_path / "no.esz", "-o", tmp_path / "x.ply", code=1).stderr
    assert "no.esz" in missing
