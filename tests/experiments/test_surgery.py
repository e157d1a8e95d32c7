"""Surgery and coupled samples: closed surfaces of the right genus, and points uniform on both."""

import sys
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))
from surgery import attach, bridge, disc_of_faces, moved, widened
from topological import coupled_points


@pytest.fixture(scope="module")
def spheres():
    ball = es.icosphere(3)
    return es.geometry.disjoint_union(
        ball, es.TriangleMesh(ball.vertices + np.array([2.3, 0, 0]), ball.faces)
    )


def facing(mesh, radius, **options):
    x = mesh.vertices[:, 0]
    one = int(np.where(x <= 1, x, -9).argmax())
    return bridge(
        mesh,
        one,
        int(np.linalg.norm(mesh.vertices - [1.3, 0, 0], axis=1).argmin()),
        radius,
        **options,
    )


def test_a_disc_is_one_disc(spheres):
    disc = disc_of_faces(spheres, 0, 0.5)
    part = es.TriangleMesh(spheres.vertices, spheres.faces[disc])
    assert es.geometry.euler_characteristic(part) == 1
    assert len(es.geometry.boundary_loops(part)) == 1
    away = np.linalg.norm(spheres.vertices[spheres.faces[disc]] - spheres.vertices[0], axis=2)
    assert away.max() <= 0.5


def test_a_radius_without_a_face_is_refused(spheres):
    with pytest.raises(es.InvalidParameterError, match="vertex 0 has none"):
        disc_of_faces(spheres, 0, 0.01)


def test_what_is_no_disc_is_refused():
    ring = es.shapes.torus(40, 12, inner=0.2)
    with pytest.raises(es.InvalidParameterError, match="must form a disc"):
        disc_of_faces(ring, 0, 0.7)


@pytest.mark.parametrize("radius", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("bulge", [0.0, 0.3])
def test_a_bridge_joins_two_spheres_into_one(spheres, radius, bulge):
    joined = facing(spheres, radius, bulge=bulge)
    assert es.geometry.is_closed(joined.two)
    assert es.geometry.is_manifold(joined.two)
    assert es.geometry.euler_characteristic(joined.two) == 2
    assert es.geometry.vertex_components(joined.two)[0] == 1
    assert not len(es.geometry.self_intersections(joined.two))
    volume = es.geometry.enclosed_volume(joined.two)
    assert volume > es.geometry.enclosed_volume(
        spheres
    )  # which neighbors turned against each other would not give


def test_a_bridge_on_one_surface_is_a_handle():
    plates = es.shapes.torus(60, 40, inner=0.35)
    top, bottom = (
        int(np.linalg.norm(plates.vertices - [side, 0, 0], axis=1).argmin())
        for side in (0.65, -0.65)
    )
    joined = bridge(plates, top, bottom, 0.15)
    assert es.geometry.is_closed(joined.two)
    assert es.geometry.is_manifold(joined.two)
    assert es.geometry.euler_characteristic(joined.two) == -2
    assert not len(es.geometry.self_intersections(joined.two))


def test_ends_that_share_a_vertex_are_refused(spheres):
    near = int(spheres.faces[spheres.faces[:, 0] == 0][0, 1])
    with pytest.raises(es.InvalidParameterError, match="must lie apart"):
        bridge(spheres, 0, near, 0.4)


def test_faces_outside_correspond(spheres):
    for surgery in (facing(spheres, 0.3), widened(facing(spheres, 0.3), 0.2)):
        one, two = (
            mesh.vertices[mesh.faces[regions < 0]]
            for mesh, regions in (
                (surgery.one, surgery.regions_one),
                (surgery.two, surgery.regions_two),
            )
        )
        np.testing.assert_array_equal(one, two)
        pair = es.stability.measure_perturbation(
            surgery.one,
            surgery.two,
            regions_one=surgery.regions_one,
            regions_two=surgery.regions_two,
        )
        assert es.stability.measure_closeness(pair).displacement.max() == 0


def test_what_is_attached_belongs_to_the_region():
    ball = es.icosphere(3)
    small = es.TriangleMesh(0.5 * ball.vertices + [1.7, 0, 0], ball.faces)
    ends = int(ball.vertices[:, 0].argmax()), int(ball.vertices[:, 0].argmin())
    found = attach(ball, small, *ends, 0.25)
    assert found.one is ball
    assert es.geometry.euler_characteristic(found.two) == 2
    areas = es.geometry.face_areas(found.two)[found.regions_two == 0].sum()
    assert areas > 0.9 * es.geometry.surface_area(small)


def test_regions_of_moved_vertices_are_pieces():
    ball = es.icosphere(2)
    vertices = ball.vertices.copy()
    ends = int(vertices[:, 0].argmax()), int(vertices[:, 0].argmin())
    vertices[list(ends)] *= 1.1
    found = moved(ball, vertices)
    for number in (0, 1):
        corners = [set(face) for face in ball.faces[found.regions_one == number].tolist()]
        assert len(set.intersection(*corners) & set(ends)) == 1


def test_coupled_points_are_uniform_on_both_surfaces(spheres):
    surgery, n = facing(spheres, 0.5), 40_000
    one, two = coupled_points(surgery, n, np.random.default_rng(1))
    same = (one == two).all(axis=1)
    share_one, share_two = (
        es.geometry.face_areas(mesh)[regions < 0].sum() / es.geometry.surface_area(mesh)
        for mesh, regions in (
            (surgery.one, surgery.regions_one),
            (surgery.two, surgery.regions_two),
        )
    )
    assert same.mean() == pytest.approx(min(share_one, share_two), abs=4 * 0.5 / n**0.5)
    for points, mesh in ((one, surgery.one), (two, surgery.two)):
        corners = mesh.vertices[mesh.faces]
        areas = es.geometry.face_areas(mesh)
        mean = areas @ corners.mean(axis=1) / areas.sum()
        error = points.std(axis=0) / n**0.5
        assert (np.abs(points.mean(axis=0) - mean) < 4 * error).all()
        middle = np.abs(points[:, 0] - 1.15) < 0.15
        near = np.abs(corners.mean(axis=1)[:, 0] - 1.15) < 0.15
        assert middle.mean() == pytest.approx(areas[near].sum() / areas.sum(), abs=0.01)
