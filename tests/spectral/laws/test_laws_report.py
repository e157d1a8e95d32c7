"""The suite that judges operators, judged: it passes what is right, and names the one law that is broken."""

from dataclasses import replace
from functools import partial
from itertools import permutations

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import mean_side_length
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import (
    boundary_vertices,
    disjoint_union,
    edge_table,
    vertex_components,
)
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_boundary_nodes, fem_laplacian
from eigenshape.operators.graph import graph_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.laws import agreement as sameness
from eigenshape.spectral.laws import laplacian_laws, operator_laws
from eigenshape.spectral.laws import transformations as changes
from eigenshape.spectral.laws.laplacian_laws import check_laplacian
from eigenshape.spectral.laws.operator_laws import check_operator
from eigenshape.spectral.laws.outcomes import (
    DEFAULT_PROMISES,
    Law,
    OperatorReport,
    SkippedLaw,
    check_promises,
)
from eigenshape.spectral.solve import solve_spectrum


def bumpy(mesh: TriangleMesh, size: float = 0.03, seed: int = 1) -> TriangleMesh:
    noise = np.random.default_rng(seed).standard_normal(mesh.vertices.shape)
    return TriangleMesh(mesh.vertices + size * noise, mesh.faces)


SPHERE = bumpy(icosphere(2))
PAIR = disjoint_union(
    bumpy(icosphere(1)), TriangleMesh(bumpy(torus(9, 6)).vertices + 5, torus(9, 6).faces)
)
DEFINITE = (DEFAULT_PROMISES - {"constants"}) | {"definite"}


def broken(report: OperatorReport) -> set[str]:
    return {law.name for law in report.laws if not law.holds}


def law(report: OperatorReport, name: str) -> Law:
    return next(law for law in report.laws if law.name == name)


def from_weights(weights: sp.sparray, mass: sp.sparray) -> Laplacian:
    weights = sp.csr_array(weights)
    return Laplacian((sp.diags_array(weights.sum(axis=1)) - weights).tocsr(), mass)


def weights_of(laplacian: Laplacian) -> sp.csr_array:
    W = laplacian.stiffness
    return sp.csr_array(sp.diags_array(W.diagonal()) - W)


def with_mass(laplacian: Laplacian, factors: np.ndarray) -> Laplacian:
    """Multiply the mass of each point."""
    return replace(laplacian, mass=sp.diags_array(laplacian.mass.diagonal() * factors).tocsr())


def face_weighted(mesh: TriangleMesh, factors: np.ndarray) -> Laplacian:
    """Multiply the mass that each face gives to its corners."""
    masses = np.bincount(mesh.faces.ravel(), weights=np.repeat(face_areas(mesh) * factors / 3, 3))
    return replace(cotangent_laplacian(mesh), mass=sp.diags_array(masses).tocsr())


def corners_from_center(mesh: TriangleMesh) -> np.ndarray:
    """Corners of the faces seen from the middle of their component."""
    count, labels = vertex_components(mesh)
    middles = np.array([mesh.vertices[labels == label].mean(axis=0) for label in range(count)])
    return (mesh.vertices - middles[labels])[mesh.faces]


def extra_entry(laplacian: Laplacian, i: int, j: int, value: float) -> Laplacian:
    """Add a weight between i and j, or to the diagonal alone."""
    shape = laplacian.stiffness.shape
    if i == j:
        return replace(
            laplacian,
            stiffness=laplacian.stiffness + sp.coo_array(([value], ([i], [j])), shape=shape),
        )
    extra = sp.coo_array(([value, value], ([i, j], [j, i])), shape=shape)
    return from_weights(weights_of(laplacian) + extra, laplacian.mass)


@pytest.mark.parametrize("mass", ["lumped", "consistent", "averaged"])
@pytest.mark.parametrize(
    "mesh", [SPHERE, PAIR, bumpy(grid(7, 5))], ids=["sphere", "two components", "sheet"]
)
def test_the_cotangent_laplacian_keeps_every_law(mesh, mass):
    report = check_operator(
        partial(cotangent_laplacian, mass=mass), mesh, promises=DEFAULT_PROMISES | {"volume"}
    )
    assert report.passed, report.explain()
    assert len(report.laws) == 16
    assert [law.name for law in report.skipped] == ["definite", "nonnegative weights"]
    assert max(law.measured for law in report.laws if law.name != "positive semidefinite") < 1e-12


def test_a_report_explains_itself():
    report = check_operator(cotangent_laplacian, SPHERE)
    lines = report.explain().splitlines()
    assert lines[0] == "All 15 laws hold."
    assert (
        "holds   kernel: within 1e-14 trace W / trace B of zero lie 1 of the eigenvalues; components of W: 1."
        in lines
    )
    assert lines[-1] == "skipped nonnegative weights: not promised"
    heavy = check_operator(
        lambda mesh: with_mass(cotangent_laplacian(mesh), 1.01), SPHERE, promises=["volume"]
    )
    assert heavy.explain().startswith("1 of 8 laws are broken.")
    assert "BROKEN  volume: the entries of B sum to 12.77" in heavy.explain()


def test_an_asymmetric_matrix_is_caught_past_the_gate_of_laplacian():
    laplacian = cotangent_laplacian(SPHERE)
    extra = sp.coo_array(([1e-3, -1e-3], ([3, 3], [4, 3])), shape=laplacian.stiffness.shape)
    stiffness = sp.csr_array(laplacian.stiffness + extra)
    object.__setattr__(laplacian, "stiffness", stiffness)
    assert "symmetry of W" in broken(check_laplacian(laplacian))


@pytest.mark.parametrize("mesh", [SPHERE, icosphere(4)], ids=["162", "2562"])
def test_a_negative_eigenvalue_is_found_and_nothing_else(mesh):
    edge = mesh.faces[0, :2]
    report = check_laplacian(extra_entry(cotangent_laplacian(mesh), *edge, -20.0), mesh)
    assert broken(report) == {"positive semidefinite"}
    pencil = extra_entry(cotangent_laplacian(mesh), *edge, -20.0)
    level = pencil.stiffness.diagonal().sum() / pencil.mass.sum()
    if pencil.n_points < 500:
        lowest = sl.eigh(pencil.stiffness.toarray(), pencil.mass.toarray(), eigvals_only=True)[0]
        measured = law(report, "positive semidefinite").measured
        assert measured / 10 < -lowest / level < measured


def test_an_operator_below_every_shift_is_named():
    report = check_laplacian(
        replace(cotangent_laplacian(SPHERE), stiffness=-cotangent_laplacian(SPHERE).stiffness)
    )
    assert not law(report, "positive semidefinite").holds
    tiny = with_mass(cotangent_laplacian(SPHERE), np.append(1e-9, np.ones(161)))
    report = check_laplacian(
        extra_entry(tiny, *SPHERE.faces[SPHERE.faces[:, 0] == 0][0, :2], -50.0)
    )
    assert law(report, "positive semidefinite").measured == np.inf


@pytest.mark.parametrize("mesh", [SPHERE, icosphere(4)], ids=["162", "2562"])
def test_a_row_sum_is_found_at_its_row(mesh):
    laplacian = cotangent_laplacian(mesh)
    report = check_laplacian(extra_entry(laplacian, 5, 5, 1e-6 * laplacian.stiffness[5, 5]), mesh)
    assert broken(report) == {"row sums"}
    assert law(report, "row sums").measured == pytest.approx(1e-6, rel=0.2)
    assert "is that of row 5, 3" in law(report, "row sums").explanation


def test_a_mass_off_by_a_hundredth_is_found():
    report = check_operator(
        lambda mesh: with_mass(cotangent_laplacian(mesh), 1.01),
        SPHERE,
        promises=DEFAULT_PROMISES | {"volume"},
    )
    assert broken(report) == {"volume"}
    assert law(report, "volume").measured == pytest.approx(0.01)


def test_a_mass_that_is_not_definite_is_found():
    laplacian = cotangent_laplacian(SPHERE)
    i, j = SPHERE.faces[0, :2]
    size = 2 * np.sqrt(laplacian.mass[i, i] * laplacian.mass[j, j])
    extra = sp.coo_array(([size, size], ([i, j], [j, i])), shape=laplacian.mass.shape)
    report = check_laplacian(replace(laplacian, mass=laplacian.mass + extra), SPHERE)
    assert broken(report) == {"positive mass"}
    assert "has a pivot that is not positive" in law(report, "positive mass").explanation


def test_a_second_zero_is_found_though_the_graph_is_whole():
    laplacian = cotangent_laplacian(SPHERE)
    W, B = laplacian.stiffness.toarray(), laplacian.mass.toarray()
    values, vectors = sl.eigh(W, B)
    weighed = B @ vectors[:, 1]
    flat = Laplacian(sp.csr_array(W - values[1] * np.outer(weighed, weighed)), laplacian.mass)
    assert broken(check_laplacian(flat)) == {"kernel"}


@pytest.mark.parametrize("side", [-1, 1])
def test_a_kernel_that_cannot_be_counted_is_no_kernel(monkeypatch, side):
    """Where no factor is found on one side of zero, nothing is known to lie between both."""
    count = laplacian_laws._count
    monkeypatch.setattr(
        laplacian_laws,
        "_count",
        lambda pencil, share: None if side * share > 0 else count(pencil, share),
    )
    report = check_laplacian(cotangent_laplacian(icosphere(1)))
    assert "kernel" in broken(report)
    assert "of zero lie 0 of the eigenvalues" in law(report, "kernel").explanation


@pytest.mark.parametrize("size", [2.0**-40, 1.0, 2.0**40])
def test_a_link_is_measured_beside_the_diagonal(size):
    laplacian = cotangent_laplacian(PAIR)
    W = laplacian.stiffness.toarray()
    linked = extra_entry(laplacian, 3, 60, 1e-3)
    scaled = replace(linked, stiffness=size * linked.stiffness)
    share = law(check_laplacian(scaled, PAIR), "components").measured
    assert share == pytest.approx(1e-3 / np.sqrt(W[3, 3] * W[60, 60]), rel=0.01)


def test_a_link_between_components_is_found_at_its_place():
    laplacian = cotangent_laplacian(PAIR)
    report = check_laplacian(
        extra_entry(laplacian, 3, 60, 1e-3), PAIR, promises=DEFAULT_PROMISES | {"volume"}
    )
    assert broken(report) == {"components"}
    assert (
        "the shape has 2; entry (3, 60) of W joins two of them"
        in law(report, "components").explanation
    )
    linked = laplacian.mass + sp.coo_array(
        ([1e-3, 1e-3], ([3, 60], [60, 3])), shape=laplacian.mass.shape
    )
    assert (
        "(3, 60) of B"
        in law(check_laplacian(replace(laplacian, mass=linked), PAIR), "components").explanation
    )


def test_negative_weights_are_found_at_their_edge():
    kite = TriangleMesh(
        np.array([[0.0, 0, 0], [4, 0, 0], [2, 0.5, 0], [2, -0.5, 0]]),
        np.array([[0, 1, 2], [1, 0, 3]]),
    )
    report = check_laplacian(cotangent_laplacian(kite), kite, promises=["nonnegative_weights"])
    # Both angles opposite to the edge have the cotangent (-4 + 1/4) / 2 = -15/8.
    assert broken(report) == {"nonnegative weights"}
    assert (
        "the lowest weight, -1.88, is that of points 0 and 1"
        in law(report, "nonnegative weights").explanation
    )
    assert check_laplacian(
        cotangent_laplacian(icosphere(2)), promises=["nonnegative_weights"]
    ).passed


def test_a_boundary_condition_is_definite_and_a_free_boundary_is_not():
    def held(mesh):
        return dirichlet_laplacian(
            cotangent_laplacian(mesh, "consistent"), boundary_vertices(mesh)
        )[0]

    report = check_operator(held, bumpy(grid(9, 7)), promises=DEFINITE)
    assert report.passed, report.explain()
    assert broken(check_operator(cotangent_laplacian, grid(9, 7), promises=DEFINITE)) == {
        "definite"
    }
    assert (
        "lie 2 of the eigenvalues"
        in law(
            check_laplacian(cotangent_laplacian(PAIR), promises=DEFINITE), "definite"
        ).explanation
    )
    cut_in_two = check_laplacian(
        held(disjoint_union(grid(4, 4), grid(3, 3))), disjoint_union(grid(4, 4), grid(3, 3))
    )
    assert law(cut_in_two, "components").explanation == "the shape has 2, and W has 2."
    assert {"row sums"} <= broken(cut_in_two)


def test_where_no_factor_serves_nothing_is_taken_for_proved(monkeypatch):
    monkeypatch.setattr(laplacian_laws.Factor, "at", lambda *_: None)
    report = check_laplacian(cotangent_laplacian(SPHERE), promises=["constants", "definite"])
    assert broken(report) == {"positive semidefinite", "kernel", "definite"}
    assert (
        law(report, "definite").explanation == "no factor near zero has its pivots on the diagonal."
    )


def depends_on_vertex_order(mesh):
    laplacian = cotangent_laplacian(mesh)
    weights = weights_of(laplacian).tocoo()
    weights.data = weights.data * (1 + 1e-6 * ((weights.row - weights.col) % 2))
    return from_weights(weights, laplacian.mass)


def depends_on_face_order(mesh):
    return face_weighted(mesh, 1 + 1e-6 * (np.arange(mesh.n_faces) % 2))


def depends_on_the_axes(mesh):
    return cotangent_laplacian(TriangleMesh(mesh.vertices * [1, 1, 1 + 1e-6], mesh.faces))


def depends_on_handedness(mesh):
    corners = corners_from_center(mesh)
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2)
    by_size = np.take_along_axis(corners, sides.argsort(axis=1)[:, :, None], axis=1)
    return face_weighted(mesh, 1 + 1e-6 * np.sign(np.linalg.det(by_size)))


def depends_on_orientation(mesh):
    return face_weighted(mesh, 1 + 1e-6 * np.sign(np.linalg.det(corners_from_center(mesh))))


def depends_on_the_unit(mesh):
    laplacian = cotangent_laplacian(mesh)
    return with_mass(laplacian, 1 + 1e-6 / laplacian.mass.diagonal())


def depends_on_what_lies_elsewhere(mesh):
    return with_mass(
        cotangent_laplacian(mesh),
        1 + 1e-6 * mean_side_length(mesh) / np.ptp(mesh.vertices, axis=0).max(),
    )


DEPENDENT = {
    "point order": depends_on_vertex_order,
    "simplex order": depends_on_face_order,
    "rigid motion": depends_on_the_axes,
    "reflection": depends_on_handedness,
    "orientation": depends_on_orientation,
    "scaling": depends_on_the_unit,
    "union": depends_on_what_lies_elsewhere,
}


@pytest.mark.long
@pytest.mark.parametrize("name", DEPENDENT)
@settings(deadline=None, max_examples=4)
@given(seed=st.integers(0, 2**32 - 1))
def test_an_operator_that_depends_on_what_it_should_not_breaks_that_law_alone(name, seed):
    promises = (
        DEFAULT_PROMISES - {"rigid_motion"} if name == "union" else DEFAULT_PROMISES
    )  # a box along the axes is not turned with it
    mesh = bumpy(icosphere(1 + seed % 2), 0.05, seed)
    report = check_operator(
        DEPENDENT[name], mesh, promises=promises, rng=np.random.default_rng(seed)
    )
    assert broken(report) == {name}, report.explain()
    assert law(report, name).measured > 1e-9


def test_the_unit_is_found_also_where_only_eigenvalues_betray_it():
    def meters(mesh):
        laplacian = cotangent_laplacian(mesh)
        return replace(laplacian, mass=laplacian.mass / np.ptp(mesh.vertices))

    report = check_operator(meters, SPHERE, promises=["scaling"])
    assert broken(report) == {"scaling"}
    assert "eigenvalues times length² by" in law(report, "scaling").explanation


def test_an_operator_that_changes_from_call_to_call_is_found():
    rng = np.random.default_rng(3)
    report = check_operator(
        lambda mesh: with_mass(
            cotangent_laplacian(mesh), 1 + 1e-15 * rng.integers(0, 9, mesh.n_vertices)
        ),
        SPHERE,
    )
    assert broken(report) == {"repetition"}


def test_an_operator_that_refuses_the_shape_in_another_unit_breaks_the_law():
    def choosy(mesh):
        if np.abs(mesh.vertices).max() > 100:
            message = "too large for me"
            raise InvalidShapeError(message)
        return cotangent_laplacian(mesh)

    report = check_operator(choosy, SPHERE)
    assert broken(report) == {"scaling"}
    assert law(report, "scaling").explanation.endswith("is refused: too large for me")


def test_rows_that_come_and_go_are_found():
    def without_the_first(mesh):
        return dirichlet_laplacian(
            cotangent_laplacian(mesh), np.flatnonzero(mesh.vertices[:, 0] < 0)
        )[0]

    report = check_operator(
        without_the_first, SPHERE, promises=["definite", "reflection", "orientation"]
    )
    assert broken(report) == {"reflection"}
    assert "rows where" in law(report, "reflection").explanation


def test_an_operator_that_cannot_be_jiggled_is_judged_all_the_same():
    known = SPHERE.vertices.tobytes()

    def knows_one_shape(mesh):
        if mesh.vertices.tobytes() != known:
            message = "I know one shape only"
            raise InvalidShapeError(message)
        return cotangent_laplacian(mesh)

    report = check_operator(knows_one_shape, SPHERE)
    assert broken(report) == {"point order", "rigid motion", "reflection", "scaling", "union"}


def test_rows_may_be_anything_that_the_shape_has():
    def joined_faces(mesh):
        table = edge_table(mesh)
        inner = table.n_faces == 2
        sides = np.argsort(table.face_edges.ravel(), kind="stable")
        ends = sides[inner[table.face_edges.ravel()[sides]]].reshape(-1, 2).T // 3
        upper = sp.coo_array((np.ones(ends.shape[1]), ends), shape=(mesh.n_faces,) * 2)
        return from_weights(upper + upper.T, sp.diags_array(face_areas(mesh)).tocsr())

    report = check_operator(joined_faces, PAIR, promises=DEFAULT_PROMISES - {"scaling"})
    assert report.passed, report.explain()
    assert law(report, "components").explanation == "the shape has 2, and W has 2."
    assert "of the 20 lowest eigenvalues" in law(report, "point order").explanation


def test_what_drowns_in_rounding_is_not_judged():
    points = SPHERE.vertices.copy()
    a, b, c = SPHERE.faces[7]
    middle = (points[a] + points[b]) / 2
    points[c] = middle + 1e-10 * (points[c] - middle)
    report = check_operator(
        cotangent_laplacian,
        TriangleMesh(points, SPHERE.faces),
        promises=DEFAULT_PROMISES | {"volume"},
    )
    assert report.passed, report.explain()
    silent = [law for law in report.skipped if law.reason != "not promised"]
    assert {law.name for law in silent} == {
        "rigid motion",
        "union",
        "simplex order",
        "orientation",
        "reflection",
    }
    assert "simplices are thin, or the operator is unstable" in report.explain()


def not_judged_for(report: OperatorReport, reason: str) -> set[str]:
    return {law.name for law in report.skipped if reason in law.reason}


BY_EIGENVALUES = {
    "point order",
    "simplex order",
    "reflection",
    "orientation",
    "rigid motion",
    "union",
}


def test_eigenvalues_that_drown_in_rounding_are_not_judged():
    points = bumpy(icosphere(1)).vertices.copy()
    a, b, c = icosphere(1).faces[7]
    points[c] = (points[a] + points[b]) / 2 + 2e-11 * (points[c] - (points[a] + points[b]) / 2)
    report = check_operator(fem_laplacian, TriangleMesh(points, icosphere(1).faces))
    assert report.passed, report.explain()
    assert law(report, "scaling").measured == 0
    by_eigenvalues = not_judged_for(report, "rounding may change eigenvalues by")
    assert "point order" in by_eigenvalues  # which of two reasons the others get, rounding decides
    assert by_eigenvalues | not_judged_for(report, "rounding of coord") == BY_EIGENVALUES


@pytest.mark.parametrize("module", [sameness, operator_laws])
def test_eigenvalues_without_proof_are_not_compared(monkeypatch, module):
    def unproved(*_):
        message = "no proof of this"
        raise ConvergenceError(message)

    monkeypatch.setattr(module, "lowest_eigenvalues", unproved)
    report = check_operator(fem_laplacian, bumpy(icosphere(1)))
    reason = "no proof of this" if module is sameness else "the lowest eigenvalues cannot be proved"
    assert report.passed, report.explain()
    assert not_judged_for(report, reason) == BY_EIGENVALUES


def test_as_many_rows_as_points_may_still_be_no_points():
    # On 2 by 2 by 2 by 2 cubes P2 has 5^4 nodes, of which 3^4 are inside; and there are 3^4 points.
    mesh = box(2, 4)

    def held(shape):
        return dirichlet_laplacian(fem_laplacian(shape), fem_boundary_nodes(shape))[0]

    assert held(mesh).n_points == mesh.n_points
    assert "point order" in broken(check_operator(held, mesh, promises=DEFINITE))
    report = check_operator(held, mesh, promises=DEFINITE, by_points=False)
    assert report.passed, report.explain()


def box(n: int, dim: int) -> SimplicialMesh:
    """Cut cubes along their diagonals (Kuhn)."""
    corners = np.stack(np.meshgrid(*[np.arange(n + 1)] * dim, indexing="ij"), axis=-1).reshape(
        -1, dim
    )
    strides = (n + 1) ** np.arange(dim)[::-1]
    first = corners[(corners < n).all(axis=1)] @ strides
    steps = [np.cumsum([0, *strides[list(order)]]) for order in permutations(range(dim))]
    return SimplicialMesh(corners / n, np.concatenate([first[:, None] + step for step in steps]))


def test_a_graph_has_no_place_and_a_cloud_no_simplices():
    ring = sp.csr_array(np.roll(np.eye(9), 1, axis=1) + np.roll(np.eye(9), -1, axis=1))
    report = check_operator(
        lambda graph: from_weights(graph, sp.eye_array(graph.shape[0], format="csr")), ring
    )
    assert report.passed, report.explain()
    silent = {law.name for law in report.skipped}
    assert {"rigid motion", "reflection", "orientation", "simplex order"} <= silent
    assert law(report, "components").measured == 0
    cloud = check_operator(
        lambda cloud: complete(cloud.points),
        PointCloud(SPHERE.vertices),
        promises=DEFAULT_PROMISES | {"volume"},
    )
    assert cloud.passed, cloud.explain()
    assert SkippedLaw("components", "no mesh or graph says what belongs together") in cloud.skipped
    assert SkippedLaw("volume", "only a mesh has one to compare with") in cloud.skipped


def complete(points: np.ndarray) -> Laplacian:
    """Join all near points with weights that fall with the distance, in multiples of the nearest one."""
    square = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    nearest = (square + np.diag(np.full(len(square), np.inf))).min(axis=1)
    relative = square / np.outer(nearest**0.5, nearest**0.5)
    weights = np.where((relative < 40) & (relative > 0), np.exp(-relative), 0)
    return from_weights(sp.csr_array(weights), sp.diags_array(nearest).tocsr())


@pytest.mark.parametrize("d", [1, 2, 3, 7])
def test_rotations_are_rotations_in_any_dimension(d):
    turn = changes.random_rotation(d, np.random.default_rng(d))
    np.testing.assert_allclose(turn @ turn.T, np.eye(d), atol=1e-14)
    assert np.linalg.det(turn) == pytest.approx(1)


def oriented_volumes(mesh):
    corners = mesh.points[mesh.simplices]
    return np.linalg.det(corners[:, 1:] - corners[:, :1])


def test_a_jiggle_is_no_larger_than_rounding():
    ball = icosphere(2)
    moved = np.abs(changes.jiggle(ball, np.random.default_rng(0)).vertices - ball.vertices)
    assert 0 < moved.max() < 1e-14


@pytest.mark.parametrize("dim", [1, 2, 3, 5])
def test_changes_keep_or_turn_the_orientation_as_they_say(dim):
    rng = np.random.default_rng(dim)
    mesh = SimplicialMesh(
        rng.standard_normal((12, dim)), [rng.permutation(12)[: dim + 1] for _ in range(40)]
    )
    before = np.sort(oriented_volumes(mesh))
    for same in (
        changes.reorder(mesh, rng),
        changes.mirror(mesh),
        changes.renumber(mesh, rng.permutation(12)),
    ):
        np.testing.assert_allclose(np.sort(oriented_volumes(same)), before, atol=1e-12)
    turned = oriented_volumes(changes.turn_over(mesh, rng)) / oriented_volumes(mesh)
    np.testing.assert_allclose(np.abs(turned), 1)
    assert turned[0] == pytest.approx(-1)
    assert 1 < (turned < 0).sum() < 40
    twice = changes.double(mesh)
    assert vertex_components(twice)[0] == 2 * vertex_components(mesh)[0]


def test_a_promise_that_is_unknown_is_refused():
    with pytest.raises(
        InvalidParameterError, match=r"promises must be among constants, .*; 'symmetry' is not\."
    ):
        check_promises.__wrapped__(["symmetry"])  # past the check of types, which only tests have


def test_what_is_no_laplacian_is_refused():
    with pytest.raises(
        InvalidParameterError, match=r"build must return a Laplacian; it returned a csr_array\."
    ):
        check_operator(lambda mesh: cotangent_laplacian(mesh).stiffness, SPHERE)


def test_a_laplacian_instead_of_its_builder_is_an_error():
    unchecked = operator_laws.check_operator.__wrapped__  # past the check of types
    with pytest.raises(
        InvalidParameterError, match=r"it is a Laplacian\. es\.spectral\.check_laplacian checks"
    ):
        unchecked(cotangent_laplacian(SPHERE), SPHERE)


def test_one_point_alone_is_judged_too():
    report = check_laplacian(
        Laplacian(sp.csr_array((1, 1)), sp.csr_array([[2.0]])),
        promises=["constants", "nonnegative_weights"],
    )
    assert report.passed, report.explain()


def test_a_law_that_is_not_promised_is_skipped_for_that_reason_first():
    graph = sp.csr_array(np.ones((3, 3)) - np.eye(3))
    reasons = {
        promises: {
            law.name: law.reason
            for law in check_operator(graph_laplacian, graph, promises=promises).skipped
        }
        for promises in ((), ("reflection",))
    }
    assert reasons[()]["reflection"] == "not promised"
    assert reasons["reflection",]["reflection"] == "a graph lies nowhere"


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_a_change_is_a_share_of_the_entries_of_its_rows(unit):
    ball = cotangent_laplacian(icosphere(1))
    before = Laplacian(unit * ball.stiffness, unit**2 * ball.mass)
    after = Laplacian(1.25 * before.stiffness, before.mass)
    change, place = sameness.distance(before, after)
    assert change == pytest.approx(0.25, rel=1e-12)
    assert place.startswith("the largest change is that of W_ij at ")


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_what_residuals_allow_is_a_share_of_the_last_eigenvalue(unit):
    ball = cotangent_laplacian(icosphere(1))
    laplacian = Laplacian(unit * ball.stiffness, ball.mass)
    spectrum = solve_spectrum(laplacian, 5)
    uncertain = replace(spectrum, residuals=np.full(5, 1e-6 * spectrum.eigenvalues[-1]))
    law = sameness.same_eigenvalues("same", laplacian, uncertain, 1e-9)
    assert law.holds
    assert law.allowed == pytest.approx(1.001e-6, rel=1e-6)
