"""What every verb of the command line does with a bad file or a bad option."""

import json

import pytest
from running import run
from typer.testing import CliRunner

from eigenshape.cli import app
from eigenshape.io.mesh_files import write_mesh
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere

VERBS = ["info", "spectrum", "features", "segment", "label", "index", "query"]
BROKEN = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"


@pytest.fixture(scope="module")
def fish(tmp_path_factory):
    path = tmp_path_factory.mktemp("fish") / "fish.off"
    write_mesh(make_creature("fish", n_vertices=800), path)
    return path


@pytest.mark.parametrize("verb", ["info", "spectrum", "features", "segment"])
def test_a_broken_file_is_named_with_what_is_wrong_in_it(tmp_path, verb):
    path = tmp_path / "broken.off"
    path.write_text(BROKEN)
    done = run(verb, path, "--json", code=1)
    assert done.stdout == ""
    assert done.stderr.startswith(
        f"error: {path}: faces must index vertices 0..2; face 0 is [0, 1, 7]"
    )
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("spectrum", "{missing}", "--picture", "{folder}/a.bmp"),
            "A picture must end in .png, .svg, .pdf",
        ),
        (
            ("spectrum", "{missing}", "--picture", "{folder}/a"),
            "A picture must end in .png, .svg, .pdf",
        ),
        (
            ("spectrum", "{missing}", "--picture", "{missing}/a.png"),
            "A picture must be written to a folder that exists",
        ),
        (
            ("features", "{missing}", "--picture", "{folder}/a.bmp"),
            "A picture must end in .png, .svg, .pdf",
        ),
        (
            ("query", "{missing}", "{missing}", "--picture", "{folder}/a.bmp"),
            "A picture must end in .png, .svg, .pdf",
        ),
        (
            ("index", "add", "{folder}/db", "{missing}", "--repair", "weld,all"),
            "name 1 is 'all'",
        ),
    ],
)
def test_a_bad_option_is_refused_before_any_file_is_looked_at(tmp_path, arguments, message):
    folder = tmp_path / "folder"
    folder.mkdir()
    done = run(
        *(text.format(missing=tmp_path / "missing.ply", folder=folder) for text in arguments),
        code=2,
    )
    assert done.stderr.startswith("error: ")
    assert message in done.stderr
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("suffix", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_pictures_of_every_kind_are_more_than_a_frame(fish, tmp_path, suffix, magic):
    plot = tmp_path / f"plot.{suffix}"
    done = run("spectrum", fish, "-k", 5, "--picture", plot, "--json", code=0)
    assert plot.read_bytes().startswith(magic)
    assert plot.stat().st_size > 5000
    assert "wrote " in done.stderr
    assert len(json.loads(done.stdout)["eigenvalues"]) == 5  # stdout stays JSON alone


@pytest.mark.long
def test_index_names_the_broken_file_takes_the_rest_and_knows_it_again(fish, tmp_path):
    folder = tmp_path / "shapes"
    folder.mkdir()
    write_mesh(icosphere(2), folder / "ball.ply")
    (folder / "broken.off").write_text(BROKEN)
    command = ("index", "add", tmp_path / "db", folder, fish, "--workers", 1, "--views", 0)
    first = run(*command, code=3)
    assert "2 described, 0 indexed already, 1 failed; the index holds 2 shapes" in first.stdout
    assert "broken.off: faces must index vertices 0..2" in first.stdout
    again = json.loads(run(*command, "--json", code=3).stdout)
    assert (again["shapes"], again["added"], sorted(again["skipped"])) == (2, [], ["ball", "fish"])
    (folder / "broken.off").unlink()
    assert json.loads(run(*command, "--json", code=0).stdout)["failed"] == []
    best = json.loads(run("query", tmp_path / "db", fish, "-n", 1, "--json", code=0).stdout)[
        "matches"
    ]
    assert [match["name"] for match in best] == ["fish"]
    done = run("query", tmp_path / "db", tmp_path / "none.ply", code=2)
    assert done.stderr.startswith("error: ")
    assert "none.ply" in done.stderr


@pytest.mark.parametrize("verb", VERBS)
def test_an_unknown_option_is_wrong_usage(verb):
    assert "No such option" in run(verb, "--color", code=2).output


@pytest.mark.parametrize(
    ("verb", "choices"),
    [
        (["features"], "'scale-free', 'thesis'"),
        (["segment"], "'parts', 'scale-free', 'thesis'"),
        (["index", "add", "db"], "'patches', 'scale-free', 'thesis'"),
        (["query", "db"], "'patches', 'scale-free', 'thesis'"),
    ],
)
def test_an_unknown_choice_is_wrong_usage_and_names_the_others(verb, choices):
    arguments = [*verb, "missing.ply", "--method", "best"]
    done = CliRunner().invoke(app, arguments, env={"COLUMNS": "200"})
    assert done.exit_code == 2
    assert f"'best' is not one of {choices}." in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("info", "{folder}"),
        ("info", "{folder}", "--json"),
        ("repair", "{folder}", "-o", "{out}.ply"),
        ("decimate", "{folder}", "--ratio", "0.5", "-o", "{out}.ply"),
        ("tetrahedralize", "{folder}", "-o", "{out}.vtu"),
        ("spectrum", "{folder}", "--json"),
        ("features", "{folder}"),
        ("segment", "{folder}"),
        ("label", "{file}", "--like", "{folder}"),
        ("match", "{file}", "{folder}", "--json"),
        ("transfer", "{folder}", "{file}", "-o", "{out}.glb"),
        ("pose", "{file}", "--like", "{folder}", "-o", "{out}.ply"),
        ("stability", "{folder}", "{file}"),
        ("fuse", "{folder}", "-o", "{out}.ply"),
        ("compress", "{folder}", "-o", "{out}.esz"),
        ("report", "{folder}", "-o", "{out}.html"),
    ],
)
def test_a_folder_in_place_of_a_file_names_a_file_in_it(fish, tmp_path, arguments):
    (tmp_path / "notes.txt").write_text("not a shape\n")
    places = {"folder": fish.parent, "file": fish, "out": tmp_path / "out"}
    done = run(*(each.format(**places) for each in arguments), code=1)
    assert done.stdout == ""
    assert done.stderr == (
        f"error: {fish.parent} must be a file; it is a folder. Name a file, such as {fish}.\n"
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ("decompress", "{folder}", "-o", "{out}.ply"),
        ("deform", "{file}", "--edits", "{folder}", "-o", "{out}.ply"),
        ("stability", "{file}", "{file}", "--map", "{folder}"),
        ("label", "{file}", "--like", "{file}", "--labels", "{folder}"),
    ],
)
def test_a_folder_in_place_of_what_is_no_shape_is_named(fish, tmp_path, arguments):
    places = {"folder": tmp_path, "file": fish, "out": tmp_path / "out"}
    done = run(*(each.format(**places) for each in arguments), code=1)
    assert done.stderr == f"error: {tmp_path} must be a file; it is a folder. Name a file.\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("label", "{fish}", "--library", "{fish}"), "Choose a folder instead of a file"),
        (("demo", "-o", "{fish}"), "Choose a folder instead of a file"),
        (("collection", "{folder}", "-o", "{fish}"), "Choose a folder instead of a file"),
        (("collection", "{fish}", "-o", "{out}"), "there are 1. Name the folder in which they lie"),
        (("spectrum", "{fish}", "-k", "3", "--cache", "{fish}"), "File exists. Choose another one"),
        (("query", "{fish}", "{folder}"), "has no index.sqlite and is a file. Create one with"),
        (("index", "ls", "{fish}", "--json"), "has no index.sqlite and is a file. Create one with"),
        (("index", "add", "{fish}", "{fish}"), "File exists. Choose another folder"),
        (("serve", "{fish}"), "has no index.sqlite and is a file. Create one with"),
    ],
)
def test_a_file_in_place_of_a_folder_is_named(fish, tmp_path, arguments, message):
    for name in ("one", "two"):
        (tmp_path / f"{name}.off").write_bytes(fish.read_bytes())
    places = {"fish": fish, "folder": tmp_path, "out": tmp_path / "out"}
    before = fish.read_bytes()
    done = CliRunner().invoke(app, [each.format(**places) for each in arguments])
    assert done.exit_code in (1, 2)
    assert message in done.stderr
    assert str(fish) in done.stderr or "there are 1" in done.stderr
    assert fish.read_bytes() == before
