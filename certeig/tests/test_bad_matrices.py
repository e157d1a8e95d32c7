"""What is no pencil is refused, with what is wrong, where, and what to pass instead."""

import known_spectra as known
import numpy as np
import pytest
import scipy.sparse as sp

import certeig
from certeig import InvalidParameterError

CHAIN = known.string(6)
ONES = sp.csr_array(sp.eye_array(6))


def with_entries(matrix, value, *places):
    changed = matrix.tolil()
    for place in places:
        changed[place] = value
    return sp.csr_array(changed)


BAD = [
    (
        CHAIN.toarray(),
        r"must be a square sparse matrix; it is a ndarray of shape \(6, 6\). Pass scipy",
    ),
    ([[1.0]], r"must be a square sparse matrix; it is a list of shape \(1, 1\). Pass scipy"),
    (None, r"must be a square sparse matrix; it is a NoneType"),
    (CHAIN[:3], r"must be a square sparse matrix; it is a csr_array of shape \(3, 6\)"),
    (
        sp.coo_array([1.0, 2.0]),
        r"must be a square sparse matrix; it is a coo_array of shape \(2,\)",
    ),
    (sp.csr_array((0, 0)), r"must have at least one row; its shape is \(0, 0\)"),
    (1j * CHAIN, r"must be real; the type of its entries is complex128\. Pass its real part, or"),
    (CHAIN.astype(np.complex64), r"must be real; the type of its entries is complex64"),
    (with_entries(CHAIN, np.nan, (2, 2)), r"must be finite; entry \(2, 2\) is nan \(1 such\)"),
    (
        with_entries(CHAIN, np.inf, (0, 1), (1, 0)),
        r"must be finite; entry \(0, 1\) is inf \(2 such",
    ),
    (with_entries(CHAIN, 3.0, (1, 4)), r"must be symmetric; entry \(1, 4\) is 3\.0 and .* is 0\.0"),
]


@pytest.mark.parametrize(("matrix", "rule"), BAD)
@pytest.mark.parametrize("name", ["W", "B"])
def test_a_matrix_that_is_none(matrix, rule, name):
    if matrix is None and name == "B":
        return  # the identity
    pair = (matrix, ONES) if name == "W" else (CHAIN, matrix)
    for function in (certeig.count_below, lambda *pair: certeig.eigenpairs(*pair, k=1)):
        with pytest.raises(InvalidParameterError, match=f"^{name} {rule}"):
            function(*pair)
    with pytest.raises(InvalidParameterError, match=f"^{name} {rule}"):
        certeig.certify(*pair, [0.0], np.ones((6, 1)))


@pytest.mark.parametrize(("matrix", "rule"), BAD)
def test_a_matrix_that_is_none_has_no_factor(matrix, rule):
    with pytest.raises(InvalidParameterError, match=f"^matrix {rule}"):
        certeig.factorize(matrix)


def test_what_a_message_says_to_pass_is_solved():
    dense = CHAIN.toarray()
    assert certeig.eigenpairs(sp.csr_array(dense), k=1).certificate.complete
    hermitian = sp.csr_array(
        CHAIN + 1j * sp.diags_array([0.5, -0.5], offsets=[1, -1], shape=(6, 6))
    )
    re, im = hermitian.real, hermitian.imag
    spectrum = certeig.eigenpairs(sp.block_array([[re, -im], [im, re]]), k=12)
    exact = np.repeat(np.linalg.eigvalsh(hermitian.toarray()), 2)
    np.testing.assert_allclose(spectrum.eigenvalues, exact, atol=1e-12)


def test_matrices_of_two_sizes():
    with pytest.raises(InvalidParameterError, match=r"same shape; the shapes are \(6, 6\) and \(5"):
        certeig.eigenpairs(CHAIN, ONES[:5, :5], k=1)


@pytest.mark.parametrize("n", [6, 900])
@pytest.mark.parametrize(
    ("mass", "rule"),
    [
        (lambda n: with_entries(sp.eye_array(n), 0.0, (2, 2)), r"entry \(2, 2\) is 0\.0"),
        (lambda n: with_entries(sp.eye_array(n), -1.0, (2, 2)), r"entry \(2, 2\) is -1\.0"),
        (lambda n: with_entries(sp.eye_array(n), 1.0, (2, 3), (3, 2)), r".* at row [23]"),
        (lambda n: with_entries(sp.eye_array(n), 2.0, (2, 3), (3, 2)), r".* at row [23]"),
        (lambda n: known.laplacian(known.adjacency(n)), r".* at row \d+"),
    ],
)
def test_a_mass_that_is_semidefinite_or_indefinite(n, mass, rule):
    with pytest.raises(InvalidParameterError, match=rf"^B must be positive definite; {rule}"):
        certeig.eigenpairs(known.string(n), mass(n), k=1)


def test_entries_too_far_apart_for_floats():
    for name, pair in [
        ("W", (sp.diags_array([1.0, 1e-150]), None)),
        ("B", (sp.eye_array(2), sp.diags_array([1.0, 1e-150]))),
    ]:
        with pytest.raises(InvalidParameterError, match=rf"diagonal of {name} must lie within"):
            certeig.eigenpairs(*pair, k=1)


@pytest.mark.parametrize(("of_w", "of_b"), [(1e200, 1e-200), (1e-200, 1e200), (1e-308, 1.0)])
def test_eigenvalues_beyond_the_range_of_floats(of_w, of_b):
    with pytest.raises(InvalidParameterError, match=r"range of floats; trace W / trace B is about"):
        certeig.eigenpairs(of_w * CHAIN, of_b * ONES, k=1)


def test_largest_eigenvalues_beyond_the_range_of_floats():
    masses = sp.diags_array([1.0, *np.full(5, 1e-9)])
    with pytest.raises(InvalidParameterError, match=r"range of floats; number \d does not"):
        certeig.eigenpairs(1e300 * CHAIN, masses, k=6)


def test_more_pairs_than_memory(monkeypatch):
    monkeypatch.setattr("certeig.kit.memory.available_memory", lambda *_: 10**6)
    with pytest.raises(InvalidParameterError, match=r"40 pairs of 900 rows.* Request fewer pairs"):
        certeig.eigenpairs(known.string(900), k=40)


def test_an_attribute_that_is_none():
    with pytest.raises(AttributeError, match=r"certeig has no attribute 'eigsh'"):
        certeig.eigsh  # noqa: B018


@pytest.mark.parametrize("entry", [0.0, 1e-200])
def test_a_factor_that_is_none(entry):
    swap = sp.csr_array([[entry, 1e200], [1e200, entry]])
    with pytest.raises(InvalidParameterError, match=r"a pivot is zero or overflows. Add a small"):
        certeig.factorize(swap)


@pytest.mark.parametrize("right", [np.arange(6.0), list(range(6)), np.eye(6), np.ones((6, 19))])
def test_a_factor_solves_vectors_lists_and_columns(right):
    factor = certeig.factorize(CHAIN)
    np.testing.assert_allclose(CHAIN @ factor.solve(right), right, atol=1e-14)
    assert factor.solve(right).shape == np.shape(right)
    assert factor.n_negative == 0
    assert certeig.factorize(-CHAIN).n_negative == 6
    assert (factor.rounding() < 1e-14).all()


@pytest.mark.parametrize(
    ("right", "rule"),
    [
        (np.ones(5), r"right must have shape \(6,\) or \(6, b\); its shape is \(5,\)"),
        (np.ones((1, 6)), r"right must have shape .* is \(1, 6\)"),
        (np.ones((6, 1, 1)), r"right must have shape .* is \(6, 1, 1\)"),
        (1.0, r"right must have shape .* is \(\)"),
        (1j * np.ones(6), r"right must be real numbers; the type is complex128"),
        ("text", r"right must be real numbers"),
    ],
)
def test_what_a_factor_cannot_solve(right, rule):
    with pytest.raises(InvalidParameterError, match=rule):
        certeig.factorize(CHAIN).solve(right)
