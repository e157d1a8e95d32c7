"""The verbs on shapes that are no triangle meshes, and operators by name."""

import json

import numpy as np
import pytest
from running import run, run_json

from eigenshape.geometry.cloud import PointCloud
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.io.shape_files import write_points
from eigenshape.operators.catalog import OPERATORS
from eigenshape.shapes.domains import box, disc
from eigenshape.shapes.exact import box_eigenvalues, disc_eigenvalues
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.multilevel import approximate


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shapes")
    cube = box(4, 4, 4)
    rows = "\n".join(" ".join(map(repr, row)) + " 0" for row in cube.points.tolist())
    cells = "\n".join(" ".join(map(str, row)) + " 0" for row in (cube.simplices + 1).tolist())
    (folder / "cube.mesh").write_text(
        f"MeshVersionFormatted 1\nDimension 3\nVertices\n{cube.n_points}\n{rows}\n"
        f"Tetrahedra\n{cube.n_simplices}\n{cells}\nEnd\n"
    )
    write_points(PointCloud(fibonacci_sphere(800).vertices), folder / "sphere.xyz")
    write_mesh(disc(8), folder / "disc.off")
    return folder


def test_info_of_a_tetrahedral_mesh(folder):
    facts = run_json("info", folder / "cube.mesh")
    assert facts["kind"] == "tetrahedral mesh"
    assert (facts["points"], facts["simplices"], facts["boundary_points"], facts["components"]) == (
        125,
        384,
        98,
        1,
    )
    assert facts["volume"] == pytest.approx(1)
    assert "tetrahedral mesh" in run("info", folder / "cube.mesh").stdout


def test_info_of_points(folder):
    facts = run_json("info", folder / "sphere.xyz", "--dim", 2)
    assert (facts["kind"], facts["points"], facts["coinciding_points"]) == ("point cloud", 800, 0)
    assert facts["mean_near_distance"] == pytest.approx(0.127, rel=0.1)


def test_info_of_a_curve_and_of_few_points(tmp_path):
    (tmp_path / "curve.obj").write_text("v 0 0 0\nv 3 4 0\nv 3 4 2\nl 1 2 3\n")
    facts = run_json("info", tmp_path / "curve.obj")
    assert (facts["kind"], facts["simplices"], facts["boundary_points"], facts["length"]) == (
        "curve",
        2,
        2,
        7,
    )
    assert "volume" not in facts
    (tmp_path / "few.xyz").write_text("0 0 0\n1 2 3\n")
    facts = run_json("info", tmp_path / "few.xyz")
    assert (facts["points"], facts["mean_near_distance"], facts["box_high"]) == (2, None, [1, 2, 3])


def test_spectra_by_other_operators(folder):
    found = run_json(
        "spectrum", folder / "cube.mesh", "-k", 4, "--operator", "p2", "--boundary", "dirichlet"
    )
    np.testing.assert_allclose(
        found["eigenvalues"], box_eigenvalues(4, (1, 1, 1), "dirichlet"), rtol=0.04
    )
    assert (found["operator"], found["boundary"]) == ("p2", "dirichlet")
    drum = run_json(
        "spectrum", folder / "disc.off", "-k", 4, "--operator", "p3", "--boundary", "dirichlet"
    )
    np.testing.assert_allclose(drum["eigenvalues"], disc_eigenvalues(4, "dirichlet"), rtol=0.01)
    points = run_json(
        "spectrum",
        folder / "sphere.xyz",
        "-k",
        4,
        "--set",
        "correct=log",
        "--set",
        "edge_factor=1.8",
    )
    np.testing.assert_allclose(points["eigenvalues"], [0, 2, 2, 2], rtol=0.03, atol=1e-9)
    assert points["operator"] == "point-cloud"
    assert points["edge_factor"] == 1.8
    usual, thesis = (
        run_json("spectrum", folder / "sphere.xyz", "-k", 4, *options)
        for options in ((), ("--set", "correct=none", "--set", "form=literal"))
    )
    np.testing.assert_allclose(usual["eigenvalues"], [0, 2, 2, 2], rtol=0.03, atol=1e-9)
    assert (thesis["correct"], thesis["form"]) == (None, "literal")
    assert thesis["eigenvalues"][3] < 0.99 * usual["eigenvalues"][3]  # the bias of the kernel
    tufted = run_json(
        "spectrum",
        folder / "sphere.xyz",
        "-k",
        4,
        "--operator",
        "robust",
        "--set",
        "n_neighbors=20",
    )
    np.testing.assert_allclose(tufted["eigenvalues"], [0, 2, 2, 2], rtol=0.05, atol=1e-9)


def test_brackets(folder):
    known = box_eigenvalues(6, (1, 1, 1), "dirichlet")
    found = run_json(
        "spectrum", folder / "cube.mesh", "-k", 6, "--brackets", "--boundary", "dirichlet"
    )["brackets"]
    assert (np.array(found["lower"]) <= known).all()
    assert (known <= np.array(found["upper"])).all()
    assert (found["boundary"], found["n_zero"]) == ("dirichlet", 0)
    text = run("spectrum", folder / "disc.off", "-k", 4, "--brackets").stdout
    assert "lower" in text.splitlines()[2]
    assert "Each of the 4 lowest eigenvalues" in " ".join(text.split())
    assert "brackets" not in run_json("spectrum", folder / "disc.off", "-k", 4)


def test_an_interval(folder):
    found = run_json(
        "spectrum", folder / "cube.mesh", "--above", 5.0, "--below", 25.0, "--brackets"
    )
    first, count = found["certificate"]["first"], len(found["eigenvalues"])
    assert first == 1
    assert 5 <= found["eigenvalues"][0] <= found["eigenvalues"][-1] < 25
    assert len(found["brackets"]["upper"]) == first + count
    text = run(
        "spectrum", folder / "cube.mesh", "--above", 5.0, "--below", 25.0, "--brackets"
    ).stdout
    assert f"eigenvalues from number 1 to {count}" in " ".join(text.split())
    wrong = run("spectrum", folder / "cube.mesh", "--above", 5.0, code=2)
    assert "above needs below" in wrong.stderr


def test_all_below_a_value(folder):
    found = run_json("spectrum", folder / "cube.mesh", "--below", 25.0)
    assert (
        len(found["eigenvalues"]) == sum(found["certificate"]["clusters"]) == 7
    )  # 0, three π², three 2π²
    held = run_json("spectrum", folder / "disc.off", "--below", 15, "--boundary", "dirichlet")
    assert len(held["eigenvalues"]) == 3
    wrong = run("spectrum", folder / "disc.off", "--below", 15, "-k", 3, code=2)
    assert "Exactly one of k and below must be given" in wrong.stderr


def test_a_plot_of_any_spectrum(folder, tmp_path):
    run(
        "spectrum",
        folder / "cube.mesh",
        "-k",
        4,
        "--picture",
        tmp_path / "a.png",
        "-o",
        tmp_path / "a.npz",
    )
    assert (tmp_path / "a.png").stat().st_size > 1000


def test_operators_are_listed():
    found = run_json("operators")
    assert {name: tuple(entry["options"]) for name, entry in found.items()} == {
        name: entry.options for name, entry in OPERATORS.items()
    }
    assert found["mesh"]["options"]["t"] == ["NUMBER", "pointwise", "none"]
    text = run("operators").stdout
    assert "Gaussian kernel, weighted by volumes" in text
    assert "for triangles, points" in text
    assert "--set mass=lumped|consistent|averaged|none" in text


def test_an_operator_is_explained():
    text = run("operators", "mesh").stdout
    assert "--set correct=log|none" in text
    assert "Distance in the kernel. Geodesic distance (on surfaces) does not leak" in text
    assert "cotangent" not in text
    assert "NAME must be one of cotangent, p2" in run("operators", "best", code=2).stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("spectrum", "sphere.xyz", "--operator", "cotangent"),
            "cotangent operator takes",
        ),
        (("spectrum", "disc.off", "--operator", "best"), "operator must be one of cotangent, p2"),
        (
            ("spectrum", "disc.off", "--operator", "p2", "--set", "mass=lumped"),
            "the p2 operator has the options none, and it is 'mass=lumped'",
        ),
        (
            ("spectrum", "disc.off", "--set", "masses=lumped"),
            "the cotangent operator has the options mass, conductivity, and it is 'masses=lumped'",
        ),
        (
            ("spectrum", "disc.off", "--set", "mass"),
            "--set takes NAME=VALUE; the cotangent operator has",
        ),
        (
            ("spectrum", "disc.off", "--set", "mass=heavy"),
            "--set gives an option one of its values; the values of mass are lumped, consistent, "
            "averaged, none, and it is 'heavy'",
        ),
        (
            ("spectrum", "sphere.xyz", "--set", "t=wide"),
            "those of t are NUMBER, none, and it is 'wide'",
        ),
        (
            ("spectrum", "sphere.xyz", "--operator", "robust", "--set", "n_neighbors=2.5"),
            "those of n_neighbors are NUMBER, none, and it is '2.5'",
        ),
        (("spectrum", "disc.off", "--operator", "best", "--set", "t=1"), "operator must be one of"),
        (
            ("spectrum", "sphere.xyz", "--boundary", "dirichlet"),
            "--boundary dirichlet is for meshes; a point cloud",
        ),
        (
            ("spectrum", "sphere.xyz", "--brackets"),
            "--brackets is for meshes; the shape is a point cloud",
        ),
        (
            ("spectrum", "sphere.xyz", "--eigenfunctions", "a.png"),
            "--eigenfunctions draws triangle meshes; the shape is PointCloud",
        ),
        (
            ("info", "sphere.xyz", "--repair", "weld"),
            "must be among auto, drop_missing, drop_duplicate_points; name 0 is 'weld'",
        ),
        (("info", "sphere.xyz", "--dim", "4"), "dim must lie in 1..3; it is 4"),
    ],
)
def test_refusals(folder, arguments, said):
    verb, name, *rest = arguments
    code = 1 if said.startswith("must be of a known format") else 2
    assert said in run(verb, folder / name, *rest, code=code).stderr


def test_missing_points_are_left_out_when_asked(tmp_path):
    (tmp_path / "a.xyz").write_text("0 0 0\n1 0 0\nnan 0 0\n0 1 0\n1 1 0\n2 0 0\n2 1 0\n0 2 0\n")
    assert (
        "--repair drop_missing, leaves them out" in run("info", tmp_path / "a.xyz", code=1).stderr
    )
    for repairs in ("drop_missing", "auto"):
        assert run_json("info", tmp_path / "a.xyz", "--repair", repairs)["points"] == 7


def test_faces_at_missing_vertices_are_left_out_when_asked(tmp_path):
    ball = icosphere(2)
    rows = [*map(str.split, map(" ".join, ball.vertices.astype(str).tolist()))]
    rows[7] = ["nan"] * 3
    lines = [f"v {' '.join(row)}" for row in rows]
    lines += [f"f {a} {b} {c}" for a, b, c in (ball.faces + 1).tolist()]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    refused = run("spectrum", tmp_path / "a.obj", code=1).stderr
    assert "vertices must be finite; vertex 7 is [nan, nan, nan] (1 such)" in refused
    assert "--repair drop_missing" in refused
    left_out = "drop_missing left out 1 vertex without finite coordinates and 5 faces at them"
    assert left_out in run("spectrum", tmp_path / "a.obj", "--repair", "drop_missing").stderr
    for verb in ("segment", "features"):  # read surfaces, of which it is a part
        assert left_out in run(verb, tmp_path / "a.obj").stderr
    assert "lost:" not in run("repair", tmp_path / "a.obj", "-o", tmp_path / "a.ply").stderr
    found = read_mesh(tmp_path / "a.ply")
    np.testing.assert_array_equal(found.vertices, np.delete(ball.vertices, 7, axis=0))
    assert found.n_faces == ball.n_faces - 5


def test_a_warning_is_one_line_and_no_error(folder):
    done = run("spectrum", folder / "sphere.xyz", "-k", 3, "--set", "edge_factor=1.2", "--json")
    assert done.stderr.startswith("warning: A kernel of width h = 1.2 e suits regular points only")
    assert len(done.stderr.strip().splitlines()) == 1
    assert len(json.loads(done.stdout)["eigenvalues"]) == 3


def test_a_closed_mesh_has_no_boundary_to_hold(folder, tmp_path):
    write_mesh(fibonacci_sphere(50), tmp_path / "closed.off")
    said = run("spectrum", tmp_path / "closed.off", "--boundary", "dirichlet", code=2).stderr
    assert (
        "--boundary dirichlet needs a boundary; TriangleMesh(50 vertices, 96 faces) is closed"
        in said
    )


@pytest.mark.long
def test_roughly_and_kept(folder, monkeypatch):
    write_mesh(icosphere(4), folder / "ball.off")
    exact = run("spectrum", folder / "ball.off", "-k", 9, "--accuracy", 1e-3)
    assert "was not counted" not in " ".join(exact.stdout.split())
    monkeypatch.setattr(approximate, "CERTIFIED_POINTS", 0)
    rough = run("spectrum", folder / "ball.off", "-k", 9, "--accuracy", 1e-3).stdout
    assert "Whether one is missing was not counted" in " ".join(rough.split())
    found = run_json("spectrum", folder / "ball.off", "-k", 9, "--accuracy", 1e-3)
    assert found["certificate"]["count"] is None
    np.testing.assert_allclose(found["eigenvalues"][1:], [2] * 3 + [6] * 5, rtol=0.01)
    kept = folder / "kept"
    first = run("spectrum", folder / "disc.off", "-k", 4, "--cache", kept).stdout
    assert len(list(kept.glob("*.npz"))) == 1
    assert run("spectrum", folder / "disc.off", "-k", 4, "--cache", kept).stdout == first
    refused = run("spectrum", folder / "disc.off", "--accuracy", 1e-3, "--below", 15, code=2)
    assert "--accuracy needs -k" in refused.stderr


@pytest.mark.long
def test_options_of_the_spectrum_combine(folder, monkeypatch):
    monkeypatch.setattr(approximate, "CERTIFIED_POINTS", 0)
    kept = folder / "combined"
    options = ("-k", 4, "--boundary", "dirichlet", "--cache", kept)
    fixed = run_json("spectrum", folder / "disc.off", *options)
    assert run_json("spectrum", folder / "disc.off", *options) == fixed
    assert len(list(kept.glob("*.npz"))) == 1
    rough = run_json("spectrum", folder / "disc.off", *options, "--accuracy", 1e-3)
    assert len(list(kept.glob("*.npz"))) == 2
    np.testing.assert_allclose(rough["eigenvalues"], fixed["eigenvalues"], rtol=4e-3)
