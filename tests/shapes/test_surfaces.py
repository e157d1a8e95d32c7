import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.measure import enclosed_volume, face_normals, surface_area
from eigenshape.geometry.resolution.subdivision import subdivide
from eigenshape.geometry.topology import boundary_loops, disjoint_union, is_closed, is_manifold
from eigenshape.shapes.surfaces import grid, icosphere, torus


@pytest.mark.parametrize("level", [0, 1, 3])
def test_icosphere(level):
    mesh = icosphere(level)
    assert mesh.n_vertices == 10 * 4**level + 2
    assert mesh.n_faces == 20 * 4**level
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1, rtol=1e-15)
    assert is_closed(mesh)
    assert inconsistent_edges(mesh).size == 0
    assert enclosed_volume(mesh) > 0


def test_an_icosphere_comes_near_the_sphere():
    assert surface_area(icosphere(4)) == pytest.approx(4 * np.pi, rel=3e-3)
    assert enclosed_volume(icosphere(4)) == pytest.approx(4 * np.pi / 3, rel=5e-3)


def test_torus():
    mesh = torus(60, 40, outer=2.0, inner=0.5)
    assert (mesh.n_vertices, mesh.n_faces) == (2400, 4800)
    rim = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]) - 2
    np.testing.assert_allclose(np.hypot(rim, mesh.vertices[:, 2]), 0.5, rtol=1e-13)
    assert is_closed(mesh)
    assert is_manifold(mesh)
    assert inconsistent_edges(mesh).size == 0
    assert enclosed_volume(mesh) == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=0.01)  # outward


def test_grid():
    mesh = grid(3, 2, width=6.0, height=1.0)
    assert (mesh.n_vertices, mesh.n_faces) == (12, 12)
    assert surface_area(mesh) == pytest.approx(6, rel=1e-14)
    np.testing.assert_array_equal(face_normals(mesh), np.tile([0.0, 0, 1], (12, 1)))
    assert [len(loop) for loop in boundary_loops(mesh)] == [10]


def test_subdividing_keeps_the_surface():
    mesh = grid(2, 1)
    finer = subdivide(mesh)
    assert finer.n_faces == 4 * mesh.n_faces
    assert surface_area(finer) == pytest.approx(1, rel=1e-15)
    np.testing.assert_array_equal(finer.vertices[: mesh.n_vertices], mesh.vertices)
    np.testing.assert_array_equal(face_normals(finer), np.tile([0.0, 0, 1], (finer.n_faces, 1)))


def test_a_union_keeps_every_coordinate():
    union = disjoint_union(grid(1, 1), icosphere(0))
    assert (union.n_vertices, union.n_faces) == (16, 22)
    np.testing.assert_array_equal(union.vertices[4:], icosphere(0).vertices)
    np.testing.assert_array_equal(union.faces[2:] - 4, icosphere(0).faces)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: icosphere(-1), r"level must lie in 0\.\.9; it is -1"),
        (lambda: icosphere(10), r"level must lie in 0\.\.9; it is 10"),
        (lambda: torus(2, 9), r"n_around must lie in 3\.\.1000000; it is 2"),
        (lambda: torus(9, 2), r"n_across must lie in 3\.\.1000000; it is 2"),
        (lambda: grid(0, 1), r"n_x must lie in 1\.\.1000000; it is 0"),
        (lambda: grid(1, 0), r"n_y must lie in 1\.\.1000000; it is 0"),
        (
            lambda: grid(1, 1, height=0.0),
            r"width and height must be positive and finite; entry 1 is 0\.0",
        ),
        (
            lambda: torus(5, 5, outer=-1.0),
            r"outer and inner must be positive and finite; entry 0 is -1\.0",
        ),
        (
            lambda: torus(5, 5, inner=np.nan),
            r"outer and inner must be positive and finite; entry 1 is nan",
        ),
        (disjoint_union, "disjoint_union must be given at least one mesh; it was given none"),
    ],
)
def test_sizes_out_of_range_are_refused(make, match):
    with pytest.raises(InvalidParameterError, match=match):
        make()
