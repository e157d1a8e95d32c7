"""`eigenshape label`: what it gives is what `transfer_labels` gives, in every form."""

import json
import shutil

import numpy as np
import pytest
from running import run

from eigenshape.features.parts import find_parts
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.label_files import read_labels, write_labels
from eigenshape.io.labeled_shapes import read_labeled_shape
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.retrieval.labels.transfer import transfer_labels
from eigenshape.shapes.creatures import make_creature


@pytest.fixture(scope="module")
def poses(tmp_path_factory):
    """Write three poses of a giraffe, and labels of two: ten times the number of the part, plus one."""
    folder = tmp_path_factory.mktemp("poses")
    rest, raised, posed = (make_creature("giraffe", pose, n_vertices=1200) for pose in (0, 1, 3))
    labels = 10 * find_parts(rest).parts.labels + 1
    write_mesh(rest, folder / "rest.ply")
    write_mesh(posed, folder / "posed.ply")
    write_labels(labels, folder / "rest.seg")
    write_mesh(raised, folder / "raised.ply", face_labels=labels)
    return folder


def command(poses, *more):
    return (
        "label",
        poses / "posed.ply",
        "--like",
        poses / "rest.ply",
        "--labels",
        poses / "rest.seg",
        *more,
    )


@pytest.mark.long
def test_label_gives_what_transfer_labels_gives(poses, tmp_path):
    saved, colored, picture = tmp_path / "posed.seg", tmp_path / "posed.ply", tmp_path / "both.png"
    run(*command(poses, "-o", saved))
    done = run(*command(poses, "--json", "-o", colored, "--picture", picture))
    found = json.loads(done.stdout)
    posed = read_mesh(poses / "posed.ply")
    expected = transfer_labels(read_labeled_shape(poses / "rest.ply"), posed)
    assert found["face_labels"] == expected.labels.tolist() == read_labels(saved).tolist()
    assert found["face_confidence"] == pytest.approx(expected.confidence.tolist())
    assert [row["label"] for row in found["parts"]] == expected.part_labels.tolist()
    assert [row["confidence"] for row in found["parts"]] == pytest.approx(
        expected.part_confidence.tolist()
    )
    assert found["like"] == {str(poses / "rest.ply"): 1.0}
    assert sum(row["area_share"] for row in found["parts"]) == pytest.approx(1)
    assert np.array_equal(read_mesh(colored).vertices, posed.vertices)
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert [path.name for path in (colored, picture)] == [
        line.rpartition("/")[2] for line in done.stderr.splitlines() if line.startswith("wrote ")
    ]


@pytest.mark.long
def test_label_takes_several_meshes_or_a_library_with_names(poses, tmp_path):
    posed = poses / "posed.ply"
    two = ("--like", poses / "rest.ply", "--like", poses / "raised.ply")
    several = json.loads(run("label", posed, *two, "--json").stdout)
    assert len(several["like"]) == 2
    assert sum(several["like"].values()) == pytest.approx(1)
    library = tmp_path / "library"
    library.mkdir()
    for name in ("rest.ply", "rest.seg", "raised.ply"):
        shutil.copy(poses / name, library)
    (library / "names.txt").write_text("nothing\ntorso\n")
    text = run("label", posed, "--library", library).stdout
    for word in ("label", "name", "torso", "confidence", "clearest vertex", "%"):
        assert word in text
    of_library = json.loads(run("label", posed, "--library", library, "--json").stdout)
    # The order of the shapes differs, and with it the last digit of the votes.
    same = np.array(of_library["face_labels"]) == several["face_labels"]
    assert same.mean() > 0.99


@pytest.mark.long
def test_a_library_with_slivers_and_a_broken_file_serves_the_rest(poses, tmp_path):
    shape = read_labeled_shape(poses / "rest.ply", poses / "rest.seg")
    a, b, _ = shape.mesh.faces[0]
    between = shape.mesh.vertices[[a, b]].mean(axis=0)
    sliver = TriangleMesh(
        np.vstack([shape.mesh.vertices, between]),
        np.vstack([shape.mesh.faces, [a, b, shape.mesh.n_vertices]]),
    )
    write_mesh(sliver, tmp_path / "sliver.ply", face_labels=np.append(shape.labels, 7))
    (tmp_path / "broken.ply").write_text("no mesh")
    done = run("label", poses / "posed.ply", "--library", tmp_path, "--json", code=3)
    assert "repair: sliver.ply: drop_degenerate removed 1 face" in done.stderr
    assert "left out: broken.ply" in done.stderr
    found = json.loads(done.stdout)
    assert (list(found["like"]), found["left_out"]) == (["sliver"], ["broken.ply"])
    (tmp_path / "sliver.ply").unlink()
    done = run("label", poses / "posed.ply", "--library", tmp_path, code=2)
    assert "that can be described" in done.stderr


@pytest.mark.long
def test_label_takes_what_segment_prints(poses, tmp_path):
    parts = tmp_path / "rest.json"
    parts.write_text(run("segment", poses / "rest.ply", "--json").stdout)
    arguments = ("label", poses / "posed.ply", "--like", poses / "rest.ply", "--labels", parts)
    many = json.loads(run(*arguments, "--json").stdout)["face_labels"]
    numbers = json.loads(run(*command(poses, "--json")).stdout)["face_labels"]
    assert [10 * label + 1 for label in many] == numbers


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--labels", "{short}"),
            "labels must hold one whole number per face, shape (2396,); the shape is (2,)",
        ),
        (("--labels", "{bad}"), "A label must be a whole number; line 2 has 'head'"),
        (("--labels", "{bad}", "--picture", "a.bmp"), "A picture must end in"),
        (
            ("--labels", "{bad}", "-o", "a.off"),
            "written to a file that ends in .obj, .ply, .glb, .seg, .txt; a.off ends in '.off'",
        ),
        (
            ("--labels", "{bad}", "-o", "{bad}/no/a.seg"),
            "A mesh with labels must be written to a folder that exists",
        ),
        (("--labels", "{none}"), "No such file"),
    ],
)
def test_label_names_what_is_wrong(poses, tmp_path, options, message):
    files = {
        "short": tmp_path / "short.seg",
        "bad": tmp_path / "bad.seg",
        "none": tmp_path / "none.seg",
    }
    files["short"].write_text("1\n2\n")
    files["bad"].write_text("1\nhead\n")
    filled = [str(word).format(**files, seg=poses / "rest.seg") for word in options]
    of_a_file = message == "No such file" or message.startswith("A label must be")
    code = 1 if of_a_file else 2
    done = run("label", poses / "posed.ply", "--like", poses / "rest.ply", *filled, code=code)
    assert message in " ".join(done.stderr.split())
    assert done.stdout == ""


def test_label_needs_shapes_that_have_labels(poses, tmp_path):
    posed = poses / "posed.ply"
    assert "Labels must come from --like or from --library" in run("label", posed, code=2).stderr
    done = run(*command(poses, "--like", poses / "raised.ply"), code=2)
    assert "there are 1 for 2" in " ".join(done.stderr.split())
    done = run("label", posed, "--like", posed, code=1)
    assert "must have a property label" in " ".join(done.stderr.split())
    done = run("label", posed, "--library", tmp_path, code=1)
    assert "must hold a mesh" in " ".join(done.stderr.split())
