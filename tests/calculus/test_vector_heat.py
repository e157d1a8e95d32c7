import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eigenshape as es
from certeig.kit.arguments import require_choice
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.calculus.log_map import LogMethod, logarithmic_map
from eigenshape.calculus.vector_heat import (
    extend_scalar,
    prepare_vector_heat,
    transport_vectors,
)
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.connection import connection_laplacian, tangent_frames
from eigenshape.shapes.surfaces import grid, icosphere, torus


def exact_logarithm(points: np.ndarray, source: int, frame: np.ndarray) -> np.ndarray:
    """Return the logarithmic map of the unit sphere."""
    cosines = points @ points[source]
    ways = points - np.outer(cosines, points[source])
    lengths = np.linalg.norm(ways, axis=1)
    angles = np.arctan2(lengths, cosines)
    return angles[:, None] * ways / np.where(lengths > 0, lengths, 1)[:, None] @ frame.T


@pytest.mark.parametrize(
    ("method", "worst"), [("affine", 0.01), ("adaptive", 0.04), ("radial", 0.06)]
)
def test_logarithmic_maps_of_the_sphere(method, worst):
    errors = []
    for n in (3, 4):
        ball = icosphere(n)
        found = logarithmic_map(ball, 20, method=method)
        exact = exact_logarithm(ball.vertices, 20, tangent_frames(ball)[20])
        near = ball.vertices @ ball.vertices[20] > np.cos(1.5)
        errors.append(np.linalg.norm(found - exact, axis=1)[near].max())
    assert errors[1] < worst
    assert errors[1] < 0.65 * errors[0]


def test_transport_on_the_sphere_follows_great_circles():
    ball = icosphere(4)
    field = transport_vectors(ball, [20], [[2.0, 0.0]])
    assert np.linalg.norm(field, axis=1) == pytest.approx(2.0)
    frames = tangent_frames(ball)
    in_space = np.einsum("nk,nkd->nd", field, frames)
    # Along a great circle through the source a vector keeps its angle with the circle.
    normal, given = ball.vertices[20], 2 * frames[20, 0]
    axes = np.cross(normal, ball.vertices)
    sines, cosines = np.linalg.norm(axes, axis=1), ball.vertices @ normal
    near = (sines > 1e-6) & (cosines > -0.5)
    axes = axes[near] / sines[near, None]
    along = (axes @ given)[:, None] * axes
    exact = (
        along + cosines[near, None] * (given - along) + sines[near, None] * np.cross(axes, given)
    )
    assert np.linalg.norm(in_space[near] - exact, axis=1).max() < 0.05


def test_transport_on_a_plane_is_parallel_up_to_the_boundary():
    square = grid(6, 5)
    field = transport_vectors(square, [0], [[0.6, -0.8]])
    in_space = np.einsum("nk,nkd->nd", field, tangent_frames(square))
    assert in_space == pytest.approx(np.tile(in_space[0], (42, 1)), abs=1e-12)


def test_the_nearest_of_several_sources_counts():
    strip = grid(40, 4, width=10, height=1)
    ends = [0, strip.n_vertices - 1]
    values = extend_scalar(strip, ends, [2.0, 6.0])
    left = strip.vertices[:, 0] < 3
    assert values[left] == pytest.approx(2.0, abs=1e-3)
    assert values.min() >= 2 - 1e-12
    assert values.max() <= 6 + 1e-12
    field = transport_vectors(strip, ends, [[1.0, 0.0], [0.0, 3.0]])
    assert np.linalg.norm(field, axis=1)[left] == pytest.approx(1.0, abs=1e-3)


def test_a_vector_of_length_zero_stays_zero():
    assert (transport_vectors(icosphere(1), [3], [[0.0, 0.0]]) == 0).all()


@pytest.mark.parametrize("scale", [2.0**-100, 2.0**100])
def test_logarithms_scale_exactly(scale):
    ball = icosphere(2)
    large = TriangleMesh(ball.vertices * scale, ball.faces)
    assert (logarithmic_map(large, 3) == scale * logarithmic_map(ball, 3)).all()


def test_a_prepared_mesh_gives_the_same():
    ring = torus(16, 10)
    solver = prepare_vector_heat(ring)
    assert (logarithmic_map(solver, 5) == logarithmic_map(ring, 5)).all()
    assert repr(solver).startswith("VectorHeat(160 points")


def test_bad_input_is_named():
    ball = icosphere(1)
    with pytest.raises(InvalidParameterError, match="values must hold one number per source"):
        extend_scalar(ball, [1, 2], [1.0])
    with pytest.raises(InvalidParameterError, match="vectors must hold two coordinates per source"):
        transport_vectors(ball, [1], [[1.0, 0.0, 0.0]])
    with pytest.raises(InvalidParameterError, match="vectors must be finite; that of source 0"):
        transport_vectors(ball, [1], [[1.0, np.nan]])
    with pytest.raises(InvalidParameterError, match="method must be 'affine', 'adaptive'"):
        require_choice("exact", LogMethod, "method")
    with pytest.raises(InvalidParameterError, match="source must lie in"):
        logarithmic_map(ball, 42)
    two = disjoint_union(ball, ball)
    with pytest.raises(InvalidParameterError, match="component must have a source; that of vertex"):
        extend_scalar(two, [0], [1.0])
    assert extend_scalar(two, [0, 50], [1.0, 2.0])[42:] == pytest.approx(2.0)
    faces = ball.faces.copy()
    faces[3] = faces[3, ::-1]
    with pytest.raises(InvalidShapeError, match="turned against each other"):
        transport_vectors(TriangleMesh(ball.vertices, faces), [1], [[1.0, 0.0]])


def test_heat_that_underflows_is_named_and_the_remedy_works():
    strip = grid(1200, 1, width=1200, height=1)
    cold = prepare_vector_heat(strip, time_factor=0.2)
    for compute in (
        lambda solver: extend_scalar(solver, [0], [1.0])[:, None],
        lambda solver: transport_vectors(solver, [0], [[1.0, 0.0]]),
        lambda solver: logarithmic_map(solver, 0, method="radial"),
        lambda solver: logarithmic_map(solver, 0, method="affine"),
    ):
        with pytest.raises(InvalidParameterError, match="Heat from the sources must reach"):
            compute(cold)
    warm = prepare_vector_heat(strip, time_factor=5.0)
    assert extend_scalar(warm, [0], [1.0]) == pytest.approx(1.0)
    field = transport_vectors(warm, [0], [[1.0, 0.0]])
    assert np.linalg.norm(field, axis=1) == pytest.approx(1.0)
    assert np.isfinite(logarithmic_map(warm, 0, method="radial")).all()
    lengths = np.linalg.norm(logarithmic_map(warm, 0, method="affine"), axis=1)
    assert lengths == pytest.approx(np.linalg.norm(strip.vertices, axis=1), abs=1e-6)


def sphere_cloud(n, seed=0):
    points = np.random.default_rng(seed).standard_normal((n, 3))
    return PointCloud(points / np.linalg.norm(points, axis=1, keepdims=True), dim=2)


def test_frames_of_a_cloud_are_orthonormal_and_tangent():
    cloud = sphere_cloud(500)
    frames = tangent_frames(cloud)
    product = frames @ frames.swapaxes(1, 2)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(2), product.shape), atol=1e-12)
    across = np.einsum("nkd,nd->nk", frames, cloud.points)
    assert np.abs(across).mean() < 0.08
    normals = np.cross(frames[:, 0], frames[:, 1])
    assert (normals[np.arange(500), np.abs(normals).argmax(axis=1)] > 0).all()


@pytest.mark.parametrize(("n", "worst"), [(1000, 3.5), (4000, 2.0)])
def test_transport_on_a_cloud_follows_great_circles(n, worst):
    cloud = sphere_cloud(n)
    points, frames = cloud.points, tangent_frames(cloud)
    start = int(points[:, 2].argmax())
    carried = transport_vectors(cloud, [start], [[2.0, 0.0]])
    found = np.einsum("nk,nkd->nd", carried, frames)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 2)
    # The turn about the axis of the great circle takes the vector along it.
    axes = np.cross(points[start], points)
    sines, cosines = np.linalg.norm(axes, axis=1, keepdims=True), points @ points[start]
    axes /= np.where(sines > 0, sines, 1)
    vector = frames[start, 0]
    exact = vector * cosines[:, None] + np.cross(axes, vector) * sines
    exact += axes * (axes @ vector * (1 - cosines))[:, None]
    angles = np.degrees(np.arccos(np.clip(np.sum(found * exact, axis=1) / 2, -1, 1)))
    assert angles[cosines > -0.8].mean() < worst


def test_transport_on_a_plane_cloud_is_parallel_whatever_side_normals_look_to():
    rng = np.random.default_rng(0)
    plane = Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).as_matrix()
    points = np.pad(rng.uniform(0, 1, (400, 2)), ((0, 0), (0, 1))) @ plane
    for unit in (1, 1e-100, 1e100):
        cloud = PointCloud(unit * points, dim=2)
        solver = prepare_vector_heat(cloud)
        found = np.einsum(
            "nk,nkd->nd", transport_vectors(solver, [7], [[0, 1.0]]), tangent_frames(cloud)
        )
        np.testing.assert_allclose(found, np.broadcast_to(found[7], found.shape), atol=1e-9)
        values = extend_scalar(solver, [7, 8], [1.0, 1.0])
        np.testing.assert_allclose(values, 1)


def test_the_connection_of_a_cloud_is_symmetric_and_positive():
    laplacian = connection_laplacian(sphere_cloud(1000))
    assert abs(laplacian.stiffness - laplacian.stiffness.T).max() == 0
    assert np.linalg.eigvalsh(laplacian.stiffness.toarray())[0] > 1e-4  # no parallel field
    # The smallest eigenvalue on the sphere is 1.
    assert es.solve_spectrum(laplacian, 1).eigenvalues[0] == pytest.approx(1, abs=0.1)


def test_what_needs_faces_refuses_the_heat_of_a_cloud():
    solver = prepare_vector_heat(sphere_cloud(100))
    assert repr(solver).startswith("VectorHeat(100 points")
    for call in (
        lambda: logarithmic_map(solver, 0),
        lambda: es.calculus.signed_heat_distance(solver, [[0, 1]]),
    ):
        with pytest.raises(InvalidParameterError, match="mesh must have faces; this VectorHeat"):
            call()
