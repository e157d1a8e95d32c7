"""`eigenshape stability`: two shapes on the command line."""

import json

import numpy as np
import pytest
from running import run

import eigenshape as es

PNG = b"\x89PNG\r\n\x1a\n"
FEW = ("-k", "6", "-n", "200")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("stability")
    mesh = es.shapes.torus(30, 15)
    es.write_mesh(mesh, place / "one.ply")
    es.write_mesh(es.TriangleMesh(mesh.vertices * [1, 1, 1.3], mesh.faces), place / "two.ply")
    es.write_mesh(es.geometry.subdivide(mesh), place / "finer.ply")
    (place / "map.txt").write_text("".join(f"{vertex}\n" for vertex in range(mesh.n_vertices)))
    return place


def test_another_unit_and_open_seams_are_named(folder, tmp_path):
    torus = es.read_mesh(folder / "one.ply")
    es.write_mesh(es.TriangleMesh(torus.vertices * 25.4, torus.faces), tmp_path / "in mm.ply")
    rings = es.shapes.grid(12, 8)
    angles = 2 * np.pi * rings.vertices[:, 0] / rings.vertices[:, 0].max()
    tube = np.column_stack([np.cos(angles), np.sin(angles), rings.vertices[:, 1]])
    es.write_mesh(es.TriangleMesh(tube, rings.faces), tmp_path / "tube.ply")

    units = ("stability", folder / "one.ply", tmp_path / "in mm.ply", *FEW)
    said = run(*units).stderr
    assert "note: lengths of in mm.ply are 25.4 times as large" in said
    normalized = run(*units, "--normalize", "area", "--json")
    assert "times as large" not in normalized.stderr
    assert max(json.loads(normalized.stdout)["spectra"]["relative"]) < 1e-6
    said = run("stability", tmp_path / "tube.ply", folder / "one.ply", *FEW).stderr
    assert said.count("warning: Both sides of a seam must share their vertices") == 1
    assert "(8 such)" in said


@pytest.mark.long
def test_people_see_tables_words_and_a_picture(folder, tmp_path):
    picture = tmp_path / "report.png"
    printed = run(
        "stability", folder / "one.ply", folder / "two.ply", *FEW, "--picture", picture
    ).stdout
    for words in (
        "Eigenvalues, in 1/length²",
        "heat time t",
        "Weyl's bound",
        "heat time is reliable",
        "δ-close",
    ):
        assert words in printed
    assert picture.read_bytes()[:8] == PNG


def test_machines_read_json(folder):
    found = json.loads(
        run("stability", folder / "one.ply", folder / "two.ply", *FEW, "--json").stdout
    )
    report = es.compare_shapes(
        *(es.read_mesh(folder / name) for name in ("one.ply", "two.ply")),
        es.stability.StabilityPlan(k=6, n_samples=200),
    )
    assert found["delta"] == report.delta
    assert found["spectra"]["one"] == report.spectra.one.tolist()
    assert found["spectra"]["hausdorff"] == report.spectra.hausdorff
    assert [row["change"] for row in found["changes"]] == [
        change.change for change in report.changes
    ]
    assert found["explanation"] == report.explain()


@pytest.mark.long
def test_a_map_and_a_scale_can_be_given(folder):
    same = run(
        "stability",
        folder / "one.ply",
        folder / "finer.ply",
        *FEW,
        "--map",
        folder / "map.txt",
        "--json",
    )
    assert json.loads(same.stdout)["delta_of_the_map"] == 0.0
    told = run(
        "stability",
        folder / "one.ply",
        folder / "two.ply",
        *FEW,
        "--normalize",
        "area",
        "-t",
        "0.01",
        "--json",
    )
    assert [row["t"] for row in json.loads(told.stdout)["changes"]] == [0.01]


def test_what_cannot_be_compared_is_named(folder, tmp_path):
    one, wrong = folder / "one.ply", tmp_path / "wrong.txt"
    wrong.write_text("0\nhead\n")
    done = run("stability", one, one, "--map", wrong, code=1)
    assert "A vertex must be a whole number; line 2" in done.stderr
    wrong.write_text("0 1\n2 3\n")
    assert (
        "A vertex must be a whole number; line 1"
        in run("stability", one, one, "--map", wrong, code=1).stderr
    )
    wrong.write_text("0\n1\n")
    assert "there are 2 for 450" in run("stability", one, one, "--map", wrong, code=2).stderr
    points = tmp_path / "points.xyz"
    np.savetxt(points, np.random.default_rng(0).random((300, 3)))
    assert (
        "--normalize is for triangle meshes"
        in run("stability", points, one, "--normalize", "area", code=2).stderr
    )
    assert "A picture must end" in run("stability", one, one, "--picture", "a.gif", code=2).stderr
    assert run("stability", one, code=2)
