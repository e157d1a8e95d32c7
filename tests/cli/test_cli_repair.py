"""`eigenshape repair`; and what verbs keep of the files that they read: polygons, textures, labels."""

import json
import re

import meshio
import numpy as np
import pytest
from running import run

from eigenshape import (
    FileFormatError,
    PointCloud,
    TriangleMesh,
    deform,
    read_mesh,
    read_shape,
    repair,
    rig_shape,
    write_mesh,
)
from eigenshape.deformation.handles import Translation
from eigenshape.geometry.repairs.repair import REPAIRS
from eigenshape.geometry.resolution.tetrahedralization import tetrahedralize
from eigenshape.geometry.topology import is_closed
from eigenshape.io.field_files import write_fields
from eigenshape.io.folders import find_items
from eigenshape.io.label_files import read_labels
from eigenshape.io.shape_files import write_points
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.spheres import icosphere

BALL = icosphere(2)
SOUP = TriangleMesh(
    BALL.vertices[BALL.faces].reshape(-1, 3), np.arange(3 * BALL.n_faces).reshape(-1, 3)
)


@pytest.mark.parametrize("suffix", [".ply", ".off", ".obj", ".stl", ".glb"])
def test_a_soup_is_welded_and_written_in_every_format(tmp_path, suffix):
    write_mesh(SOUP, tmp_path / "soup.ply")
    done = run(
        "repair", tmp_path / "soup.ply", "--repair", "weld", "-o", tmp_path / f"ball{suffix}"
    )
    assert "repair: weld joined 798 vertices to others at the same place" in done.stderr
    assert "wrote " in done.stderr
    assert "480" not in done.stderr
    assert "components" in done.stdout
    found, wanted = read_mesh(tmp_path / f"ball{suffix}"), repair(SOUP, ["weld"]).mesh
    assert (found.n_vertices, found.n_faces) == (162, 320)
    np.testing.assert_allclose(found.vertices, wanted.vertices, atol=1e-7)
    np.testing.assert_array_equal(found.faces, wanted.faces)


def test_json_holds_the_report_and_the_facts_before_and_after(tmp_path):
    write_mesh(SOUP, tmp_path / "soup.ply")
    arguments = (
        "repair",
        tmp_path / "soup.ply",
        "--repair",
        "weld,drop_unreferenced",
        "-o",
        tmp_path / "a.ply",
        "--json",
    )
    found = json.loads(run(*arguments).stdout)
    assert found["report"] == [
        "weld joined 798 vertices to others at the same place",
        "drop_unreferenced removed 0 vertices without a face",
    ]
    assert (found["before"]["vertices"], found["after"]["vertices"]) == (960, 162)
    assert (found["before"]["closed"], found["after"]["closed"]) == (False, True)
    assert found["output"] == str(tmp_path / "a.ply")


@pytest.mark.skipif("auto" not in REPAIRS, reason="the repair auto comes with another change")
def test_by_default_it_does_what_is_needed(tmp_path):
    write_mesh(SOUP, tmp_path / "soup.ply")
    run("repair", tmp_path / "soup.ply", "-o", tmp_path / "ball.ply")
    assert read_mesh(tmp_path / "ball.ply").n_vertices == 162


def test_without_repairs_it_converts(tmp_path):
    write_mesh(BALL, tmp_path / "a.ply")
    done = run("repair", tmp_path / "a.ply", "--repair", "", "-o", tmp_path / "a.off")
    assert "repair:" not in done.stderr
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.off").vertices, BALL.vertices)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--repair", "polish", "-o", "{folder}/b.ply"),
            "Names of --repair must be among auto, drop_missing, weld",
        ),
        (
            ("--repair", "weld", "-o", "{folder}/b.dxf"),
            "A mesh must be written to a file that ends in .off, .obj, .ply, .stl, .glb, .vtu, .vtp, .vtk, .npz, "
            ".gii, .surf; ",
        ),
        (
            ("--repair", "weld", "-o", "{folder}/no/b.ply"),
            "A mesh must be written to a folder that exists; ",
        ),
    ],
)
def test_what_is_wrong_is_named_and_nothing_written(tmp_path, options, message):
    write_mesh(BALL, tmp_path / "a.ply")
    done = run(
        "repair", tmp_path / "a.ply", *(word.format(folder=tmp_path) for word in options), code=2
    )
    assert message in " ".join(done.stderr.split())
    assert [path.name for path in tmp_path.iterdir()] == ["a.ply"]


def test_a_mesh_that_is_no_mesh_is_named(tmp_path):
    (tmp_path / "a.ply").write_text("ply\n")
    assert (
        "must end with end_header"
        in run("repair", tmp_path / "a.ply", "--repair", "weld", "-o", "b.ply", code=1).stderr
    )
    assert "Missing option" in " ".join(run("repair", tmp_path / "a.ply", code=2).output.split())


def write_quads(path):
    """Write a closed tube of quads with texture coordinates, and a loose vertex."""
    turns, rings = 12, 10
    angle = 2 * np.pi * np.arange(turns) / turns
    points = [(float(np.cos(a)), float(np.sin(a)), 0.6 * z) for z in range(rings) for a in angle]
    quads = [
        [
            z * turns + i,
            z * turns + (i + 1) % turns,
            (z + 1) * turns + (i + 1) % turns,
            (z + 1) * turns + i,
        ]
        for z in range(rings - 1)
        for i in range(turns)
    ]
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in (*points, (9.0, 9.0, 9.0))]
    rows += [f"vt {i / turns} {z / rings}" for z in range(rings) for i in range(turns)]
    rows += ["usemtl skin", *("f " + " ".join(f"{c + 1}/{c + 1}" for c in quad) for quad in quads)]
    path.write_text("\n".join(rows) + "\n")


def test_quads_and_textures_stay_on_the_way_through_repair_and_deform(tmp_path):
    write_quads(tmp_path / "tube.obj")
    faces = [
        line for line in (tmp_path / "tube.obj").read_text().splitlines() if line.startswith("f ")
    ]
    run(
        "repair",
        tmp_path / "tube.obj",
        "--repair",
        "drop_unreferenced",
        "-o",
        tmp_path / "clean.obj",
    )
    clean = (tmp_path / "clean.obj").read_text().splitlines()
    assert [line for line in clean if line.startswith("f ")] == faces
    assert sum(line.startswith("v ") for line in clean) == 120
    assert sum(line.startswith("vt ") for line in clean) == 120
    assert "usemtl skin" in clean
    arguments = (
        "--region",
        "z>80%",
        "--move",
        "0.5,0,0",
        "--fixed",
        "z<20%",
        "--repair",
        "drop_unreferenced",
    )
    run("deform", tmp_path / "tube.obj", *arguments, "-o", tmp_path / "bent.obj")
    bent = (tmp_path / "bent.obj").read_text().splitlines()
    assert [line for line in bent if line.startswith("f ")] == faces
    mesh = read_mesh(tmp_path / "clean.obj")
    z = mesh.vertices[:, 2]
    low, high = z.min(), z.max()
    region, fixed = z > low + 0.8 * (high - low), z < low + 0.2 * (high - low)
    expected = deform(rig_shape(mesh), region, Translation([0.5, 0, 0]), fixed=fixed)
    np.testing.assert_allclose(
        read_mesh(tmp_path / "bent.obj").vertices, expected.vertices, atol=1e-9
    )
    run("deform", tmp_path / "tube.obj", *arguments, "-o", tmp_path / "bent.stl")
    assert read_mesh(tmp_path / "bent.stl").n_faces == expected.n_faces


@pytest.mark.long
def test_labels_are_a_property_of_faces_that_label_reads(tmp_path):
    shape = make_creature("giraffe", 0, n_vertices=600)
    write_mesh(shape, tmp_path / "a.ply")
    done = run("segment", tmp_path / "a.ply", "-o", tmp_path / "parts.ply", "--json")
    labels = json.loads(done.stdout)["face_labels"]
    assert read_labels(tmp_path / "parts.ply").tolist() == labels
    arguments = (
        "label",
        tmp_path / "a.ply",
        "--like",
        tmp_path / "a.ply",
        "--labels",
        tmp_path / "parts.ply",
    )
    for name in ("again.ply", "again.seg"):
        run(*arguments, "-o", tmp_path / name)
    again = read_labels(tmp_path / "again.ply")
    assert again.tolist() == read_labels(tmp_path / "again.seg").tolist()
    assert np.mean(again == labels) > 0.95
    assert again.dtype == np.int64


@pytest.mark.parametrize("suffix", [".msh", ".mesh", ".vtk", ".vtu"])
def test_triangles_of_other_formats_serve_verbs_for_meshes(tmp_path, suffix):
    kinds = {".msh": "gmsh", ".mesh": "medit"}
    path = tmp_path / f"ball{suffix}"
    meshio.write_points_cells(
        path, BALL.vertices, [("triangle", BALL.faces)], file_format=kinds.get(suffix)
    )
    done = run("features", path, "--json", "-n", 3)
    assert len(json.loads(done.stdout)["face_labels"]) == BALL.n_faces
    run("repair", path, "--repair", "", "-o", tmp_path / "again.ply")
    np.testing.assert_array_equal(read_mesh(tmp_path / "again.ply").faces, BALL.faces)
    assert {item.path.name for item in find_items([tmp_path])} == {path.name, "again.ply"}


def test_cells_say_what_polygons_of_four_corners_are(tmp_path):
    polygon = "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\nPOLYGONS 1 5\n4 0 1 2 3\n"
    (tmp_path / "a.vtk").write_text(
        f"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\n{polygon}"
    )
    done = run("info", tmp_path / "a.vtk", code=1)
    assert "--cells in the commands info, spectrum and repair" in " ".join(done.stderr.split())
    assert (
        json.loads(run("info", tmp_path / "a.vtk", "--cells", "tetrahedra", "--json").stdout)[
            "simplices"
        ]
        == 1
    )
    assert (
        json.loads(run("info", tmp_path / "a.vtk", "--cells", "quads", "--json").stdout)["faces"]
        == 2
    )
    run("repair", tmp_path / "a.vtk", "--cells", "quads", "--repair", "", "-o", tmp_path / "a.ply")
    assert read_mesh(tmp_path / "a.ply").n_faces == 2
    done = json.loads(
        run("spectrum", tmp_path / "a.vtk", "--cells", "tetrahedra", "-k", 3, "--json").stdout
    )
    assert len(done["eigenvalues"]) == 3


def test_a_texture_goes_through_every_verb_and_losses_are_printed(tmp_path):
    """From OBJ to GLB by a bend, and on to OBJ in another folder by a repair."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in BALL.vertices.tolist()]
    lines += [f"vt {x!r} {y!r}" for x, y, _ in BALL.vertices.tolist()]
    lines += ["mtllib a.mtl", "usemtl wool"]
    lines += [
        "f " + " ".join(f"{corner}/{corner}" for corner in row) for row in (BALL.faces + 1).tolist()
    ]
    (tmp_path / "a.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "a.mtl").write_text("newmtl wool\nKd 1 0.5 0.25\nmap_Kd wool.png\n")
    (tmp_path / "wool.png").write_bytes(b"an image")
    (tmp_path / "far").mkdir()
    glb, obj = tmp_path / "b.glb", tmp_path / "far" / "c.obj"
    bend = ("--region", "y>70%", "--move", "0,0.1,0")
    assert "lost" not in run("deform", tmp_path / "a.obj", *bend, "-o", glb).stderr
    assert "lost" not in run("repair", glb, "-o", obj).stderr
    mesh, found = read_mesh(obj, attributes=True)
    (wool,) = found.materials
    assert (wool.name, wool.image) == ("wool", b"an image")
    np.testing.assert_allclose(wool.color, (1, 0.5, 0.25, 1), atol=1e-6)
    # Texture coordinates are those of the places before the bend, which moved the rest up alone.
    np.testing.assert_allclose(
        found.texture_coordinates[..., 0], mesh.vertices[mesh.faces][..., 0], atol=0.1
    )
    printed = " ".join(run("repair", glb, "-o", tmp_path / "d.stl").stderr.split())
    assert "lost: d.stl does not keep: texture coordinates, materials, images." in printed
    run("segment", glb, "-n", "2", "-o", tmp_path / "parts.glb")
    names = {
        material.name
        for material in read_mesh(tmp_path / "parts.glb", attributes=True)[1].materials
    }
    assert all(name.startswith("part_") for name in names)


def test_broken_materials_do_not_stop_a_repair(tmp_path):
    write_mesh(BALL, tmp_path / "a.obj")
    text = (tmp_path / "a.obj").read_text()
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + text)
    (tmp_path / "a.mtl").write_text("newmtl odd\nKd spectral file.rfl\n")
    printed = run("repair", tmp_path / "a.obj", "-o", tmp_path / "b.glb").stderr
    assert "Materials and other attributes must be whole" in " ".join(printed.split())
    assert read_mesh(tmp_path / "b.glb").n_faces == BALL.n_faces


CUBE = """MeshVersionFormatted 2
Dimension 3
Vertices
8
0 0 0 0  1 0 0 0  1 1 0 0  0 1 0 0  0 0 1 0  1 0 1 0  1 1 1 0  0 1 1 0
Hexahedra
1
1 2 3 4 5 6 7 8 0
End
"""


def test_solids_are_split_and_written(tmp_path):
    (tmp_path / "hex.mesh").write_text(CUBE)
    done = run("repair", tmp_path / "hex.mesh", "-o", tmp_path / "tets.vtu")
    assert "hex.mesh: 1 hexahedra were split into 6 tetrahedra" in done.stderr
    assert "simplices" in done.stdout
    assert read_shape(tmp_path / "tets.vtu").simplices.shape == (6, 4)
    with pytest.warns(UserWarning, match="1 hexahedra were split into 6 tetrahedra"):
        read_shape(tmp_path / "hex.mesh")
    refused = run("repair", tmp_path / "hex.mesh", "-o", tmp_path / "tets.ply", code=2).stderr
    assert "A mesh of tetrahedra or segments must be written to a file that ends in .vtu" in refused


def test_a_mesh_in_the_plane_is_written_at_zero(tmp_path):
    (tmp_path / "flat.obj").write_text("v 0 0\nv 1 0\nv 1 1\nv 0 1\nf 1 2 3 4\n")
    assert "a mesh in the plane was taken at z = 0" in run("segment", tmp_path / "flat.obj").stderr
    with pytest.raises(FileFormatError, match=r"es\.io\.read_surface, or eigenshape repair"):
        read_mesh(tmp_path / "flat.obj")
    done = run("repair", tmp_path / "flat.obj", "-o", tmp_path / "flat.ply")
    assert "repair: a mesh in the plane was taken at z = 0" in done.stderr
    np.testing.assert_array_equal(read_mesh(tmp_path / "flat.ply").vertices[2], [1, 1, 0])
    run("segment", tmp_path / "flat.ply")


def test_points_become_a_surface_that_is_written(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\n")
    refused = run("repair", tmp_path / "a.obj", "-o", tmp_path / "a.ply", code=1).stderr
    assert "a.obj: A cloud must have at least 100 points in R^3 to become a surface" in refused
    write_points(PointCloud(icosphere(3).vertices), tmp_path / "ball.xyz")
    done = run("repair", tmp_path / "ball.xyz", "-o", tmp_path / "ball.ply")
    assert "reconstruct_surface made" in done.stderr
    assert is_closed(read_mesh(tmp_path / "ball.ply"))


def test_what_points_have_besides_is_said_not_to_be_kept(tmp_path):
    cloud = tmp_path / "cloud.ply"
    write_points(PointCloud(icosphere(3).vertices), cloud)
    done = run("repair", cloud, "-o", tmp_path / "ball.ply", "--json")
    assert "lost" not in done.stderr
    assert "made of points or cells of cloud.ply; their colors and values, if" in done.stderr
    facts = json.loads(done.stdout)
    assert (facts["before"]["points"], facts["after"]["vertices"]) == (642, 2000)
    table = run("repair", cloud, "-o", tmp_path / "ball.ply").stdout
    assert re.search(r"points +│ +642 │ - ", table)
    assert re.search(r"closed +│ +- │ yes ", table)
    named = ("--repair", "drop_duplicate_points")  # as info advises
    assert "reconstruct" in run("repair", cloud, *named, "-o", tmp_path / "ball.ply").stderr
    ball = icosphere(1)
    solid = tetrahedralize(ball)
    write_fields(solid, tmp_path / "solid.vtu", {"height": solid.points[:, 2]})
    thin = run("decimate", tmp_path / "solid.vtu", "--ratio", "0.8", "-o", tmp_path / "thin.vtu")
    assert "note: the surface was made of points or cells of solid.vtu" in thin.stderr
