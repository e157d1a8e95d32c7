import numpy as np
import pytest

from eigenshape.geometry.creatures import CREATURES, make_creature
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.sampling import cut_by_planes, partial_scan, random_planes, rotation_towards, viewpoint
from eigenshape.geometry.surfaces import grid, icosphere, torus


def turned_over(mesh):
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def require_out(mesh):
    assert orient_outward(mesh) is mesh
    np.testing.assert_array_equal(orient_outward(turned_over(mesh)).faces, mesh.faces)


@pytest.mark.parametrize("mesh", [icosphere(2), torus()])
def test_closed_surfaces_face_out(mesh):
    require_out(mesh)


@pytest.mark.parametrize("kind", CREATURES)
def test_parts_and_scans_of_creatures_face_out(kind):
    whole = make_creature(kind, n_vertices=1500)
    require_out(whole)
    for number in range(6):
        require_out(partial_scan(whole, viewpoint(number)).mesh)
        rng = np.random.default_rng(number)
        require_out(cut_by_planes(whole, random_planes(whole, rng, n_planes=2, share=0.2)).mesh)


def test_a_cap_that_is_mostly_open_faces_out_where_its_signed_volume_says_nothing():
    require_out(cut_by_planes(icosphere(4), [[0, 0, -1, -0.8]]).mesh)


def test_neither_rotation_nor_unit_matters():
    scan = partial_scan(make_creature("quadruped", n_vertices=1500), viewpoint(1)).mesh
    turn = rotation_towards(np.array([0.36, 0.48, 0.8]))
    require_out(TriangleMesh(scan.vertices @ turn.T + [5.0, 6.0, -7.0], scan.faces))
    for scale in (1e-100, 1e100):
        require_out(TriangleMesh(scan.vertices * scale, scan.faces))


def test_what_is_flat_has_no_outside():
    flat = grid(3, 3)
    assert orient_outward(flat) is flat
    assert orient_outward(turned_over(flat)).faces.tolist() == turned_over(flat).faces.tolist()
