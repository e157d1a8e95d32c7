import numpy as np
import pytest

from eigenshape.geometry.facets import facet_components, facet_table
from eigenshape.geometry.measure import edge_lengths, face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import pieces, split_long_edges, subdivide
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.domains import ball, circle, interval
from eigenshape.shapes.surfaces import grid


def test_an_interval_by_hand():
    halved = subdivide(interval(2, 4.0))
    assert halved.points.ravel().tolist() == [0, 2, 4, 1, 3]
    assert halved.simplices.tolist() == [[0, 3], [3, 1], [1, 4], [4, 2]]


def test_a_tetrahedron_by_hand():
    # Four at the corners, and the octahedron between cut in four along the edge between 02 and 13.
    named = {tuple(sorted(map(tuple, np.sort(piece, axis=1).tolist()))) for piece in pieces(3)}
    corners = {tuple(sorted((min(a, b), max(a, b)) for b in range(4))) for a in range(4)}
    assert corners < named
    assert all({(0, 2), (1, 3)} <= set(piece) for piece in named - corners)
    assert len(named) == 8


@pytest.mark.parametrize("dim", [1, 2, 3, 4, 5])
def test_the_pieces_are_2_to_the_m_of_equal_volume(dim):
    points = np.concatenate([np.zeros((1, dim)), np.tril(np.ones((dim, dim)))])
    whole = SimplicialMesh(points, [list(range(dim + 1))])
    halved = subdivide(whole)
    assert halved.n_simplices == 2**dim
    np.testing.assert_allclose(
        simplex_volumes(halved), simplex_volumes(whole)[0] / 2**dim, rtol=1e-12
    )


@pytest.mark.parametrize(
    "mesh",
    [circle(5), SimplicialMesh(grid(3, 2).vertices, grid(3, 2).faces), ball(4), subdivide(ball(2))],
)
def test_neighbors_match(mesh):
    rng = np.random.default_rng(0)
    names = rng.permutation(mesh.n_points)
    points = np.empty_like(mesh.points)
    points[names] = mesh.points
    mixed = SimplicialMesh(points, rng.permuted(names[mesh.simplices], axis=1))
    halved = subdivide(mixed)
    before, after = facet_table(mixed), facet_table(halved)
    assert after.n_simplices.max() == 2
    assert len(after.boundary) == 2 ** (mesh.dim - 1) * len(before.boundary)
    assert facet_components(after)[0] == facet_components(before)[0]
    assert simplex_volumes(halved).sum() == pytest.approx(simplex_volumes(mixed).sum(), rel=1e-12)
    np.testing.assert_array_equal(halved.points[: mesh.n_points], mixed.points)


def test_shapes_stay_few():
    mesh = SimplicialMesh(np.random.default_rng(1).standard_normal((4, 3)), [[0, 1, 2, 3]])
    for _ in range(3):
        mesh = subdivide(mesh)
    corners = mesh.points[mesh.simplices]
    first, second = np.triu_indices(4, 1)
    lengths = np.sort(np.linalg.norm(corners[:, first] - corners[:, second], axis=2), axis=1)
    assert len(np.unique(np.round(lengths, 9), axis=0)) <= 3


def test_long_edges_are_split_and_no_point_moves():
    mesh = make_creature("quadruped", n_vertices=500)
    longest = 0.6 * edge_lengths(mesh).max()
    fine, origins = split_long_edges(mesh, longest, 10_000)
    assert edge_lengths(fine).max() <= longest
    assert (fine.vertices[: mesh.n_vertices] == mesh.vertices).all()
    assert origins[: mesh.n_vertices].tolist() == list(range(mesh.n_vertices))
    away = np.linalg.norm(fine.vertices - mesh.vertices[origins], axis=1)
    assert away.max() < edge_lengths(mesh).max()
    # The faces lie in those of the mesh, face the same way, and leave no gap.
    assert face_areas(fine).sum() == pytest.approx(face_areas(mesh).sum(), rel=1e-12)
    before, after = (signed_volume(each) for each in (mesh, fine))
    assert after == pytest.approx(before, rel=1e-12)
    assert fine.n_vertices - fine.n_faces / 2 == mesh.n_vertices - mesh.n_faces / 2


def signed_volume(mesh):
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return np.einsum("fi,fi->", a, np.cross(b, c)) / 6


def test_split_edges_do_not_depend_on_the_order_of_corners():
    mesh = make_creature("hand", n_vertices=500)
    rolled = TriangleMesh(mesh.vertices, mesh.faces[::-1, [1, 2, 0]])
    length = float(np.median(edge_lengths(mesh)))
    points = [split_long_edges(each, length, 10_000)[0].vertices for each in (mesh, rolled)]
    one, other = (each[np.lexsort(each.T)] for each in points)
    assert np.allclose(one, other, rtol=0, atol=1e-15)


def test_edges_are_split_until_there_are_as_many_vertices_as_wanted():
    mesh = grid(2, 2)
    same, origins = split_long_edges(mesh, 0.01, mesh.n_vertices)
    assert same is mesh
    assert origins.tolist() == list(range(9))
    assert split_long_edges(mesh, 10.0, 1000)[0] is mesh
    assert mesh.n_vertices < split_long_edges(mesh, 0.01, 40)[0].n_vertices <= 40
