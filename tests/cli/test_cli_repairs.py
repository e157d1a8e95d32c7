"""What the verbs refuse is mended by what they say: --repair auto."""

import json
import shutil

import numpy as np
import pytest
from broken_meshes import (
    flipped,
    soup,
    tetrahedra,
    with_duplicates,
    with_flat_simplices,
    with_loose_points,
    with_specks,
)
from running import run

from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import write_mesh
from eigenshape.io.shape_files import write_points
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere


def info(path, *options):
    return json.loads(run("info", path, "--json", *options).stdout)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("broken")
    whole, rng = make_creature("quadruped", n_vertices=500), np.random.default_rng(0)
    write_mesh(whole, folder / "whole.ply")
    write_mesh(soup(whole), folder / "soup.ply")
    write_mesh(
        with_loose_points(with_flat_simplices(with_duplicates(whole, rng), rng), rng, 40),
        folder / "ugly.ply",
    )
    write_mesh(flipped(whole, rng), folder / "flipped.ply")
    return folder


@pytest.fixture(scope="module", params=["patches", "scale-free"])
def preset(request, folder):
    """A method, by which an index of its name holds the sound shape."""
    options = ("--method", request.param, "--views", 0, "--workers", 1)
    run("index", "add", folder / request.param, folder / "whole.ply", *options)
    return request.param


@pytest.mark.long
@pytest.mark.parametrize("name", ["soup", "ugly", "flipped"])
def test_a_broken_shape_is_found_once_it_is_repaired(folder, tmp_path, name, preset):
    broken, db = folder / f"{name}.ply", tmp_path / "db"
    shutil.copytree(folder / preset, db)
    if (name, preset) != ("flipped", "scale-free"):  # heat has no side
        asked = run("query", db, broken, "--repair", "none", code=1)
        assert "--repair auto on the command line" in asked.stderr
        options = ("--method", preset, "--views", 0, "--workers", 1, "--repair", "none")
        refused = run("index", "add", db, broken, *options, code=3)
        assert "--repair auto on the command line" in refused.stderr
    found = json.loads(run("query", db, broken, "--json").stdout)  # repairs what needs repair
    assert found["matches"][0]["name"] == "whole"
    added = run("index", "add", db, broken, "--method", preset, "--views", 0, "--workers", 1)
    assert "1 described" in added.stdout
    assert f"repaired: {name}: " in added.stderr


@pytest.mark.parametrize("verb", ["features", "segment"])
@pytest.mark.parametrize("name", ["soup", "ugly"])
def test_parts_of_a_broken_shape_are_found_once_it_is_repaired(folder, verb, name):
    none = run(verb, folder / f"{name}.ply", "--repair", "none", code=1).stderr
    assert "--repair auto on the command line" in none
    if name == "soup":  # seams are joined without a word of the user
        assert "weld_seams joined" in run(verb, folder / f"{name}.ply").stderr
    done = run(verb, folder / f"{name}.ply", "--json", "--repair", "auto")
    assert "repair: " in done.stderr
    assert sum(
        row["area_share"]
        for row in json.loads(done.stdout)["features" if verb == "features" else "parts"]
    ) == (pytest.approx(1))


def test_loose_vertices_are_called_so_and_not_components(folder):
    said = run("features", folder / "ugly.ply", code=1).stderr
    assert "Every vertex must belong to a face; vertex 0 at" in said
    assert "largest_component" not in said


@pytest.mark.long
def test_info_proposes_all_that_helps(tmp_path):
    ball, rng = icosphere(3), np.random.default_rng(1)
    cases = {
        "flipped": (flipped(ball, rng), ["orient"]),
        "inward": (TriangleMesh(ball.vertices, ball.faces[:, ::-1]), ["orient"]),
        "holes": (
            TriangleMesh(ball.vertices, np.delete(ball.faces, np.arange(0, 1140, 30), axis=0)),
            ["fill_holes"],
        ),
        "specks": (with_specks(ball, rng, 200), ["largest_component"]),
        "soup": (soup(ball), ["weld_seams"]),
    }
    for name, (mesh, expected) in cases.items():
        path = tmp_path / f"{name}.ply"
        write_mesh(mesh, path)
        assert info(path)["repairs_to_try"] == expected
        mended = info(path, "--repair", ",".join(expected))
        assert mended["repairs_to_try"] == []
        assert (mended["closed"], mended["components"], mended["faces"]) == (True, 1, ball.n_faces)
        assert mended["enclosed_volume"] == pytest.approx(4.15, abs=0.01)
    assert info(tmp_path / "flipped.ply")["enclosed_volume"] is None
    assert info(tmp_path / "holes.ply")["boundary_loops"] == 38


@pytest.mark.long
def test_copies_of_points_and_tetrahedra(tmp_path):
    points = fibonacci_sphere(300).vertices
    write_points(PointCloud(np.concatenate([points, points[:5]])), tmp_path / "copies.xyz")
    assert (
        'Try repair(cloud, ["auto"]), or --repair auto'
        in run("spectrum", tmp_path / "copies.xyz", code=1).stderr
    )
    done = run("spectrum", tmp_path / "copies.xyz", "-k", 4, "--json", "--repair", "auto")
    assert "repair: drop_duplicate_points removed 5 points at the places of others" in done.stderr
    assert info(tmp_path / "copies.xyz")["repairs_to_try"] == ["drop_duplicate_points"]
    assert (
        info(tmp_path / "copies.xyz", "--repair", "drop_duplicate_points")["repairs_to_try"] == []
    )
    mesh = with_duplicates(tetrahedra(), np.random.default_rng(0), 1)
    rows = "\n".join(" ".join(map(str, row)) + " 0" for row in mesh.points.tolist())
    cells = "\n".join(" ".join(map(str, row)) + " 0" for row in (mesh.simplices + 1).tolist())
    (tmp_path / "twice.mesh").write_text(
        f"MeshVersionFormatted 1\nDimension 3\nVertices\n{mesh.n_points}\n{rows}\n"
        f"Tetrahedra\n{mesh.n_simplices}\n{cells}\nEnd\n"
    )
    assert (
        "Simplices must differ" in run("spectrum", tmp_path / "twice.mesh", "-k", 3, code=1).stderr
    )
    run("spectrum", tmp_path / "twice.mesh", "-k", 3, "--repair", "auto")
    assert info(tmp_path / "twice.mesh")["repairs_to_try"] == ["drop_duplicate_faces"]


@pytest.mark.long
@pytest.mark.data
def test_a_horse_that_faces_inward(data):
    path = data / "classics" / "horse.ply"
    assert info(path)["repairs_to_try"] == ["orient"]
    assert info(path, "--repair", "auto")["enclosed_volume"] > 0
