"""Files, folders, labels and indexes whose names steer terminals, break SVG or look like markup and formulas."""

import io
import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from describers import keep
from rich.console import Console
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app, console

EVIL = "a\x1b[31m\x07\n\u202e$x_[bold]\x9b$"
SPELLED = r"a\x1b[31m\x07\n\u202e$x_[bold]\x9b$"


@pytest.fixture(scope="module")
def zoo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("zoo") / EVIL
    folder.mkdir()
    for pose in range(2):
        es.write_mesh(es.make_creature("fish", pose, n_vertices=500), folder / f"{EVIL}{pose}.ply")
    (folder / f"{EVIL}.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 nan\n3 0 1 2\n")
    return folder


@pytest.fixture(autouse=True)
def wide_terminal(monkeypatch):
    """Break no name: a test process may have fixed the width before these tests begin."""
    for terminal in (console.out, console.err):
        monkeypatch.setattr(terminal, "_width", 300)


def run(*arguments, code=0):
    done = CliRunner().invoke(
        app, [str(argument) for argument in arguments], env={"COLUMNS": "300"}
    )
    assert done.exit_code == code, done.output
    for line in (done.stdout + done.stderr).split("\n"):
        assert line.isprintable(), repr(line)
    return done


def parse(picture):
    text = picture.read_text()
    ET.fromstring(text)
    return text


@pytest.mark.long
def test_a_mesh(zoo, tmp_path):
    mesh, picture, edits = zoo / f"{EVIL}0.ply", tmp_path / f"{EVIL}.svg", tmp_path / f"{EVIL}.json"
    labels, colored = tmp_path / f"{EVIL}.seg", tmp_path / f"{EVIL}.ply"
    labels.write_text("1\n" * es.read_mesh(mesh).n_faces)
    assert SPELLED in run("info", mesh).stdout
    assert SPELLED in run("spectrum", mesh, "-k", 4, "--picture", picture).stderr
    parse(picture)
    run("features", mesh, "--picture", picture, "-o", colored)
    run("segment", mesh, "-o", colored)
    run("label", mesh, "--like", mesh, "--labels", labels, "-o", tmp_path / f"{EVIL}2.seg")
    run(
        "deform",
        mesh,
        "--region",
        "y>70%",
        "--move",
        "0,0.02,0",
        "-o",
        colored,
        "--save-edits",
        edits,
    )
    assert (
        f"{SPELLED}.json: Edits name vertices"
        in run("deform", mesh, "--edits", changed(edits), code=2).stderr
    )
    run("repair", mesh, "-o", colored)
    run("stability", mesh, colored, "-k", 4, "-n", 100, "--picture", picture)
    assert SPELLED in parse(picture)


def changed(edits):
    """Say that the edits were made on a mesh of another size."""
    edits.write_text(edits.read_text().replace('"n_vertices": ', '"n_vertices": 1', 1))
    return edits


@pytest.mark.long
def test_an_index(zoo, tmp_path):
    db, sheet = tmp_path / EVIL, tmp_path / "sheet.svg"
    done = run("index", "add", db, zoo, "--views", 0, "--method", "scale-free", code=3)
    assert f"{SPELLED}: " in done.stdout
    assert f"{SPELLED}: " in done.stderr
    done = run("query", db, zoo / f"{EVIL}0.ply", "--picture", sheet)
    assert f"{SPELLED}0" in done.stdout
    text = parse(sheet)
    assert f"query: {SPELLED}0" in text
    assert f"<!-- {SPELLED}1 -->" in text
    foreign = es.ShapeIndex.create(tmp_path / "foreign")
    descriptor = es.retrieval.find_heat_features(
        es.make_creature("fish", 0, n_vertices=500)
    ).descriptor
    keep(foreign, EVIL, [descriptor], label=EVIL, source=EVIL)
    done = run("query", foreign.folder, zoo / f"{EVIL}0.ply", "--picture", sheet)
    assert done.stdout.count(SPELLED) == 2
    assert f"not drawn: {SPELLED}" in done.stderr
    parse(sheet)


NAMES = (
    EVIL,
    "../../outside",
    "/etc/passwd",
    "a//b",
    "'one' \"two\" `three`",
    " spaces  and\ttabs ",
    "Würfel 立方体 κύβος",
    "--json",
    "long" * 1024,
)


@pytest.mark.long
def test_shapes_of_any_name(tmp_path, monkeypatch):
    """Names of shapes are never names of files: they are listed, found, exported and removed."""
    monkeypatch.chdir(tmp_path)
    index = es.ShapeIndex.create("index")
    fish = es.make_creature("fish", 0, n_vertices=500)
    descriptor = es.retrieval.find_heat_features(fish).descriptor
    for name in NAMES:
        keep(index, name, [descriptor], label=name, source=name)
    shown = run("index", "ls", "index").stdout
    assert SPELLED in shown
    assert r" spaces  and\ttabs " in shown
    listed = json.loads(run("index", "ls", "index", "--json").stdout)
    assert [record["name"] for record in listed] == sorted(NAMES)
    for name in NAMES:
        if name == "/etc/passwd":  # a file, which a query takes before a name
            continue
        found = json.loads(run("query", "--json", "-n", 20, "--", "index", name).stdout)
        assert found["scan"] == name
        assert {match["name"] for match in found["matches"]} == set(NAMES) - {name}
    run("index", "export", "index", "-o", "exported")
    exported = json.loads(Path("exported/records.json").read_text())
    assert [record["name"] for record in exported] == sorted(NAMES)
    run("query", "index", EVIL, "-n", 20, "-o", "matches.csv")
    assert run("index", "rm", "index", "--", *NAMES).stdout.startswith("9 shapes removed")
    assert run("index", "rm", "index", "--", NAMES[-1], code=1).stderr.count("\n") == 1
    made = {path.name for path in tmp_path.rglob("*") if path.parent.name != "index"}
    assert made == {"index", "exported", "records.json", "descriptors.npz", "matches.csv"}


def test_progress_bars(monkeypatch):
    terminal = Console(file=io.StringIO(), force_terminal=True, width=300)
    monkeypatch.setattr(console, "err", terminal)
    with console.progress_bar("index") as progress:
        progress(0.5, EVIL)
    shown = terminal.file.getvalue()
    assert SPELLED in shown
    assert not any(letter in shown for letter in "\x07\u202e\x9b")


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["info", EVIL], 1),
        (["info", f"{EVIL}.ply"], 1),
        (["info", "{zoo}"], 1),
        (["features", "{zoo}/{evil}.off"], 1),
        (["spectrum", "{zoo}/{evil}0.ply", "--operator", EVIL], 2),
        (["spectrum", "{zoo}/{evil}0.ply", "-o", EVIL], 2),
        (["spectrum", "{zoo}/{evil}0.ply", "-k", EVIL], 2),
        (["spectrum", "{zoo}/{evil}0.ply", "--picture", EVIL], 2),
        (["segment", "{zoo}/{evil}0.ply", "-o", EVIL], 2),
        (["deform", "{zoo}/{evil}0.ply", "--region", EVIL, "--move", "0,1,0"], 2),
        (["deform", "{zoo}/{evil}0.ply", "--region", "y>0", "--rotate", EVIL], 2),
        (["deform", "{zoo}/{evil}0.ply", "--edits", "{zoo}/{evil}.off"], 1),
        (
            [
                "label",
                "{zoo}/{evil}0.ply",
                "--like",
                "{zoo}/{evil}0.ply",
                "--labels",
                "{zoo}/{evil}.off",
            ],
            1,
        ),
        (["query", EVIL, EVIL], 1),
        (["index", "add", "{zoo}", "{zoo}", "--repair", EVIL], 2),
        (["demo", "--kind", EVIL], 2),
        ([f"--{EVIL}"], 2),
        ([EVIL], 2),
        (["info", f"--{EVIL}"], 2),
    ],
)
def test_messages(zoo, arguments, code):
    done = run(
        *(text.replace("{zoo}", str(zoo)).replace("{evil}", EVIL) for text in arguments), code=code
    )
    if "Usage:" not in done.stderr:
        assert done.stderr.count("\n") == 1


def test_warnings(zoo, monkeypatch):
    def warn(path, **_):
        import warnings

        warnings.warn(f"{path} is odd", UserWarning, stacklevel=1)
        return es.repair(es.icosphere(0), [])

    monkeypatch.setattr("eigenshape.cli.steps.reading.read_surface", warn)
    assert f"{SPELLED}0.ply is odd" in run("segment", zoo / f"{EVIL}0.ply").stderr


def test_the_alphabet_of_a_name_stays():
    assert (
        console.escape_text(Path("Würfel 立方体 κύβος مكعب.ply")) == "Würfel 立方体 κύβος مكعب.ply"
    )
