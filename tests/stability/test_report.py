"""Reports on two shapes: what they say of shapes whose difference is known."""

import numpy as np
import pytest

import eigenshape as es

PLAN = es.stability.StabilityPlan(k=8, n_samples=300)


def moved(mesh, height):
    waves = np.sin(3 * mesh.vertices[:, :1]) * np.cos(2 * mesh.vertices[:, 1:2])
    return es.TriangleMesh(
        mesh.vertices + height * waves * es.geometry.vertex_normals(mesh), mesh.faces
    )


@pytest.fixture(scope="module")
def torus():
    return es.shapes.torus(40, 20)


@pytest.fixture(scope="module")
def bulged(torus):
    return es.compare_shapes(torus, moved(torus, 0.05), PLAN)


def test_a_shape_is_as_itself(torus):
    found = es.compare_shapes(torus, torus, PLAN)
    assert found.spectra.index_distance == 0.0
    assert found.closeness.delta == found.delta == found.distance == 0.0
    assert found.angles.angles.max() < 1e-6
    assert found.times.low_reason == "spacing"
    assert not any(change.change > 2 * change.floor for change in found.changes)
    assert not found.spectra.proved_changes.any()


def test_the_map_from_vertex_to_vertex_is_measured(torus, bulged):
    other = moved(torus, 0.05)
    steps = np.linalg.norm(other.vertices - torus.vertices, axis=1)
    assert bulged.delta == pytest.approx(steps.max())
    assert bulged.distance <= steps.max() * (1 + 1e-9)
    assert bulged.closeness.delta == pytest.approx(
        es.stability.measure_closeness(es.stability.measure_perturbation(torus, other)).delta
    )
    spectra = [
        es.solve_spectrum(es.cotangent_laplacian(mesh), 8).eigenvalues for mesh in (torus, other)
    ]
    assert bulged.spectra.index_distance == pytest.approx(np.abs(spectra[0] - spectra[1]).max())
    assert bulged.spectra.proved_changes[1:].all()
    assert bulged.angles.angles.max() > 0
    assert (bulged.angles.angles <= bulged.angles.bounds + 1e-9).all()


def test_no_change_exceeds_weyls_bound_and_none_of_these_ours(bulged):
    for change in bulged.changes:
        assert change.change <= change.weyl * (1 + 1e-5) <= change.bound * (1 + 2e-5)
        assert change.admissible
    times = [change.t for change in bulged.changes]
    assert times == pytest.approx(np.geomspace(bulged.times.low, bulged.times.high, 4))
    # Each heat time has Laplacians of its own.
    assert len({change.change for change in bulged.changes}) == len(times)


def test_a_report_can_be_read(bulged):
    text = bulged.explain()
    for words in (
        "change by",
        "In space, each point",
        "Reliable heat times are",
        "raph Laplacians of such samples",
        "Eigenspaces, from vertex to vertex",
    ):
        assert words in text


@pytest.mark.long
def test_other_meshes_are_matched_by_points_or_by_a_map(torus):
    finer = es.geometry.subdivide(torus)
    found = es.compare_shapes(torus, finer, PLAN)
    assert found.closeness is None
    assert found.distance < 0.1  # edges are twice as long
    assert "between 300 matched points" in found.explain()
    told = es.compare_shapes(torus, finer, PLAN, partners=np.arange(torus.n_vertices))
    assert told.closeness.delta == 0.0
    assert told.angles.angles.max() < np.radians(5)


@pytest.mark.long
def test_points_and_meshes_can_be_compared(torus):
    rng = np.random.default_rng(1)
    cloud = es.PointCloud(es.geometry.sample_surface(torus, 1200, rng=rng).points)
    found = es.compare_shapes(torus, cloud, PLAN)
    assert found.closeness is None
    assert len(found.distances[1]) == 1200
    again = es.compare_shapes(torus, cloud, PLAN)
    assert found.changes == again.changes


@pytest.mark.long
def test_a_report_follows_the_unit(torus):
    other = moved(torus, 0.05)
    small = [es.TriangleMesh(mesh.vertices * 1e-40, mesh.faces) for mesh in (torus, other)]
    one, two = es.compare_shapes(torus, other, PLAN), es.compare_shapes(*small, PLAN)
    assert two.delta == pytest.approx(1e-40 * one.delta)
    assert two.times.low == pytest.approx(1e-80 * one.times.low)
    assert [c.change for c in two.changes] == pytest.approx(
        [c.change for c in one.changes], rel=1e-6
    )
    assert two.angles.angles == pytest.approx(one.angles.angles, rel=1e-5, abs=1e-6)


def test_brackets_prove_changes_of_the_shapes(torus):
    far = es.compare_shapes(
        torus,
        es.TriangleMesh(2 * torus.vertices, torus.faces),
        es.stability.StabilityPlan(k=8, n_samples=300, brackets=True),
    )
    assert far.spectra.bracketed
    assert far.spectra.proved_changes[1:].all()


@pytest.mark.long
def test_a_change_that_is_too_large_leaves_no_heat_time(torus):
    away = es.TriangleMesh(torus.vertices + 3.0, torus.faces)
    found = es.compare_shapes(torus, away, PLAN)
    assert found.times.empty
    assert not any(change.admissible for change in found.changes)
    assert found.times.low_reason == "closeness"
    assert "No heat time is reliable" in found.explain()
    asked = es.compare_shapes(
        torus, away, es.stability.StabilityPlan(k=8, n_samples=300, times=(0.1,))
    )
    assert [change.t for change in asked.changes] == [0.1]
    assert not asked.changes[0].admissible


def test_bad_input_is_named_before_anything_is_computed(torus):
    cloud = es.PointCloud(np.random.default_rng(0).random((150, 3)))
    with pytest.raises(es.InvalidParameterError, match=r"theirs are 2 in R\^3 and 3 in R\^3"):
        es.compare_shapes(torus, es.shapes.box(2, 2, 2), PLAN)
    with pytest.raises(
        es.InvalidParameterError,
        match=r"at least 200 points, because it is halved; it is PointCloud\(150",
    ):
        es.compare_shapes(torus, cloud, PLAN)
    with pytest.raises(es.InvalidParameterError, match="brackets and partners are for meshes"):
        es.compare_shapes(torus, cloud, PLAN, partners=[0])
    with pytest.raises(es.InvalidParameterError, match="there are 3 for 800"):
        es.compare_shapes(torus, torus, PLAN, partners=[0, 1, 2])
    with pytest.raises(es.InvalidParameterError, match="partners must"):
        es.compare_shapes(torus, torus, PLAN, partners=np.arange(1, 801))
    for wrong, told in (
        (es.stability.StabilityPlan(k=1), "k must"),
        (es.stability.StabilityPlan(n_samples=5), "n_samples must"),
        (es.stability.StabilityPlan(times=(-1.0,)), "times must be positive"),
    ):
        with pytest.raises(es.InvalidParameterError, match=told):
            es.compare_shapes(torus, torus, wrong)
