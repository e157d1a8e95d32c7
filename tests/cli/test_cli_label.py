"""`eigenshape label`: what it gives is what `transfer_labels` gives, in every form."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from eigenshape.cli import app
from eigenshape.features.parts import find_parts
from eigenshape.io.labels import read_labels, write_labels
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.retrieval.label_transfer import transfer_labels
from eigenshape.shapes.creatures import make_creature


def run(*arguments, code=0):
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == code, done.output
    return done


@pytest.fixture(scope="module")
def poses(tmp_path_factory):
    """Write two poses of a giraffe, and labels of the first: ten times the number of its part, plus one."""
    folder = tmp_path_factory.mktemp("poses")
    rest, posed = (make_creature("giraffe", pose, n_vertices=1200) for pose in (0, 3))
    labels = 10 * find_parts(rest).parts.labels + 1
    write_mesh(rest, folder / "rest.ply")
    write_mesh(posed, folder / "posed.ply")
    write_labels(labels, folder / "rest.seg")
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
    rest, posed = read_mesh(poses / "rest.ply"), read_mesh(poses / "posed.ply")
    expected = transfer_labels(rest, read_labels(poses / "rest.seg"), posed)
    assert found["face_labels"] == expected.labels.tolist() == read_labels(saved).tolist()
    assert [row["label"] for row in found["parts"]] == expected.part_labels.tolist()
    assert [row["confidence"] for row in found["parts"]] == pytest.approx(
        expected.confidence.tolist()
    )
    assert [row["like_part"] for row in found["parts"]] == expected.matches.tolist()
    assert sum(row["area_share"] for row in found["parts"]) == pytest.approx(1)
    assert np.array_equal(read_mesh(colored).vertices, posed.vertices)
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert [path.name for path in (colored, picture)] == [
        line.rpartition("/")[2] for line in done.stderr.splitlines() if line.startswith("wrote ")
    ]


@pytest.mark.long
def test_label_prints_a_table_and_takes_what_segment_prints(poses, tmp_path):
    parts = tmp_path / "rest.json"
    parts.write_text(run("segment", poses / "rest.ply", "--json").stdout)
    arguments = ("label", poses / "posed.ply", "--like", poses / "rest.ply", "--labels", parts)
    text = run(*arguments, "-n", 3).stdout
    for word in ("label", "confidence", "feature point", "like part", "%"):
        assert word in text
    few = json.loads(run(*arguments, "-n", 3, "--json").stdout)
    assert len(few["parts"]) == 3
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
            ("--labels", "{bad}", "-o", "a.obj"),
            "written to a file that ends in .ply, .seg, .txt; a.obj ends in '.obj'",
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
    done = run("label", poses / "posed.ply", "--like", poses / "rest.ply", *filled, code=1)
    assert message in " ".join(done.stderr.split())
    assert done.stdout == ""


def test_label_needs_a_mesh_that_has_labels(poses):
    for missing in ("--like", "--labels"):
        words = [word for word in command(poses) if word != missing]
        assert f"Missing option '{missing}'" in run(*words, code=2).output
