"""`eigenshape deform`: regions and handles in words."""

import json

import numpy as np
import pytest
from running import run

from eigenshape.cli.deform import parse_region, parse_rotation
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import bend
from eigenshape.deformation.region import BoxRegion, BrushRegion, region_boundary, region_mask
from eigenshape.deformation.rig import rig_shape
from eigenshape.features.parts import find_parts
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import subdivide
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import read_mesh, write_mesh
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere

PNG = b"\x89PNG\r\n\x1a\n"
QUIET = lambda share, what: None  # noqa: E731


@pytest.fixture(scope="module")
def giraffe(tmp_path_factory):
    path = tmp_path_factory.mktemp("giraffe") / "giraffe.ply"
    write_mesh(make_creature("giraffe", 1, n_vertices=900), path)
    return path


@pytest.mark.long
def test_a_head_nods(giraffe, tmp_path):
    bent, picture, edits = tmp_path / "bent.ply", tmp_path / "bent.png", tmp_path / "edits.json"
    words = ["--region", "y>70%", "--rotate", "x by 40"]
    done = run(
        "deform",
        giraffe,
        *words,
        "-o",
        bent,
        "--picture",
        picture,
        "--save-edits",
        edits,
        "--json",
    )
    found = json.loads(done.stdout)
    mesh = read_mesh(giraffe)
    region = parse_region("y>70%", mesh, QUIET)
    expected = bend(bind(rig_shape(mesh), [region]), [parse_rotation("x by 40", mesh, region)])
    np.testing.assert_array_equal(read_mesh(bent).vertices, expected.vertices)
    assert found["edits"] == 1
    assert 0 < found["vertices_moved"] < mesh.n_vertices
    assert 0 < found["edge_error"] < 0.2
    assert found["crossing_faces"] == []
    assert picture.read_bytes()[:8] == PNG

    again = tmp_path / "again.ply"
    run("deform", giraffe, "--edits", edits, "-o", again)
    np.testing.assert_array_equal(read_mesh(again).vertices, expected.vertices)
    more = json.loads(
        run("deform", giraffe, "--edits", edits, *words[:2], "--move", "0,0.1,0", "--json").stdout
    )
    assert more["edits"] == 2


@pytest.mark.long
def test_edits_of_another_mesh_are_refused_or_carried(giraffe, tmp_path):
    edits, finer, bent = tmp_path / "edits.json", tmp_path / "finer.ply", tmp_path / "bent.ply"
    listed = tmp_path / "head.txt"
    mesh = read_mesh(giraffe)
    head = np.flatnonzero(mesh.vertices[:, 1] > np.quantile(mesh.vertices[:, 1], 0.9))
    listed.write_text("\n".join(map(str, head)))
    run("deform", giraffe, "--region", listed, "--move", "0,0.05,0", "--save-edits", edits)
    write_mesh(subdivide(mesh), finer)
    refused = " ".join(run("deform", finer, "--edits", edits, "-o", bent, code=2).stderr.split())
    assert (
        "edits.json: Edits name vertices of the mesh on which they were made; that has 900 vertices"
        in refused
    )
    assert "On the command line, --edits-mesh names it." in refused
    assert not bent.exists()
    run("deform", finer, "--edits", edits, "--edits-mesh", giraffe, "-o", bent)
    moved = np.linalg.norm(read_mesh(bent).vertices - read_mesh(finer).vertices, axis=1)
    # What is deep in the head moves as one; the rest of it follows the neck.
    assert np.median(moved[head]) == pytest.approx(0.05, rel=0.02)
    assert np.isclose(moved[head], 0.05, rtol=1e-6).sum() > len(head) / 4
    new = moved[mesh.vertices.shape[0] :]
    assert np.isclose(new, 0.05, rtol=1e-6).sum() > len(head) / 2
    assert np.median(moved) < 1e-3
    alone = " ".join(
        run(
            "deform",
            finer,
            *("--edits-mesh", giraffe, "--region", "y>70%", "--move", "0,0.1,0"),
            code=2,
        ).stderr.split()
    )
    assert "--edits-mesh is used together with --edits" in alone


@pytest.mark.parametrize("suffix", [".obj", ".glb", ".stl", ".off", ".ply"])
def test_a_bent_mesh_goes_to_every_format(giraffe, tmp_path, suffix):
    bent = tmp_path / f"bent{suffix}"
    run("deform", giraffe, "--region", "y>70%", "--move", "0,0.02,0", "-o", bent)
    assert read_mesh(bent).n_faces == read_mesh(giraffe).n_faces


def test_people_see_a_table(giraffe):
    printed = run(
        "deform", giraffe, "--region", "y>70%", "--move", "0,0.02,0", "--mode", "thesis"
    ).stdout
    assert all(
        words in printed
        for words in ("vertices that moved", "edges stretched", "pairs of faces that cross")
    )


@pytest.mark.long
def test_words_for_regions(giraffe, tmp_path):
    mesh = read_mesh(giraffe)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    box = parse_region("y > 25%, x<0.5", mesh, QUIET)
    assert isinstance(box, BoxRegion)
    np.testing.assert_allclose(box.low, [-np.inf, low[1] + 0.25 * (high - low)[1], -np.inf])
    np.testing.assert_allclose(box.high, [0.5, np.inf, np.inf])
    brush = parse_region("vertex 7 within 10%", mesh, QUIET)
    assert isinstance(brush, BrushRegion)
    assert brush.radius == pytest.approx(0.1 * surface_area(mesh) ** 0.5)
    assert parse_region("vertex 7 within 0.25", mesh, QUIET).radius == 0.25
    listed = tmp_path / "some.txt"
    listed.write_text("3\n1\n4\n")
    assert parse_region(str(listed), mesh, QUIET) == [3, 1, 4]
    n_parts = len(find_parts(mesh).parts.features.vertices)
    masks = [
        region_mask(mesh, parse_region(f"part {number}", mesh, QUIET)) for number in range(n_parts)
    ]
    assert np.all(np.any(masks, axis=0))
    assert all(0 < mask.sum() < mesh.n_vertices for mask in masks)


def test_words_for_handles(giraffe):
    mesh = read_mesh(giraffe)
    region = parse_region("y>70%", mesh, QUIET)
    turn = parse_rotation("0,3,4 by -90", mesh, region)
    np.testing.assert_allclose(turn.axis, [0, 0.6, 0.8])
    assert turn.angle == pytest.approx(-np.pi / 2)
    rim = region_boundary(mesh, region_mask(mesh, region))
    np.testing.assert_allclose(turn.pivot, mesh.vertices[rim].mean(axis=0))
    np.testing.assert_allclose(parse_rotation("z by 720 @ 1,2,3", mesh, region).pivot, [1, 2, 3])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--region", "head", "--move", "0,1,0"], "A region is one of these"),
        (
            ["--region", "head", "--move", "0,1,0", "-o", "a.txt"],
            "A mesh must be written to a file that ends in .off, .obj, .ply, .stl, .glb, .vtu, .vtp, .vtk, .npz, "
            ".gii, .surf; a.txt",
        ),
        (
            ["--region", "head", "--move", "0,1,0", "-o", "nowhere/a.obj"],
            "A mesh must be written to a folder that exists",
        ),
        (["--region", "y>500", "--move", "0,1,0"], "must have a boundary on the shape"),
        (["--region", "y>70%", "--move", "0,1"], "A move is three numbers separated by commas"),
        (["--region", "y>70%", "--rotate", "x 90"], "A rotation is 'x by 90'"),
        (
            ["--region", "y>70%", "--rotate", "a,b,c by 3"],
            "An axis other than x, y and z is three numbers",
        ),
        (["--region", "y>70%", "--rotate", "x by 3 @ 1,2"], "A pivot is three numbers"),
        (
            ["--region", "vertex 99999 within 1", "--move", "0,1,0"],
            "A vertex of a region must lie in 0",
        ),
        (["--region", "part 99", "--move", "0,1,0"], "A part must lie in 0"),
        (["--region", "y>70%"], "Give --region with either --rotate or --move"),
        (["--move", "0,1,0"], "Give --region with either --rotate or --move"),
        (
            ["--region", "y>70%", "--move", "0,1,0", "--rotate", "x by 3"],
            "Give --region with either",
        ),
        (
            ["--region", "y>70%", "--move", "0,1,0", "--mode", "soft"],
            "'soft' is not one of 'graded', 'uncrossed'",
        ),
        (["--region", "y>70%", "--move", "0,1,0", "-n", "999"], "n_modes must lie in 1"),
    ],
)
def test_what_is_wrong_is_named(giraffe, words, message):
    done = run("deform", giraffe, *words, code=2)
    assert message in " ".join(done.stderr.replace("│", " ").split())


def test_a_list_that_is_none_is_named(giraffe, tmp_path):
    listed = tmp_path / "some.txt"
    listed.write_text("3\nx\n")
    done = run("deform", giraffe, "--region", listed, "--move", "0,1,0", code=2)
    assert "has one vertex index a line" in " ".join(done.stderr.split())


@pytest.mark.long
def test_faces_that_cross_are_pointed_out_with_what_may_help(giraffe):
    hint = "--fixed with a smaller part"
    folded = run("deform", giraffe, "--region", "y>60%", "--rotate", "x by 170")
    assert hint in folded.stderr
    assert hint not in run("deform", giraffe, "--region", "y>60%", "--rotate", "x by 1").stderr


def test_each_patch_turns_about_the_middle_of_its_own_boundary(tmp_path):
    """Two legs of a table, selected by one box; about a point that is given, they turn as one."""
    path, edits = tmp_path / "two.ply", tmp_path / "edits.json"
    ball = icosphere(2)
    write_mesh(
        disjoint_union(ball, TriangleMesh(ball.vertices + np.array([3, 0, 0]), ball.faces)), path
    )
    for rotation, pivots in (
        ("x by 30", [[0.0, 0.0], [3.0, 0.0]]),
        ("x by 30 @ 1.5,0,0", [[1.5, 0.0]]),
    ):
        run("deform", path, "--region", "z>0.2", "--rotate", rotation, "--save-edits", edits)
        moves = json.loads(edits.read_text())["edits"][0]["moves"]
        found = [move["handle"]["pivot"][:2] for move in moves]
        np.testing.assert_allclose(sorted(found), pivots, atol=1e-12)


@pytest.mark.long
def test_an_island_of_a_region_is_named_once(tmp_path):
    path, region = tmp_path / "ball.ply", tmp_path / "region.txt"
    ball = icosphere(3)
    write_mesh(ball, path)
    top = ball.vertices[:, 2] > 0.5
    island = np.flatnonzero((ball.vertices[:, 2] > 0.2) & (ball.vertices[:, 2] < 0.25))[0]
    region.write_text("\n".join(map(str, [*np.flatnonzero(top), island])))
    words = ["--region", region, "--move", "0,0,0.3"]
    done = run("deform", path, *words, "--picture", tmp_path / "a.png")
    assert done.stderr.count("Small patches of a region") == 1
    assert f"1 vertex, of which vertex {island} follows by 0." in " ".join(done.stderr.split())


@pytest.fixture(scope="module")
def textured(tmp_path_factory):
    """A creature with an image on it, whose vertices are double along the seam at the back."""
    mesh = make_creature("quadruped", n_vertices=600)
    x, _, z = (mesh.vertices - mesh.vertices.mean(axis=0)).T
    u = (np.arctan2(x, z) / (2 * np.pi) + 0.5)[mesh.faces]
    u += (np.ptp(u, axis=1) > 0.5)[:, None] & (u < 0.5)
    rows = np.column_stack([mesh.faces.ravel(), u.ravel()])
    different, faces = np.unique(rows, axis=0, return_inverse=True)
    vertices = mesh.vertices[different[:, 0].astype(int)]
    folder = tmp_path_factory.mktemp("textured")
    (folder / "skin.png").write_bytes(PNG)
    (folder / "skin.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    lines = ["mtllib skin.mtl", "usemtl skin"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [
        f"vt {u!r} {v!r}" for u, v in np.column_stack([different[:, 1], vertices[:, 1]]).tolist()
    ]
    lines += ["f " + " ".join(f"{i}/{i}" for i in face) for face in faces.reshape(-1, 3) + 1]
    path = folder / "character.obj"
    path.write_text("\n".join(lines) + "\n")
    assert len(vertices) > mesh.n_vertices
    return path, mesh.n_vertices


def torn(before, after):
    """Count the places of the file whose corners have come apart."""
    _, places = np.unique(before.vertices, axis=0, return_inverse=True)
    corners, where = places.ravel()[before.faces.ravel()], after.vertices[after.faces.ravel()]
    return sum(len(np.unique(where[corners == place], axis=0)) > 1 for place in np.unique(corners))


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".obj", ".glb"])
def test_a_textured_character_does_not_tear_along_its_seams(textured, tmp_path, suffix):
    path, n_joined = textured
    if suffix == ".glb":
        mesh, attributes = read_mesh(path, attributes=True)
        path = tmp_path / "character.glb"
        write_mesh(mesh, path, attributes=attributes)
    before, held = read_mesh(path, attributes=True)
    bent = tmp_path / f"bent{suffix}"
    words = ["deform", path, "--region", "y>60%", "--rotate", "x by 40", "-o", bent]
    said = " ".join(run(*words).stderr.split())
    n_double = before.n_vertices - n_joined
    assert f"repair: weld_seams joined {n_double} vertices along seams" in said
    assert f"vertices have new numbers, up to {n_joined - 1}" in said
    after, kept = read_mesh(bent, attributes=True)
    assert torn(before, after) == 0
    assert not np.array_equal(before.vertices[before.faces], after.vertices[after.faces])
    np.testing.assert_array_equal(kept.texture_coordinates, held.texture_coordinates)
    assert [each.image for each in kept.materials] == [PNG]
    # What was torn before, and is still, where somebody asks for it; then it is said.
    said = " ".join(run(*words, "--repair", "none").stderr.split())
    assert "Both sides of a seam must share their vertices" in said
    assert torn(before, read_mesh(bent)) > 3


def test_other_verbs_join_seams_too(textured):
    path, n_joined = textured
    for verb in ("segment", "features"):
        done = run(verb, path, "--json")
        assert "weld_seams joined" in done.stderr
        rows = json.loads(done.stdout)
        found = rows["parts" if verb == "segment" else "features"]
        assert all(row["vertex"] < n_joined for row in found)


def test_a_mesh_without_seams_is_not_said_to_have_none(giraffe):
    assert "repair" not in run("deform", giraffe, "--region", "y>70%", "--move", "0,0.1,0").stderr
