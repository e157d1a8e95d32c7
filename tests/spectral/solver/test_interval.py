import numpy as np
import pytest
from pencils import cycle, dense_eigenvalues, graph, hypercube, tetrahedra

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.solver import certified, slices
from certeig.solver import strategy as roads
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.clouds.gaussian import mesh_laplacian
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.domains import irregular_grid
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.signatures.heat import heat_kernel_signature
from eigenshape.spectral.solve import solve_spectrum
from eigenshape.spectral.spectrum import Spectrum

pytestmark = pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")  # of pieces


@pytest.fixture
def thin(monkeypatch):
    """Send small operators the sparse road, in slices."""
    for module, name, value in (
        (slices, "SLICE", 14),
        (roads, "ONE_SHIFT_PAIRS", 20),
        (roads, "DENSE_POINTS", 0),
        (certified, "FEW_BELOW", 0),
        (roads, "DENSE_SHARE", 0),
    ):
        monkeypatch.setattr(module, name, value)


def middle(reference, *numbers):
    """Return the middles of the widest gaps near these eigenvalues."""
    ends = []
    for number in numbers:
        near = np.arange(max(number - 12, 1), min(number + 12, len(reference)))
        last = near[np.argmax(reference[near] - reference[near - 1])]
        ends.append(float(reference[last - 1] + reference[last]) / 2)
    return ends


@pytest.mark.long
@pytest.mark.parametrize(
    ("laplacian", "fewest"),
    [
        (cotangent_laplacian(irregular_grid(24, 24, rng=np.random.default_rng(0))), 3),
        (
            cotangent_laplacian(irregular_grid(24, 24, rng=np.random.default_rng(0)), "consistent"),
            3,
        ),
        (cotangent_laplacian(icosphere(3)), 3),
        (cotangent_laplacian(torus(20, 30)), 3),
        (
            cotangent_laplacian(tetrahedra(100)),
            0,
        ),  # clusters of 100 and 300: all that lie lower are found instead
        (graph(cycle(700)), 3),
        (graph(hypercube(9)), 0),  # and of up to 126
    ],
)
def test_an_interval_has_what_dense_solves_have_there(thin, laplacian, fewest):
    reference = dense_eigenvalues(laplacian)
    n, far_up = len(reference), 0
    for ends in ((60, 84), (100, 160), (n // 2, n // 2 + 24), (10, 90), (n - 40, n - 14)):
        low, high = middle(reference, *ends)
        inside = reference[(reference >= low) & (reference < high)]
        if not inside.size or np.abs(reference[:, None] - [low, high]).min() < 1e-9 * reference[-1]:
            continue  # in the middle of a wide cluster
        found = solve_spectrum(laplacian, above=low, below=high)
        np.testing.assert_allclose(found.eigenvalues, inside, rtol=0, atol=1e-9 * reference[-1])
        assert found.certificate.first == np.count_nonzero(reference < low)
        assert found.certificate.complete
        assert found.certificate.n_pairs == len(inside)
        weighed = found.mass @ found.eigenvectors
        np.testing.assert_allclose(found.eigenvectors.T @ weighed, np.eye(len(inside)), atol=1e-9)
        far_up += np.isfinite(found.certificate.floor)
    assert far_up >= fewest


def test_the_proof_of_an_interval_says_what_was_counted(tmp_path):
    laplacian = cotangent_laplacian(fibonacci_sphere(3000))
    found = solve_spectrum(laplacian, above=150.0, below=170.0)
    proof = found.certificate
    assert found.eigenvalues[0] >= 150
    assert found.eigenvalues[-1] < 170
    assert proof.floor < 150
    assert proof.shift > 170
    assert (
        f"eigenvalues from number {proof.first} to {proof.first + len(found.eigenvalues) - 1} "
        in proof.explain()
    )
    assert f"differ by {proof.count} in their negative pivots" in proof.explain()
    found.save(tmp_path / "part.npz")
    assert Spectrum.load(tmp_path / "part.npz").certificate == proof
    mesh = fibonacci_sphere(3000)
    large = cotangent_laplacian(TriangleMesh(1e3 * mesh.vertices, mesh.faces))
    larger = solve_spectrum(large, above=150e-6, below=170e-6)
    np.testing.assert_allclose(larger.eigenvalues * 1e6, found.eigenvalues, rtol=1e-11)
    assert larger.certificate.first == proof.first


def test_an_interval_of_a_kernel_is_in_its_reported_values():
    laplacian = mesh_laplacian(fibonacci_sphere(1500), correct="log")
    lowest = solve_spectrum(laplacian, 110).eigenvalues
    low, high = (float(lowest[i - 1] + lowest[i]) / 2 for i in (81, 100))
    found = solve_spectrum(laplacian, above=low, below=high)
    np.testing.assert_allclose(found.eigenvalues, lowest[81:100], rtol=1e-9)
    assert found.certificate.first == 81


def test_an_interval_with_the_boundary_held():
    mesh = irregular_grid(30, 30, rng=np.random.default_rng(1))
    laplacian = cotangent_laplacian(mesh)
    rim = np.arange(30)
    lowest = solve_spectrum(laplacian, 90, fixed=rim).eigenvalues
    low, high = (float(lowest[i - 1] + lowest[i]) / 2 for i in (70, 80))
    np.testing.assert_allclose(
        solve_spectrum(laplacian, fixed=rim, above=low, below=high).eigenvalues,
        lowest[70:80],
        rtol=1e-9,
    )


@pytest.mark.parametrize("low", [0, 0.0, 1e-9])
def test_from_zero_on_an_interval_is_all_below(low):
    laplacian = cotangent_laplacian(icosphere(2))
    whole, found = (
        solve_spectrum(laplacian, below=7.0),
        solve_spectrum(laplacian, above=low, below=7.0),
    )
    assert found.certificate.first == (1 if low else 0)
    np.testing.assert_array_equal(found.eigenvalues, whole.eigenvalues[found.certificate.first :])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"above": 3.0, "below": 3.0},
            r"above must be less than below; above is 3.0 and below is 3.0",
        ),
        ({"above": 5.0, "below": 3.0}, r"above must be less than below; above is 5.0"),
        ({"above": 5.0}, r"Exactly one of k and below must be given; k is None and below is None"),
        ({"above": 5.0, "k": 3}, r"above needs below, the other end of an interval; above is 5.0"),
        ({"above": np.nan, "below": 3.0}, r"above must be positive and finite"),
        ({"above": -1.0, "below": 3.0}, r"above must be positive and finite"),
        (
            {"above": 2.5, "below": 5.0},
            r"There must be eigenvalues between above and below; 4 lie below 2.5 and none",
        ),
    ],
)
def test_what_is_no_interval_is_named(arguments, message):
    with pytest.raises(InvalidParameterError, match=message):
        solve_spectrum(cotangent_laplacian(icosphere(3)), **arguments)


def test_an_empty_interval_far_up_is_named(thin):
    laplacian = graph(cycle(700))
    reference = dense_eigenvalues(laplacian)
    gap = 200 + int(np.diff(reference[200:300]).argmax())
    width = reference[gap + 1] - reference[gap]
    with pytest.raises(InvalidParameterError, match=f"{gap + 1} lie below .* and none from there"):
        solve_spectrum(
            laplacian, above=reference[gap] + width / 3, below=reference[gap] + width / 2
        )


def test_a_part_of_a_spectrum_has_no_heat_signature():
    found = solve_spectrum(cotangent_laplacian(icosphere(2)), above=3.0, below=8.0)
    with pytest.raises(
        InvalidParameterError,
        match=r"must begin with the lowest eigenvalue; it begins with number 4",
    ):
        heat_kernel_signature(found, [0.1])


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_where_counts_and_finds_never_agree_nothing_is_returned(monkeypatch):
    small = irregular_grid(6, 6, rng=np.random.default_rng(0))
    faces = [small.faces + copy * small.n_vertices for copy in range(20)]
    laplacian = cotangent_laplacian(
        TriangleMesh(np.tile(small.vertices, (20, 1)), np.concatenate(faces))
    )
    pencil = normalize(laplacian)
    values = dense_eigenvalues(laplacian) * np.ldexp(1.0, -pencil.value_exponent)
    low, high = middle(values, 90, 130)
    counted = certified.count_interval(pencil, low, high)
    pairs, certificate = certified.solve_interval(pencil, counted, lambda done: None)
    assert certificate.count == certificate.n_found

    def forgetful(*arguments):
        vectors, factor = slices.walk_on(*arguments)
        return np.delete(vectors, vectors.shape[1] // 2, axis=1), factor

    monkeypatch.setattr(certified, "walk_on", forgetful)
    _, again = certified.solve_interval(pencil, counted, lambda done: None)
    assert again.count == again.n_found == certificate.count
    monkeypatch.setattr(certified, "INTERVAL_RUNS", 1)
    with pytest.raises(
        ConvergenceError, match=r"Every eigenvalue that inertia counts .* in the interval were"
    ):
        certified.solve_interval(pencil, counted, lambda done: None)
    monkeypatch.setattr(certified, "_clear_gaps", lambda *_: None)
    monkeypatch.setattr(certified, "walk_on", lambda pencil, factor, *rest: (pairs.vectors, factor))
    with pytest.raises(ConvergenceError, match="An interval must end in a gap between eigenvalues"):
        certified.solve_interval(pencil, counted, lambda done: None)


def test_an_interval_that_fails_alone_is_found_with_all_below_it(monkeypatch, thin):
    laplacian = cotangent_laplacian(irregular_grid(24, 24, rng=np.random.default_rng(0)))
    alone = solve_spectrum(laplacian, above=1000.0, below=1400.0)

    def fail(*arguments):
        raise ConvergenceError("no")

    monkeypatch.setattr(certified, "solve_interval", fail)
    found = solve_spectrum(laplacian, above=1000.0, below=1400.0)
    np.testing.assert_allclose(found.eigenvalues, alone.eigenvalues, rtol=1e-10)
    assert alone.certificate.fallbacks == ()
    assert found.certificate.fallbacks == ("slices of the interval: no",)
