from dataclasses import replace

import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import face_normals, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import boundary_loops, disjoint_union, vertex_components
from eigenshape.scans.depth_camera import DepthCamera, simulate_scan
from eigenshape.shapes.surfaces import grid, icosphere

BALL = icosphere(4)
PERFECT = DepthCamera(noise=0.0, dropout_angle=84.9, dropout=0.0, n_holes=0)
AHEAD = [0.0, 0.0, 1.0]


def scanned(mesh, camera, *, view=AHEAD, seed=0):
    return simulate_scan(mesh, np.random.default_rng(seed), view=view, camera=camera)


def focal(camera):
    return (camera.resolution / 2 - 1) * np.sqrt(4 * camera.distance**2 - 1)


def test_a_perfect_camera_sees_points_of_the_surface():
    found = scanned(BALL, PERFECT)
    corners = BALL.vertices[BALL.faces[found.source_faces]]
    normals = face_normals(BALL)[found.source_faces]
    off = np.einsum("ni,ni->n", found.mesh.vertices - corners[:, 0], normals)
    assert np.abs(off).max() < 1e-12
    assert len(boundary_loops(found.mesh)) == 1


def test_perspective_shows_less_than_half_a_sphere():
    camera = replace(PERFECT, resolution=400)
    for distance in (1.0, 4.0):
        found = scanned(BALL, replace(camera, distance=distance))
        horizon = 1 / (distance * np.sqrt(12.0))  # cosine at which a tangent from there touches
        lowest = found.mesh.vertices[:, 2].min()
        assert horizon - 0.03 < lowest < horizon + 0.2
        assert (face_normals(found.mesh) @ AHEAD > 0).mean() > 0.99


def test_vertices_lie_behind_their_pixels():
    found = scanned(grid(8, 8), PERFECT)
    middle, diagonal = np.array([0.5, 0.5, 0.0]), np.sqrt(2.0)
    places = (found.mesh.vertices - middle)[:, :2] / (PERFECT.distance * diagonal) * focal(PERFECT)
    turned = found.pixels + 0.5 - PERFECT.resolution / 2
    np.testing.assert_allclose(
        np.linalg.norm(places, axis=1), np.linalg.norm(turned, axis=1), rtol=1e-9
    )


def test_noise_is_as_stated_face_on_and_more_on_slanted_surfaces():
    noisy = replace(PERFECT, noise=0.003, resolution=300)
    flat = scanned(grid(8, 8), noisy).mesh
    central = np.linalg.norm(flat.vertices[:, :2] - 0.5, axis=1) < 0.2
    assert flat.vertices[central, 2].std() == pytest.approx(0.003 * np.sqrt(2), rel=0.03)
    slanted = simulate_scan(
        grid(8, 8), np.random.default_rng(0), view=[0, 5.0, 1.0], camera=noisy
    ).mesh
    direction = np.array([0, 5.0, 1.0]) / np.sqrt(26)
    depth = slanted.vertices[:, 2] / direction[2]
    assert depth.std() > 1.15 * 0.003 * np.sqrt(2)


def test_noise_grows_with_the_square_of_the_depth():
    far = TriangleMesh(grid(8, 8).vertices + np.array([2.0, 0, -3.0]), grid(8, 8).faces)
    both, camera = disjoint_union(grid(8, 8), far), replace(PERFECT, noise=0.002, resolution=300)
    seen = simulate_scan(
        both, np.random.default_rng(0), view=AHEAD, camera=camera, all_pieces=True
    ).mesh
    heights = seen.vertices[:, 2]
    middle = camera.distance * np.sqrt(
        9 + 9 + 1
    )  # depth of the middle of the box, half way between the two
    ratio = heights[heights < -1.5].std() / heights[heights > -1.5].std()
    assert ratio == pytest.approx(((middle + 1.5) / (middle - 1.5)) ** 2, rel=0.05)


def test_grazing_sides_get_lost():
    found = scanned(BALL, replace(PERFECT, dropout_angle=50.0))
    turned = np.rad2deg(np.arccos(np.clip(face_normals(BALL)[found.source_faces] @ AHEAD, -1, 1)))
    assert turned.max() < 80  # 85 towards the camera, which stands near
    share = len(found.pixels) / len(scanned(BALL, PERFECT).pixels)
    assert 0.4 < share < 0.9


def test_holes_and_lost_pixels():
    whole = scanned(grid(8, 8), PERFECT)
    pierced = scanned(grid(8, 8), replace(PERFECT, n_holes=5))
    assert surface_area(pierced.mesh) < surface_area(whole.mesh)
    assert len(boundary_loops(pierced.mesh)) > 1
    thinned = scanned(grid(8, 8), replace(PERFECT, dropout=0.1))
    assert len(thinned.pixels) / len(whole.pixels) == pytest.approx(0.9, abs=0.02)


def test_what_lies_behind_a_jump_is_not_joined_and_the_larger_piece_stays():
    near = TriangleMesh(grid(4, 4).vertices * 0.4 + np.array([0.1, 0.1, 1.0]), grid(4, 4).faces)
    found = scanned(disjoint_union(near, grid(4, 4)), PERFECT)
    assert vertex_components(found.mesh)[0] == 1
    np.testing.assert_allclose(found.mesh.vertices[:, 2], 0, atol=1e-12)
    assert (found.source_faces >= near.n_faces).all()
    both = simulate_scan(
        disjoint_union(near, grid(4, 4)),
        np.random.default_rng(0),
        view=AHEAD,
        camera=PERFECT,
        all_pieces=True,
    )
    assert vertex_components(both.mesh)[0] == 2
    assert set(np.round(both.mesh.vertices[:, 2], 9)) == {0.0, 1.0}


def test_the_same_source_gives_the_same_scan_and_another_gives_another():
    one, same, other = (scanned(BALL, None, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.mesh.vertices, same.mesh.vertices)
    np.testing.assert_array_equal(one.mesh.faces, same.mesh.faces)
    assert one.mesh.n_vertices != other.mesh.n_vertices


def test_without_a_direction_the_source_draws_one():
    camera = replace(PERFECT, resolution=64)
    views = [
        simulate_scan(BALL, np.random.default_rng(seed), camera=camera).mesh for seed in (0, 1)
    ]
    means = [view.vertices.mean(axis=0) for view in views]
    assert np.linalg.norm(means[0] - means[1]) > 0.1


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_scans_scale_with_the_shape(scale):
    near, far = scanned(BALL, None), scanned(TriangleMesh(BALL.vertices * scale, BALL.faces), None)
    np.testing.assert_array_equal(near.pixels, far.pixels)
    np.testing.assert_allclose(far.mesh.vertices / scale, near.mesh.vertices, atol=1e-9)


def test_scans_stand_where_the_shape_stands():
    away = np.array([1000.0, -500.0, 20.0])
    near, far = (
        scanned(BALL, PERFECT),
        scanned(TriangleMesh(BALL.vertices + away, BALL.faces), PERFECT),
    )
    assert surface_area(far.mesh) == pytest.approx(surface_area(near.mesh), rel=1e-3)
    np.testing.assert_allclose(
        far.mesh.vertices.mean(axis=0) - away, near.mesh.vertices.mean(axis=0), atol=1e-3
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"resolution": 8}, r"resolution must lie in 16..4096; it is 8"),
        ({"n_holes": -1}, r"n_holes must lie in 0..1000; it is -1"),
        ({"distance": 0.5}, r"distance must be finite and more than 0.5 diagonals; it is 0.5"),
        (
            {"distance": np.inf},
            r"distance must be finite and more than 0.5 diagonals; it is inf",
        ),
        ({"noise": -0.1}, r"noise must lie in 0..1 diagonals; it is -0.1"),
        (
            {"dropout_angle": 85.0},
            r"dropout_angle must be at least 0 and less than 85 degrees; it is 85.0",
        ),
        ({"dropout": 1.0}, r"dropout must be at least 0 and less than 1; it is 1.0"),
    ],
)
def test_cameras_out_of_range_are_refused(changes, message):
    with pytest.raises(InvalidParameterError, match=message):
        scanned(BALL, replace(PERFECT, **changes))


def test_what_cannot_be_scanned_is_refused():
    point = TriangleMesh(np.ones((3, 3)), [[0, 1, 2]])
    with pytest.raises(
        InvalidShapeError,
        match=r"must have a size above zero to be scanned; all its vertices are equal",
    ):
        scanned(point, PERFECT)
    with pytest.raises(
        InvalidShapeError, match=r"no three neighboring pixels see one surface from this view"
    ):
        scanned(grid(4, 4), PERFECT, view=[0, 1.0, 0])
    with pytest.raises(
        InvalidParameterError, match=r"view must be three finite numbers that are not all zero"
    ):
        scanned(BALL, PERFECT, view=[0, 0, 0])
