import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus.heat_distance import (
    factorize_definite,
    heat_distances,
    prepare_heat_geodesics,
)
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.clouds.neighbors import neighbor_graph
from eigenshape.shapes.domains import box, interval
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import grid, icosphere, torus


def on_sphere(points: np.ndarray, source: int) -> np.ndarray:
    return np.arccos(np.clip(points @ points[source], -1, 1))


@pytest.mark.parametrize("robust", [False, True])
def test_errors_on_the_sphere_fall_with_the_edge_length(robust):
    errors, edges = [], []
    for n in (2, 3, 4):
        ball = icosphere(n)
        found = heat_distances(prepare_heat_geodesics(ball, robust=robust), [0])[0]
        errors.append(np.abs(found - on_sphere(ball.vertices, 0)).mean())
        edges.append(2.0**-n)
    order = np.polyfit(np.log(edges), np.log(errors), 1)[0]
    assert errors[-1] < 0.015
    assert order > 0.8


def test_errors_on_a_flat_torus_in_four_dimensions_fall():
    errors = []
    for n in (16, 32, 64):
        i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        u, v = 2 * np.pi * i / n, 2 * np.pi * j / n
        points = np.column_stack([np.cos(u), np.sin(u), np.cos(v), np.sin(v)])
        right, up = (i + 1) % n * n + j, i * n + (j + 1) % n
        across = (i + 1) % n * n + (j + 1) % n
        corners = [(i * n + j, right, across), (i * n + j, across, up)]
        faces = np.concatenate([np.column_stack(triangle) for triangle in corners])
        found = heat_distances(SimplicialMesh(points, faces), [0])[0]
        exact = np.hypot(np.minimum(u, 2 * np.pi - u), np.minimum(v, 2 * np.pi - v))
        errors.append(np.abs(found - exact).mean())
    # The ridge where waves meet is rounded off, which leaves less than the first order.
    assert errors[2] < 0.72 * errors[1] < 0.72**2 * errors[0]


def test_tetrahedra_and_segments():
    cube = box(8, 8, 8)
    exact = np.linalg.norm(cube.points - cube.points[0], axis=1)
    assert np.abs(heat_distances(cube, [0])[0] - exact).max() < 0.13
    line = interval(40, length=2.0)
    assert heat_distances(line, [0])[0] == pytest.approx(line.points[:, 0], abs=1e-12)


def test_point_clouds():
    points = np.array(fibonacci_sphere(1500).vertices)
    found = heat_distances(PointCloud(points, dim=2), [7])[0]
    assert np.abs(found - on_sphere(points, 7)).max() < 0.1


def test_many_sources_are_each_source_alone():
    solver = prepare_heat_geodesics(torus(16, 10))
    together = heat_distances(solver, np.arange(20))
    alone = np.concatenate([heat_distances(solver, [source]) for source in range(20)])
    assert together == pytest.approx(alone, rel=1e-13, abs=1e-13)


def test_several_sources_count_as_one_set():
    square = grid(20, 20)
    left = np.flatnonzero(square.vertices[:, 0] == 0)
    found = heat_distances(square, [np.append(left, left)])[0]
    half_an_edge = 0.025
    assert found == pytest.approx(square.vertices[:, 0], abs=half_an_edge)


def test_components_without_a_source_are_infinitely_far():
    two = disjoint_union(icosphere(1), icosphere(1))
    found = heat_distances(two, [0, 42])
    assert np.isinf(found[0, 42:]).all()
    assert np.isinf(found[1, :42]).all()
    assert found[0, :42] == pytest.approx(found[1, 42:], abs=1e-12)
    set_of = heat_distances(two, [[0, 1], 42])[0]
    assert np.isinf(set_of[42:]).all()
    assert set_of[:42] == pytest.approx(heat_distances(icosphere(1), [[0, 1]])[0])


def test_heat_that_underflows_is_named_and_the_remedy_works():
    line = interval(1500, length=1500.0)
    with pytest.raises(InvalidParameterError, match="Heat from the sources must reach"):
        heat_distances(line, [0])
    warm = prepare_heat_geodesics(line, time_factor=6.0)
    assert heat_distances(warm, [0])[0] == pytest.approx(line.points[:, 0], abs=1e-6)


@pytest.mark.parametrize("scale", [2.0**-300, 2.0**300])
def test_distances_scale_exactly(scale):
    ball = icosphere(2)
    large = TriangleMesh(ball.vertices * scale, ball.faces)
    assert (heat_distances(large, [3]) == scale * heat_distances(ball, [3])).all()


def test_longer_heat_is_smoother_and_stated():
    ball = icosphere(2)
    short, long = (prepare_heat_geodesics(ball, time_factor=factor) for factor in (1, 4))
    assert long.time == pytest.approx(4 * short.time)
    assert repr(short).startswith("HeatGeodesics(162 points, time=")


def test_faces_may_be_turned_for_distances():
    ball = icosphere(2)
    faces = ball.faces.copy()
    faces[::2] = faces[::2, ::-1]
    turned = heat_distances(TriangleMesh(ball.vertices, faces), [0])
    assert turned == pytest.approx(heat_distances(ball, [0]), abs=1e-12)


def test_bad_input_is_named():
    ball = icosphere(1)
    with pytest.raises(InvalidParameterError, match="at least one source; there is none"):
        heat_distances(ball, [])
    with pytest.raises(InvalidParameterError, match="at least one source; there is none"):
        heat_distances(ball, [[]])
    with pytest.raises(InvalidParameterError, match=r"A source must lie in 0\.\.41; it is 42"):
        heat_distances(ball, [42])
    with pytest.raises(InvalidParameterError, match="time_factor must be positive"):
        prepare_heat_geodesics(ball, time_factor=0)
    with pytest.raises(InvalidParameterError, match="robust must be False unless"):
        prepare_heat_geodesics(box(1, 1, 1), robust=True)
    with pytest.raises(InvalidShapeError, match="angles well above 0 for the equations"):
        factorize_definite(neighbor_graph([[0.0], [1.0]], 1) * 0.0)
