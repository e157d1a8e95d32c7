import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError


def pairs_of(pairs):
    return list(zip(pairs.birth_vertices.tolist(), pairs.death_vertices.tolist(), strict=True))


def path(values):
    """A curve whose vertices have these heights."""
    ends = np.column_stack([np.arange(len(values) - 1), np.arange(1, len(values))])
    return es.SimplicialMesh(np.arange(len(values), dtype=float)[:, None], ends), np.array(
        values, dtype=float
    )


@pytest.mark.long
def test_a_mountain_range_by_hand():
    found = es.features.persistence_diagram(*path([0, 5, 2, 3, 1, 9, 4]))
    assert pairs_of(found.maxima) == [(1, 4), (3, 2)]
    assert pairs_of(found.minima) == [(6, 5), (4, 1), (2, 3)]
    assert pairs_of(found.components) == [(0, 5)]
    assert found.maxima.births.tolist() == [5, 3]
    assert found.maxima.deaths.tolist() == [1, 2]
    assert found.maxima.persistence.tolist() == [4, 1]
    assert not len(found.loops.births)


def test_the_loops_of_a_standing_torus_are_born_and_die_at_its_saddles():
    # Height along x of a ring around z: the hole is seen between x = -0.6 and 0.6, and both loops last there.
    mesh = es.shapes.torus(24, 12, outer=1.0, inner=0.4)
    found = es.features.persistence_diagram(mesh, mesh.vertices[:, 0])
    assert found.components.births == pytest.approx(-1.4)
    assert found.components.deaths == pytest.approx(1.4)
    ends = sorted(zip(found.loops.births, found.loops.deaths, strict=True))
    np.testing.assert_allclose(ends, [[-0.6, 0.6], [0.6, -0.6]], atol=1e-12)


def test_a_constant_function_has_its_components_alone():
    mesh = es.geometry.disjoint_union(es.icosphere(0), es.shapes.grid(2, 2))
    found = es.features.persistence_diagram(mesh, np.full(mesh.n_vertices, 3.0))
    assert not len(found.maxima.births)
    assert not len(found.minima.births)
    assert found.components.births.tolist() == found.components.deaths.tolist() == [3.0, 3.0]


def test_points_are_joined_to_their_neighbors():
    angles = 2 * np.pi * np.arange(40) / 40
    cloud = es.PointCloud(np.column_stack([np.cos(angles), np.sin(angles)]), dim=1)
    found = es.features.persistence_diagram(cloud, np.cos(3 * angles), n_neighbors=2)
    assert len(found.maxima.births) == 2
    assert len(found.minima.births) == 2
    assert len(found.components.births) == 1
    assert found.loops is None
    apart = es.PointCloud(np.vstack([cloud.points, cloud.points + 9]), dim=1)
    assert (
        len(
            es.features.persistence_diagram(apart, np.tile(np.cos(3 * angles), 2)).components.births
        )
        == 2
    )


def test_minima_are_the_maxima_of_minus_the_function():
    mesh = es.shapes.torus(20, 12)
    values = np.random.default_rng(0).standard_normal(mesh.n_vertices)
    one, two = (
        es.features.persistence_diagram(mesh, values),
        es.features.persistence_diagram(mesh, -values),
    )
    assert pairs_of(one.minima) == pairs_of(two.maxima)
    assert pairs_of(one.maxima) == pairs_of(two.minima)
    assert sorted(pairs_of(one.loops)) == sorted((b, a) for a, b in pairs_of(two.loops))


@pytest.mark.long
@pytest.mark.parametrize("scale", [1e-150, 1e150])
def test_diagrams_scale_with_the_function(scale):
    mesh = es.shapes.torus(16, 10)
    rng = np.random.default_rng(0)
    values = rng.random(mesh.n_vertices)
    one = es.features.persistence_diagram(mesh, values)
    big = es.features.persistence_diagram(mesh, scale * values)
    for kind in ("maxima", "minima", "components", "loops"):
        assert pairs_of(getattr(big, kind)) == pairs_of(getattr(one, kind))
        np.testing.assert_array_equal(
            getattr(big, kind).persistence,
            np.abs(scale * getattr(one, kind).births - scale * getattr(one, kind).deaths),
        )


def test_bad_input_is_named():
    mesh = es.shapes.grid(1, 1)
    with pytest.raises(InvalidParameterError, match="entry 2 is nan"):
        es.features.persistence_diagram(mesh, [0, 1, np.nan, 2])
    with pytest.raises(InvalidParameterError, match=r"n_neighbors must lie in 1\.\.3; it is 10"):
        es.features.persistence_diagram(es.PointCloud(mesh.vertices), [0, 1, 2, 3])
    with pytest.raises(InvalidShapeError, match=r"face 0 is \[0, 0, 1\]"):
        es.features.persistence_diagram(es.TriangleMesh(mesh.vertices, [[0, 0, 1]]), [0, 1, 2, 3])


def test_results_are_read_only_and_sorted():
    mesh = es.shapes.torus(20, 12)
    found = es.features.persistence_diagram(
        mesh, np.random.default_rng(0).standard_normal(mesh.n_vertices)
    )
    for pairs in (found.maxima, found.minima, found.components, found.loops):
        assert (np.diff(pairs.persistence) <= 0).all()
        for array in vars(pairs).values():
            assert not array.flags.writeable
