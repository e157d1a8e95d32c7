"""Diagrams are stable, and blind to names and to what is done to the values in order."""

import numpy as np
from gudhi.hera import bottleneck_distance
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components

import eigenshape as es

some = settings(deadline=None, max_examples=60)
seeds = st.integers(0, 2**32 - 1)
SHAPES = (
    es.icosphere(1), es.shapes.torus(6, 5), es.shapes.grid(5, 4),
    es.geometry.disjoint_union(es.icosphere(0), es.shapes.torus(4, 3)),
    es.shapes.projective_plane(1),
)  # fmt: skip


def shape_and_values(seed, spread):
    """Whole numbers over eight, whose sums and halves are exact."""
    rng = np.random.default_rng(seed)
    shape = SHAPES[seed % len(SHAPES)]
    return shape, rng.integers(0, spread, shape.n_points) / 8, rng


def columns(pairs):
    return sorted(zip(pairs.births.tolist(), pairs.deaths.tolist(), strict=True))


@some
@given(seeds, st.sampled_from([2, 20, 1000]), st.integers(1, 200))
def test_diagrams_are_at_most_as_far_apart_as_their_functions(seed, spread, change):
    shape, values, rng = shape_and_values(seed, spread)
    others = values + rng.integers(-change, change + 1, shape.n_points) / 8
    one, two = (
        es.features.persistence_diagram(shape, values),
        es.features.persistence_diagram(shape, others),
    )
    most = np.abs(values - others).max()
    for kind in ("maxima", "minima"):
        first, second = (np.array(columns(getattr(each, kind))) for each in (one, two))
        # Hera takes births below deaths.
        ends = [np.sort(points.reshape(-1, 2), axis=1) for points in (first, second)]
        assert bottleneck_distance(*ends, 0.0) <= most
    lowest = [np.sort(each.components.births) for each in (one, two)]
    assert np.abs(lowest[0] - lowest[1]).max() <= most


@some
@given(seeds, st.sampled_from([2, 20, 1000]))
def test_names_of_points_do_not_matter(seed, spread):
    shape, values, rng = shape_and_values(seed, spread)
    new_of_old = rng.permutation(shape.n_points)
    points, named = np.empty_like(shape.points), np.empty_like(values)
    points[new_of_old], named[new_of_old] = shape.points, values
    other = es.SimplicialMesh(points, new_of_old[shape.simplices])
    one, two = (
        es.features.persistence_diagram(shape, values),
        es.features.persistence_diagram(other, named),
    )
    for kind in ("maxima", "minima", "components", "loops"):
        assert columns(getattr(one, kind)) == columns(getattr(two, kind))


@some
@given(seeds, st.sampled_from([2, 20, 1000]), st.integers(0, 1000))
def test_pairs_alive_at_a_level_are_the_components_there(seed, spread, level):
    shape, values, _ = shape_and_values(seed, spread)
    found, graph = es.features.persistence_diagram(shape, values), es.operators.edge_graph(shape)
    for pairs, ends, sign in (
        (found.minima, found.components.births, 1),
        (found.maxima, found.components.deaths, -1),
    ):
        inside = sign * values <= sign * level / 8
        alive = (sign * pairs.births <= sign * level / 8) & (sign * pairs.deaths > sign * level / 8)
        count = alive.sum() + (sign * ends <= sign * level / 8).sum()
        assert count == connected_components(graph[inside][:, inside], directed=False)[0]
