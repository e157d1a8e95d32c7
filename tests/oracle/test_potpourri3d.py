"""Beside potpourri3d (geometry-central): heat geodesics, vector heat, logarithmic maps, paths."""

import numpy as np
import potpourri3d as pp3d
import pytest

import eigenshape as es
from eigenshape.calculus.geodesic_paths import geodesic_path
from eigenshape.calculus.geodesic_rays import trace_geodesic
from eigenshape.calculus.heat_distance import heat_distances, prepare_heat_geodesics
from eigenshape.calculus.log_map import logarithmic_map
from eigenshape.calculus.signed_heat import signed_heat_distance
from eigenshape.calculus.vector_heat import (
    VectorHeat,
    extend_scalar,
    prepare_vector_heat,
    transport_vectors,
)
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import boundary_loops
from eigenshape.operators.clouds.cloud_triangles import local_triangles
from eigenshape.operators.connection import tangent_frames
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.robust import robust_laplacian
from eigenshape.shapes.surfaces import grid, icosphere, torus

SHIFT = 1e-6  # theirs solves W + 1e-6 instead of W


def ellipsoid() -> TriangleMesh:
    ball = icosphere(3)
    return TriangleMesh(ball.vertices * [1.0, 1.2, 0.8], ball.faces)


def uneven_grid() -> TriangleMesh:
    """A square whose corners lie on no common circles, where either diagonal would be Delaunay."""
    square = grid(12, 9)
    noise = np.random.default_rng(0).uniform(-0.02, 0.02, square.vertices.shape)
    return TriangleMesh(square.vertices + noise, square.faces)


CLOSED = {"sphere": icosphere(3), "torus": torus(40, 20), "ellipsoid": ellipsoid()}


def arrays(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    return np.array(mesh.vertices), np.array(mesh.faces)


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("name", [*CLOSED, "grid"])
def test_heat_distances(name, robust):
    mesh = uneven_grid() if name == "grid" else CLOSED[name]
    ours = heat_distances(prepare_heat_geodesics(mesh, robust=robust), [3])[0]
    theirs = pp3d.MeshHeatMethodDistanceSolver(*arrays(mesh), 1.0, robust).compute_distance(3)
    # Their distances solve a shifted equation; those of the same right-hand side are compared.
    stiffness = robust_laplacian(mesh).stiffness if robust else cotangent_laplacian(mesh).stiffness
    doubled = 2 if robust else 1  # their tufted cover counts each face twice
    shifted = doubled * (stiffness @ theirs) + SHIFT * (theirs - theirs.mean())
    right = doubled * (stiffness @ ours)
    assert np.abs(shifted - right).max() < 1e-10 * np.abs(right).max()
    assert ours == pytest.approx(theirs, abs=1e-4 * ours.max())


def angles_between_frames(solver: VectorHeat, theirs: np.ndarray) -> np.ndarray:
    """Return the first vectors of their frames in ours, as complex numbers.

    These are directions of edges; their normals differ from ours, so the nearest edge is taken.
    """
    frames = tangent_frames(solver.mesh)
    rough = np.einsum("nd,nkd->nk", theirs, frames) @ [1, 1j]
    rough /= np.abs(rough)
    tails = solver.mesh.faces.ravel()
    edges = np.exp(1j * solver.directions.at_tail)
    order = np.lexsort((-np.abs(edges - rough[tails]), tails))
    exact = np.empty_like(rough)
    exact[tails[order]] = edges[order]  # the last of each vertex, the nearest, stays
    return exact


@pytest.mark.parametrize("name", CLOSED)
def test_vector_heat_and_logarithmic_maps(name):
    mesh = CLOSED[name]
    solver = prepare_vector_heat(mesh)
    theirs = pp3d.MeshVectorHeatSolver(*arrays(mesh), 1.0, False)
    turns = angles_between_frames(solver, theirs.get_tangent_frames()[0])
    sources, vectors = [25, 3], np.array([1.0, 2.0j])
    given = vectors / turns[sources]
    found = theirs.transport_tangent_vectors(sources, np.column_stack([given.real, given.imag]))
    ours = transport_vectors(solver, sources, np.column_stack([vectors.real, vectors.imag]))
    assert ours @ [1, 1j] == pytest.approx(found @ [1, 1j] * turns, abs=1e-10)
    extended = theirs.extend_scalar([1, 7], [2.0, 5.0])
    assert extend_scalar(solver, [1, 7], [2.0, 5.0]) == pytest.approx(extended, abs=1e-11)
    for method, strategy in {
        "affine": "AffineLocal",
        "adaptive": "AffineAdaptive",
        "radial": "VectorHeat",
    }.items():
        if (name, method) == ("sphere", "radial"):
            continue  # rounding turns the vector opposite to the source, and all distances follow
        coordinates = theirs.compute_log_map(25, strategy) @ [1, 1j] * turns[25]
        found = logarithmic_map(solver, 25, method=method) @ [1, 1j]
        # Opposite to the source of a round sphere any direction is as good.
        near = np.linalg.norm(mesh.vertices + mesh.vertices[25], axis=1) > 1e-6
        assert found[near] == pytest.approx(coordinates[near], abs=1e-9)


@pytest.mark.parametrize("name", CLOSED)
def test_geodesic_paths(name):
    mesh = CLOSED[name]
    solver = pp3d.EdgeFlipGeodesicSolver(*arrays(mesh))
    rng = np.random.default_rng(0)
    same = 0
    for start, end in rng.choice(mesh.n_vertices, (12, 2), replace=False):
        theirs = solver.find_geodesic_path(int(start), int(end))
        length = np.linalg.norm(np.diff(theirs, axis=0), axis=1).sum()
        ours = geodesic_path(mesh, start, end).length
        same += abs(ours - length) < 1e-9 * length
        assert ours == pytest.approx(length, rel=0.01)
    # Where the path along edges is as long on both sides, another geodesic may be found.
    assert same >= 10


def test_straight_walks():
    mesh = icosphere(4)
    vector = np.array([0.3, 1.2])
    theirs = pp3d.GeodesicTracer(*arrays(mesh))
    found = theirs.trace_geodesic_from_vertex(25, vector @ tangent_frames(mesh)[25])
    ours = trace_geodesic(mesh, 25, vector)
    # Their normals, and so their tangent planes, differ a little from ours.
    assert np.linalg.norm(ours.points[-1] - found[-1]) < 1e-3


def test_triangles_around_points():
    points = np.random.default_rng(1).standard_normal((1000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    theirs = pp3d.PointCloudLocalTriangulation(points, False).get_local_triangulation()
    theirs = theirs.reshape(-1, 3)
    theirs = theirs[theirs[:, 0] >= 0]
    ours = local_triangles(PointCloud(points, dim=2))

    def keys(triangles: np.ndarray) -> set[tuple[int, ...]]:
        return {(row[0], *sorted(row[1:])) for row in triangles.tolist()}

    assert keys(ours) == keys(theirs)


def test_signed_distances_have_the_opposite_sign():
    # Theirs keeps vectors at edges and is positive on the left of a curve.
    ball = CLOSED["sphere"]
    path = cap_loop(ball)
    ours = signed_heat_distance(ball, [path])
    theirs = pp3d.MeshSignedHeatSolver(*arrays(ball)).compute_distance([[(i, []) for i in path]])
    assert np.abs(ours + theirs).max() < 0.1 * np.abs(theirs).max()


def cap_loop(ball: TriangleMesh) -> list[int]:
    """Return the vertices around a cap of faces, counter-clockwise, the first again at the end."""
    cap = TriangleMesh(ball.vertices, ball.faces[(ball.vertices[ball.faces, 2] > 0.4).all(axis=1)])
    loop = boundary_loops(cap)[0].tolist()
    return [*loop, loop[0]]


def test_walks_from_points_inside_faces_are_theirs():
    ball = es.icosphere(3)
    mesh = es.TriangleMesh(ball.vertices * [1, 1.2, 0.8], ball.faces)
    tracer = pp3d.GeodesicTracer(np.array(mesh.vertices), np.array(mesh.faces))
    rng = np.random.default_rng(0)
    for number in range(40):
        start = es.geometry.sample_surface(mesh, 1, rng=rng)
        face, weights, vector = int(start.simplices[0]), start.weights[0], rng.uniform(-1, 1, 2)
        one, two, three = mesh.vertices[mesh.faces[face]]
        x = (two - one) / np.linalg.norm(two - one)
        normal = np.cross(x, three - one)
        y = np.cross(normal / np.linalg.norm(normal), x)
        theirs = tracer.trace_geodesic_from_face(face, weights.tolist(), vector @ [x, y])
        ours = es.calculus.trace_geodesic(mesh, start, vector)
        np.testing.assert_allclose(ours.points[-1], theirs[-1], atol=1e-10, err_msg=str(number))
