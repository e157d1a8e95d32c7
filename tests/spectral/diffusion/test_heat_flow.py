"""Heat that flows for a time: the laws of the heat operator, by factors and by modes."""

from functools import cache

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import boundary_vertices, disjoint_union
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.shapes.surfaces import grid, icosphere, torus
from eigenshape.spectral.diffusion.heat_flow import apply_heat
from eigenshape.spectral.solve import solve_spectrum

TORUS = torus(18, 11)
OPERATORS = {
    "lumped": cotangent_laplacian(TORUS),
    "consistent": cotangent_laplacian(TORUS, "consistent"),
    "kernel": mesh_laplacian(TORUS),
    "parts": cotangent_laplacian(disjoint_union(icosphere(1), torus(12, 9))),
    "fixed boundary": dirichlet_laplacian(
        cotangent_laplacian(grid(12, 9)), boundary_vertices(grid(12, 9))
    )[0],
}
TIMES = np.array([1e-9, 1e-3, 0.1, 1.0, 30.0, 1e5])


@cache
@one_blas_thread()
def dense_pairs(laplacian):
    """Return all eigenpairs of the dense pencil; eigenvalues of constants are 0."""
    values, vectors = sl.eigh(laplacian.stiffness.toarray(), laplacian.mass.toarray())
    values[values < 1e-12 * values[-1]] = 0
    return values, vectors


def exact_heat(laplacian, columns, t):
    values, vectors = dense_pairs(laplacian)
    return vectors @ (np.exp(-t * values)[:, None] * (vectors.T @ (laplacian.mass @ columns)))


def norms(laplacian, columns):
    return np.sqrt(np.einsum("nc,nc->c", columns, laplacian.mass @ columns))


def some_columns(laplacian, seed=0):
    return np.random.default_rng(seed).standard_normal((laplacian.n_points, 3))


@pytest.mark.parametrize("accuracy", [1e-4, 1e-10, 1e-12])
@pytest.mark.parametrize("name", OPERATORS)
def test_the_error_is_at_most_the_stated_one(name, accuracy):
    laplacian = OPERATORS[name]
    columns = some_columns(laplacian)
    found = apply_heat(laplacian, columns, TIMES, accuracy=accuracy)
    assert found.shape == (*columns.shape, len(TIMES))
    for place, t in enumerate(TIMES):
        error = norms(laplacian, found[:, :, place] - exact_heat(laplacian, columns, t))
        # Beside the accuracy: rounding, of a spectrum whose eigenvalues span 1e4.
        assert (error <= (accuracy + 2e-11) * norms(laplacian, columns)).all()


@settings(max_examples=8, deadline=None)
@given(
    st.sampled_from(sorted(OPERATORS)),
    st.floats(1e-4, 10.0),
    st.floats(1e-4, 10.0),
    st.integers(0, 99),
)
def test_heat_operators_are_a_semigroup_of_symmetric_operators(name, s, t, seed):
    laplacian = OPERATORS[name]
    f, g, _ = some_columns(laplacian, seed).T
    size = norms(laplacian, np.column_stack([f, g]))
    twice = apply_heat(laplacian, apply_heat(laplacian, f, s), t)
    once = apply_heat(laplacian, f, s + t)
    assert norms(laplacian, (twice - once)[:, None])[0] <= 4e-10 * size[0]
    left, right = apply_heat(laplacian, f, t), apply_heat(laplacian, g, t)
    assert abs(left @ (laplacian.mass @ g) - f @ (laplacian.mass @ right)) <= 1e-11 * size.prod()


@pytest.mark.parametrize("name", ["lumped", "consistent", "kernel", "parts"])
def test_no_heat_is_lost_in_any_part(name):
    laplacian = OPERATORS[name]
    columns = some_columns(laplacian)
    found = apply_heat(laplacian, columns, TIMES)
    labels = np.repeat([0, 1], [42, 108]) if name == "parts" else np.zeros(laplacian.n_points)
    for label in np.unique(labels):
        total = laplacian.mass @ (labels == label)
        before, after = total @ columns, np.einsum("n,ncq->cq", total, found)
        np.testing.assert_allclose(after, np.tile(before[:, None], len(TIMES)), atol=1e-12)


def test_through_a_fixed_boundary_heat_is_lost():
    laplacian = OPERATORS["fixed boundary"]
    totals = laplacian.mass.diagonal() @ apply_heat(
        laplacian, np.ones(laplacian.n_points), [0.01, 0.1, 1.0]
    )
    assert (np.diff(totals) < 0).all()
    assert totals[-1] < 1e-7


@pytest.mark.parametrize("stiff", [4, 0])
def test_one_stiff_pair_does_not_hide_a_fixed_boundary(stiff):
    weights = np.ones(8)
    weights[stiff] = 1e11
    rows = np.append(weights, 0) + np.append(1.0, weights)  # left of point 0 the boundary is fixed
    stiffness = sp.csr_array(sp.diags_array([-weights, rows, -weights], offsets=[-1, 0, 1]))
    laplacian = Laplacian(stiffness, sp.csr_array(sp.eye_array(9)))
    found = apply_heat(laplacian, np.ones(9), [0.1, 0.4])
    exact = np.stack([sl.expm(-t * glued(stiff)) @ np.ones(8) for t in (0.1, 0.4)], axis=1)
    np.testing.assert_allclose(np.delete(found, stiff, axis=0), exact, atol=1e-4)


def glued(stiff):
    """Return B⁻¹W of the path of unit weights whose points `stiff` and `stiff + 1` are one."""
    stiffness = np.diag(np.append(np.full(7, 2.0), 1.0)) - np.eye(8, k=1) - np.eye(8, k=-1)
    mass = np.ones(8)
    mass[stiff] = 2
    return stiffness / mass[:, None]


def test_heat_of_one_sign_keeps_it_where_no_weight_is_negative():
    laplacian = cotangent_laplacian(icosphere(2))  # all angles are acute
    point = np.zeros(laplacian.n_points)
    point[7] = 1
    found = apply_heat(laplacian, point, TIMES)
    worst = 1e-10 * np.sqrt(laplacian.mass.diagonal()[7] / laplacian.mass.diagonal())
    assert (found >= -worst[:, None]).all()
    assert found.max() <= 1 + 1e-10
    assert (found[:, 2] > 0).all()  # and it is everywhere at once


def test_at_first_all_heat_is_where_it_was_and_in_the_end_it_is_even():
    laplacian = OPERATORS["lumped"]
    values = some_columns(laplacian)[:, 0]
    found = apply_heat(laplacian, values, [1e-13, 1e6])
    np.testing.assert_allclose(found[:, 0], values, atol=1e-9)
    mean = laplacian.mass.diagonal() @ values / laplacian.mass.sum()
    np.testing.assert_allclose(found[:, 1], mean, atol=1e-12)


@pytest.mark.parametrize("scale", [2.0**-200, 2.0**300, 1e-100])
def test_units_change_nothing(scale):
    values = TORUS.vertices[:, 0]
    mesh = TriangleMesh(TORUS.vertices * scale, TORUS.faces)
    found = apply_heat(cotangent_laplacian(TORUS), values, [0.01, 0.3])
    scaled = apply_heat(cotangent_laplacian(mesh), values, np.array([0.01, 0.3]) * scale * scale)
    if scale == 1e-100:
        np.testing.assert_allclose(scaled, found, rtol=1e-9, atol=1e-12)
    else:
        np.testing.assert_array_equal(scaled, found)  # powers of two change no digit


def test_with_a_spectrum_the_error_is_at_most_what_the_last_eigenvalue_leaves():
    laplacian = OPERATORS["lumped"]
    spectrum = solve_spectrum(laplacian, 60)
    columns = some_columns(laplacian)
    modes = spectrum.eigenvectors
    rest = norms(laplacian, columns - modes @ (modes.T @ (laplacian.mass @ columns)))
    for t in (0.01, 0.1, 0.5):
        error = norms(
            laplacian, apply_heat(spectrum, columns, t) - exact_heat(laplacian, columns, t)
        )
        assert (error <= np.exp(-t * spectrum.eigenvalues[-1]) * rest + 1e-12).all()
        assert error.max() > 1e-3 * np.exp(-t * spectrum.eigenvalues[-1])  # the bound is no luxury
    whole = solve_spectrum(laplacian, laplacian.n_points)
    np.testing.assert_allclose(
        apply_heat(whole, columns, [1e-3, 0.2], accuracy=1e-12),
        apply_heat(laplacian, columns, [1e-3, 0.2]),
        atol=1e-9,
    )


def test_shapes_of_results():
    laplacian = OPERATORS["lumped"]
    spectrum, n = solve_spectrum(laplacian, 9), laplacian.n_points
    for operator in (laplacian, spectrum):
        assert apply_heat(operator, np.ones(n), 1.0).shape == (n,)
        assert apply_heat(operator, np.ones((n, 2)), 1.0).shape == (n, 2)
        assert apply_heat(operator, np.ones(n), [1.0, 2.0, 0.5]).shape == (n, 3)
        assert apply_heat(operator, np.ones((n, 2), dtype=int), [1.0]).shape == (n, 2, 1)
    many = apply_heat(laplacian, TORUS.vertices, TIMES[::-1])
    np.testing.assert_array_equal(many, apply_heat(laplacian, TORUS.vertices, TIMES)[:, :, ::-1])


def test_progress_ends_at_one():
    heard = []
    apply_heat(
        OPERATORS["lumped"],
        TORUS.vertices,
        [0.01, 1.0],
        progress=lambda share, message: heard.append(share),
    )
    assert heard == sorted(heard)
    assert heard[-1] == 1.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.ones(5), r"shape \(198,\) or \(198, k\) for k functions; the shape is \(5,\)"),
        (np.ones((1, 198)), "values must hold one number per point, .* Transpose it"),
        (
            np.where(np.arange(198) == 6, np.nan, 1.0),
            "values must be finite; entry 6 is nan",
        ),
    ],
)
def test_values_that_do_not_fit_are_named(values, message):
    with pytest.raises(InvalidParameterError, match=message):
        apply_heat(OPERATORS["lumped"], values, 1.0)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_times_that_are_not_positive_are_named(bad):
    for operator in (OPERATORS["lumped"], solve_spectrum(OPERATORS["lumped"], 5)):
        with pytest.raises(InvalidParameterError, match="t must be positive and finite; entry 1"):
            apply_heat(operator, np.ones(198), [1.0, bad])


def test_a_time_beyond_all_digits_is_refused_and_a_spectrum_takes_it():
    laplacian = OPERATORS["lumped"]
    with pytest.raises(InvalidParameterError, match="Without a spectrum t must be at most") as info:
        apply_heat(laplacian, np.ones(198), 1e12)
    limit = float(str(info.value).split("at most ")[1].split(",")[0])
    np.testing.assert_allclose(apply_heat(laplacian, np.ones(198), 0.99 * limit), 1, atol=1e-9)
    of_modes = apply_heat(solve_spectrum(laplacian, 3), np.ones(198), 2 * limit)
    np.testing.assert_allclose(of_modes, 1, atol=1e-5)


@pytest.mark.parametrize("accuracy", [0.5, 1e-14, np.nan])
def test_accuracies_that_cannot_be_had_are_refused(accuracy):
    with pytest.raises(InvalidParameterError, match=r"accuracy must lie in 1e-12\.\.0\.1; it is"):
        apply_heat(OPERATORS["lumped"], np.ones(198), 1.0, accuracy=accuracy)


def test_a_spectrum_that_is_too_short_for_the_accuracy_is_refused():
    laplacian = OPERATORS["lumped"]
    spectrum = solve_spectrum(laplacian, 20)
    with pytest.raises(InvalidParameterError, match="20 pairs leave up to") as info:
        apply_heat(spectrum, np.ones(198), 0.3, accuracy=1e-3)
    below = float(str(info.value).split("below ")[1].split(",")[0])
    longer = solve_spectrum(laplacian, below=1.05 * below)
    longer = solve_spectrum(laplacian, len(longer.eigenvalues) + 1)
    assert apply_heat(longer, np.ones(198), 0.3, accuracy=1e-3).shape == (198,)


def test_a_corrected_kernel_needs_a_spectrum():
    laplacian = mesh_laplacian(TORUS, correct="log")
    with pytest.raises(InvalidParameterError, match="operator must be given by its matrices"):
        apply_heat(laplacian, np.ones(198), 0.3)
    np.testing.assert_allclose(
        apply_heat(solve_spectrum(laplacian, 5), np.ones(198), 0.3), 1, atol=1e-9
    )


def test_an_operator_that_makes_heat_is_refused():
    edges = sp.csr_array(np.array([[-1.0, 1.0], [1.0, -1.0]]))
    with pytest.raises(InvalidParameterError, match="must have no negative eigenvalue, or heat"):
        apply_heat(Laplacian(edges, sp.csr_array(np.eye(2))), [1.0, 0.0], 30.0)
