from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
import scipy.sparse as sp
from pencils import cycle, dense_eigenvalues, graph, hypercube, path, tetrahedra, wild

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.mesh_files import read_mesh
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.multilevel import aggregation, approximate
from eigenshape.spectral.multilevel import davidson as refinement
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

solve_roughly = partial(solve_spectrum, method="approximate")
RING = cotangent_laplacian(torus(36, 24))
SIX = cotangent_laplacian(disjoint_union(*[icosphere(2)] * 6))


@pytest.fixture(autouse=True)
def never_certify(monkeypatch):
    """Take the multilevel solver where the certified one is as fast."""
    monkeypatch.setattr(approximate, "CERTIFIED_POINTS", 0)


@pytest.fixture
def always_coarsen(monkeypatch):
    """Take the road of large operators, also for small ones."""
    monkeypatch.setattr(approximate, "EXACT_POINTS", 0)
    monkeypatch.setattr(approximate, "COARSENED", 3)


def require_near(laplacian, k, accuracy, expected=None):
    """Compare with exact eigenvalues: the accuracy is reached, and every bound holds."""
    found = solve_roughly(laplacian, k, accuracy=accuracy, max_residual=accuracy)
    assert found.certificate.count is None
    every = dense_eigenvalues(laplacian) if expected is None else expected
    rounding = 1e-12 * every[-1]
    assert (found.residuals <= 1.01 * accuracy * found.eigenvalues[-1] + rounding).all()
    distances = np.abs(every[:, None] - found.eigenvalues).min(axis=0)
    assert (distances <= found.residuals + rounding).all()
    np.testing.assert_allclose(
        found.eigenvalues, every[:k], atol=accuracy * every[k - 1] + rounding
    )
    gram = found.eigenvectors.T @ (found.mass @ found.eigenvectors)
    np.testing.assert_allclose(gram, np.eye(k), atol=1e-10)
    return np.abs(found.eigenvalues - every[:k]).max() / every[k - 1]


@cache
def ball():
    return cotangent_laplacian(icosphere(3))


@pytest.mark.parametrize("accuracy", [0.1, 1e-3, 1e-6, 1e-10])
@pytest.mark.parametrize("k", [4, 9, 12, 40])
def test_the_accuracy_asked_for_is_reached_on_a_sphere(always_coarsen, k, accuracy):
    assert require_near(ball(), k, accuracy) < max(
        accuracy / 10, 1e-12
    )  # quotients err by the square of residuals


@pytest.mark.parametrize("accuracy", [0.1, 1e-2, 1e-4])
@pytest.mark.parametrize("laplacian", [ball(), RING, SIX], ids=["sphere", "torus", "6 spheres"])
def test_the_estimate_is_not_below_the_error(always_coarsen, laplacian, accuracy):
    every = dense_eigenvalues(laplacian)[:20]
    found = solve_roughly(laplacian, 20, accuracy=accuracy)
    estimate = found.certificate.estimate
    assert estimate <= accuracy
    assert np.abs(found.eigenvalues - every).max() <= estimate * every[-1] + 1e-11 * every[-1]
    assert f"by about {estimate:.1e} of the largest" in found.certificate.explain()


@pytest.mark.long
@pytest.mark.parametrize(
    "laplacian",
    [
        RING,
        SIX,
        cotangent_laplacian(tetrahedra(200)),
        dirichlet_laplacian(cotangent_laplacian(icosphere(3)), np.arange(20))[0],
        graph(path(700)),
        graph(cycle(700)),
        graph(sp.kronsum(cycle(26), cycle(26))),
        graph(hypercube(10)),
        graph(np.ones((640, 640)) - np.eye(640)),
    ],
    ids=[
        "torus",
        "6 spheres",
        "tetrahedra",
        "held",
        "path",
        "cycle",
        "flat torus",
        "hypercube",
        "complete",
    ],
)
@pytest.mark.parametrize("k", [3, 11, 30])
def test_operators_of_any_kind(always_coarsen, laplacian, k):
    every = dense_eigenvalues(laplacian)
    if every[k - 1] < 1e-9:  # all of them are 0: what is near to 0 is judged by the next scale
        found = solve_roughly(laplacian, k)
        assert found.eigenvalues.max() < 1e-6 * every[-1]
        return
    require_near(laplacian, k, 1e-3, every)


@pytest.mark.long
def test_what_aggregates_cannot_see_is_found_by_a_last_look(always_coarsen, monkeypatch):
    laplacian = graph(hypercube(10))  # bits that change within aggregates only
    require_near(laplacian, 12, 1e-3)
    monkeypatch.setattr(
        refinement, "_look_again", lambda tower, columns, values, k, bound, seed: values
    )
    found = solve_roughly(laplacian, 12)
    assert abs(found.eigenvalues[10] - 2.0) > 0.1  # ten copies of 2, and one of them missing
    assert not found.certificate.complete


def test_indicators_serve_where_smoothed_aggregates_do_not(always_coarsen, monkeypatch):
    honest, calls = approximate._solve_coarsest, []

    def fail_once(*arguments):
        calls.append(arguments)
        if len(calls) == 1:
            raise ConvergenceError("No.")
        return honest(*arguments)

    monkeypatch.setattr(approximate, "_solve_coarsest", fail_once)
    found = solve_roughly(ball(), 9)
    np.testing.assert_allclose(found.eigenvalues, dense_eigenvalues(ball())[:9], atol=1e-3 * 12)
    assert found.certificate.fallbacks == ("smoothed aggregates: No.",)
    assert found.certificate.explain().endswith("Tried before, in vain: smoothed aggregates: No.")


def test_kernels_are_corrected_as_by_the_exact_solver():
    laplacian = mesh_laplacian(fibonacci_sphere(1500), edge_factor=2.0, correct="log")
    exact = solve_spectrum(laplacian, 25)
    found = solve_roughly(laplacian, 25, accuracy=1e-6, max_residual=1e-6)
    assert not found.certificate.complete
    np.testing.assert_allclose(found.eigenvalues, exact.eigenvalues, rtol=1e-9, atol=1e-9)
    assert (np.abs(found.eigenvalues - exact.eigenvalues) <= found.residuals + 1e-10).all()
    with pytest.warns(UserWarning, match=r"are too close to 1/t"):
        solve_roughly(mesh_laplacian(icosphere(3), edge_factor=2.0), 70)


@pytest.mark.data
@pytest.mark.parametrize("name", ["classics/bunny.off", "retrieval/octopus/psb124.ply"])
def test_scans(data, name):
    laplacian = cotangent_laplacian(read_mesh(data / name))
    exact = solve_spectrum(laplacian, 30)
    found = solve_roughly(laplacian, 30, max_residual=1e-3)
    assert not found.certificate.complete
    scale = exact.eigenvalues[-1]
    assert found.residuals.max() <= 1.01e-3 * scale
    np.testing.assert_allclose(found.eigenvalues, exact.eigenvalues, atol=2e-4 * scale)


@pytest.mark.long
@pytest.mark.parametrize("options", [{}, {"accuracy": 1e-2}, {"max_residual": 1e-9}])
def test_up_to_100_000_points_pairs_are_certified(monkeypatch, options):
    monkeypatch.undo()
    ball = cotangent_laplacian(icosphere(4))
    found, exact = solve_roughly(ball, 9, **options), solve_spectrum(ball, 9)
    assert found.certificate.complete
    np.testing.assert_array_equal(found.eigenvalues, exact.eigenvalues)
    # An operator that the certified method would not factor either is approximated.
    dense = mesh_laplacian(icosphere(4), h=0.3)
    assert dense.stiffness.nnz > 100 * dense.n_points
    assert not solve_roughly(dense, 9, **options | {"max_residual": None}).certificate.complete


@pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")
def test_few_points_are_solved_and_proved():
    found = solve_roughly(cotangent_laplacian(icosphere(2)), 9)
    assert found.certificate.complete
    assert found.certificate.count == found.certificate.n_found
    nothing = Laplacian(sp.csr_array((700, 700)), sp.csr_array(sp.eye_array(700)))
    assert solve_roughly(nothing, 3).certificate.complete  # no two points can be joined


def test_the_certificate_says_that_nothing_was_counted(tmp_path):
    found = solve_roughly(cotangent_laplacian(icosphere(4)), 6)
    proof = found.certificate
    assert (proof.complete, proof.count, proof.n_missing, proof.n_pairs) == (False, None, 0, 6)
    text = proof.explain()
    assert text.startswith("These are approximations, 6 of them: by what the last round")
    assert text.endswith(
        "Whether one is missing was not counted; the certified method of solve_spectrum proves that none is."
    )
    found.save(tmp_path / "rough.npz")
    assert Spectrum.load(tmp_path / "rough.npz").certificate == proof


def test_same_input_gives_the_same_bits():
    laplacian = cotangent_laplacian(icosphere(4))
    one, two = solve_roughly(laplacian, 12), solve_roughly(laplacian, 12)
    assert np.array_equal(one.eigenvalues, two.eigenvalues)
    assert np.array_equal(one.eigenvectors, two.eigenvectors)


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_units_change_nothing(scale):
    mesh = torus(60, 40)
    far = solve_roughly(
        cotangent_laplacian(TriangleMesh(mesh.vertices * scale, mesh.faces)), 12, max_residual=1e-3
    )
    one = solve_roughly(cotangent_laplacian(mesh), 12, max_residual=1e-3)
    assert not far.certificate.complete
    np.testing.assert_allclose(
        far.eigenvalues * scale * scale, one.eigenvalues, rtol=1e-6, atol=1e-9
    )
    np.testing.assert_allclose(far.residuals.max() * scale * scale, one.residuals.max(), rtol=0.5)


def test_the_order_of_points_does_not_matter():
    laplacian = cotangent_laplacian(torus(60, 40))
    order = np.random.default_rng(0).permutation(laplacian.n_points)
    mixed = Laplacian(laplacian.stiffness[order][:, order], laplacian.mass[order][:, order])
    one, two = (
        solve_roughly(each, 12, accuracy=1e-6, max_residual=1e-6) for each in (laplacian, mixed)
    )
    np.testing.assert_allclose(two.eigenvalues, one.eigenvalues, rtol=1e-9, atol=1e-9)


def test_several_levels(monkeypatch):
    monkeypatch.setattr(approximate, "COARSEST", 100)
    monkeypatch.setattr(approximate, "COARSEST_PER_PAIR", 1)
    monkeypatch.setattr(aggregation, "LARGEST", 64)
    laplacian = cotangent_laplacian(fibonacci_sphere(12000))
    said = []
    found = solve_roughly(laplacian, 9, accuracy=1e-5, progress=lambda *parts: said.append(parts))
    exact = solve_spectrum(laplacian, 9)
    np.testing.assert_allclose(
        found.eigenvalues, exact.eigenvalues, atol=1e-5 * exact.eigenvalues[-1]
    )
    shares, words = [share for share, _ in said], {each for _, each in said}
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert {"refining on level 1 of 2", "refining on level 2 of 2"} <= words


def test_bad_input_is_refused_by_name():
    laplacian = cotangent_laplacian(icosphere(3))
    with pytest.raises(InvalidParameterError, match="k must"):
        solve_roughly(laplacian, 0)
    for accuracy in (1e-11, 0.2, np.nan):
        with pytest.raises(
            InvalidParameterError, match=r"accuracy must lie in 1e-10\.\.0\.1; it is"
        ):
            solve_roughly(laplacian, 3, accuracy=accuracy)
        with pytest.raises(
            InvalidParameterError, match=r"max_residual must lie in 1e-10\.\.0\.1; it is"
        ):
            solve_roughly(laplacian, 3, max_residual=accuracy)
    with pytest.raises(
        InvalidParameterError,
        match=r"mass must be diagonal for approximate eigenpairs; entry \(0, \d+\) is 0\.00",
    ):
        solve_roughly(cotangent_laplacian(icosphere(3), "consistent"), 3)


def test_an_indefinite_stiffness_is_refused(always_coarsen):
    laplacian = cotangent_laplacian(icosphere(3))
    lowered = replace(laplacian, stiffness=sp.csr_array(laplacian.stiffness - 3.0 * laplacian.mass))
    with pytest.raises(
        InvalidParameterError,
        match=r"stiffness must be positive semidefinite; eigenvalue 0 is -(3|2\.99)",
    ):
        solve_roughly(lowered, 20)


def test_what_does_not_converge_is_not_returned(always_coarsen, monkeypatch):
    with pytest.raises(
        ConvergenceError,
        match=r"Smoothed eigenvectors must be independent; fewer than 24 are\. The weights",
    ):
        solve_roughly(
            wild(), 12, max_residual=1e-3
        )  # weights over eight decades: the way to the exact solver
    monkeypatch.setattr(approximate, "MOST_ROUNDS", 0)
    with pytest.raises(
        ConvergenceError,
        match=r"estimated at no more than 1\.0e-10 of the last eigenvalue, .* after 0 rounds these are .*"
        r"Request less accuracy, or solve with method='certified'",
    ):
        solve_roughly(cotangent_laplacian(icosphere(4)), 12, accuracy=1e-10)


@pytest.mark.parametrize("which", ["smooth", "correct"])
def test_corrections_that_overflow_are_refused(always_coarsen, monkeypatch, which):
    monkeypatch.setattr(
        refinement, which, lambda tower, block, shifts, steps: np.full_like(block, np.inf)
    )
    with pytest.raises(
        ConvergenceError,
        match=r"Corrections must be finite; those of eigenvector [01] overflow\. The",
    ):
        solve_roughly(cotangent_laplacian(icosphere(4)), 12, accuracy=1e-10)


def test_what_does_not_fit_is_refused_with_numbers(monkeypatch):
    laplacian = cotangent_laplacian(icosphere(4))
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 1e5)
    with pytest.raises(
        InvalidParameterError,
        match=r"9 pairs of 2562 points that is about 0\.0 GiB of bases, 0\.0 GiB of levels of their",
    ):
        solve_roughly(laplacian, 9)


CENSUS = {
    "icosphere 3": lambda: cotangent_laplacian(icosphere(3)),
    "icosphere 4": lambda: cotangent_laplacian(icosphere(4)),
    "torus": lambda: cotangent_laplacian(torus(48, 32)),
    "4 icospheres": lambda: cotangent_laplacian(disjoint_union(*[icosphere(2)] * 4)),
    "6 icospheres": lambda: cotangent_laplacian(disjoint_union(*[icosphere(2)] * 6)),
    "12 icospheres": lambda: cotangent_laplacian(disjoint_union(*[icosphere(2)] * 12)),
    "5 tori": lambda: cotangent_laplacian(disjoint_union(*[torus(16, 12)] * 5)),
    "cycle": lambda: graph(cycle(900)),
    "flat torus": lambda: graph(sp.kronsum(cycle(30), cycle(30))),
    "3-torus": lambda: graph(sp.kronsum(sp.kronsum(cycle(10), cycle(10)), cycle(10))),
    "hypercube": lambda: graph(hypercube(10)),
}


@pytest.mark.long
@pytest.mark.sweep
@pytest.mark.parametrize("name", CENSUS)
def test_census_of_missing_eigenvalues(always_coarsen, name):
    laplacian = CENSUS[name]()
    every = dense_eigenvalues(laplacian)
    # Numbers that cut multiple eigenvalues and that keep them, each with one of the accuracies.
    for accuracy, ks in (
        (0.1, (2, 5, 9, 13, 20, 25, 36, 48, 56)),
        (1e-3, (3, 7, 10, 16, 24, 31, 40, 49, 60)),
    ):
        for k in ks:
            found = solve_roughly(laplacian, k, accuracy=accuracy).eigenvalues
            errors = np.abs(found - every[:k])
            assert (errors <= accuracy * every[k - 1] + 1e-9).all(), (k, accuracy)
