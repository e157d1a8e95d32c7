"""eigenshape match and pose."""

import csv
import json

import numpy as np
import pytest
from running import run

import eigenshape as es

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("fish")
    meshes = [es.make_creature("fish", pose, n_vertices=500) for pose in (0, 1)]
    es.write_mesh(meshes[0], path / "rest.ply")
    es.write_mesh(meshes[1], path / "posed.ply")
    # Coarser ones take a third of the time, and what is printed and written does not depend on it.
    rest, posed = (es.geometry.decimate(mesh, n_faces=400).mesh for mesh in meshes)
    es.write_mesh(es.partial_scan(rest, [0, 0, 1]).mesh, path / "scan.ply")
    es.write_mesh(posed, path / "whole.ply")
    return path


def test_a_scan_is_matched_and_the_map_is_written(folder):
    scan, whole = folder / "scan.ply", folder / "whole.ply"
    n = es.read_mesh(scan).n_vertices
    files = [folder / f"map.{suffix}" for suffix in ("csv", "npz", "txt")]
    picture = folder / "map.png"
    done = run("match", scan, whole, "--json", "-o", files[0], "--picture", picture)
    found = json.loads(done.stdout)
    assert found["n_vertices"] == n == len(found["vertices"])
    assert picture.read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader(files[0].read_text().splitlines()))
    assert [int(row["whole_vertex"]) for row in rows] == found["vertices"]
    assert [float(row["confidence"]) for row in rows] == pytest.approx(
        found["vertex_confidence"], rel=1e-3
    )
    for file in files[1:]:
        run("match", scan, whole, "-o", file)
    with np.load(files[1]) as arrays:
        assert arrays["vertices"].tolist() == found["vertices"]
        assert arrays["weights"].shape == (n, 3)
    assert [int(line) for line in files[2].read_text().split()] == found["vertices"]


def test_a_map_says_how_sure_it_is(folder):
    text = run("match", folder / "scan.ply", folder / "whole.ply").stdout
    assert "have a confidence of at least 0.5, the mean is 0." in text


def test_a_scale_is_a_word_or_a_number(folder):
    arguments = "match", folder / "scan.ply", folder / "whole.ply", "--scale"
    assert json.loads(run(*arguments, "0.9", "--json").stdout)["scale"] == 0.9
    assert "--scale takes auto, known, unknown or a number; it is 'big'" in run(
        *arguments, "big", code=2
    ).output.replace("\n", " ")


def test_what_two_parts_share_is_written(folder, tmp_path):
    mesh = es.read_mesh(folder / "rest.ply")
    below, above = np.quantile(mesh.vertices[:, 2], [0.25, 0.75])
    paths = tmp_path / "low.ply", tmp_path / "high.ply"
    for path, plane in zip(paths, [[0, 0, 1, above], [0, 0, -1, -below]], strict=True):
        es.write_mesh(es.scans.cut_by_planes(mesh, [plane]).mesh, path)
    table, picture = tmp_path / "map.csv", tmp_path / "map.png"
    arguments = "match", *paths, "--overlap", "partial"
    found = json.loads(run(*arguments, "--json", "-o", table, "--picture", picture).stdout)
    places = np.array(found["vertices"])
    assert 0 < (places >= 0).sum() < len(places)
    assert 0 < sum(found["covered"]) < es.read_mesh(paths[1]).n_vertices
    assert any("the shapes share" in sentence for sentence in found["report"])
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [int(row["whole_vertex"]) for row in rows] == found["vertices"]
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "overlap" in run("match", *paths, "--overlap", "some", code=2).output


def test_a_raw_file_is_repaired_and_loose_pieces_are_named(folder):
    mesh = es.read_mesh(folder / "scan.ply")
    n = mesh.n_vertices
    speck = mesh.vertices[0] + 1e-3 * np.eye(3)
    raw = es.TriangleMesh(
        np.vstack([mesh.vertices, speck]),
        np.vstack([mesh.faces, mesh.faces[:1], [[n, n + 1, n + 2]]]),
    )
    es.write_mesh(raw, folder / "raw.ply")
    done = run("match", folder / "raw.ply", folder / "whole.ply")
    assert "drop_duplicate_faces removed 1 face" in done.stderr
    assert "1 loose piece of" in done.stdout
    assert "of the area of the part was left out." in done.stdout
    refused = run(
        "match", folder / "raw.ply", folder / "whole.ply", "--repair", "none", code=1
    ).output.replace("\n", " ")
    assert "--repair auto" in refused


def test_a_shape_that_turns_into_itself_says_so(folder):
    es.write_mesh(es.shapes.torus(20, 8), folder / "ring.ply")
    found = json.loads(run("match", folder / "ring.ply", folder / "ring.ply", "--json").stdout)
    assert found["n_equally_good"] > 3
    assert found["mean_confidence"] < 0.3
    text = run("match", folder / "ring.ply", folder / "ring.ply").stdout
    assert "maps that differ fit equally well" in text.replace("\n", " ")


def test_a_map_is_written_to_known_files_only(folder):
    done = run("match", folder / "scan.ply", folder / "whole.ply", "-o", folder / "map.xls", code=2)
    assert "must be written to a file that ends in .csv, .npz, .txt" in done.output


@pytest.mark.parametrize("rest", [False, True])
def test_a_mesh_takes_a_pose(folder, tmp_path, rest):
    bent, picture = tmp_path / "bent.ply", tmp_path / "poses.png"
    more = ("--rest", folder / "rest.ply", "--json") if rest else ()
    arguments = "pose", folder / "rest.ply", "--like", folder / "posed.ply", *more
    done = run(*arguments, "-o", bent, "--picture", picture)
    assert es.read_mesh(bent).n_vertices == es.read_mesh(folder / "rest.ply").n_vertices
    assert picture.exists()
    if rest:
        assert json.loads(done.stdout)["like"].endswith("posed.ply")
