import numpy as np
import pytest

from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import scale_to_unit
from eigenshape.geometry.measure import (
    edge_lengths,
    enclosed_volume,
    face_areas,
    face_normals,
    surface_area,
    vertex_normals,
)
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.requirements import require_volumes
from eigenshape.geometry.simplices import degenerate_simplices

# The cube [0, 1]^3; its vertex 4x + 2y + z lies at (x, y, z).
CUBE = TriangleMesh(
    list(np.ndindex(2, 2, 2)),
    [
        *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5)],  # x = 0 and x = 1
        *[(0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6)],  # y
        *[(0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],  # z
    ],
)
SCALES = [1e-100, 1.0, 1e100]


def scaled(mesh, scale):
    return TriangleMesh(mesh.vertices * scale, mesh.faces)


@pytest.mark.parametrize("scale", SCALES)
def test_a_cube_at_any_scale(scale):
    cube = scaled(CUBE, scale)
    np.testing.assert_allclose(face_areas(cube) / scale / scale, 0.5, rtol=1e-14)
    np.testing.assert_allclose(surface_area(cube) / scale / scale, 6, rtol=1e-14)
    np.testing.assert_allclose(enclosed_volume(cube) / scale / scale / scale, 1, rtol=1e-14)
    lengths = np.sort(edge_lengths(cube) / scale)
    np.testing.assert_allclose(lengths, [1.0] * 12 + [2**0.5] * 6, rtol=1e-14)
    require_volumes(cube)


@pytest.mark.parametrize("scale", SCALES)
def test_normals_of_a_cube_point_outward(scale):
    cube = scaled(CUBE, scale)
    expected = np.repeat(
        [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], 2, axis=0
    )
    np.testing.assert_allclose(face_normals(cube), expected, atol=1e-15)
    # Corners 0 and 7 have two faces on each side; corner 4 = (1, 0, 0) has areas 2, 1, 1 at x, y, z.
    normals = vertex_normals(cube)
    np.testing.assert_allclose(normals[0], -np.ones(3) / 3**0.5, rtol=1e-14)
    np.testing.assert_allclose(normals[7], np.ones(3) / 3**0.5, rtol=1e-14)
    np.testing.assert_allclose(normals[4], np.array([2, -1, -1]) / 6**0.5, rtol=1e-14)


def test_turned_inside_out_the_volume_is_negative():
    inward = TriangleMesh(CUBE.vertices, CUBE.faces[:, ::-1])
    assert enclosed_volume(inward) == pytest.approx(-1, rel=1e-14)
    np.testing.assert_allclose(face_normals(inward), -face_normals(CUBE), atol=1e-15)


def test_far_from_the_origin_areas_stand():
    far = TriangleMesh(CUBE.vertices + 2.0**30, CUBE.faces)
    assert surface_area(far) == pytest.approx(6, rel=1e-14)
    assert enclosed_volume(far) == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("power", [-300, -1, 40, 300])
def test_powers_of_two_cost_no_digit(power):
    points, scale = scale_to_unit(CUBE.vertices)
    again, larger = scale_to_unit(2.0**power * CUBE.vertices)
    np.testing.assert_array_equal(again, points)
    assert larger == scale * 2.0**power


@pytest.mark.parametrize("size", [1.7e308, 1e-308, 5e-324])
def test_coordinates_at_the_ends_of_the_range_come_to_size_one(size):
    points, _ = scale_to_unit(np.array([[size, 0, 0], [-size, 0, 0], [0, size, 0]]))
    assert 0.5 <= np.abs(points).max() <= 2


def test_all_points_equal_have_no_size():
    points, scale = scale_to_unit(np.zeros((3, 3)))
    assert scale == 1
    assert not points.any()


def test_normals_are_zero_where_there_is_no_area():
    line = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [9, 9, 9]], [[0, 1, 2]])
    assert not face_normals(line).any()
    assert not vertex_normals(line).any()


@pytest.mark.parametrize("scale", SCALES)
def test_a_face_without_area_is_refused(scale):
    mesh = scaled(
        TriangleMesh(
            [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2], [0, 1, 3], [1, 1, 2]]
        ),
        scale,
    )
    assert degenerate_simplices(mesh).tolist() == [1, 2]
    with pytest.raises(
        InvalidShapeError,
        match=r"Faces must have area; face 1 is \[0, 1, 3\] with corners .* \(2 such\)\. Try repair\(mesh,",
    ):
        require_volumes(mesh)


@pytest.mark.parametrize("points", [np.ones((3, 3)), [[0, 0, 0], [1, 1, 1], [3, 3, 3]]])
def test_a_mesh_without_any_area_is_refused(points):
    with pytest.raises(
        InvalidShapeError, match="all 1 have none: their points are equal or on a line"
    ):
        require_volumes(TriangleMesh(points, [[0, 1, 2]]))


def test_a_thin_face_still_has_area():
    assert (
        degenerate_simplices(
            TriangleMesh([[0, 0, 0], [1, 0, 0], [0.5, 1e-13, 0]], [[0, 1, 2]])
        ).size
        == 0
    )


@pytest.mark.parametrize("size", [1e300, 1e160, 1e-160, 1e-300])
def test_areas_and_volumes_that_floats_cannot_hold_are_refused(size):
    cube = scaled(CUBE, size)
    with pytest.raises(
        InvalidShapeError,
        match=r"areas the largest coordinate must lie within 1e-150\.\.1e150; it is about [79]e[+-]",
    ):
        face_areas(cube)
    with pytest.raises(
        InvalidShapeError,
        match=r"volumes .* must lie within 1e-100\.\.1e100; it is about [79]e[+-]",
    ):
        enclosed_volume(cube)
    np.testing.assert_allclose(edge_lengths(cube).min(), size, rtol=1e-14)
    np.testing.assert_array_equal(face_normals(cube), face_normals(CUBE))
    assert degenerate_simplices(cube).size == 0


def test_lengths_that_floats_cannot_hold_are_refused():
    wide = TriangleMesh([[1.7e308, 0, 0], [-1.7e308, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    with pytest.raises(
        InvalidShapeError,
        match=r"To measure lengths .* 1e-301\.\.1e301; it is about 9e\+307\. Choose",
    ):
        edge_lengths(wide)


def test_a_face_is_measured_by_its_corners_alone():
    rng = np.random.default_rng(0)
    points = rng.random((9, 3))
    alone = TriangleMesh(points[:3], [[0, 1, 2]])
    among = TriangleMesh(
        np.concatenate([points, [[1e300, 0, 0]]]), [[6, 7, 8], [0, 1, 2], [3, 4, 5]]
    )
    np.testing.assert_array_equal(face_areas(among)[1], face_areas(alone)[0])
    np.testing.assert_array_equal(face_normals(among)[1], face_normals(alone)[0])


def test_small_faces_on_a_slanted_line_are_found_in_a_large_mesh():
    rng = np.random.default_rng(0)
    for _ in range(300):
        corners, step = rng.integers(-500, 500, (4, 3)), rng.integers(1, 4, 3)
        mesh = TriangleMesh(
            [*corners, corners[3] + step, corners[3] + 3 * step], [[0, 1, 2], [3, 4, 5]]
        )
        assert degenerate_simplices(scaled(mesh, 0.1)).tolist() == [1]
