"""The command line as a user meets it: text, JSON, pictures, exit codes."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from describers import keep
from running import run, run_json

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.retrieval.heat.features import find_heat_features
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.scans.partial import partial_scan
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.solve import solve_spectrum

PNG = b"\x89PNG\r\n\x1a\n"
STOPPABLE = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where a background job runs the tests
from eigenshape_command import main
main()
"""


@pytest.fixture
def sphere(tmp_path):
    path = tmp_path / "sphere.ply"
    write_mesh(icosphere(2), path)
    return path


@pytest.fixture(scope="module")
def zoo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("zoo")
    for kind in ("fish", "snake"):
        (folder / kind).mkdir()
        for pose in range(2):
            write_mesh(
                make_creature(kind, pose, n_vertices=800), folder / kind / f"{kind}{pose}.ply"
            )
    (folder / "broken.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 nan\n3 0 1 2\n")
    return folder


@pytest.fixture(scope="module")
def database(zoo, tmp_path_factory):
    db = tmp_path_factory.mktemp("db") / "index"
    done = run("index", "add", db, zoo, "--views", 1, code=3)
    assert "4 described, 0 indexed already, 1 failed; the index holds 4 shapes" in done.stdout
    assert "broken: " in done.output
    assert "vertex 2 is [2.0, 0.0, nan]" in done.output
    return db


def test_info(sphere):
    facts = run_json("info", sphere)
    assert (facts["vertices"], facts["faces"], facts["components"], facts["closed"]) == (
        162,
        320,
        1,
        True,
    )
    assert facts["euler_characteristic"] == 2
    assert facts["area"] == pytest.approx(4 * np.pi, rel=0.02)
    assert facts["repairs_to_try"] == []
    text = run("info", sphere).stdout
    assert "faces" in text
    assert "320" in text


def test_info_says_which_repairs_would_help_and_they_do(tmp_path):
    ball = icosphere(1)
    soup = TriangleMesh(np.concatenate([ball.vertices[ball.faces].reshape(-1, 3), [[9, 9, 9]]]),
                        [*np.arange(240).reshape(-1, 3), [0, 0, 1], [0, 1, 2]])  # fmt: skip
    path = tmp_path / "soup.obj"
    write_mesh(soup, path)
    facts = run_json("info", path)
    assert facts["repairs_to_try"] == [
        "drop_duplicate_faces",
        "weld_seams",
        "drop_degenerate",
        "drop_unreferenced",
    ]
    run("spectrum", path, code=1)
    mended = run("info", path, "--json", "--repair", ",".join(facts["repairs_to_try"]))
    assert json.loads(mended.stdout)["vertices"] == ball.n_vertices
    assert "repair: weld_seams joined" in mended.stderr


@pytest.mark.long
def test_spectrum(sphere, tmp_path):
    expected = solve_spectrum(cotangent_laplacian(read_mesh(sphere), "averaged"), 9)
    plot, picture, saved = tmp_path / "plot.png", tmp_path / "functions.png", tmp_path / "s.npz"
    options = (
        "-k",
        9,
        "--set",
        "mass=averaged",
        "--picture",
        plot,
        "--eigenfunctions",
        picture,
        "-o",
        saved,
    )
    found = run_json("spectrum", sphere, *options)
    assert found["eigenvalues"] == pytest.approx(expected.eigenvalues.tolist(), abs=1e-12)
    assert found["certificate"]["count"] == 9
    assert plot.read_bytes()[:8] == picture.read_bytes()[:8] == PNG
    with np.load(saved) as arrays:
        assert arrays["eigenvectors"].shape == (162, 9)
    assert (
        run_json("spectrum", sphere, "-k", 162)["certificate"]["shift"] is None
    )  # all there are: no upper end
    text = run("spectrum", sphere, "-k", 9).stdout
    assert "none is missing" in text


@pytest.mark.long
def test_features(zoo, tmp_path):
    picture = tmp_path / "parts.png"
    path = zoo / "fish" / "fish0.ply"
    found = run_json("features", path, "-n", 4, "--picture", picture)
    assert len(found["features"]) == 4
    assert found["features"][0]["persistence"] is None
    assert sum(row["area_share"] for row in found["features"]) == pytest.approx(1)
    assert set(found["face_labels"]) == {0, 1, 2, 3}
    assert picture.read_bytes()[:8] == PNG
    few = run_json("features", path, "--persistence", found["features"][2]["persistence"])
    assert len(few["features"]) == 3
    assert "merges" in run("features", path, "--method", "thesis").stdout
    lengths = [row["persistence"] for row in run_json("features", path, "-n", 999)["features"][1:]]
    widest = int(np.argmax(np.subtract(lengths, [*lengths[1:], 0])))
    assert len(run_json("features", path, "--largest-gap")["features"]) == widest + 2
    refused = run("features", path, "--largest-gap", "--persistence", 1, code=2)
    assert "at most one of --n-parts, --persistence, --largest-gap" in " ".join(
        refused.stderr.split()
    )


@pytest.mark.long
def test_index_goes_on_where_it_stopped(zoo, database):
    again = run_json("index", "add", database, zoo, "--views", 1, code=3)
    assert len(again["skipped"]) == again["shapes"] == 4
    assert again["added"] == []
    assert [name for name, _ in again["failed"]] == ["broken"]


@pytest.mark.long
@pytest.mark.parametrize("how", ["SIGINT", "SIGKILL"])
def test_a_stopped_index_goes_on_without_doing_a_shape_twice(tmp_path, how):
    folder, db = tmp_path / "meshes", tmp_path / "db"
    folder.mkdir()
    for number in range(6):
        write_mesh(make_creature("fish", number, n_vertices=800), folder / f"fish{number}.ply")
    command = [
        sys.executable,
        "-c",
        STOPPABLE,
        "index",
        "add",
        db,
        folder,
        "--workers",
        "1",
    ]
    running = subprocess.Popen(
        [*command, "--views", "0", "--method", "scale-free"], stderr=subprocess.PIPE, text=True
    )
    while running.poll() is None and not (db / "changes.txt").exists():
        time.sleep(0.01)
    running.send_signal(getattr(signal, how))
    told = running.communicate()[1]
    if how == "SIGINT":
        assert (running.returncode, told) == (130, "stopped; what was finished is kept\n")
    before = {record.name for record in ShapeIndex.open(db).records()}
    report = run_json(
        "index", "add", db, folder, "--workers", 1, "--views", 0, "--method", "scale-free"
    )
    assert set(report["skipped"]) == before
    assert len(before) < 6
    assert set(report["added"]) | before == {f"fish{number}" for number in range(6)}


@pytest.mark.long
def test_query_finds_the_kind_and_draws_it(zoo, database, tmp_path):
    scan = tmp_path / "scan.ply"
    write_mesh(partial_scan(make_creature("snake", 5, n_vertices=800), [0.2, 1.0, 0.1]).mesh, scan)
    sheet = tmp_path / "sheet.png"
    found = run_json("query", database, scan, "-n", 2, "--picture", sheet)
    assert [match["label"] for match in found["matches"]] == ["snake", "snake"]
    assert found["matches"][0]["correspondences"]
    assert set(found["seconds"]) == {"describe", "query"}
    assert sheet.read_bytes()[:8] == PNG
    text = run("query", database, zoo / "fish" / "fish1.ply").stdout
    assert text.index("fish/fish1") < text.index("snake/")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("info", "nowhere.ply"), "No such file"),
        (("info", "mesh.abc"), "mesh.abc must be of a"),
        (("query", "nowhere", "{sphere}"), "must be an index"),
    ],
)
def test_errors_are_one_line_and_exit_code_1(sphere, arguments, message):
    refused(*(text.format(sphere=sphere) for text in arguments), message=message, code=1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("spectrum", "{sphere}", "-k", "0"), "k must lie in 1..162; it is 0"),
        (("spectrum", "{sphere}", "--picture", "plot.bmp"), "A picture must end in"),
        (
            ("info", "{sphere}", "--repair", "everything"),
            "Names of --repair must be among auto, drop_missing, weld",
        ),
        (
            (
                "deform",
                "{sphere}",
                "--region",
                "none.txt",
                "--move",
                "0,1,0",
                "-o",
                "{folder}/a.ply",
            ),
            "A region is one of these",
        ),
        (("index", "add", "{folder}/db", "{folder}"), "Folders of shapes must hold meshes"),
        (("demo", "--kind", "unicorn"), "--kind takes ant"),
    ],
)
def test_wrong_options_are_one_line_and_exit_code_2(sphere, tmp_path, arguments, message):
    empty = tmp_path / "empty"
    empty.mkdir()
    words = [text.format(sphere=sphere, folder=empty) for text in arguments]
    refused(*words, message=message, code=2)


def refused(*arguments, message, code):
    done = run(*arguments, code=code)
    assert done.stderr.startswith("error: ")
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_two_files_of_one_name_are_refused(zoo, tmp_path):
    path = tmp_path / "fish0.ply"
    path.write_bytes((zoo / "fish" / "fish0.ply").read_bytes())
    done = run("index", "add", tmp_path / "db", zoo / "fish" / "fish0.ply", path, code=2)
    assert "Names of shapes must differ; 'fish0' is the name of both " in done.stderr


@pytest.mark.long
def test_a_sheet_is_drawn_from_another_folder_than_the_index_was_made_in(
    zoo, tmp_path, monkeypatch
):
    monkeypatch.chdir(zoo)
    run("index", "add", tmp_path / "index", "fish", "--views", 0, "--method", "scale-free")
    scan = zoo / "fish" / "fish0.ply"
    monkeypatch.chdir(tmp_path)
    done = run("query", "index", scan, "--picture", "sheet.png")
    assert done.stderr == "wrote sheet.png\n"
    assert (tmp_path / "sheet.png").read_bytes()[:8] == PNG


@pytest.mark.long
def test_a_match_without_its_file_leaves_its_place_empty(zoo, tmp_path):
    path, moved, changed = (
        zoo / "fish" / "fish0.ply",
        tmp_path / "moved.ply",
        tmp_path / "changed.ply",
    )
    index = ShapeIndex.create(tmp_path / "index")
    descriptor = find_heat_features(read_mesh(path)).descriptor
    write_mesh(icosphere(0), changed)
    for name, source in {
        "loose": None,
        "moved": str(moved),
        "changed": str(changed),
        "there": str(path),
    }.items():
        keep(index, name, [descriptor], source=source)
    done = run("query", index.folder, path, "--picture", tmp_path / "sheet.png")
    for said in (
        "not drawn: loose: A match is drawn from its mesh file; it was added to the index without one",
        "not drawn: moved: [Errno 2] No such file or directory",
        "not drawn: changed: A match is drawn from the mesh that was indexed; that had a vertex",
        "now has 12 vertices. Give the same --repair as to `eigenshape index add`, or index the file again",
    ):
        assert said in done.stderr
    assert "there" not in done.stderr.replace(str(path), "")
    assert (tmp_path / "sheet.png").read_bytes()[:8] == PNG


@pytest.mark.long
def test_features_of_large_meshes_say_how_far_heat_is_off(tmp_path, monkeypatch):
    monkeypatch.setattr("eigenshape.cli.steps.parts.LARGE", 1000)
    monkeypatch.setattr("eigenshape.spectral.multilevel.approximate.COARSENED", 5)
    path = tmp_path / "large.ply"
    write_mesh(make_creature("hand", n_vertices=2500), path)
    assert (
        "2,500 vertices: heat is approximate, with a relative error of about"
        in run("features", path).stderr
    )
    found = run_json("features", path)
    assert len(found["features"]) == 15
    assert 0 < found["heat_error"] < 0.2
    small = tmp_path / "small.ply"
    write_mesh(make_creature("hand", n_vertices=900), small)
    assert run_json("features", small)["heat_error"] is None
    rough, fine = (
        run_json("features", small, "--accuracy", share)["heat_error"] for share in ("0.1", "1e-4")
    )
    assert rough > fine > 0


@pytest.mark.long
def test_an_index_lists_files_that_it_holds_twice_and_names_the_methods_that_it_lacks(tmp_path):
    folder = tmp_path / "meshes" / "fish"
    folder.mkdir(parents=True)
    write_mesh(make_creature("fish", n_vertices=500), folder / "one.ply")
    options = ("--method", "scale-free", "--views", 0, "--workers", 1)
    run("index", "add", tmp_path / "db", tmp_path / "meshes", *options)
    assert run_json("index", "duplicates", tmp_path / "db")["pairs"] == []
    run("index", "add", tmp_path / "db", folder, *options)  # named by another folder
    (pair,) = run_json("index", "duplicates", tmp_path / "db")["pairs"]
    assert pair == {"shape": "fish/one", "other": "one", "score": 0.0, "kind": "copy"}

    found = run("query", tmp_path / "db", folder / "one.ply", "--method", "scale-free")
    assert "score: 0 for the same description, lower is more alike" in found.stdout
    for method in ("thesis", "patches"):
        done = run("query", tmp_path / "db", folder / "one.ply", "--method", method, code=1)
        assert f"has no descriptions by {method}. Run `eigenshape index add`" in done.stderr
        assert done.stderr.count("\n") == 1


def test_info_says_why_a_closed_mesh_should_be_oriented(sphere, tmp_path):
    mesh = read_mesh(sphere)
    path = tmp_path / "inward.ply"
    write_mesh((mesh.vertices, mesh.faces[:, ::-1]), path)
    assert "(faces point inward)" in run("info", path).stdout
    assert "inward" not in run("info", sphere).stdout


def test_features_print_the_time_of_the_heat(sphere):
    assert "heat at time t = 0.004 of the area" in run("features", sphere).stdout
    assert "t = 0.001 of the square" in run("features", sphere, "--method", "thesis").stdout
