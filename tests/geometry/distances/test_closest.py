import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.distances.closest import closest_points, signed_distance, winding_numbers
from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.stability.anchors import squared_distances

CUBE = boundary_surface(box(2, 2, 2))
BALL = icosphere(2)


def cloud(n: int = 200) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1.5, 1.5, (n, 3))


def inverted(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def moved(mesh: TriangleMesh, factor: float, shift: float) -> TriangleMesh:
    return TriangleMesh(factor * mesh.vertices + shift, mesh.faces)


@pytest.mark.parametrize("mesh", [BALL, torus(12, 8), grid(3, 3)], ids=["ball", "torus", "grid"])
def test_the_nearest_point_is_the_nearest_of_all_faces(mesh):
    points = cloud()
    found = closest_points(mesh, points)
    least = squared_distances(points, mesh.vertices[mesh.faces]).min(axis=1)
    away = np.linalg.norm(found.points - points, axis=1)
    np.testing.assert_allclose(away, np.sqrt(least), rtol=1e-12, atol=1e-14)
    assert (found.weights >= 0).all()
    np.testing.assert_allclose(found.weights.sum(axis=1), 1, atol=1e-15)


def test_faces_without_area_are_segments_and_points():
    needle = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    found = closest_points(needle, [[1.5, 1, 0], [3, 0, 0], [-1, 0, 0]])
    np.testing.assert_allclose(found.points[:, 0], [1.5, 2, 0], atol=1e-15)
    dot = TriangleMesh([[1, 2, 3]], [[0, 0, 0]])
    assert closest_points(dot, [[1, 2, 5]]).points.tolist() == [[1, 2, 3]]


def test_distances_to_a_cube_are_exact():
    points = cloud() + 0.5
    beyond = np.abs(points - 0.5) - 0.5
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    exact = outside + np.minimum(beyond.max(axis=1), 0)
    np.testing.assert_allclose(signed_distance(CUBE, points), exact, atol=1e-14)


def test_distances_to_a_ball_fall_to_those_of_the_sphere_with_the_second_order():
    points = cloud()
    exact = np.linalg.norm(points, axis=1) - 1
    errors = [np.abs(signed_distance(icosphere(n), points) - exact).max() for n in (1, 2, 3)]
    order = np.log2(errors[0] / errors[2]) / 2
    assert 1.8 < order < 2.1


def test_points_on_the_surface_are_at_distance_0():
    middles = BALL.vertices[BALL.faces].mean(axis=1)
    assert (signed_distance(BALL, BALL.vertices) == 0).all()
    np.testing.assert_allclose(signed_distance(BALL, middles), 0, atol=1e-15)
    # Just beside edges and corners the sign is right as well.
    near = np.concatenate([BALL.vertices, middles])
    assert (signed_distance(BALL, near * (1 - 1e-9)) < 0).all()
    assert (signed_distance(BALL, near * (1 + 1e-9)) > 0).all()


def test_units_and_places_do_not_matter():
    points = cloud()
    plain = signed_distance(BALL, points)
    for factor in (2.0**300, 2.0**-300):
        scaled = signed_distance(moved(BALL, factor, 0.0), factor * points)
        np.testing.assert_array_equal(scaled, factor * plain)
    np.testing.assert_allclose(
        signed_distance(moved(BALL, 1.0, 1e6), points + 1e6), plain, atol=1e-8
    )


def test_winding_numbers_count_layers_and_cavities():
    both = disjoint_union(BALL, moved(BALL, 1.0, 0.5))
    shell = disjoint_union(BALL, inverted(moved(BALL, 0.5, 0.0)))
    points = [[0.25, 0.25, 0.25], [-0.5, -0.5, -0.5], [3, 0, 0]]
    np.testing.assert_allclose(winding_numbers(both, points), [2, 1, 0], atol=1e-12)
    np.testing.assert_allclose(winding_numbers(shell, points), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(winding_numbers(inverted(BALL), points), [-1, -1, 0], atol=1e-12)
    assert (np.sign(signed_distance(both, points)) == [-1, -1, 1]).all()
    assert (np.sign(signed_distance(shell, points)) == [1, -1, 1]).all()


def test_an_open_surface_winds_by_its_solid_angle():
    # One of six sides of a cube, seen from the middle; above, from far away.
    side = moved(grid(2, 2), 2.0, -1.0)
    np.testing.assert_allclose(
        np.abs(winding_numbers(side, [[0, 0, 0], [0, 0, 1e6]])), [1 / 6, 0], atol=1e-12
    )


def test_many_layers_count_their_turns():
    layers = disjoint_union(*[moved(BALL, 1 + 0.1 * n, 0.0) for n in range(7)])
    assert winding_numbers(layers, [[0.1, 0.2, 0.3]])[0] == pytest.approx(7, abs=1e-12)


def test_a_small_hole_is_closed():
    holed = TriangleMesh(BALL.vertices, BALL.faces[2:])
    points = cloud()
    clear = np.abs(signed_distance(BALL, points)) > 0.2
    signs = np.sign(signed_distance(holed, points[clear]))
    np.testing.assert_array_equal(signs, np.sign(signed_distance(BALL, points[clear])))


def test_faces_that_look_inward_are_refused_and_the_remedies_work():
    one = disjoint_union(moved(BALL, 1.0, 5.0), inverted(BALL))
    with pytest.raises(InvalidShapeError, match=r"face 320 looks inward \(320 such\)") as caught:
        signed_distance(one, [[0, 0, 0]])
    assert 'repair(mesh, ["orient"])' in str(caught.value)
    assert signed_distance(repair(one, ["orient"]).mesh, [[0, 0, 0]])[0] < -0.9
    bowl = inverted(TriangleMesh(BALL.vertices, BALL.faces[9:]))
    with pytest.raises(InvalidShapeError, match=r"Try orient_outward\(mesh\)"):
        signed_distance(bowl, [[0, 0, 0]])
    assert signed_distance(orient_outward(bowl), [[0, 0, 0]])[0] < -0.9
    faces = np.array(BALL.faces)
    faces[5] = faces[5, ::-1]
    with pytest.raises(InvalidShapeError, match="Neighboring faces must be turned the same way"):
        signed_distance(TriangleMesh(BALL.vertices, faces), [[0, 0, 0]])


@pytest.mark.parametrize("compute", [closest_points, signed_distance, winding_numbers])
def test_bad_points_are_named(compute):
    with pytest.raises(InvalidShapeError, match="points must be finite; point 1"):
        compute(BALL, [[0, 0, 0], [0, np.nan, 0]])
    with pytest.raises(InvalidShapeError, match=r"points must have shape \(n, 3\)"):
        compute(BALL, [[0, 0]])
    with pytest.raises(InvalidParameterError, match=r"within 1e\+50 sizes .* point 1"):
        compute(BALL, [[0, 0, 0], [1e150, 0, 0]])


def test_no_points_have_no_distances():
    assert signed_distance(BALL, np.empty((0, 3))).shape == (0,)
