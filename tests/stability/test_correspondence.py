"""One-to-one correspondences: by hand, by brute force, planted, blocked, and those of Theorem 4.2.1."""

from itertools import permutations

import numpy as np
import pytest
import scipy.sparse as sp
from changed_shapes import bumped, handled
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import maximum_bipartite_matching

import eigenshape as es

some = settings(deadline=None, max_examples=80)
seeds = st.integers(0, 2**32 - 1)


def longest(one, two, partners):
    return np.linalg.norm(one - two[partners], axis=1).max()


def throw(shape, n, seed):
    return es.geometry.sample_surface(shape, n, rng=np.random.default_rng(seed))


# Bottleneck.


def test_a_bottleneck_by_hand():
    one, two = [[0.0], [1.0], [2.0]], [[2.5], [0.5], [1.5]]
    found = es.stability.bottleneck_matching(one, two)
    assert found.partners.tolist() == [1, 2, 0]
    assert found.distance == 0.5
    # The nearest neighbors' greedy choice would leave the last point a move of 3.
    greedy = es.stability.bottleneck_matching([[0.0], [1.0]], [[1.1], [3.0]])
    assert greedy.partners.tolist() == [0, 1]
    assert greedy.distance == 2.0
    with pytest.raises(ValueError, match="read-only"):
        found.partners[0] = 1


@some
@given(seeds, st.integers(1, 6), st.integers(1, 3), st.sampled_from([2, 4, 1000]))
def test_no_permutation_moves_less(seed, n, dim, spread):
    one, two = np.random.default_rng(seed).integers(0, spread, (2, n, dim)).astype(float)
    found = es.stability.bottleneck_matching(one, two)
    best = min(longest(one, two, list(order)) for order in permutations(range(n)))
    assert found.distance == best == longest(one, two, found.partners)
    assert sorted(found.partners) == list(range(n))


@pytest.mark.long
@some
@given(seeds, st.integers(1, 60), st.sampled_from([1e-100, 1.0, 1e100]))
def test_laws_of_the_bottleneck(seed, n, scale):
    rng = np.random.default_rng(seed)
    one, two, three = scale * rng.random((3, n, 2))
    found = es.stability.bottleneck_matching(one, two)
    assert found.distance == longest(one, two, found.partners)
    assert (
        found.distance
        == es.stability.bottleneck_matching(two, one).distance
        <= longest(one, two, np.arange(n))
    )
    detour = (
        es.stability.bottleneck_matching(one, three).distance
        + es.stability.bottleneck_matching(three, two).distance
    )
    assert found.distance <= detour * (1 + 1e-12)
    order = rng.permutation(n)
    assert es.stability.bottleneck_matching(one, one[order]).distance == 0
    assert es.stability.bottleneck_matching(one, two[order]).distance == found.distance
    assert es.stability.bottleneck_matching(16 * one, 16 * two).distance == 16 * found.distance


def test_a_small_move_is_found_among_thousands():
    rng = np.random.default_rng(0)
    one = rng.random((4000, 2))
    order = rng.permutation(4000)
    shift = rng.uniform(-1e-6, 1e-6, one.shape)
    found = es.stability.bottleneck_matching(one, (one + shift)[order])
    np.testing.assert_array_equal(order[found.partners], np.arange(4000))
    assert found.distance == pytest.approx(np.linalg.norm(shift, axis=1).max(), rel=1e-9)


def test_one_point_far_away_decides():
    rng = np.random.default_rng(1)
    one, two = rng.random((2, 300, 3))
    one[17] = [1e6, 0, 0]
    found = es.stability.bottleneck_matching(one, two)
    assert found.distance == np.linalg.norm(one[17] - two, axis=1).min()


def test_point_sets_that_do_not_correspond_are_named():
    with pytest.raises(
        es.InvalidParameterError, match=r"same shape \(n, d\).*these are \(2, 1\) and \(1, 1\)"
    ):
        es.stability.bottleneck_matching([[0], [1]], [[0]])
    with pytest.raises(es.InvalidParameterError, match=r"these are \(1, 1\) and \(1, 2\)"):
        es.stability.bottleneck_matching([[0]], [[0, 1]])
    with pytest.raises(es.InvalidParameterError, match="must have the same shape"):
        es.stability.bottleneck_matching(np.empty((0, 2)), np.empty((0, 2)))
    with pytest.raises(es.InvalidShapeError, match="point 1 is"):
        es.stability.bottleneck_matching([[0], [np.inf]], [[0], [1]])


# Matching.


def neighbors(graph, rows):
    return np.unique(
        np.concatenate([graph.indices[graph.indptr[row] : graph.indptr[row + 1]] for row in rows])
    )


@pytest.mark.long
@some
@given(seeds, st.integers(1, 40), st.integers(1, 40), st.floats(0, 0.3))
def test_as_many_are_matched_as_by_scipy_and_the_blocked_prove_it(seed, n, k, share):
    graph = sp.csr_array((np.random.default_rng(seed).random((n, k)) < share).astype(float))
    found = es.stability.maximum_matching(graph)
    rows = np.flatnonzero(found.partners >= 0)
    assert len(np.unique(found.partners[rows])) == found.n_matched == len(rows)
    assert (graph.todense()[rows, found.partners[rows]] == 1).all()
    assert found.n_matched == (maximum_bipartite_matching(graph, perm_type="column") >= 0).sum()
    assert found.is_perfect == (found.n_matched == n)
    if found.is_perfect:
        assert not len(found.blocked)
    else:
        assert len(found.blocked) - len(neighbors(graph, found.blocked)) == n - found.n_matched


def test_a_planted_matching_is_found():
    rng = np.random.default_rng(2)
    order = rng.permutation(2000)
    noise = sp.random_array((2000, 2000), density=0.0005, rng=rng)
    planted = sp.csr_array((np.ones(2000), (np.arange(2000), order)), shape=(2000, 2000))
    assert es.stability.maximum_matching(planted + noise).is_perfect


@pytest.mark.long
def test_five_rows_with_three_columns_are_refused():
    graph = np.ones((9, 9))
    graph[2:7, 3:] = 0
    found = es.stability.maximum_matching(sp.csr_array(graph))
    assert not found.is_perfect
    assert found.n_matched == 7
    assert found.blocked.tolist() == [2, 3, 4, 5, 6]
    stored = sp.csr_array(np.ones((2, 2)))
    stored.data[:] = [1, 0, 1, 0]  # entries that are stored and 0 join nothing
    assert es.stability.maximum_matching(stored).n_matched == 1


# Theorem 4.2.1.


def test_the_reach_of_the_theorem():
    assert es.stability.matching_reach(8) == 3
    assert es.stability.matching_reach(2) == 6
    with pytest.raises(es.InvalidParameterError, match="mu must be positive"):
        es.stability.matching_reach(0)


@pytest.mark.parametrize("delta", [0.2, 0.5])
def test_nodes_are_apart_and_cover(delta):
    mesh = es.icosphere(3)  # made uneven, so that no two vertices are equally far
    mesh = es.TriangleMesh(
        mesh.vertices + 0.02 * np.random.default_rng(0).random(mesh.vertices.shape), mesh.faces
    )
    found = es.stability.anchor_nodes(mesh, delta, start=5)
    between = es.geometry.geodesic_distances(mesh, found.vertices)
    apart = between[:, found.vertices] + np.where(np.eye(len(found.vertices)), np.inf, 0)
    assert apart.min() >= delta
    assert between.min(axis=0).max() == pytest.approx(found.reached)
    assert found.reached < delta
    assert found.vertices[0] == 5
    points = throw(mesh, 2000, 0).points
    assert np.linalg.norm(points[:, None] - found.points, axis=2).min(axis=1).max() <= found.cover
    small = es.stability.anchor_nodes(
        es.TriangleMesh(mesh.vertices * 1e-100, mesh.faces), 1e-100 * delta, start=5
    )
    np.testing.assert_array_equal(small.vertices, found.vertices)


def test_each_piece_has_its_nodes():
    mesh = es.geometry.disjoint_union(es.icosphere(1), es.icosphere(1))
    found = es.stability.anchor_nodes(mesh, 4.0)
    assert len(found.vertices) == 2


def test_what_is_no_distance_is_named():
    mesh, other, labels, others = bumped()
    changed = es.stability.measure_perturbation(mesh, other, regions_one=labels, regions_two=others)
    with pytest.raises(es.InvalidParameterError, match="delta must be positive"):
        es.stability.anchor_nodes(mesh, 0.0)
    with pytest.raises(es.InvalidParameterError, match="start must lie in"):
        es.stability.anchor_nodes(mesh, 1.0, start=10**6)
    with pytest.raises(es.InvalidParameterError, match="delta must be positive"):
        es.stability.anchor_region(mesh.vertices, mesh.vertices, -1.0)
    with pytest.raises(es.InvalidParameterError, match="rho must be positive"):
        es.stability.witness_region(changed, throw(other, 5, 0), mesh.vertices, 1.0, rho=-1.0)
    elsewhere = throw(es.icosphere(3), 5, 0)
    with pytest.raises(es.InvalidParameterError, match="Points must lie on the second shape"):
        es.stability.witness_region(changed, elsewhere, mesh.vertices, 1.0, rho=3.0)


PAIRS = {
    "raised": bumped(),
    "with a handle": handled(),
    "unchanged": (es.icosphere(3), es.icosphere(3), np.full(1280, -1), np.full(1280, -1)),
}


def swayed_pair(name):
    """A pair whose map moves points outside too."""
    mesh, other, labels, others = PAIRS[name]
    swayed = es.TriangleMesh(
        other.vertices + 0.03 * np.sin(3 * other.vertices[:, ::-1]), other.faces
    )
    return es.stability.measure_perturbation(mesh, swayed, regions_one=labels, regions_two=others)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("factor", [1.0, 1.6])
def test_no_edge_is_longer_than_the_claims_say(name, factor):
    changed = swayed_pair(name)
    closeness = es.stability.measure_closeness(changed)
    lengths = np.append(closeness.radii, closeness.displacement.max())
    delta, rho = factor * lengths.max(), 3.0
    nodes = es.stability.anchor_nodes(changed.one, delta)
    points, images = throw(changed.one, 400, 1), throw(changed.two, 400, 2)
    graph = es.stability.correspondence_graph(
        changed, points, images, nodes=nodes.points, delta=delta, rho=rho
    )
    coo = graph.tocoo()
    lengths = np.linalg.norm(points.points[coo.row] - images.points[coo.col], axis=1)
    anomalous = changed.regions_two[images.simplices[coo.col]] >= 0
    from_node = np.linalg.norm(nodes.points[:, None] - points.points, axis=2).min(axis=0)
    assert from_node.max() <= nodes.cover
    excess = max(0.0, nodes.cover - delta)
    assert lengths[~anomalous].max() <= (rho + 3) * delta + excess
    assert lengths[anomalous].max(initial=0) <= (rho + 4) * delta + excess
    assert lengths.max() > rho * delta / 2  # the graph reaches as far as it should


@pytest.mark.parametrize("name", PAIRS)
def test_the_region_of_a_set_is_that_of_its_nodes_and_the_graph_has_their_points(name):
    """Observation 4.2.2, (i)."""
    changed = swayed_pair(name)
    delta, rho = 0.25, 1.2
    nodes = es.stability.anchor_nodes(changed.one, delta).points
    points, images = throw(changed.one, 200, 3), throw(changed.two, 300, 4)
    each = np.array(
        [es.stability.witness_region(changed, images, node[None], delta, rho=rho) for node in nodes]
    )
    chosen = np.random.default_rng(0).random(len(nodes)) < 0.1
    np.testing.assert_array_equal(
        es.stability.witness_region(changed, images, nodes[chosen], delta, rho=rho),
        each[chosen].any(axis=0),
    )
    assert 0 < each.sum() < each.size
    nearest = np.linalg.norm(points.points[:, None] - nodes, axis=2).argmin(axis=1)
    graph = es.stability.correspondence_graph(
        changed, points, images, nodes=nodes, delta=delta, rho=rho
    )
    np.testing.assert_array_equal(graph.todense() == 1, each[nearest])
    np.testing.assert_array_equal(
        es.stability.anchor_region(points.points, nodes[chosen], delta),
        np.linalg.norm(points.points[:, None] - nodes[chosen], axis=2).min(axis=1) <= delta,
    )


def test_all_of_a_region_is_a_witness_as_soon_as_its_counterpart_is_met():
    changed = swayed_pair("with a handle")
    images = throw(changed.two, 3000, 5)
    inside = changed.regions_two[images.simplices] == 0
    region = changed.one.vertices[changed.one.faces[changed.regions_one == 0]].reshape(-1, 3)
    node = np.array([[2.0, 0.0, 0.0]])
    away = np.linalg.norm(region - node, axis=1).min()  # the nearest point of this cap is a corner
    for rho, met in [(away * 1.001 - 1, True), (away * 0.98 - 1, False)]:
        found = es.stability.witness_region(changed, images, node, 1.0, rho=rho)
        assert (found[inside] == met).all()
        assert found[~inside].any()


def test_observation_422_is_short_by_delta_inside_a_region():
    """A disc of radius δ that begins (ρ+1)δ from a node belongs to its witness region, up to (ρ+3)δ away.

    And a point on the other side of the node, δ from it and (ρ+4)δ from the disc's far end, is joined to all of it.
    """
    delta, rho = 1.0, 3.0
    mesh = es.shapes.grid(40, 12, width=10.0, height=3.0)
    away = np.linalg.norm(mesh.vertices - [7.0, 1.5, 0], axis=1)
    disc = (away[mesh.faces].max(axis=1) <= delta).astype(int) - 1
    changed = es.stability.measure_perturbation(mesh, mesh, regions_one=disc, regions_two=disc)
    assert es.stability.measure_closeness(changed).radii[0] <= delta
    images = throw(mesh, 20_000, 6)
    first = mesh.vertices[mesh.faces[disc == 0]].reshape(-1, 3)[:, 0].min()
    node = np.array([[first - (rho + 1) * delta + 1e-9, 1.5, 0.0]])
    found = es.stability.witness_region(changed, images, node, delta, rho=rho)
    farthest = np.linalg.norm(images.points[found] - node, axis=1).max()
    assert (rho + 2) * delta + 0.7 < farthest <= (rho + 3) * delta
    point = es.geometry.SurfacePoints(
        node - [[delta, 0, 0]], np.zeros(1, dtype=int), np.ones((1, 3)) / 3
    )
    graph = es.stability.correspondence_graph(
        changed, point, images, nodes=node, delta=delta, rho=rho
    )
    longest_edge = np.linalg.norm(images.points[graph.indices] - point.points, axis=1).max()
    assert (rho + 3) * delta + 0.7 < longest_edge <= (rho + 4) * delta


def test_many_points_of_two_close_shapes_have_a_perfect_matching_and_few_have_not():
    changed = swayed_pair("with a handle")
    delta = float(es.stability.measure_closeness(changed).radii.max())
    nodes = es.stability.anchor_nodes(changed.one, delta).points
    points, images = throw(changed.one, 1000, 7), throw(changed.two, 1000, 8)
    graph = es.stability.correspondence_graph(
        changed, points, images, nodes=nodes, delta=delta, rho=3.0
    )
    found = es.stability.maximum_matching(graph)
    assert found.is_perfect
    assert longest(points.points, images.points, found.partners) <= 7 * delta
    tight = es.stability.correspondence_graph(
        changed, points, images, nodes=nodes, delta=0.05, rho=0.2
    )
    assert not es.stability.maximum_matching(tight).is_perfect


def test_pairs_that_would_not_fit_are_refused(monkeypatch):
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 1e5)
    near, far = np.random.default_rng(0).random((2, 40, 3))
    es.stability.bottleneck_matching(near, near + 1e-3)  # few pairs
    with pytest.raises(
        es.InvalidShapeError, match=r"Pairs of near points must fit .*; for 1.6e\+03 pairs within"
    ):
        es.stability.bottleneck_matching(near, far + 100)
