"""Maps between shapes: onto themselves, onto copies, one after the other; what is carried, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es

HAND = es.make_creature("hand", 1, n_vertices=1200)
TURN = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
ORDER = np.random.default_rng(1).permutation(HAND.n_vertices)
PLACES = np.argsort(ORDER)
TIPS = es.geometry.farthest_points(HAND, 6)[0]
N_MODES = 60


def solve(mesh, k=N_MODES):
    return es.solve_spectrum(es.cotangent_laplacian(mesh), k)


@pytest.fixture(scope="module")
def hand():
    return solve(HAND)


@pytest.fixture(scope="module")
def mixed():
    return solve(es.TriangleMesh(HAND.vertices[ORDER], PLACES[HAND.faces]))


@pytest.fixture(scope="module")
def bent():
    return solve(es.make_creature("hand", 2, n_vertices=1200), 40)


def pairs(of_target=None):
    return np.column_stack([TIPS, TIPS if of_target is None else of_target[TIPS]])


def test_onto_itself_it_is_the_identity(hand):
    found = es.functional_map(hand, hand, pairs())
    np.testing.assert_allclose(found.matrix, np.eye(20), atol=1e-9)
    refined = es.spectral.refine_map(found, N_MODES)
    np.testing.assert_allclose(refined.matrix, np.eye(N_MODES), atol=1e-9)
    assert np.array_equal(es.spectral.point_map(refined), np.arange(HAND.n_vertices))


def test_one_pair_is_enough_where_no_eigenvalue_is_double(hand):
    found = es.functional_map(hand, hand, [[TIPS[0], TIPS[0]]], n_modes=10)
    np.testing.assert_allclose(found.matrix, np.eye(10), atol=1e-6)


def test_other_vertex_numbers_are_found(hand, mixed):
    refined = es.spectral.refine_map(es.functional_map(hand, mixed, pairs(PLACES)), N_MODES)
    assert np.array_equal(es.spectral.point_map(refined), ORDER)
    functions = HAND.vertices
    carried = es.spectral.transfer_function(refined, functions)
    own = es.spectral.transfer_function(
        es.spectral.map_from_points(hand, hand, np.arange(len(ORDER)), n_modes=N_MODES), functions
    )
    np.testing.assert_allclose(carried, own[ORDER], atol=1e-8)


@pytest.mark.parametrize("size", [1e-100, 7.0, 1e100])
def test_size_and_motion_change_nothing(hand, size):
    copy = solve(es.TriangleMesh(size * (HAND.vertices @ TURN.T), HAND.faces))
    found = es.functional_map(hand, copy, pairs())
    signs = np.sign(np.diag(found.matrix))  # a tie for the largest entry may turn a column over
    np.testing.assert_allclose(found.matrix, np.diag(signs), atol=1e-7)
    assert np.array_equal(
        es.spectral.point_map(es.spectral.refine_map(found, N_MODES)), np.arange(HAND.n_vertices)
    )
    np.testing.assert_allclose(
        es.spectral.transfer_function(found, np.full(HAND.n_vertices, 3.0)), 3.0, rtol=1e-9
    )


def test_a_pair_tells_one_side_from_the_other():
    # A box of three different sides has the same spectrum as its mirror images; pairs alone tell them apart.
    sphere = es.icosphere(3)
    ends = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    spectrum = solve(es.TriangleMesh(sphere.vertices * [1.0, 1.5, 2.2], sphere.faces), 30)
    mirrored = np.linalg.norm(
        sphere.vertices[:, None] - sphere.vertices * [-1, 1, 1], axis=2
    ).argmin(axis=0)
    corner = (sphere.vertices @ (ends.sum(axis=0))).argmax()
    for partner in (np.arange(len(mirrored)), mirrored):
        found = es.functional_map(spectrum, spectrum, [[corner, partner[corner]]], n_modes=4)
        assert np.array_equal(es.spectral.point_map(es.spectral.refine_map(found, 30)), partner)


def test_maps_compose(hand, mixed):
    forth = es.functional_map(hand, mixed, pairs(PLACES))
    back = es.functional_map(mixed, hand, pairs(PLACES)[:, ::-1])
    np.testing.assert_allclose((back @ forth).matrix, np.eye(20), atol=1e-7)
    wide = es.spectral.refine_map(back, 30)
    composed = wide @ forth
    assert composed.matrix.shape == (30, 20)
    values = np.sin(HAND.vertices)
    one_by_one = es.spectral.transfer_function(wide, es.spectral.transfer_function(forth, values))
    np.testing.assert_allclose(
        es.spectral.transfer_function(composed, values), one_by_one, atol=1e-8
    )


def test_constants_stay_between_different_shapes(hand, bent):
    found = es.functional_map(hand, bent, pairs()[:, [0, 0]] % len(bent.eigenvectors))
    for mapping in (
        found,
        es.spectral.refine_map(found, 40),
        es.spectral.refine_map(found, 40, n_samples=100),
    ):
        np.testing.assert_allclose(mapping.matrix[:, 0], np.eye(len(mapping.matrix))[0], atol=1e-9)
        carried = es.spectral.transfer_function(mapping, np.full((HAND.n_vertices, 2), [1.0, -4.0]))
        np.testing.assert_allclose(carried, np.full_like(carried, [1.0, -4.0]), atol=1e-7)


def test_a_map_of_points_and_its_adjoint(hand):
    """The projection of f∘p is what the matrix gives, by hand with B written out."""
    points = np.random.default_rng(3).integers(0, HAND.n_vertices, HAND.n_vertices)
    found = es.spectral.map_from_points(hand, hand, points, n_modes=5)
    basis, mass = hand.eigenvectors[:, :5], hand.mass.toarray()
    expected = basis @ (basis.T @ mass @ hand.eigenvectors[points, 2])
    np.testing.assert_allclose(
        es.spectral.transfer_function(found, hand.eigenvectors[:, 2]), expected, atol=1e-10
    )


def test_refined_maps_are_nearer(hand):
    """Of a pose of the same individual, whose vertices have the same numbers but other places."""
    wave = HAND.vertices + 0.05 * np.sin(4 * HAND.vertices[:, [1, 2, 0]])
    moved = solve(es.TriangleMesh(wave, HAND.faces))
    start = es.functional_map(hand, moved, pairs())
    along = es.geometry.geodesic_distances(HAND, np.arange(HAND.n_vertices)) / np.sqrt(
        es.geometry.surface_area(HAND)
    )
    errors = [
        along[np.arange(HAND.n_vertices), es.spectral.point_map(each)].mean()
        for each in (start, es.spectral.refine_map(start, 60))
    ]
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.02


def test_the_same_input_gives_the_same_map(hand, bent):
    start = es.functional_map(hand, bent, pairs() % len(bent.eigenvectors))
    again = es.functional_map(hand, bent, pairs() % len(bent.eigenvectors))
    assert np.array_equal(start.matrix, again.matrix)
    assert np.array_equal(
        es.spectral.refine_map(start, 40).matrix, es.spectral.refine_map(again, 40).matrix
    )


def test_progress_is_told(hand):
    told = []
    es.spectral.refine_map(
        es.functional_map(hand, hand, pairs()),
        30,
        step=4,
        progress=lambda *report: told.append(report),
    )
    assert [message for _, message in told] == ["20 modes", "24 modes", "28 modes", "30 modes"]
    assert [share for share, _ in told] == [0, 1 / 3, 2 / 3, 1]


def test_a_map_with_all_modes_stays(hand):
    start = es.functional_map(hand, hand, pairs())
    assert np.array_equal(es.spectral.refine_map(start, 20).matrix, start.matrix)


@pytest.mark.parametrize("bad", [np.empty((0, 2), int), [[1, 2, 3]], [[0.5, 1.0]], [1, 2]])
def test_pairs_of_another_form_are_refused(hand, bad):
    with pytest.raises(
        es.InvalidParameterError,
        match=r"pairs must be whole numbers in shape \(p, 2\), at least one row",
    ):
        es.functional_map(hand, hand, bad)


@pytest.mark.parametrize("bad", [[3, 1200], [-1, 4]])
def test_pairs_out_of_range_are_refused(hand, bad):
    with pytest.raises(
        es.InvalidParameterError,
        match=rf"vertices 0\.\.{HAND.n_vertices - 1} of the source .* pair 1 is",
    ):
        es.functional_map(
            hand, hand, [[0, 0], [bad[0], HAND.n_vertices if bad[1] == 1200 else bad[1]]]
        )


def test_more_modes_than_there_are_are_refused(hand, bent):
    for mapping in (es.functional_map, es.spectral.map_from_points):
        with pytest.raises(
            es.InvalidParameterError, match=r"n_modes must lie in 2\.\.40; it is 41"
        ):
            mapping(hand, bent, pairs(), n_modes=41)
    start = es.functional_map(hand, hand, pairs())
    for k in (19, 61):
        with pytest.raises(
            es.InvalidParameterError, match=rf"n_modes must lie in 20\.\.60; it is {k}"
        ):
            es.spectral.refine_map(start, k)
    with pytest.raises(es.InvalidParameterError, match="step must be at least 1"):
        es.spectral.refine_map(start, 30, step=0)
    with pytest.raises(es.InvalidParameterError, match=r"n_samples must lie in 60\.\."):
        es.spectral.refine_map(start, 30, n_samples=59)


def test_point_maps_of_another_form_are_refused(hand):
    for bad in (np.zeros(3, int), np.zeros(HAND.n_vertices)):
        with pytest.raises(
            es.InvalidParameterError,
            match="points must hold one whole number for each vertex of the targ",
        ):
            es.spectral.map_from_points(hand, hand, bad)
    with pytest.raises(es.InvalidParameterError, match=r"points must be vertices .* entry 0 is -1"):
        es.spectral.map_from_points(hand, hand, np.arange(HAND.n_vertices) - 1)


def test_shapes_in_pieces_are_refused(hand):
    two = solve(es.geometry.disjoint_union(HAND, HAND), 30)
    with pytest.raises(
        es.InvalidParameterError,
        match=r"Shapes to be mapped must be connected; the target has the eigenvalues",
    ):
        es.functional_map(hand, two, pairs())
    with pytest.raises(
        es.InvalidParameterError,
        match=r"Shapes to be mapped must be connected; the source has the eigenvalues",
    ):
        es.spectral.map_from_points(two, hand, np.arange(HAND.n_vertices))


def test_spectra_without_a_constant_are_refused(hand):
    inner = es.solve_spectrum(
        es.cotangent_laplacian(HAND), above=hand.eigenvalues[3] * 1.001, below=hand.eigenvalues[9]
    )
    fixed = es.solve_spectrum(es.cotangent_laplacian(HAND), 10, fixed=np.arange(10))
    for spectrum in (inner, fixed):
        with pytest.raises(
            es.InvalidParameterError,
            match=r"The first mode of a shape to be mapped must be constant",
        ):
            es.functional_map(hand, spectrum, pairs())
    with pytest.raises(
        es.InvalidParameterError,
        match="A map needs at least 2 modes of each shape; the source has 1",
    ):
        es.functional_map(solve(HAND, 1), hand, pairs())


def test_matrices_that_fit_no_modes_are_refused(hand, bent):
    for shape in ((41, 60), (40, 61), (0, 2)):
        with pytest.raises(es.InvalidParameterError, match=r"at most \(40, 60\); its shape is"):
            es.spectral.FunctionalMap(np.zeros(shape), hand, bent)
    with pytest.raises(
        es.InvalidParameterError, match=r"The matrix of a map must be finite; entry \[1, 0\]"
    ):
        es.spectral.FunctionalMap(np.array([[1.0, 0], [np.nan, 1]]), hand, bent)


def test_functions_of_other_shapes_are_refused(hand, bent):
    mapping = es.functional_map(hand, bent, pairs() % len(bent.eigenvectors))
    with pytest.raises(
        es.InvalidParameterError,
        match=r"values must hold one number per point, .*; the shape is \(3,\)",
    ):
        es.spectral.transfer_function(mapping, np.zeros(3))
    with pytest.raises(es.InvalidParameterError, match="values must be finite; entry 2 is"):
        es.spectral.transfer_function(mapping, np.where(np.arange(HAND.n_vertices) == 2, np.inf, 0))


def test_maps_that_do_not_meet_are_refused(hand, bent):
    forth = es.functional_map(hand, bent, pairs() % len(bent.eigenvectors))
    with pytest.raises(
        es.InvalidParameterError,
        match="The target of the map on the right must be the source of the one on the left",
    ):
        forth @ forth
    with pytest.raises(TypeError, match="unsupported operand"):
        forth @ forth.matrix[0].tolist()
    turned = replace(forth, source=bent, target=hand)
    assert (turned @ forth).matrix.shape == (20, 20)
