import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import edge_lengths, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import boundary_vertices
from eigenshape.operators.smoothing import denoise, noise_level
from eigenshape.scans.partial import cut_by_planes, rotation_towards
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere

BALL = icosphere(4)
HALF = cut_by_planes(BALL, [[0, 0, 1, 0.1]]).mesh


def noisy(mesh, share, seed=0):
    deviation = share * edge_lengths(mesh).mean()
    return TriangleMesh(
        mesh.vertices
        + deviation * np.random.default_rng(seed).standard_normal((mesh.n_vertices, 3)),
        mesh.faces,
    )


def off_sphere(mesh):
    """Return how far vertices inside lie off the unit sphere; those of a curve have fewer neighbors to agree with."""
    inside = np.delete(mesh.vertices, boundary_vertices(mesh), axis=0)
    return np.sqrt(np.mean((np.linalg.norm(inside, axis=1) - 1) ** 2))


def test_noise_grows_with_noise_and_is_none_on_a_plane():
    assert noise_level(grid(8, 8)) == 0
    levels = [noise_level(noisy(grid(40, 40), share)) for share in (0.05, 0.1, 0.25, 0.5)]
    assert levels == sorted(levels)
    # Off a plane with six neighbors a vertex stands by share · sqrt(7/6), and the median of that is .6745 as much.
    assert levels[0] == pytest.approx(0.05 * 0.6745 * np.sqrt(7 / 6), rel=0.1)
    only_boundary = TriangleMesh(np.eye(3), [[0, 1, 2]])
    assert noise_level(only_boundary) == 0


@pytest.mark.parametrize("mesh", [BALL, HALF])
@pytest.mark.parametrize("share", [0.25, 0.5])
def test_denoising_brings_a_noisy_sphere_nearer_to_one(mesh, share):
    rough = noisy(mesh, share)
    assert off_sphere(denoise(rough)) < 0.6 * off_sphere(rough)
    assert abs(surface_area(denoise(rough)) - surface_area(mesh)) < 0.5 * abs(
        surface_area(rough) - surface_area(mesh)
    )


def test_twicing_keeps_the_size_of_what_is_smooth():
    found = denoise(BALL, reach=1.0)
    radii = np.linalg.norm(found.vertices, axis=1)
    # One implicit step takes the share 2 h² / (1 + 2 h²) of the radius of a unit sphere, twicing leaves its square.
    lost = 2 * edge_lengths(BALL).mean() ** 2
    assert 1 - radii.mean() == pytest.approx((lost / (1 + lost)) ** 2, rel=0.15)


def test_a_plane_stays_in_its_plane_and_a_straight_boundary_straight():
    flat = noisy(grid(12, 12), 0.25)
    flat = TriangleMesh(flat.vertices * [1, 1, 0], flat.faces)
    np.testing.assert_allclose(denoise(flat, reach=2.0).vertices[:, 2], 0, atol=1e-15)
    straight = denoise(grid(12, 12), reach=1.0)
    middle = np.isclose(grid(12, 12).vertices[:, 0], 0) & (
        np.abs(grid(12, 12).vertices[:, 1] - 0.5) < 0.2
    )
    np.testing.assert_allclose(straight.vertices[middle, 0], 0, atol=2e-3)


def test_what_has_no_noise_stays_as_it_is():
    flat = grid(5, 5)
    assert denoise(flat) is flat


def test_the_boundary_goes_its_own_way():
    rough, rim = noisy(HALF, 0.25), boundary_vertices(HALF)
    dented = rough.vertices.copy()
    inside = np.setdiff1d(np.arange(HALF.n_vertices), rim)
    dented[inside] *= 1.05
    one, other = denoise(rough, reach=1.0), denoise(TriangleMesh(dented, HALF.faces), reach=1.0)
    bound = 0.12 * edge_lengths(HALF).mean()  # reach counts in mean edges, which the dent lengthens
    assert np.abs(one.vertices[rim] - other.vertices[rim]).max() < bound
    level = HALF.vertices[rim, 2].mean()
    assert one.vertices[rim, 2].mean() == pytest.approx(level, abs=0.3 * edge_lengths(HALF).mean())


def test_the_boundary_gets_smooth_too():
    rim = boundary_vertices(HALF)
    rough = noisy(HALF, 0.25)
    before, after = (mesh.vertices[rim] - HALF.vertices[rim] for mesh in (rough, denoise(rough)))
    assert np.sqrt((after**2).mean()) < 0.85 * np.sqrt((before**2).mean())


@pytest.mark.long
def test_rigid_motion_and_order_of_vertices():
    rough = noisy(make_creature("quadruped", n_vertices=1200), 0.25)
    turn, shift = rotation_towards(np.array([0.6, 0.0, 0.8])), np.array([3.0, -2.0, 1.0])
    found = denoise(rough).vertices
    moved = denoise(TriangleMesh(rough.vertices @ turn.T + shift, rough.faces)).vertices
    np.testing.assert_allclose(moved, found @ turn.T + shift, atol=1e-10)
    order = np.random.default_rng(1).permutation(rough.n_vertices)
    shuffled = TriangleMesh(rough.vertices[order], np.argsort(order)[rough.faces])
    np.testing.assert_allclose(denoise(shuffled).vertices, found[order], atol=1e-10)


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_units_do_not_matter(scale):
    rough = noisy(HALF, 0.25)
    far = TriangleMesh(rough.vertices * scale, rough.faces)
    assert noise_level(far) == pytest.approx(noise_level(rough), rel=1e-12)
    np.testing.assert_allclose(
        denoise(far).vertices / scale, denoise(rough).vertices, rtol=1e-9, atol=1e-12
    )


def test_bad_reach_and_faces_without_area_are_refused():
    with pytest.raises(
        InvalidParameterError, match=r"reach must be positive and finite; entry 0 is 0.0"
    ):
        denoise(BALL, reach=0.0)
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0.5]], [[0, 1, 2], [0, 1, 3]])
    with pytest.raises(InvalidShapeError, match=r"face 0"):
        denoise(flat, reach=1.0)


def test_equations_that_cannot_be_solved_are_named(monkeypatch):
    monkeypatch.setattr("eigenshape.operators.smoothing.SymmetricFactor.of", lambda *_: None)
    with pytest.raises(
        InvalidShapeError, match=r"must have angles well above 0 for .*; some have angles so close"
    ):
        denoise(make_creature("hand", n_vertices=600), reach=1.0)
