import numpy as np
import pytest

from eigenshape.geometry.facets import facet_components, facet_table
from eigenshape.geometry.resolution.subdivision import pieces, subdivide
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
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
