"""Every remedy that a message names is applied to the file, and ends in an answer."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from broken_meshes import (
    flipped,
    moebius,
    soup,
    with_duplicates,
    with_flat_simplices,
    with_loose_points,
)
from typer.testing import CliRunner

from eigenshape.cli import app
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_names import MESH_REPAIRS
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import write_mesh
from eigenshape.io.shape_files import read_shape, write_points
from eigenshape.io.surface_files import read_surface
from eigenshape.operators.catalog import OPERATORS
from eigenshape.shapes.surfaces import icosphere

MOST_REMEDIES = 3
LARGEST = 300_000  # bytes of a file; larger ones are slow, and other tests read them
NAMES = "|".join(MESH_REPAIRS)
REMEDIES = {
    "--repair": rf"--repair ((?:{NAMES})(?:,(?:{NAMES}))*)",
    "--operator": rf"--operator ({'|'.join(OPERATORS)})",
    "--scale": "--scale (unknown)",
}
# What cannot be answered, and why.
UNANSWERABLE = {
    "empty": r"must hold a mesh; it is empty|must have points; it has none|must hold triangles; it holds none",
    "cut off": r"must hold the (triangles|rows) (it|they) declares?",
    "against its format": r"must have three corners|must declare an element",
    "a few points": r"holds (no|\d) points and no face|must have at least \d+ points|must have over \d+ points",
    "curves have no parts": r"it holds \d+ segments",
    "no face has an area": r"no face would remain|Try a cloud",
}


def is_unanswerable(message):
    return any(re.search(pattern, message) for pattern in UNANSWERABLE.values())


def named_remedies(verb, message):
    """Return the options that a message names, without those that the verb does not have."""
    found = {option: re.search(pattern, message) for option, pattern in REMEDIES.items()}
    if verb != "spectrum":
        found["--operator"] = None
    return {option: match[1] for option, match in found.items() if match}


def answer(verb, path, *options):
    """Apply the remedies of each refusal; return the last message, or None for an answer, and what was applied."""
    applied = {}
    for _ in range(MOST_REMEDIES + 1):
        words = [word for pair in applied.items() for word in pair if word]
        done = CliRunner().invoke(app, [verb, str(path), *options, *words, "--json"])
        if done.exit_code == 0:
            return None, applied
        assert isinstance(done.exception, SystemExit), f"{path.name}: {done.exception!r}"
        message = done.stderr.rsplit("error:", 1)[-1]
        remedies = named_remedies(verb, message)
        new = {option: value for option, value in remedies.items() if applied.get(option) != value}
        if not new:
            break
        option, value = next(iter(new.items()))
        before = applied.get(option)
        applied[option] = ",".join([before, value]) if before and option == "--repair" else value
    return message, applied


def beside_a_speck(share):
    ball = icosphere(3)
    speck = TriangleMesh(share * ball.vertices + 3, ball.faces)
    return disjoint_union(ball, speck)


def with_fine_spot(ratio, depth):
    """Put a smaller triangle into the first face, so many times."""
    mesh = icosphere(3)
    vertices, faces = [*mesh.vertices], [tuple(face) for face in mesh.faces]
    for _ in range(depth):
        a, b, c = faces[0]
        corners = np.array([vertices[i] for i in faces[0]])
        i = len(vertices)
        vertices += [*(corners.mean(axis=0) + ratio * (corners - corners.mean(axis=0)))]
        ring = [
            (a, b, i + 1),
            (a, i + 1, i),
            (b, c, i + 2),
            (b, i + 2, i + 1),
            (c, a, i),
            (c, i, i + 2),
        ]
        faces = [(i, i + 1, i + 2), *faces[1:], *ring]
    return TriangleMesh(vertices, faces)


def broken():
    rng = np.random.default_rng(0)
    whole = icosphere(3)
    yield "soup", soup(whole)
    yield "flipped", flipped(whole, rng)
    yield "ugly", with_loose_points(with_flat_simplices(with_duplicates(whole, rng), rng), rng, 9)
    yield "strip", moebius()
    yield "speck", beside_a_speck(1e-6)
    yield "fine spot", with_fine_spot(1e-3, 4)


@pytest.mark.parametrize("verb", ["spectrum", "features", "segment"])
@pytest.mark.parametrize(
    ("name", "mesh"), [*broken()], ids=lambda part: part if isinstance(part, str) else ""
)
def test_remedies_of_messages_end_in_an_answer(tmp_path, verb, name, mesh):
    path = tmp_path / "broken.ply"
    write_mesh(mesh, path)
    message, applied = answer(verb, path)
    assert message is None, (applied, message)
    if verb == "spectrum" and name in ("ugly", "speck", "fine spot"):
        assert applied, "this shape is refused as it is"


@pytest.mark.data
@pytest.mark.long
@pytest.mark.parametrize("verb", ["spectrum", "features"])
def test_real_files_are_answered_or_refused_for_a_known_reason(data, verb):
    options = ["-k", "20"] if verb == "spectrum" else []
    refused, count = [], 0
    for path in sorted(Path(data / "nasty").rglob("*")):
        if not path.is_file() or path.stat().st_size > LARGEST:
            continue
        count += 1
        message, applied = answer(verb, path, *options)
        if message is not None and not is_unanswerable(message):
            refused.append((path.name, applied, message))
    assert count > 80
    assert not refused


RAW = "trimesh/tube.obj", "geometrycentral/triple_vierbein.obj"
ONE_SIDED = "geometrycentral/moebius.obj"
VERBS = "match", "label", "pose", "pose --rest", "fuse"


@pytest.mark.data
@pytest.mark.long
@pytest.mark.parametrize(
    ("verb", "name", "given", "remedy"),
    [
        # These have too few points to be fused.
        *((verb, name, ["--repair", "none"], "auto") for verb in VERBS[:4] for name in RAW),
        *((verb, ONE_SIDED, [], "cut_one_sided") for verb in VERBS),
    ],
)
def test_remedies_of_maps_of_real_files_end_in_an_answer(data, tmp_path, verb, name, given, remedy):
    path, labels = data / "nasty" / name, tmp_path / "labels.txt"
    labels.write_text("1\n" * read_surface(path).mesh.n_faces)
    others = {
        "match": [path],
        "label": ["--like", path, "--labels", labels],
        "pose": ["--like", path],
        "pose --rest": ["--like", path, "--rest", path],
        "fuse": [path, "-o", tmp_path / "fused.ply"],
    }[verb]
    message, applied = answer(verb.split()[0], path, *map(str, others), *given)
    assert message is None, (applied, message)
    assert applied["--repair"].endswith(remedy)


@pytest.mark.data
@pytest.mark.long
def test_a_part_that_is_too_large_for_its_unit_finds_its_size(data, tmp_path):
    whole, part = data / "nasty" / "geometrycentral" / "fox.ply", tmp_path / "part.ply"
    mesh = read_surface(whole).mesh
    write_mesh(TriangleMesh(2 * mesh.vertices, mesh.faces), part)
    message, applied = answer("match", part, str(whole), "--scale", "known")
    assert message is None, message
    assert applied == {"--scale": "unknown"}


def test_a_scan_of_uneven_spacing_is_answered(tmp_path):
    # A corridor seen from its end: the spacing grows with the square of the distance.
    angles = np.linspace(0.05, 1.2, 40)
    across, turn = np.meshgrid(1 / np.tan(angles), np.linspace(0, 2 * np.pi, 40, endpoint=False))
    points = np.stack([across, np.cos(turn), np.sin(turn)], axis=-1).reshape(-1, 3)
    far = np.array([[60.0, 1, 0], [60.0, -1, 0], [60.0, 0, 1]])
    write_points(PointCloud(np.concatenate([points, far])), tmp_path / "corridor.pts")
    assert answer("spectrum", tmp_path / "corridor.pts") == (None, {})
    done = CliRunner().invoke(app, ["spectrum", str(tmp_path / "corridor.pts"), "--json"])
    assert "too uneven for a kernel of one width" in done.stderr
    assert json.loads(done.stdout)["operator"] == "robust"
    asked = answer("spectrum", tmp_path / "corridor.pts", "--operator", "point-cloud")
    assert asked == (None, {"--operator": "robust"})


@pytest.mark.long
@pytest.mark.data
@pytest.mark.parametrize("name", ["mice/WSB.ply", "nasty/pymesh/quad_s1.obj"])
def test_missing_vertices_and_planes_are_answered(data, name):
    for verb in ("spectrum", "features"):
        assert answer(verb, data / name)[0] is None


@pytest.mark.long
@pytest.mark.data
def test_a_cloud_that_becomes_no_surface_has_a_spectrum(data):
    path = data / "points" / "fragment_000.ply"
    message, _ = answer("features", path)
    assert "The points alone have a spectrum" in message
    assert "eigenshape spectrum" in message
    assert answer("spectrum", path, "-k", "5")[0] is None


def test_a_cavity_that_faces_out_is_turned_and_stays_empty(tmp_path):
    pytest.importorskip("netgen.meshing", reason="the extra tetrahedralize is missing")
    ball, path, output = icosphere(2), tmp_path / "hollow.off", str(tmp_path / "hollow.vtu")
    write_mesh(disjoint_union(ball, TriangleMesh(ball.vertices / 2, ball.faces)), path)
    message, applied = answer("tetrahedralize", path, "-o", output)
    assert (message, applied) == (None, {"--repair": "orient"})
    assert simplex_volumes(read_shape(output)).sum() == pytest.approx(7 / 8 * enclosed_volume(ball))


@pytest.mark.data
def test_the_hollow_ball_is_turned_by_what_info_proposes(data):
    path = str(data / "everyday" / "D_hollow_ball.off")
    names = json.loads(CliRunner().invoke(app, ["info", path, "--json"]).stdout)["repairs_to_try"]
    assert names == ["orient"]
    done = CliRunner().invoke(app, ["info", path, "--json", "--repair", ",".join(names)])
    assert json.loads(done.stdout)["enclosed_volume"] == pytest.approx(28.329, abs=1e-3)
    assert json.loads(done.stdout)["repairs_to_try"] == []


@pytest.mark.data
def test_a_seam_that_is_open_by_rounding_is_closed_by_what_info_proposes(data):
    path = str(data / "everyday" / "E_tube.obj")
    facts = json.loads(CliRunner().invoke(app, ["info", path, "--json"]).stdout)
    assert (facts["edges_on_seams"], facts["repairs_to_try"]) == (10, ["weld_seams"])
    options = ["spectrum", path, "-k", "3", "--json"]
    done = CliRunner().invoke(app, options)
    said = " ".join(done.stderr.split())
    assert "warning: Both sides of a seam must share their vertices" in said
    assert "(10 such)" in said
    assert "or --repair weld_seams on the command line" in said
    done = CliRunner().invoke(app, [*options, "--repair", "weld_seams"])
    assert "joined 11 vertices along seams, which were open by up to 2.4e-16" in done.stderr
    assert "warning:" not in done.stderr
    np.testing.assert_allclose(json.loads(done.stdout)["eigenvalues"][1:], 1, rtol=1e-6)


@pytest.mark.parametrize("suffix", [".glb", ".ply", ".obj"])
def test_a_soup_of_faces_finds_out_why_its_spectrum_is_too_large(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 2.0**25)
    path = tmp_path / f"flat{suffix}"
    write_mesh(soup(icosphere(3)), path)
    message, applied = answer("spectrum", path, "--below", "20")
    assert (message, applied) == (None, {"--repair": "auto,largest_component"})
