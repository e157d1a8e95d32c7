"""eigenshape transfer."""

import pytest
from characters import write_character
from running import run, run_json

import eigenshape as es
from eigenshape.io.formats.gltf import read_gltf


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("characters")
    write_character(path / "hero.glb", "biped", 1500)
    es.write_mesh(es.make_creature("biped", n_vertices=1200), path / "scan.ply")
    return path


def test_a_character_is_dressed(folder):
    output = folder / "rigged.glb"
    found = run_json("transfer", folder / "hero.glb", folder / "scan.ply", "-o", output)
    assert {"texture coordinates", "images", "skins", "morph targets", "animations"} <= {
        *found["carried"]
    }
    assert found["mean_confidence"] == 1.0
    assert found["share_filled"] == 0.0
    tree = read_gltf(output.read_bytes()).tree
    part = tree["meshes"][0]["primitives"][0]
    assert {"WEIGHTS_0", "TEXCOORD_0", "_CONFIDENCE"} <= part["attributes"].keys()
    assert len(part["targets"]) == 2
    assert es.read_mesh(output).n_faces == es.read_mesh(folder / "scan.ply").n_faces


def test_landmarks_are_written_beside(folder):
    hand = es.read_mesh(folder / "hero.glb").vertices
    points = hand[[hand[:, 0].argmax(), hand[:, 1].argmax()]]
    es.morphometrics.write_landmarks(
        es.morphometrics.Landmarks(["hand", "crown"], points), folder / "points.csv"
    )
    given = "--landmarks", folder / "points.csv"
    text = run(
        "transfer", folder / "hero.glb", folder / "scan.ply", "-o", folder / "b.glb", *given
    ).stdout
    assert "to 1,200 vertices; the mean confidence is 1.00" in text
    found = es.morphometrics.read_landmarks(folder / "b.landmarks.csv")
    assert found.names == ("hand", "crown")
    assert abs(found.points - points).max() < 0.05


def test_only_glb_is_written(folder):
    done = run("transfer", folder / "hero.glb", folder / "scan.ply", "-o", folder / "a.ply", code=2)
    assert "must be written to a file that ends in .glb" in done.stderr.replace("\n", " ")


def test_a_bare_source_is_refused(folder):
    done = run("transfer", folder / "scan.ply", folder / "scan.ply", "-o", folder / "c.glb", code=2)
    assert "The source must have something to transfer" in done.stderr.replace("\n", " ")
