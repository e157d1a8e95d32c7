"""Shapes of a few points through every verb: no default may ask for more than there is."""

import pytest
from running import run, run_json

from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import write_mesh
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import grid

TINY = {
    "triangle": TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    "square": grid(1, 1),
    "tetrahedron": TriangleMesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    ),
    "cube": boundary_surface(box(1, 1, 1)),
}


@pytest.fixture(params=TINY)
def tiny(request, tmp_path):
    path = tmp_path / f"{request.param}.obj"
    write_mesh(TINY[request.param], path)
    return path


@pytest.mark.long
def test_all_pairs_are_computed_where_there_are_fewer_than_usual(tiny):
    n = TINY[tiny.stem].n_vertices
    done = run("spectrum", tiny)
    assert f"note: this shape has {n} eigenpairs, not 20; all are computed" in done.stderr
    assert len(run_json("spectrum", tiny, "--operator", "robust")["eigenvalues"]) == n
    assert len(run_json("spectrum", tiny, "--brackets")["eigenvalues"]) == n
    assert len(run_json("spectrum", tiny, "--accuracy", "1e-2")["eigenvalues"]) == n
    assert len(run_json("spectrum", tiny, "-k", 20)["eigenvalues"]) == n


def test_inner_points_alone_count_where_the_boundary_is_held(tmp_path):
    path = tmp_path / "grid.obj"
    write_mesh(grid(3, 3), path)
    done = run("spectrum", path, "--boundary", "dirichlet")
    assert "note: this shape has 4 eigenpairs, not 20; all are computed" in done.stderr


@pytest.mark.long
@pytest.mark.sweep
def test_other_verbs_take_a_tiny_shape(tiny, tmp_path):
    run("info", tiny)
    run("features", tiny)
    run("segment", tiny)
    run("segment", tiny, "--method", "scale-free")
    run("deform", tiny, "--region", "x>0.5", "--rotate", "x by 30", "-o", tmp_path / "bent.ply")
    # Half a minute goes into the usual number of samples, whatever the shape.
    samples = () if tiny.stem == "triangle" else ("--n-samples", 200)
    found = run_json("stability", tiny, tiny, *samples)
    assert len(found["spectra"]["one"]) == min(20, TINY[tiny.stem].n_vertices - 1)
    assert found["spectra"]["hausdorff"] == 0


@pytest.mark.long
@pytest.mark.parametrize("preset", ["scale-free", "patches"])
def test_tiny_shapes_are_indexed_and_found(preset, tmp_path):
    for name, mesh in TINY.items():
        write_mesh(mesh, tmp_path / f"{name}.obj")
    run("index", "add", tmp_path / "db", tmp_path, "--method", preset)
    for name in TINY:
        matches = run_json("query", tmp_path / "db", tmp_path / f"{name}.obj")["matches"]
        assert {match["name"] for match in matches} == {*TINY}
