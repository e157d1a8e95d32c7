import numpy as np
import pytest
import scipy.sparse as sp
from pencils import cycle, dense_eigenvalues, graph, hypercube, path, tetrahedra, wild

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.solver import strategy as roads
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.certify import certify
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.solve import solve_spectrum

pytestmark = pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")  # of pieces


@pytest.fixture
def always_lanczos(monkeypatch):
    """Take the road of large operators, also for small ones."""
    monkeypatch.setattr(roads, "DENSE_POINTS", 0)
    monkeypatch.setattr(roads, "DENSE_SHARE", 2.5)


def require_lowest(laplacian, ks):
    """Compare with all eigenvalues of a dense solve, none left out and none twice."""
    reference = dense_eigenvalues(laplacian)
    for k in ks:
        spectrum = solve_spectrum(laplacian, k)
        rounding = (
            1e-13 * reference[-1]
        )  # of the dense solve, whose errors are of the size of the largest eigenvalue
        np.testing.assert_allclose(
            spectrum.eigenvalues, reference[:k], rtol=1e-10, atol=rounding, err_msg=f"k = {k}"
        )
        equals = np.count_nonzero(
            np.abs(reference - reference[k - 1]) <= 1e-7 * reference[k - 1] + rounding
        )
        below = np.count_nonzero(reference < reference[k - 1] * (1 - 1e-7) - rounding)
        assert spectrum.certificate.n_split == below + equals - k, f"k = {k}"
    return len(ks)


def test_two_points_by_hand():
    laplacian = graph(
        [[0, 3], [3, 0]], mass=[1.0, 2.0]
    )  # W = [[3, -3], [-3, 3]], so λ = 0 and 3 (1/1 + 1/2)
    spectrum = solve_spectrum(laplacian, 2)
    np.testing.assert_allclose(spectrum.eigenvalues, [0, 4.5], atol=1e-15)
    np.testing.assert_allclose(spectrum.eigenvectors[:, 0], 1 / np.sqrt(3))
    np.testing.assert_allclose(spectrum.eigenvectors[:, 1], [2 / np.sqrt(6), -1 / np.sqrt(6)])


@pytest.mark.long
@pytest.mark.parametrize("mass", ["lumped", "consistent", "averaged"])
@pytest.mark.parametrize(
    "mesh",
    [
        tetrahedra(12),
        icosphere(2),
        torus(16, 12),
        disjoint_union(*[icosphere(1)] * 5),
    ],
    ids=["12 tetrahedra", "icosphere", "torus", "5 icospheres"],
)
def test_no_eigenvalue_is_missing_or_extra(always_lanczos, mesh, mass):
    assert require_lowest(cotangent_laplacian(mesh, mass), [1, 2, 4, 7, 12, 15]) == 6


MESHES = {
    "icosphere 1": icosphere(1),
    "icosphere 2": icosphere(2),
    "icosphere 3": icosphere(3),
    "12 tetrahedra": tetrahedra(12),
    "60 tetrahedra": tetrahedra(60),
    "torus": torus(36, 24),
    "6 icospheres": disjoint_union(*[icosphere(2)] * 6),
}
# Numbers at which copies end, and between.
NUMBERS = {
    "icosphere": (1, 4, 5, 9, 16, 17, 25, 36, 49, 64, 81, 100, 150, 200),
    "others": (1, 3, 11, 12, 13, 24, 30, 47, 59, 60, 61, 100, 180),
}


@pytest.mark.long
@pytest.mark.sweep
@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("name", MESHES)
def test_a_hundred_solves_miss_nothing(always_lanczos, name, turn):
    laplacian = cotangent_laplacian(MESHES[name], ("lumped", "consistent", "averaged")[turn])
    # Every other number, and the others with the next mass.
    numbers = NUMBERS["icosphere" if name.startswith("icosphere") else "others"][turn % 2 :: 2]
    assert require_lowest(laplacian, [k for k in numbers if k < laplacian.n_points]) >= 3


@pytest.mark.parametrize(
    "laplacian",
    [
        graph(path(400)),
        graph(cycle(400)),
        graph(sp.kronsum(cycle(20), cycle(20))),
        graph(sp.kronsum(sp.kronsum(cycle(7), cycle(7)), cycle(7))),
        graph(hypercube(9)),
        graph(np.ones((320, 320)) - np.eye(320)),
        Laplacian(sp.csr_array((320, 320)), sp.csr_array(sp.eye_array(320))),
        wild(),
    ],
    ids=["path", "cycle", "flat torus", "3-torus", "hypercube", "complete", "no edge", "wild"],
)
def test_operators_of_any_dimension(laplacian):
    assert require_lowest(laplacian, [1, 2, 5, 10, 33, 70]) == 6


def test_all_eigenvalues():
    laplacian = cotangent_laplacian(icosphere(2), "averaged")
    spectrum = solve_spectrum(laplacian, laplacian.n_points)
    np.testing.assert_allclose(
        spectrum.eigenvalues, dense_eigenvalues(laplacian), rtol=1e-12, atol=1e-12
    )
    assert spectrum.certificate.shift == np.inf


def test_a_shift_on_an_eigenvalue_moves_away(monkeypatch):
    laplacian = cotangent_laplacian(icosphere(3))
    expected = solve_spectrum(laplacian, 40)
    pencil = normalize(laplacian)
    on_it = float(np.ldexp(expected.eigenvalues[25], -pencil.value_exponent))
    from certeig.solver.shift import factorize_near

    monkeypatch.setattr(
        roads, "shift_inside", lambda pencil, k: factorize_near(pencil, on_it * (1 + 1e-12))
    )
    found = solve_spectrum(laplacian, 40)
    np.testing.assert_allclose(found.eigenvalues, expected.eigenvalues, rtol=1e-12, atol=1e-12)
    assert found.certificate.max_residual < 1e-10


def test_residuals_bound_the_errors_and_are_small():
    laplacian = cotangent_laplacian(icosphere(3), "consistent")
    spectrum = solve_spectrum(laplacian, 60)
    errors = np.abs(spectrum.eigenvalues - dense_eigenvalues(laplacian)[:60])
    assert (errors <= spectrum.residuals + 1e-12 * spectrum.eigenvalues[-1]).all()
    assert spectrum.residuals.max() < 1e-10 * spectrum.eigenvalues[-1]


def test_same_input_gives_the_same_bits_and_signs_are_fixed():
    laplacian = cotangent_laplacian(icosphere(3))
    one, two = solve_spectrum(laplacian, 30), solve_spectrum(laplacian, 30)
    assert np.array_equal(one.eigenvectors, two.eigenvectors)
    sizes = np.abs(one.eigenvectors)
    leading = np.argmax(sizes >= (1 - 1e-6) * sizes.max(axis=0), axis=0)
    assert (one.eigenvectors[leading, np.arange(30)] > 0).all()
    assert not one.eigenvalues.flags.writeable
    assert not one.eigenvectors.flags.writeable


def test_a_spectrum_passes_its_own_certification_where_a_cluster_is_cut():
    laplacian = cotangent_laplacian(icosphere(3))  # eigenvalues 2 to 4 are one, by symmetry
    spectrum = solve_spectrum(laplacian, 3)
    assert spectrum.certificate.n_split == 1
    again = certify(laplacian, spectrum.eigenvalues, spectrum.eigenvectors)
    assert again.n_split == 1
    assert "keeps it whole" in spectrum.certificate.explain()


def test_progress_runs_from_nothing_to_all():
    reports = []
    solve_spectrum(
        cotangent_laplacian(icosphere(3)),
        80,
        progress=lambda done, message: reports.append((done, message)),
    )
    fractions = [done for done, _ in reports]
    assert fractions[0] == 0.0
    assert fractions[-1] == 1.0
    assert all(0 <= done <= 1 for done in fractions)
    assert any("Lanczos" in message for _, message in reports)


def test_an_interrupt_passes_through():
    def interrupt(done, message):
        if "Lanczos" in message:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_spectrum(cotangent_laplacian(icosphere(3)), 20, progress=interrupt)


@pytest.mark.parametrize("k", [0, -3, 13])
def test_k_out_of_range_is_refused(k):
    with pytest.raises(InvalidParameterError, match=rf"k must lie in 1\.\.12; it is {k}"):
        solve_spectrum(cotangent_laplacian(icosphere(0)), k)


def test_a_negative_eigenvalue_is_refused():
    stiffness = sp.csr_array(np.array([[1.0, -2.0], [-2.0, 1.0]]))  # eigenvalues -1 and 3
    with pytest.raises(InvalidParameterError, match=r"positive semidefinite; eigenvalue 0 is -1,"):
        solve_spectrum(Laplacian(stiffness, sp.csr_array(sp.eye_array(2))), 1)


def test_an_indefinite_mass_is_refused():
    mass = sp.csr_array(np.array([[1.0, 2.0], [2.0, 1.0]]))
    with pytest.raises(InvalidParameterError, match=r"mass must be positive definite"):
        solve_spectrum(Laplacian(sp.csr_array((2, 2)), mass), 1)


def test_a_dense_solve_that_loses_a_pair_is_refused(monkeypatch):
    honest = roads.sl.eigh

    def lossy(stiffness, mass):
        values, vectors = honest(stiffness, mass)
        return values[1:], vectors[:, 1:]

    monkeypatch.setattr(roads.sl, "eigh", lossy)
    with pytest.raises(ConvergenceError, match=r"not proved: 4 lie below .* 3 were found there"):
        solve_spectrum(cotangent_laplacian(icosphere(1)), 5)


def test_lanczos_that_never_finds_a_pair_is_refused(monkeypatch, always_lanczos):
    monkeypatch.setattr(roads, "DENSE_LIMIT", 0)
    honest = roads.block_lanczos

    def lossy(*args, **options):
        values, vectors = honest(*args, **options)
        return values[1:], vectors[:, 1:]

    monkeypatch.setattr(roads, "block_lanczos", lossy)
    monkeypatch.setattr(roads, "MOST_RUNS", 1)
    with pytest.raises(ConvergenceError, match=r"19 of 20 were found in 1 runs and 1 are missing"):
        solve_spectrum(cotangent_laplacian(icosphere(3)), 20)


def test_lanczos_that_fails_gives_way_to_a_dense_solve(monkeypatch):
    laplacian = cotangent_laplacian(icosphere(3))
    expected = solve_spectrum(laplacian, 20)

    def fail(*args, **options):
        raise ConvergenceError("no")

    monkeypatch.setattr(roads, "block_lanczos", fail)
    found = solve_spectrum(laplacian, 20)
    np.testing.assert_allclose(found.eigenvalues, expected.eigenvalues, atol=1e-11)
    assert expected.certificate.fallbacks == ()
    assert found.certificate.fallbacks == ("one shift: no",)
    assert found.certificate.explain().endswith("Tried before, in vain: one shift: no")
    parts = solve_spectrum(cotangent_laplacian(disjoint_union(*[icosphere(3)] * 2)), 20)
    assert parts.certificate.fallbacks == ("one shift: no",)
    monkeypatch.setattr(roads, "DENSE_LIMIT", 0)
    with pytest.raises(ConvergenceError, match=r"no"):
        solve_spectrum(laplacian, 20)


@pytest.mark.parametrize("mesh", [icosphere(2), icosphere(4)])
def test_all_below_a_value(mesh):
    laplacian = cotangent_laplacian(mesh)
    longer = solve_spectrum(laplacian, 40)
    for below in (1e-6, 5.0, 11.0, 16.0):
        found = solve_spectrum(laplacian, below=below)
        assert len(found.eigenvalues) == np.count_nonzero(longer.eigenvalues < below)
        assert (
            found.certificate.n_pairs == len(found.eigenvalues) == sum(found.certificate.clusters)
        )
        assert found.certificate.complete
        np.testing.assert_allclose(
            found.eigenvalues, longer.eigenvalues[: len(found.eigenvalues)], atol=1e-11
        )
    assert solve_spectrum(laplacian, below=5.0).certificate.clusters == (1, 3)
    everything = solve_spectrum(cotangent_laplacian(icosphere(1)), below=1e9)
    assert len(everything.eigenvalues) == 42


def test_below_scales_as_eigenvalues_do():
    small = TriangleMesh(1e-100 * icosphere(2).vertices, icosphere(2).faces)
    assert len(solve_spectrum(cotangent_laplacian(small), below=5e200).eigenvalues) == 4


def test_one_of_k_and_below_is_required():
    laplacian = cotangent_laplacian(icosphere(1))
    with pytest.raises(
        InvalidParameterError, match="Exactly one of k and below must be given; k is None"
    ):
        solve_spectrum(laplacian)
    with pytest.raises(InvalidParameterError, match=r"k is 3 and below is 1\.0"):
        solve_spectrum(laplacian, 3, below=1.0)
    with pytest.raises(InvalidParameterError, match="below must"):
        solve_spectrum(laplacian, below=-1.0)
    disc_inside = dirichlet_laplacian(laplacian, np.array([0]))[0]
    with pytest.raises(
        InvalidParameterError, match=r"below must exceed the lowest eigenvalue, 0\.\d+; it is 1e-09"
    ):
        solve_spectrum(disc_inside, below=1e-9)


@pytest.mark.parametrize(
    ("level", "words"),
    [(2, "0.0 GiB of factors of their operator"), (4, "20 pairs of 2562 points")],
)
def test_what_does_not_fit_is_refused_with_numbers(monkeypatch, level, words):
    laplacian = cotangent_laplacian(icosphere(level))
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 1e5)
    with pytest.raises(
        InvalidParameterError,
        match=r"A spectrum must fit into 90 % of the memory, 0\.0 GiB; for 20 pairs of .*",
    ) as error:
        solve_spectrum(laplacian, 20)
    assert words in str(error.value)
