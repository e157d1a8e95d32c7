"""eigenshape collection: a folder of specimens, landmarks of some on all, and a report of one page."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from running import run, run_json

import eigenshape as es
from eigenshape.cli import steps

pytestmark = pytest.mark.long

CHOSEN = [100, 200, 300, 400]
NAMES = [f"point {i}" for i in CHOSEN]
ODD = "hand <3>"


def hand(number):
    """Return a hand with proportions and a bend of its own; vertices of all correspond."""
    mesh = es.make_creature("hand", n_vertices=600)
    x, y, z = mesh.vertices.T
    draw = np.random.default_rng(number).standard_normal(3)
    bent = np.column_stack(
        [x * (1 + 0.1 * draw[0]), y, z + 0.1 * draw[1] * y**2 + 0.05 * draw[2] * x]
    )
    return es.TriangleMesh(bent + np.array([number, 0, 0]), mesh.faces)


def landmarks(number):
    return es.morphometrics.Landmarks(NAMES, hand(number).vertices[CHOSEN])


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scans")
    for number, name in enumerate(["hand 0", "hand 1", "hand 2", ODD]):
        es.write_mesh(hand(number), folder / f"{name}.ply")
    es.morphometrics.write_landmarks(landmarks(0), folder / "hand 0.mrk.json")
    es.morphometrics.write_landmarks(landmarks(1), folder / "hand 1.fcsv")
    (folder / "broken.ply").write_text("ply\n")
    return folder


@pytest.fixture(scope="module")
def output(scans):
    """The collection, within the folder of its specimens."""
    output = scans / "out"
    done = run("collection", scans, "-o", output, "--workers", 1, code=3)
    assert "4 specimens, 1 failed, 2 labelled; all have 4 landmarks now." in done.stdout
    assert "broken: " in done.stdout
    assert "failed: broken: " in done.stderr
    # Where stderr is a file, it has a line for each step: three of each specimen, one of what failed.
    steps_done = re.findall(r"^\d+ of 15, (.*)$", done.stderr, re.MULTILINE)
    assert steps_done.count("hand 1") == 3
    assert steps_done.count("broken") == 1
    assert f"wrote {output / 'report.html'}" in done.stderr
    return output


def page_data(output):
    page = (output / "report.html").read_text()
    block = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)
    return page, json.loads(block[1])


def test_landmarks_of_all_specimens_are_a_table(output):
    text = (output / "landmarks.csv").read_text()
    assert text.startswith("specimen,landmark,x,y,z,spread,doubtful,given,distance,disagreement,")
    table = es.morphometrics.read_specimens(output / "landmarks.csv")
    assert sorted(table) == ["hand 0", "hand 1", "hand 2", ODD]
    assert np.array_equal(table["hand 0"].points, landmarks(0).points)
    assert np.array_equal(table["hand 1"].spread, np.zeros(4))
    for number, name in ((2, "hand 2"), (3, ODD)):
        away = np.linalg.norm(table[name].points - landmarks(number).points, axis=1)
        assert np.median(away) < 0.05
        assert (table[name].spread > 0).all()
    assert es.read_mesh(output / "mean.ply").n_vertices > 500


def test_points_of_curves_are_spaced_and_carried_with_the_table_of_their_neighbors(scans, tmp_path):
    path = es.calculus.geodesic_path(hand(0), 100, 300).points
    drawn = path[np.linspace(0, len(path) - 1, 8).astype(int)]
    names = [f"drawn {i}" for i in range(8)]
    template = es.morphometrics.Landmarks(names, drawn, curves=[range(8)])
    es.morphometrics.write_landmarks(template, tmp_path / "hand 0.mrk.json")
    es.write_mesh(hand(0), tmp_path / "hand 0.ply")
    es.write_mesh(hand(1), tmp_path / "hand 1.ply")
    command = ["collection", tmp_path, "-o", tmp_path / "out", "--workers", 1, "--curve-points"]
    assert "n_points must lie in 2..10000; it is 1" in run(*command, 1, code=2).stderr
    done = run(*command, 4)
    path = tmp_path / "out" / "landmarks.sliders.csv"
    assert f"wrote {path}" in done.stderr
    assert path.read_text() == "before,slide,after\n1,3,4\n3,4,2\n"
    table = es.morphometrics.read_specimens(tmp_path / "out" / "landmarks.csv")
    assert table["hand 1"].names == ("drawn 0", "drawn 7", "curve 1 point 1", "curve 1 point 2")
    steps = np.diff(table["hand 1"].points[[0, 2, 3, 1]], axis=0)
    assert np.ptp(np.linalg.norm(steps, axis=1)) < 0.2 * np.linalg.norm(steps, axis=1).mean()


def test_the_page_holds_all_that_it_shows(output):
    page, data = page_data(output)
    assert not set(re.findall(r"https?://[^\"'\s]+", page)) - {"http://www.w3.org/2000/svg"}
    assert page.count("</script>") == 2
    assert [each["name"] for each in data["specimens"]] == ["hand 0", "hand 1", "hand 2", ODD]
    assert all(each["picture"].startswith("data:image/png") for each in data["specimens"])
    assert data["failures"].keys() == {"broken"}
    assert [mark["name"] for mark in data["landmarks"]] == NAMES
    assert len(data["modes"]) == 3
    built = es.collections.open_collection(output)
    corners = np.array([mark["corners"] for mark in data["landmarks"]])
    weights = np.array([mark["weights"] for mark in data["landmarks"]])
    there = np.einsum("kc,kcd->kd", weights, built.points[2][corners])
    table = es.morphometrics.read_specimens(output / "landmarks.csv")
    assert np.linalg.norm(there - table["hand 2"].points, axis=1).max() < 0.1


def test_landmarks_that_all_specimens_were_given_have_no_spread(output, tmp_path):
    built = es.collections.open_collection(output)
    given = {name: landmarks(number) for number, name in enumerate(built.names)}
    carried = es.collections.carry_landmarks(built, given)
    steps.write_collection_report(built, carried, tmp_path / "report.html", "all", lambda *_: None)
    assert [mark["spread"] for mark in page_data(tmp_path)[1]["landmarks"]] == [0.0] * 4


def test_the_same_command_goes_on_and_says_the_same(scans, output):
    before = (output / "landmarks.csv").read_bytes()
    facts = run_json("collection", scans, "-o", output, "--workers", 1, code=3)
    assert (output / "landmarks.csv").read_bytes() == before
    assert facts["specimens"] == ["hand 0", "hand 1", "hand 2", ODD]
    assert facts["labelled"] == ["hand 0", "hand 1"]
    sides = facts["sides"]  # bends make the two sides of some hands alike
    assert set(sides.values()) == {"same", "cannot be told"}
    # The odd hand is bent so far that the fit from where `match_shapes` puts it is seven times as near.
    methods = dict.fromkeys(facts["specimens"], "position") | {ODD: "intrinsic"}
    assert facts["methods"] == methods
    rows = (output / "specimens.csv").read_text().splitlines()
    assert rows[0] == "specimen,side,method,size,notes"
    assert [row.split(",")[:3] for row in rows[1:]] == [
        *([name, sides[name], methods[name]] for name in methods), ["broken", "", "failed"],
    ]  # fmt: skip
    assert facts["failures"].keys() == {"broken"}
    assert [text.split(":")[0] for text in facts["warnings"]] == ["mirror images"]


def test_it_is_said_where_mirror_images_cannot_be_told(output):
    built = es.collections.open_collection(output)
    assert steps.unsure_sides(replace(built, sides=("same",) * 4)) == []
    one = replace(built, sides=("same", "cannot be told", "same", "same"))
    assert steps.unsure_sides(one)[0].startswith(
        "mirror images: of hand 1 it cannot be told whether"
    )
    many = replace(built, names=tuple("abcdefg"), sides=("cannot be told",) * 6 + ("same",))
    assert steps.unsure_sides(many)[0].startswith(
        "mirror images: of 6 of 7 specimens it cannot be told"
    )


def test_landmarks_in_another_frame_or_unit_are_refused_before_the_fits(scans, tmp_path):
    moved = es.morphometrics.Landmarks(NAMES, landmarks(0).points * [-1, -1, 1] + 5.0)
    small = es.morphometrics.Landmarks(NAMES, landmarks(1).points / 1000)
    table = tmp_path / "table.csv"
    es.morphometrics.write_landmarks({"hand 0": moved, "hand 1": small}, table)
    options = ("-o", tmp_path / "out", "--landmarks", table)
    error = run("collection", scans, *options, code=2).stderr
    assert "of 'hand 0' lie farther from it" in error
    assert "in another frame or of another specimen" in error
    assert "1000 times as large they would lie on it" in error
    assert not (tmp_path / "out").exists()


def test_landmarks_of_a_specimen_that_fails_or_in_another_order_are_named(scans, output, tmp_path):
    given = {f"hand {i}": landmarks(i) for i in range(3)} | {"broken": landmarks(1)}
    given["hand 2"] = es.morphometrics.Landmarks(NAMES, landmarks(2).points[::-1])
    table = tmp_path / "table.csv"
    es.morphometrics.write_landmarks(given, table)
    options = ("-o", output, "--landmarks", table, "--workers", 1)
    facts = run_json("collection", scans, *options, code=3)
    assert any(
        "the landmarks of broken are not used, because it failed" in text
        for text in facts["warnings"]
    )
    assert any(text.startswith("landmarks: 4 of 4 of hand 2") for text in facts["warnings"])
    assert facts["doubtful"]["hand 2"] == NAMES
    rows = csv.DictReader((output / "landmarks.csv").read_text().splitlines())
    (row,) = [row for row in rows if (row["specimen"], row["landmark"]) == ("hand 2", NAMES[0])]
    assert float(row["distance"]) < 1e-6
    assert float(row["disagreement"]) > 0.1


def test_what_is_doubtful_on_all_specimens_is_said_once(scans, output, tmp_path):
    exchanged = es.morphometrics.Landmarks(NAMES, landmarks(1).points[[1, 0, 2, 3]])
    table = tmp_path / "table.csv"
    es.morphometrics.write_landmarks({"hand 0": landmarks(0), "hand 1": exchanged}, table)
    options = ("-o", output, "--landmarks", table, "--workers", 1)
    lines = run("collection", scans, *options, code=3).stdout.splitlines()
    about = [line for line in lines if "doubtful landmarks" in line]
    assert about == [f"  all specimens: doubtful landmarks: {NAMES[0]}, {NAMES[1]}"]


def test_a_unit_that_the_file_names_is_converted(scans, output, tmp_path):
    small = es.morphometrics.Landmarks(NAMES, landmarks(0).points / 1000)
    path = tmp_path / "hand 0.mrk.json"
    es.morphometrics.write_landmarks(small, path)
    path.write_text(path.read_text().replace('"LPS",', '"LPS", "coordinateUnits": "m",'))
    options = ("-o", output, "--landmarks", tmp_path, "--workers", 1)
    done = run("collection", scans, *options, code=3)
    assert "its points are in m and were converted to mm" in done.stderr
    table = es.morphometrics.read_specimens(output / "landmarks.csv")
    np.testing.assert_allclose(table["hand 0"].points, landmarks(0).points, rtol=1e-14)
    error = run("collection", scans, *options, "--unit", "m", code=2).stderr
    assert "1000 times as large they would lie on it" in error


def test_landmarks_that_fit_no_specimen_are_refused(scans, tmp_path):
    def refused(source, code=2):
        options = ("-o", tmp_path / "out", "--landmarks", source)
        return run("collection", scans, *options, code=code).stderr

    table = tmp_path / "table.csv"
    es.morphometrics.write_landmarks({"hnad 0": landmarks(0)}, table)
    assert "Landmarks must be of specimens" in refused(table)
    (tmp_path / "empty").mkdir()
    out = tmp_path / "out"
    done = run("collection", tmp_path / "empty", "-o", out, code=2)
    assert "Folders of shapes must hold meshes or points" in done.stderr
    assert "index" not in done.stderr
    message = "A folder of landmarks must hold files that end in .mrk.json"
    assert message in refused(tmp_path / "empty", code=1)
    (tmp_path / "twice").mkdir()
    for suffix in (".fcsv", ".mrk.json"):
        es.morphometrics.write_landmarks(landmarks(0), tmp_path / "twice" / f"hand 0{suffix}")
    assert "must have one file of landmarks" in refused(tmp_path / "twice")
    assert not (tmp_path / "out").exists()
