"""The verbs of `eigenshape index`, and queries of several kinds."""

import csv
import json

import numpy as np
import pytest
from describers import SPOIL_ROWS, keep, spoil
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app
from eigenshape.io.mesh_files import write_mesh
from eigenshape.retrieval.building.batch import announce_learning
from eigenshape.retrieval.heat.features import find_heat_features
from eigenshape.retrieval.heat.recipe import THESIS
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.store.writing import DescribedShape
from eigenshape.shapes.creatures import make_creature

TABLE = "name,label,tags,height\nfish/a,fish,wet;small,0.5\nbird/a,bird,,2\n"
LIGHT = ("--method", "scale-free", "--views", 0, "--workers", 1)


def run(*arguments, code=0):
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == code, done.output
    return done


def run_json(*arguments, code=0):
    return json.loads(run(*arguments, "--json", code=code).stdout)


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    for kind in ("fish", "bird"):
        (folder / kind).mkdir()
        for pose, name in enumerate("ab"):
            write_mesh(make_creature(kind, pose, n_vertices=500), folder / kind / f"{name}.ply")
    (folder / "table.csv").write_text(TABLE)
    return folder


@pytest.fixture(scope="module")
def made(meshes, tmp_path_factory):
    index = tmp_path_factory.mktemp("made") / "index"
    run("index", "add", index, meshes, "--labels", meshes / "table.csv", *LIGHT)
    return index


@pytest.fixture
def index(made, tmp_path):
    """Return an index of four shapes that a test may change."""
    ShapeIndex.create(tmp_path / "index").merge([ShapeIndex.open(made)])
    return tmp_path / "index"


pytestmark = pytest.mark.long


def test_ls_lists_what_the_table_says(index):
    shapes = {record["name"]: record for record in run_json("index", "ls", index)}
    assert list(shapes) == ["bird/a", "bird/b", "fish/a", "fish/b"]
    fish = shapes["fish/a"]
    assert (fish["label"], fish["tags"]) == ("fish", ["small", "wet"])
    assert fish["attributes"] == {"height": 0.5}
    text = run("index", "ls", index).stdout
    assert "4 shapes" in text
    assert "small, wet" in text


@pytest.mark.parametrize(
    ("filters", "names"),
    [
        (["label=bird"], ["bird/a", "bird/b"]),
        (["tag=wet"], ["fish/a"]),
        (["height=1..3"], ["bird/a"]),
        (["height=..1"], ["fish/a"]),
        (["height=2"], ["bird/a"]),
        (["label=bird,fish", "height=0..9"], ["bird/a", "fish/a"]),
        (["label!=fish", "height!=2"], ["bird/b", "cup", "range", "seven"]),
        (["label=7"], ["seven"]),  # a class is a text, whatever it looks like
        (["label=1..2"], ["range"]),
        (['label="cup, small",7'], ["cup", "seven"]),
    ],
)
def test_filters_choose_shapes(index, filters, names):
    descriptor = find_heat_features(make_creature("fish", n_vertices=500)).descriptor
    for name, label in (("seven", "7"), ("range", "1..2"), ("cup", "cup, small")):
        keep(ShapeIndex.open(index), name, [descriptor], label=label)
    options = [part for text in filters for part in ("--filter", text)]
    assert [record["name"] for record in run_json("index", "ls", index, *options)] == names


@pytest.mark.parametrize(
    "text", ["label", "=cat", "!=cat", "height=", "height=1..2..3", "height=a..b"]
)
def test_a_filter_that_is_none_is_refused(index, text):
    done = run("index", "ls", index, "--filter", text, code=2)
    assert repr(text) in done.stderr


def test_two_filters_of_one_key_are_refused_and_none_is_forgotten(index):
    filters = ("--filter", "label=bird", "--filter", "label=fish")
    assert "label=one,other" in run("index", "rm", index, *filters, code=2).stderr


def test_rm_takes_names_or_a_filter(index):
    assert run_json("index", "rm", index, "fish/a", "fish/b")["removed"] == ["fish/a", "fish/b"]
    assert run_json("index", "rm", index, "--filter", "height=2")["removed"] == ["bird/a"]
    assert [record["name"] for record in run_json("index", "ls", index)] == ["bird/b"]
    assert "'fish/a' is not" in run("index", "rm", index, "fish/a", code=1).stderr
    assert "give one of the two" in run("index", "rm", index, code=2).stderr


def test_stats_count_shapes_classes_and_bytes(index):
    facts = run_json("index", "stats", index)
    assert facts["shapes"] == 4
    assert facts["labels"] == {"bird": 2, "fish": 2}
    assert facts["recipes"] == {"scale-free": 4}
    assert facts["bytes"] == sum(path.stat().st_size for path in index.rglob("*"))
    assert "4 shapes" in run("index", "stats", index).stdout


def test_stats_say_the_stage_before_there_are_shapes(tmp_path):
    index = ShapeIndex.create(tmp_path / "index")
    passed_on = []
    with announce_learning(index.folder, lambda *facts: passed_on.append(facts)) as report:
        report(37, 4000, "cat", None)
        text = run("index", "stats", index.folder).stdout
        assert "learning a codebook: 37 of 100 shapes read by process" in text
        assert "37 of 100" in run_json("index", "stats", index.folder)["stage"]
    assert passed_on == [(37, 4000, "cat", None)]
    assert run_json("index", "stats", index.folder)["stage"] is None


def test_no_column_vanishes_in_a_narrow_terminal(tmp_path):
    index = ShapeIndex.create(tmp_path / "index")
    descriptor = find_heat_features(make_creature("fish", n_vertices=500)).descriptor
    facts = {"repairs": "what was done to it " * 9}
    index.add_many([DescribedShape("long" * 30, [descriptor], label="fish", attributes=facts)])
    done = CliRunner(env={"COLUMNS": "80"}).invoke(app, ["index", "ls", str(index.folder)])
    assert "│ fish " in done.stdout
    assert max(map(len, done.stdout.splitlines())) == 80


def test_duplicates_are_listed(index):
    shelf = ShapeIndex.open(index)
    keep(shelf, "copy", shelf.descriptors("fish/a", shelf.default_recipe()), label="x")
    (pair,) = run_json("index", "duplicates", index, "--score", 0.001)["pairs"]
    assert (pair["shape"], pair["other"], pair["score"]) == ("copy", "fish/a", 0)
    assert "│ fish/a │" in run("index", "duplicates", index, "--score", 0.001).stdout
    shelf.remove("copy")
    assert "none of 4 shapes" in run("index", "duplicates", index, "--score", 0.001).stdout


def test_duplicates_tell_copies_from_other_poses(tmp_path):
    shelf = ShapeIndex.create(tmp_path / "index")
    fish, bent = (make_creature("fish", pose, n_vertices=500) for pose in (0, 1))
    moved = es.TriangleMesh(3 * fish.vertices[:, [1, 2, 0]] + 7, fish.faces)
    mirrored = es.TriangleMesh(fish.vertices * [-1, 1, 1], fish.faces[:, ::-1])
    for name, mesh in {"a": fish, "b": moved, "c": mirrored, "other pose": bent}.items():
        shelf.add(name, mesh, n_views=0)
    found = run_json("index", "duplicates", shelf.folder)["pairs"]
    kinds = {(pair["shape"], pair["other"]): pair["kind"] for pair in found}
    assert kinds == {("a", "b"): "copy", ("a", "c"): "mirror image", ("b", "c"): "mirror image"} | {
        (name, "other pose"): "similar" for name in "abc"
    }
    rows = run("index", "duplicates", shelf.folder).stdout.splitlines()
    assert sum(" copy " in row for row in rows) == 1
    assert sum(" mirror image " in row for row in rows) == 2


def test_verify_names_a_damaged_shape_and_exits_with_1(index):
    assert run_json("index", "verify", index)["damages"] == []
    assert "no damage" in run("index", "verify", index).stdout
    spoil(index, SPOIL_ROWS)
    (damage,) = run_json("index", "verify", index, code=1)["damages"]
    assert damage["file"] == "index.sqlite"
    assert damage["shape"] in {"bird/a", "bird/b", "fish/a", "fish/b"}
    assert "damaged: " in run("index", "verify", index, code=1).stdout


def test_compact_gives_the_space_of_removed_shapes_back(index):
    shelf = ShapeIndex.open(index)
    (fish,) = shelf.descriptors("fish/a", shelf.default_recipe())
    shelf.add_many(
        DescribedShape(f"x{number}", [fish], label="x", thumbnail=bytes(8000))
        for number in range(20)
    )
    run("index", "rm", index, "--filter", "label=x")
    before = run_json("index", "stats", index)["bytes"]
    given = run_json("index", "compact", index)["bytes"]
    assert given > 20 * 8000 - 16_384
    assert run_json("index", "stats", index)["bytes"] <= before - given
    assert run_json("index", "verify", index)["damages"] == []


def test_export_writes_records_and_arrays(index, tmp_path):
    run("index", "export", index, "-o", tmp_path / "out", "--filter", "label=fish")
    records = json.loads((tmp_path / "out" / "records.json").read_text())
    assert {record["name"] for record in records} == {"fish/a", "fish/b"}
    assert (tmp_path / "out" / "descriptors.npz").exists()


def test_parts_are_merged_to_the_index_of_all(meshes, index, tmp_path):
    for part in (1, 2):
        run("index", "add", tmp_path / f"{part}", meshes, "--part", f"{part}/2", *LIGHT)
    parts = tmp_path / "1", tmp_path / "2"
    assert run_json("index", "merge", tmp_path / "whole", *parts)["added"] == 4
    scan = meshes / "fish" / "b.ply"
    found = [
        [(match["name"], match["score"]) for match in run_json("query", folder, scan)["matches"]]
        for folder in (index, tmp_path / "whole")
    ]
    assert found[0] == found[1]


def test_a_merge_names_shapes_that_queries_do_not_find(index, tmp_path):
    other = ShapeIndex.create(tmp_path / "other")
    by_another = find_heat_features(make_creature("fish", n_vertices=500), THESIS).descriptor
    keep(other, "apart", [by_another], digest="0" * 64)
    done = run("index", "merge", index, other.folder)
    assert "not found by queries: 1 shape, which scale-free does not describe: apart" in done.stderr
    again = run_json("index", "merge", index, other.folder)
    assert (again["added"], again["not_compared"]) == (0, ["apart"])
    assert run("query", index, "apart", code=1).stderr.count("Choose another --method") == 1
    empty = run("query", index, "fish/a", "--filter", "label=nobody").stdout
    assert "none; the index holds no other shape, or none agrees with the filters" in empty


@pytest.mark.parametrize("text", ["3", "0/2", "3/2", "1/0", "a/b"])
def test_a_part_that_is_none_is_refused(meshes, tmp_path, text):
    done = run("index", "add", tmp_path / "index", meshes, "--part", text, code=2)
    assert repr(text) in done.stderr


def test_files_that_are_gone_are_pruned_when_asked(meshes, index, tmp_path):
    folder = tmp_path / "copy"
    (folder / "fish").mkdir(parents=True)
    for name in "ab":
        data = (meshes / "fish" / f"{name}.ply").read_bytes()
        (folder / "fish" / f"{name}.ply").write_bytes(data)
    moved = run_json("index", "add", index, folder, *LIGHT)
    assert moved["skipped"] == ["fish/a", "fish/b"]
    (folder / "fish" / "a.ply").unlink()
    assert run_json("index", "add", index, folder, *LIGHT)["pruned"] == []
    assert run_json("index", "add", index, folder, "--prune", *LIGHT)["pruned"] == ["fish/a"]
    assert run_json("index", "stats", index)["shapes"] == 3


def test_the_class_is_printed_with_its_probability(index, tmp_path):
    folder = tmp_path / "patches"
    shelf = ShapeIndex.create(folder)
    for kind in ("fish", "bird"):
        shelf.add(kind, make_creature(kind, n_vertices=500), label=kind, n_views=0)
    found = run_json("query", folder, "fish", "-n", 1, "--classify")
    assert list(found["classes"]) == ["bird"]
    share = f"{100 * found['classes']['bird']:.0f} %"
    assert f"class: bird {share}" in run("query", folder, "fish", "--classify").stdout
    refused = run("query", index, "fish/a", "--classify", code=2).stderr
    assert "Probabilities of classes are known for patches" in refused


def test_a_folder_and_a_shape_of_the_index_are_queries_too(meshes, index, tmp_path):
    table = tmp_path / "matches.csv"
    answers = run_json("query", index, meshes, "-n", 2, "-o", table)
    assert [answer["matches"][0]["name"] for answer in answers] == [
        "bird/a",
        "bird/b",
        "fish/a",
        "fish/b",
    ]
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["rank"] for row in rows] == ["1", "2"] * 4
    n_shapes = run_json("index", "stats", index)["shapes"]
    said = run("query", index, meshes, "-n", 2).stdout
    assert f"4 scans, each described, and compared with {n_shapes} shapes, in " in said
    assert rows[0]["name"] == "bird/a"
    assert [row["query"] for row in rows[::2]] == ["bird/a", "bird/b", "fish/a", "fish/b"]
    shown = run("query", index, meshes, "-n", 2).stdout
    assert (shown.count("Most similar shapes"), shown.count("score: ")) == (4, 1)
    alike = run_json("query", index, "fish/a", "-n", 1)["matches"]
    assert [match["name"] for match in alike] == ["fish/b"]
    assert "nobody is none of them" in run("query", index, "nobody", code=2).stderr
    misspelled = run("query", index, meshes, "--filter", "sead=1", code=2).stderr
    assert ("no shape has 'sead'" in misspelled, "not searched for" in misspelled) == (True, False)
    only = run_json("query", index, "fish/a", "--filter", "label=bird")["matches"]
    assert {match["label"] for match in only} == {"bird"}


def test_clouds_and_frames_become_surfaces_which_is_told(meshes, tmp_path):
    folder, index = tmp_path / "scans", tmp_path / "index"
    folder.mkdir()
    bird, fish = (es.make_creature(kind, n_vertices=1500) for kind in ("bird", "fish"))
    es.io.write_points(sampled(bird), folder / "bird.xyz")
    write_frame(fish, folder / "fish.pcd")
    (folder / "few.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    report = run_json("index", "add", index, folder, *LIGHT, code=3)
    assert report["added"] == ["bird", "fish"]
    ((name, reason),) = report["failed"]
    assert name == "few"
    assert "at least 100 points" in reason
    made = {name: done[0].split()[0] for name, done in report["repaired"]}
    assert made == {"bird": "reconstruct_surface", "fish": "triangulate_frame"}
    listed = {record["name"]: record for record in run_json("index", "ls", index)}
    for name, done in report["repaired"]:
        assert listed[name]["attributes"]["repairs"] == "; ".join(done)
    es.write_mesh(bird, tmp_path / "bird.ply")
    assert run_json("query", index, tmp_path / "bird.ply")["matches"][0]["name"] == "bird"
    done = run("query", index, folder / "fish.pcd", "-n", 1, "--picture", tmp_path / "fish.png")
    assert "repair: triangulate_frame joined" in done.stderr
    assert "fish" in done.stdout


def sampled(mesh):
    points = es.geometry.sample_surface(mesh, 4000, rng=np.random.default_rng(0)).points
    return es.PointCloud(points)


def write_frame(mesh, path):
    """Write the organized frame of a camera that sees a mesh, from the pixels of a scan."""
    camera = es.scans.DepthCamera(resolution=96, noise=0, dropout_angle=84.9, dropout=0, n_holes=0)
    scan = es.scans.simulate_scan(
        mesh, np.random.default_rng(0), view=[0, 0, 1], camera=camera, all_pieces=True
    )
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    away = camera.distance * np.linalg.norm(high - low)
    frame = np.full((96, 96, 3), np.nan)
    columns, rows = scan.pixels.T
    frame[rows, columns] = scan.mesh.vertices - (low + high) / 2 - [0, 0, away]
    path.write_text(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 96\nHEIGHT 96\n"
        "POINTS 9216\nDATA ascii\n"
        + "\n".join(" ".join(map(str, point)) for point in frame.reshape(-1, 3))
    )


def test_queries_that_cannot_be_read_are_named_and_the_others_answered(meshes, index, tmp_path):
    (tmp_path / "scans").mkdir()
    (tmp_path / "scans" / "bad.ply").write_text("no mesh")
    good = (meshes / "fish" / "a.ply").read_bytes()
    (tmp_path / "scans" / "good.ply").write_bytes(good)
    done = run("query", index, tmp_path / "scans", code=3)
    assert "not searched for: bad: " in done.stderr
    assert "Most similar shapes" in done.stdout


def test_an_explanation_is_drawn(meshes, index, tmp_path):
    picture = tmp_path / "why.png"
    run("query", index, meshes / "fish" / "b.ply", "--explain", picture)
    assert picture.read_bytes()[:4] == b"\x89PNG"
    from_above = tmp_path / "above.png"
    run("query", index, meshes / "fish" / "b.ply", "--explain", from_above, "--view", "top")
    assert from_above.read_bytes() != picture.read_bytes()
    done = run("query", index, "fish/a", "--explain", picture, code=2)
    assert "Leave --picture and --explain out" in done.stderr


def test_a_folder_that_is_not_there_makes_no_index(tmp_path):
    done = run("index", "add", tmp_path / "new", tmp_path / "misspelled", *LIGHT, code=1)
    assert "No such file" in done.stderr
    assert not (tmp_path / "new").exists()


def test_a_codebook_is_for_patches_and_is_a_codebook(meshes, index, tmp_path):
    asked = ("index", "add", tmp_path / "new", meshes, "--codebook")
    assert "is for --method patches" in run(*asked, index, *LIGHT, code=2).stderr
    assert "has none" in run(*asked, index, code=1).stderr
    assert "is none" in run(*asked, meshes / "table.csv", code=1).stderr
    learned = tmp_path / "book.npz"
    done = run("index", "learn", meshes, "-o", learned)
    assert "too few shapes" in done.stderr
    options = ("--views", 0, "--workers", 1)
    assert run_json(*asked, learned, *options)["added"] == ["bird/a", "bird/b", "fish/a", "fish/b"]


def test_all_shapes_of_an_index_have_as_many_frames(meshes, tmp_path):
    new = tmp_path / "new"
    asked = ("index", "add", new, meshes / "fish" / "a.ply", "--views", 0, "--workers", 1)
    assert "is for --method patches" in run(*asked, "--frames", 2, *LIGHT, code=2).stderr
    assert len(run_json(*asked, "--frames", 2)["added"]) == 1
    recipe = ShapeIndex.open(new).default_recipe()
    assert recipe.n_frames == 2
    assert len(ShapeIndex.open(new).descriptors("a", recipe)[0].codes) == 3
    assert "has 2 frames a shape" in run(*asked, "--frames", 1, code=2).stderr
    assert run_json(*asked)["skipped"] == ["a"]


def test_an_unreachable_cluster_is_named(meshes, tmp_path):
    pytest.importorskip("distributed")
    asked = ("index", "add", tmp_path / "new", meshes, "--scheduler", "nonsense://here:1")
    assert "--scheduler takes the address of a Dask scheduler" in run(*asked, code=2).stderr
