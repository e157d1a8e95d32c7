"""How close two shapes are: by hand, after moves and changes of unit, and what is no perturbation."""

import numpy as np
import pytest
from changed_shapes import bumped, handled

import eigenshape as es


def closeness_of(mesh, other, labels, others):
    return es.stability.measure_closeness(
        es.stability.measure_perturbation(mesh, other, regions_one=labels, regions_two=others)
    )


def map_closeness(mesh, images):
    """Measure the closeness of a mesh and its image, whose faces all correspond."""
    return closeness_of(mesh, type(mesh)(images, mesh.simplices), None, None)


def test_a_stretched_square_by_hand():
    mesh = es.shapes.grid(4, 4)
    found = map_closeness(mesh, mesh.vertices * [1.1, 1, 1])
    assert found.displacement.max() == pytest.approx(0.1)
    np.testing.assert_allclose(found.jacobians, 1.1)
    assert found.delta == pytest.approx(0.1)
    assert found.size == pytest.approx(1)
    assert not len(found.radii)
    moved = map_closeness(mesh, mesh.vertices + np.array([0, 0, 0.3]))
    assert (moved.delta, moved.limited_by) == (pytest.approx(0.3), "displacement")
    assert "the displacement of points is the largest change" in moved.explain()
    shrunk = map_closeness(mesh, mesh.vertices * [0.5, 0.5, 1])
    assert (shrunk.delta, shrunk.limited_by) == (pytest.approx(0.75), "Jacobian")
    same = map_closeness(mesh, mesh.vertices)
    assert (same.delta, same.limited_by) == (0, "nothing")
    assert "the shapes are the same" in same.explain()


def test_lengths_count_by_the_size_of_the_shape():
    mesh = es.shapes.grid(2, 2, width=3, height=3)
    found = map_closeness(mesh, mesh.vertices + np.array([0, 0, 0.3]))
    assert found.size == pytest.approx(3)
    assert found.delta == pytest.approx(0.1)


def test_a_changed_cap():
    mesh, other, labels, others = bumped()
    found = closeness_of(mesh, other, labels, others)
    assert (found.displacement == 0).all()
    assert (found.jacobians == 1).all()
    corners = np.concatenate(
        [mesh.vertices[mesh.faces[labels == 0]], other.vertices[other.faces[others == 0]]]
    )
    assert found.radii[0] == pytest.approx(
        es.geometry.enclosing_ball(corners.reshape(-1, 3)).radius
    )
    areas = [es.geometry.simplex_volumes(each) for each in (mesh, other)]
    assert found.volume_ratios[0] == pytest.approx(
        areas[1][others == 0].sum() / areas[0][labels == 0].sum()
    )
    assert found.delta == max(found.radii[0] / found.size, found.volume_ratios[0] - 1)
    assert found.limited_by == "volume"
    assert "the volume of a region" in found.explain()
    low = closeness_of(*bumped(height=0.01))
    assert low.limited_by == "ball"
    assert "the size of the regions is the largest change" in low.explain()


def test_topology_may_change_inside():
    mesh, other, labels, others = handled()
    assert es.geometry.euler_characteristic(mesh) == 2
    assert es.geometry.euler_characteristic(other) == 0
    assert es.geometry.is_manifold(other)
    found = closeness_of(mesh, other, labels, others)
    assert found.delta < 0.3
    assert found.displacement.max() == 0


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_closeness_keeps_its_unit_and_delta_has_none(scale):
    mesh, other, labels, others = bumped()
    swayed = es.TriangleMesh(other.vertices + 0.1 * np.sin(other.vertices[:, ::-1]), other.faces)
    plain = closeness_of(mesh, swayed, labels, others)
    big = closeness_of(
        es.TriangleMesh(scale * mesh.vertices, mesh.faces),
        es.TriangleMesh(scale * swayed.vertices, swayed.faces),
        labels,
        others,
    )
    assert big.delta == pytest.approx(plain.delta, rel=1e-12)
    assert big.limited_by == plain.limited_by
    assert big.size == pytest.approx(scale * plain.size, rel=1e-12)
    np.testing.assert_allclose(big.displacement, scale * plain.displacement, rtol=1e-12)
    np.testing.assert_allclose(big.jacobians, plain.jacobians, rtol=1e-12)
    np.testing.assert_allclose(big.radii, scale * plain.radii, rtol=1e-12)


def test_closeness_does_not_see_how_both_are_turned():
    mesh, other, labels, others = bumped()
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turned = [
        es.TriangleMesh(each.vertices @ turn + [1, 2, 3], each.faces) for each in (mesh, other)
    ]
    assert closeness_of(*turned, labels, others).delta == pytest.approx(
        closeness_of(mesh, other, labels, others).delta, rel=1e-9
    )


def test_solids_and_curves_are_measured_too():
    solid = es.shapes.box(2, 2, 2)
    assert map_closeness(solid, solid.points * 1.1).delta == pytest.approx(1.1**3 - 1)
    curve = es.SimplicialMesh([[0.0, 0], [1, 0], [1, 1]], [[0, 1], [1, 2]])
    found = map_closeness(curve, curve.points * 1.01)
    assert found.size == pytest.approx(2)
    assert found.delta == pytest.approx(0.01)


def test_all_may_be_anomalous():
    mesh = es.icosphere(1)
    labels = np.zeros(mesh.n_faces, dtype=int)
    found = closeness_of(mesh, es.icosphere(2), labels, np.zeros(320, dtype=int))
    assert found.delta * found.size == pytest.approx(1, rel=1e-9)
    assert len(found.displacement) == len(found.jacobians) == 0


def test_vertices_go_where_their_faces_go():
    mesh, other, labels, others = bumped()
    order = np.random.default_rng(0).permutation(other.n_vertices)
    renamed = es.TriangleMesh(other.vertices[order], np.argsort(order)[other.faces])
    changed = es.stability.measure_perturbation(
        mesh, renamed, regions_one=labels, regions_two=others
    )
    pairs = es.stability.vertex_pairs(changed)
    assert len(pairs) == len(np.unique(mesh.faces[labels < 0]))
    np.testing.assert_array_equal(mesh.vertices[pairs[:, 0]], renamed.vertices[pairs[:, 1]])
    assert es.stability.measure_closeness(changed).displacement.max() == 0
    assert changed.n_regions == 1
    with pytest.raises(ValueError, match="read-only"):
        changed.regions_one[0] = 3


def test_what_is_no_perturbation_is_named():
    mesh, other, labels, _ = bumped()
    square = es.shapes.grid(2, 2)
    turned = es.TriangleMesh(mesh.vertices, np.roll(mesh.faces, 1, axis=1))
    with pytest.raises(
        es.InvalidParameterError, match=r"vertex 0 of `one` would be vertices \d+ and \d+ of `two`"
    ):
        es.stability.measure_perturbation(mesh, turned)
    glued = es.TriangleMesh(square.vertices, np.where(square.faces == 8, 0, square.faces))
    with pytest.raises(
        es.InvalidParameterError, match="vertex 0 of `two` would be vertices 0 and 8 of `one`"
    ):
        es.stability.measure_perturbation(square, glued)
    with pytest.raises(
        es.InvalidParameterError, match="must have the same dimensions to correspond"
    ):
        es.stability.measure_perturbation(mesh, es.shapes.box(1, 1, 1))
    with pytest.raises(
        es.InvalidParameterError, match="must lie outside the regions; 320 and 292 do"
    ):
        es.stability.measure_perturbation(
            mesh, es.TriangleMesh(mesh.vertices, mesh.faces[labels < 0])
        )
    with pytest.raises(es.InvalidParameterError, match="regions_two has no face in region 0"):
        es.stability.measure_perturbation(mesh, other, regions_one=labels)
    with pytest.raises(
        es.InvalidParameterError, match=r"regions_one must hold one whole number per face.*\(3,\)"
    ):
        es.stability.measure_perturbation(mesh, other, regions_one=[0, 0, 0])
    with pytest.raises(
        es.InvalidParameterError, match="must number regions from 0, with -1 outside; face 0 has -2"
    ):
        es.stability.measure_perturbation(mesh, mesh, regions_one=np.full(mesh.n_faces, -2))


def test_regions_must_be_apart_and_their_boundaries_correspond():
    mesh = es.shapes.grid(6, 6)
    touching = np.full(mesh.n_faces, -1)
    touching[[0, 1]] = [0, 1]
    with pytest.raises(
        es.InvalidParameterError, match=r"must not touch; in regions_one, vertex \d+ is in"
    ):
        es.stability.measure_perturbation(mesh, mesh, regions_one=touching, regions_two=touching)
    one, two = np.full((2, mesh.n_faces), -1)
    one[0], one[5] = 0, 1
    two[0], two[5] = 1, 0
    with pytest.raises(
        es.InvalidParameterError, match=r"mapped onto that of its counterpart \(C1\); for region 0"
    ):
        es.stability.measure_perturbation(mesh, mesh, regions_one=one, regions_two=two)


def test_a_map_needs_areas():
    flat = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    with pytest.raises(es.InvalidShapeError, match="must have area"):
        map_closeness(flat, np.zeros((3, 3)))
