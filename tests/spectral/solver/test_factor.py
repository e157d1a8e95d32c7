from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from pencils import dense_eigenvalues, graph, path, wild

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.solver import shift as shift_module
from certeig.solver.factor import Factor
from certeig.solver.shift import factorize_near, shift_inside
from certeig.sparse.front_loops import WIDE
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.fem import fem_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.pencils import normalize


def scaled_back(pencil, value):
    return float(np.ldexp(value, -pencil.value_exponent))


def test_pivots_count_the_eigenvalues_below_the_shift():
    pencil = normalize(graph(path(3)))  # eigenvalues 0, 1, 3
    counts = [
        Factor.at(pencil, scaled_back(pencil, shift)).count for shift in (-0.5, 0.5, 1.5, 2.9, 3.1)
    ]
    assert counts == [0, 1, 2, 2, 3]


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_counts_agree_with_a_dense_solve(mass):
    laplacian = cotangent_laplacian(icosphere(2), mass)
    pencil, reference = normalize(laplacian), dense_eigenvalues(laplacian)
    for shift in np.linspace(0.7, 0.99 * reference[-1], 23):
        assert Factor.at(pencil, scaled_back(pencil, shift)).count == np.count_nonzero(
            reference < shift
        )


def test_a_zero_pivot_is_no_factor():
    pencil = normalize(graph(path(2)))  # at σ = 1 the diagonal is zero and pivots would leave it
    assert Factor.at(pencil, scaled_back(pencil, 1.0)) is None
    assert (
        Factor.at(normalize(Laplacian(sp.csr_array((2, 2)), sp.csr_array(sp.eye_array(2)))), 0.0)
        is None
    )


def unpacked(factor):
    e, lower = factor.elimination, np.eye(len(factor.pivots))
    for s in range(len(e.above)):
        rows, at = e.rows[e.begins[s] : e.begins[s + 1]], e.places[s]
        for start in range(e.first[s], e.first[s + 1], WIDE):
            columns = np.arange(start, min(start + WIDE, e.first[s + 1]))
            tall = rows[start - e.first[s] :]
            lower[np.ix_(tall, columns)] = factor.panels[
                at : at + len(tall) * len(columns)
            ].reshape(len(tall), -1)
            at += len(tall) * len(columns)
    return np.tril(lower)


@pytest.mark.parametrize("laplacian", [wild(16), cotangent_laplacian(icosphere(2), "consistent")])
@pytest.mark.parametrize("share", [0.1, 0.3, 1.0])
def test_the_rounding_bound_covers_the_rounding(laplacian, share):
    pencil = normalize(laplacian)
    factor = Factor.at(pencil, share * pencil.level)
    lower, pivots = np.longdouble(unpacked(factor.lower)), np.longdouble(factor.lower.pivots)
    order = factor.lower.elimination.order
    matrix = (pencil.stiffness - factor.shift * pencil.mass).toarray()[np.ix_(order, order)]
    product = lower @ (pivots[:, None] * lower.T)  # L D Lᵀ in extended precision
    error = np.abs(product - matrix).sum(axis=1)
    assert (error <= factor.rounding()[order]).all()
    assert error.max() > 0
    assert factor.count == np.count_nonzero(pivots < 0)


def test_slack_is_taken_off_the_diagonal():
    pencil = normalize(graph(path(30)))
    slack = np.full(30, 0.11)
    one, two = (
        Factor.at(pencil, 0.37, slack),
        Factor.at(pencil, 0.48),
    )  # B is 1, so slack is a shift
    assert one.count == two.count > Factor.at(pencil, 0.37).count
    right = np.arange(30.0)[:, None]
    np.testing.assert_allclose(one.solve(right), two.solve(right))


@pytest.mark.parametrize("k", [1, 2, 10, 60])
@pytest.mark.parametrize("laplacian", [cotangent_laplacian(icosphere(3)), graph(path(500)), wild()])
def test_the_shift_stands_among_the_wanted(laplacian, k):
    count = shift_inside(normalize(laplacian), k).count
    assert 0.45 * k - 3 <= count <= min(0.78 * k + 1, k)


def test_a_shift_without_a_factor_is_an_error(monkeypatch):
    monkeypatch.setattr(shift_module.Factor, "at", lambda *args: None)
    with pytest.raises(
        ConvergenceError,
        match=r"must have its pivots on the diagonal, and little rounding; none has",
    ):
        factorize_near(normalize(graph(path(9))), 0.3)


def test_units_are_powers_of_two_and_leave_digits_alone():
    laplacian = cotangent_laplacian(icosphere(1))
    far = Laplacian(laplacian.stiffness, sp.csr_array(laplacian.mass * 2.0**600))
    one, two = normalize(laplacian), normalize(far)
    assert one.value_exponent - two.value_exponent == 600
    assert np.array_equal(one.mass.toarray(), two.mass.toarray())
    assert 1 <= one.mass_diagonal.max() < 4


def test_residual_bounds_hold_for_a_full_mass():
    laplacian = cotangent_laplacian(icosphere(1), "consistent")
    pencil = normalize(laplacian)
    reference = np.ldexp(dense_eigenvalues(laplacian), -pencil.value_exponent)
    vectors = np.random.default_rng(0).standard_normal((pencil.n, 7))
    values = np.linspace(0, reference[-1], 7)
    nearest = np.abs(reference[:, None] - values).min(axis=0)
    assert (nearest <= pencil.residual_norms(values, vectors)).all()
    assert 0.2 < pencil.mass_floor < 0.5


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("mesh", [icosphere(1), box(2, 2, 2)])
def test_the_floor_of_the_mass_that_elements_know_is_the_one_that_a_factor_proves(mesh, order):
    known = fem_laplacian(mesh, order)
    unknown = Laplacian(known.stiffness, known.mass)
    assert known.mass_floor > 0 == unknown.mass_floor
    assert normalize(known).mass_floor == normalize(unknown).mass_floor < 0.5
    # Of another mass nothing is known.
    assert replace(known, mass=known.mass + known.stiffness).mass_floor == 0


def test_an_indefinite_mass_is_refused():
    mass = sp.csr_array(np.array([[1.0, 1.5], [1.5, 2.0]]))
    with pytest.raises(InvalidParameterError, match=r"mass must be positive definite"):
        normalize(Laplacian(sp.csr_array((2, 2)), mass))
