import numpy as np
import pytest
import scipy.sparse as sp
from bent_shapes import lump, lump_rig, tube, tube_rig
from scipy.spatial.transform import Rotation as Turn

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.deformation import rigidity
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import bend_graded, move_by_shares, quaternions
from eigenshape.deformation.handles import Rotation
from eigenshape.deformation.rigidity import (
    edge_weights,
    factor_equations,
    fit_turns,
    free_part,
    relax,
)
from eigenshape.deformation.rigidity_loops import fit_rotations, turn_edges
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union, edge_table
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import grid, icosphere

RNG = np.random.default_rng(0)


def star(n_edges, kind):
    """Edges at one vertex, before and after, and their weights."""
    before = RNG.standard_normal((n_edges, 3))
    if kind == "flat":
        before[:, 2] = 0
    turned = before @ Turn.random(random_state=RNG).as_matrix().T
    after = {
        "bent": turned + 0.3 * RNG.standard_normal(before.shape),
        "flat": turned + 0.3 * RNG.standard_normal(before.shape),
        "mirrored": turned * [1, 1, -1],
        "anything": RNG.standard_normal(before.shape),
    }[kind]
    return before, after, RNG.random(n_edges) + 0.1


def best_turn(before, after, weights):
    """The proper rotation that fits best, by singular values."""
    left, _, right = np.linalg.svd((after * weights[:, None]).T @ before)
    left[:, 2] *= np.linalg.det(left @ right)
    return left @ right


def fitted(before, after, weights, start):
    """The rotation of the kernel, from a quaternion with its real part first, and what is left."""
    n = len(before)
    rest, posed = (np.vstack([np.zeros(3), edges]) for edges in (before, after))
    turns = np.tile(np.asarray(start, dtype=float), (n + 1, 1))
    starts = np.array([0] + [n] * (n + 1))
    left = fit_rotations(np.array([0]), starts, np.arange(1, n + 1), weights, rest, posed, turns)
    return Turn.from_quat(np.roll(turns[0], -1)).as_matrix(), left


def energy(rotation, before, after, weights):
    return weights @ ((before @ rotation.T - after) ** 2).sum(axis=1) / 2


@pytest.mark.parametrize("kind", ["bent", "flat", "mirrored", "anything"])
def test_from_near_the_fit_is_that_of_singular_values(kind):
    for _ in range(200):
        edges = star(6, kind)
        best = best_turn(*edges)
        near = Turn.from_rotvec(0.3 * RNG.standard_normal(3)) * Turn.from_matrix(best)
        found, left = fitted(*edges, np.roll(near.as_quat(), 1))
        np.testing.assert_allclose(found, best, atol=1e-11)
        assert np.linalg.det(found) == pytest.approx(1, abs=1e-14)
        assert left == pytest.approx(energy(best, *edges), abs=1e-13)


@pytest.mark.parametrize("kind", ["bent", "flat", "anything", "mirrored"])
def test_from_anywhere_it_is_nearly_always(kind):
    """Far away there are rotations that are neither best nor worse than their neighbors: a fit may linger there."""
    gaps = []
    for _ in range(500):
        edges = star(6, kind)
        found, left = fitted(*edges, np.roll(Turn.random(random_state=RNG).as_quat(), 1))
        gaps.append(left - energy(best_turn(*edges), *edges))
        assert np.linalg.det(found) == pytest.approx(1, abs=1e-14)
    assert np.min(gaps) > -1e-12
    assert np.sum(np.array(gaps) > 1e-10) <= 2


@pytest.mark.long
@pytest.mark.parametrize("size", [1e-100, 1e-10, 1e100])
def test_units_change_no_fit(size):
    for kind in ("bent", "anything"):
        before, after, weights = star(5, kind)
        start = np.roll(Turn.random(random_state=RNG).as_quat(), 1)
        one, left = fitted(before, after, weights, start)
        other, less = fitted(size * before, size * after, weights, start)
        np.testing.assert_allclose(other, one, atol=1e-12)
        assert less / size**2 == pytest.approx(left, rel=1e-10)


def test_where_edges_tell_no_rotation_it_is_kept():
    start = np.roll(Turn.from_rotvec([0.3, 0.2, 0.1]).as_quat(), 1)
    kept = Turn.from_rotvec([0.3, 0.2, 0.1]).as_matrix()
    found, _ = fitted(np.zeros((3, 3)), np.zeros((3, 3)), np.ones(3), start)
    np.testing.assert_allclose(found, kept, atol=1e-15)
    found, _ = fitted(np.eye(3), np.zeros((3, 3)), np.ones(3), start)  # all edges shrank to nothing
    np.testing.assert_allclose(found, kept, atol=1e-15)


def test_edges_along_one_line_are_fitted_by_the_nearest_turn():
    """About the line nothing is told, and so nothing turns about it."""
    found, left = fitted(
        np.array([[1.0, 0, 0], [-2.0, 0, 0]]),
        np.array([[0, 1.0, 0], [0, -2.0, 0]]),
        np.ones(2),
        [1, 0, 0, 0],
    )
    assert left == pytest.approx(0, abs=1e-15)
    np.testing.assert_allclose(found, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-6)


def test_one_by_one_and_all_at_once_agree():
    mesh, edges = lump(2), edge_weights(lump(2), cotangent_laplacian(lump(2)).stiffness)
    posed = mesh.vertices @ Turn.from_rotvec(
        [0.1, 0.4, -0.2]
    ).as_matrix().T + 0.02 * RNG.standard_normal((162, 3))
    turns = quaternions(np.zeros((162, 3)))
    fit_rotations(
        np.arange(162), edges.starts, edges.others, edges.weights, mesh.vertices, posed, turns
    )
    found = Turn.from_quat(np.roll(turns, -1, axis=1)).as_matrix()
    np.testing.assert_allclose(found, fit_turns(edges, mesh.vertices, posed), atol=1e-11)


def test_weights_are_positive_and_on_every_edge():
    for mesh in (
        lump(),
        grid(4, 4),
        tube(),
        TriangleMesh([[0, 0, 0], [9, 0, 0], [4, 1, 0], [5, -1, 0]], [[0, 1, 2], [1, 0, 3]]),
    ):
        stiffness = cotangent_laplacian(mesh).stiffness
        edges = edge_weights(mesh, stiffness)
        assert len(edges.weights) == 2 * len(edge_table(mesh).edges)
        assert edges.weights.min() > 0
        np.testing.assert_allclose(edges.matrix @ np.ones(mesh.n_vertices), 0, atol=1e-13)
        assert (abs(edges.matrix - edges.matrix.T) > 0).nnz == 0
        plain = stiffness.toarray()
        strong = -plain > 0.1
        np.testing.assert_allclose(edges.matrix.toarray()[strong], plain[strong], rtol=1e-14)
    assert (-plain[0, 1]) < 0  # an edge whose cotangents add up to less than nothing
    assert edges.matrix[0, 1] < 0


def test_edges_do_not_depend_on_rounding():
    """The cotangents across the diagonals of squares sum to 0, or to a rounding error."""
    mesh = grid(4, 4)
    stiffness = cotangent_laplacian(mesh).stiffness.toarray()
    one, two = mesh.faces[:16, 0], mesh.faces[:16, 2]  # the ends of the diagonals
    np.testing.assert_allclose(stiffness[one, two], 0, atol=1e-15)
    found = []
    for rounding in (0.0, 1e-17, -1e-17):
        stiffness[one, two] = stiffness[two, one] = rounding
        found.append(edge_weights(mesh, sp.csr_array(stiffness)))
    assert len(found[0].weights) == 2 * len(edge_table(mesh).edges)
    for other in found[1:]:
        np.testing.assert_array_equal(other.starts, found[0].starts)
        np.testing.assert_array_equal(other.others, found[0].others)
        np.testing.assert_allclose(other.weights, found[0].weights, rtol=1e-14)
        np.testing.assert_allclose(other.matrix.toarray(), found[0].matrix.toarray(), atol=1e-14)


def test_turned_edges_are_the_sum_that_they_say():
    mesh, edges = lump(1), edge_weights(lump(1), cotangent_laplacian(lump(1)).stiffness)
    turns = np.roll(Turn.random(42, random_state=RNG).as_quat(), 1, axis=1)
    spin = Turn.from_quat(np.roll(turns, -1, axis=1)).as_matrix() - np.eye(3)
    found = np.empty((42, 3))
    turn_edges(
        np.arange(42), edges.starts, edges.others, edges.weights, mesh.vertices, turns, found
    )
    dense = -edges.matrix.toarray()
    np.fill_diagonal(dense, 0)
    plain = [
        sum(
            dense[i, j] * (spin[i] + spin[j]) @ (mesh.vertices[i] - mesh.vertices[j]) / 2
            for j in range(42)
        )
        for i in range(42)
    ]
    np.testing.assert_allclose(found, plain, atol=1e-13)


def bent_tube():
    rows = np.arange(492) // 12
    binding = bind(tube_rig(), [rows >= 30], fixed=rows <= 10)
    return binding, Rotation([0, 0, 3], [1, 0, 0], 1.0)


def total(binding, posed):
    edges, rest = binding.rig.edges, binding.rig.mesh.vertices
    turns = fit_turns(edges, rest, posed)
    one = np.repeat(np.arange(len(rest)), np.diff(edges.starts))
    arms, after = rest[edges.others] - rest[one], posed[edges.others] - posed[one]
    return (
        edges.weights @ ((np.einsum("eij,ej->ei", turns[one], arms) - after) ** 2).sum(axis=1) / 2
    )


@pytest.mark.long
def test_more_rounds_are_more_rigid():
    binding, handle = bent_tube()
    energies = [total(binding, move_by_shares(binding, [handle]))]
    energies += [
        total(binding, bend_graded(binding, [handle], n_rounds=rounds))
        for rounds in (1, 2, 3, 5, 10, 20)
    ]
    assert (np.diff(energies) <= 1e-12 * energies[0]).all()
    assert energies[-1] < 0.6 * energies[0]


@pytest.mark.long
def test_many_rounds_end_where_plain_alternation_does(monkeypatch):
    """Written out: the best rotations by singular values, then all free vertices by a dense solve, again and again."""
    binding, handle = bent_tube()
    edges, rest, free = binding.rig.edges, binding.rig.mesh.vertices, binding.part.free
    matrix = edges.matrix.toarray()
    links = -matrix + np.diag(matrix.diagonal())
    posed, solve = move_by_shares(binding, [handle]), np.linalg.inv(matrix[np.ix_(free, free)])
    held = np.setdiff1d(np.arange(len(rest)), free)
    for _ in range(2000):
        turns = fit_turns(edges, rest, posed)
        own = np.einsum("iab,ib->ia", turns, matrix @ rest)
        others = (links @ turns.reshape(-1, 9)).reshape(-1, 3, 3)
        theirs = np.einsum("iab,ib->ia", others, rest) - links @ np.einsum(
            "jab,jb->ja", turns, rest
        )
        posed[free] = solve @ ((own + theirs)[free] / 2 - matrix[np.ix_(free, held)] @ posed[held])
    quick = bend_graded(binding, [handle])
    assert total(binding, quick) == pytest.approx(total(binding, posed), rel=3e-4)
    monkeypatch.setattr(rigidity, "ENERGY_TOLERANCE", 0.0)
    patient = bend_graded(binding, [handle], n_rounds=2000)
    assert np.abs(patient - posed).max() < 1e-9


def test_nothing_free_is_nothing_to_relax():
    rig = lump_rig()
    part = free_part(rig.edges, np.ones(642, dtype=bool))
    assert part.factor is None
    start = RNG.standard_normal((642, 3))
    assert (
        relax(rig.edges, part, rig.mesh.vertices, start, quaternions(np.zeros((642, 3))), 5)
        is start
    )


def test_each_component_must_be_held():
    mesh = disjoint_union(icosphere(0), icosphere(0), icosphere(0))
    edges = edge_weights(mesh, cotangent_laplacian(mesh).stiffness)
    held = np.zeros(36, dtype=bool)
    held[3] = True
    with pytest.raises(
        InvalidParameterError, match=r"the component of vertex 12 has none \(2 such\)"
    ):
        free_part(edges, held)


def test_equations_that_are_not_definite_are_refused():
    edges = edge_weights(icosphere(0), cotangent_laplacian(icosphere(0)).stiffness)
    with pytest.raises(
        InvalidShapeError,
        match="angles well above zero to be bent; the equations of the 5 free",
    ):
        factor_equations(-edges.matrix[:5][:, :5])


def test_quaternions_are_those_of_scipy():
    turns = np.vstack([np.zeros(3), RNG.standard_normal((20, 3)), [[0, 0, 7.0]], [[1e-9, 0, 0]]])
    np.testing.assert_allclose(
        Turn.from_quat(np.roll(quaternions(turns), -1, axis=1)).as_matrix(),
        Turn.from_rotvec(turns).as_matrix(),
        atol=1e-14,
    )
