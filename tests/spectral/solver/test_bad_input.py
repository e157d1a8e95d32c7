"""What should not be solved, or hardly can be: the right answer, or an error that names cause, index and value."""

import numpy as np
import pytest
import scipy.sparse as sp
from pencils import cycle, dense_eigenvalues, graph, path

from certeig.kit.errors import ConvergenceError, InvalidParameterError
from certeig.solver.diagnosis import require_solvable
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian, dirichlet_laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.pencils import normalize
from eigenshape.spectral.solve import solve_spectrum

pytestmark = pytest.mark.filterwarnings("ignore:All .* eigenvalues are 0")  # of pieces

TRIANGLE, PAIR = np.ones((3, 3)) - np.eye(3), np.ones((2, 2)) - np.eye(2)


def diagonal(*entries):
    return sp.csr_array(sp.diags_array(np.array(entries, dtype=float)))


def unit(n):
    return diagonal(*np.ones(n))


def copies(block, count):
    return graph(sp.kron(sp.eye_array(count), block))


def grid(side):
    return graph(sp.kronsum(path(side), path(side)))


def shifted(laplacian, amount):
    """Move all eigenvalues down."""
    return Laplacian(sp.csr_array(laplacian.stiffness - amount * laplacian.mass), laplacian.mass)


def with_edge(laplacian, weight):
    """Put an edge of this weight between points 0 and 1."""
    corner = sp.coo_array(
        (weight * np.array([1.0, 1, -1, -1]), ([0, 1, 0, 1], [0, 1, 1, 0])), laplacian.mass.shape
    )
    return Laplacian(sp.csr_array(laplacian.stiffness + corner), laplacian.mass)


@pytest.mark.parametrize("k", [0, 26, -1, 10**30])
def test_k_beyond_what_there_is(k):
    with pytest.raises(InvalidParameterError, match=rf"k must lie in 1\.\.25; it is {k}\."):
        solve_spectrum(grid(5), k)


@pytest.mark.parametrize("k", [np.array(2.0), np.array(2.5), np.array(np.nan), np.array([2, 3])])
def test_k_that_is_not_whole(k):
    with pytest.raises(InvalidParameterError, match=r"k must be a whole number; it is "):
        solve_spectrum(grid(5), k)


@pytest.mark.parametrize("below", [np.nan, 0.0, -1.0, np.inf, -np.inf])
def test_below_that_is_no_bound(below):
    with pytest.raises(
        InvalidParameterError, match=rf"below must be positive and finite; entry 0 is {below}"
    ):
        solve_spectrum(grid(5), below=below)


def test_below_the_lowest_eigenvalue():
    inside = dirichlet_laplacian(grid(30), np.array([0]))[0]
    with pytest.raises(
        InvalidParameterError,
        match=r"below must exceed the lowest eigenvalue, 0\.00\d+; it is 1e-12\.",
    ):
        solve_spectrum(inside, below=1e-12)


@pytest.mark.parametrize(
    ("entry", "rule"),
    [
        (0.0, r"mass must be positive; the mass of point 2 is 0\.0 \(1 such\)"),
        (-1.0, r"mass must be positive; the mass of point 2 is -1\.0 \(1 such\)"),
        (np.nan, r"mass must be finite; entry \(2, 2\) is nan"),
        (np.inf, r"mass must be finite; entry \(2, 2\) is inf"),
    ],
)
def test_an_entry_of_the_mass(entry, rule):
    with pytest.raises(InvalidParameterError, match=rule):
        Laplacian(graph(path(4)).stiffness, diagonal(1, 1, entry, 1))


@pytest.mark.parametrize("n", [10, 1000])
def test_a_mass_that_is_indefinite_off_its_diagonal(n):
    mass = sp.csr_array(unit(n) + sp.coo_array(([2.0, 2.0], ([5, 7], [7, 5])), shape=(n, n)))
    with pytest.raises(
        InvalidParameterError,
        match=r"mass must be positive definite; .* not positive, -3 at point [57]",
    ):
        solve_spectrum(Laplacian(graph(path(n)).stiffness, mass), 3)


@pytest.mark.parametrize("n", [2, 1000])
def test_a_mass_that_is_singular(n):
    mass = sp.csr_array(sp.kron(sp.eye_array(n // 2), np.ones((2, 2))))
    with pytest.raises(
        InvalidParameterError, match=r"mass must be positive definite; .* at point \d+"
    ):
        solve_spectrum(Laplacian(graph(path(n)).stiffness, mass), 1)


def test_a_stiffness_that_is_not_symmetric_or_not_finite():
    skew = sp.csr_array(np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1.5, 1]]))
    with pytest.raises(
        InvalidParameterError, match=r"entry \(1, 2\) is -1\.0 and entry \(2, 1\) is -1\.5"
    ):
        Laplacian(skew, unit(3))
    for entry in (np.nan, np.inf):
        bad = sp.csr_array(np.array([[1.0, entry], [entry, 1]]))
        with pytest.raises(
            InvalidParameterError, match=rf"stiffness must be finite; entry \(0, 1\) is {entry}"
        ):
            Laplacian(bad, unit(2))


@pytest.mark.parametrize(
    ("laplacian", "low", "high"),
    [
        (Laplacian(diagonal(-1, 2, 3), unit(3)), -1.0, -1.0),
        (shifted(grid(20), 0.5), -0.5, -0.5),
        (shifted(grid(80), 0.5), -0.5, -0.5),
        (shifted(grid(80), 1e-6), -1e-6, -1e-6),
        (Laplacian(-grid(80).stiffness, unit(6400)), -8.0, -7.9),
        (
            Laplacian(sp.csr_array(grid(80).stiffness - diagonal(7, *np.zeros(6399))), unit(6400)),
            -5.5,
            -5.0,
        ),
    ],
    ids=["by hand", "small", "large", "by little", "negative", "one point"],
)
def test_a_stiffness_with_negative_eigenvalues(laplacian, low, high):
    with pytest.raises(
        InvalidParameterError, match=r"stiffness must be positive semidefinite; eigenvalue 0 "
    ) as error:
        solve_spectrum(laplacian, 2)
    words = str(error.value).replace(",", " ").replace(";", " ").split()
    if "between" in words:  # where nothing converged, an interval
        place = words.index("between")
        assert float(words[place + 1]) <= low * (1 - 1e-5)
        assert high <= float(words[place + 3])
    else:
        assert low * (1 + 1e-5) <= float(words[words.index("0") + 2]) <= high * (1 - 1e-5)


def test_an_operator_that_is_sound_is_not_blamed():
    for laplacian in (
        grid(20),
        cotangent_laplacian(icosphere(3)),
        copies(PAIR, 4),
        Laplacian(0 * unit(5), unit(5)),
    ):
        require_solvable(normalize(laplacian), ConvergenceError("no"))


@pytest.mark.long
@pytest.mark.parametrize("n", [1, 2, 300, 301, 10_000])
def test_no_stiffness_at_all(n):
    laplacian = Laplacian(sp.csr_array((n, n)), unit(n))
    k = min(n, 7)
    for spectrum in (solve_spectrum(laplacian, k), solve_spectrum(laplacian, 1)):
        assert not spectrum.eigenvalues.any()
        assert spectrum.certificate.n_split == n - len(spectrum.eigenvalues)
    found = solve_spectrum(laplacian, k).eigenvectors
    np.testing.assert_allclose(found.T @ found, np.eye(k), atol=1e-14)


def test_one_point_and_two():
    one = Laplacian(diagonal(3), diagonal(2))
    np.testing.assert_allclose(solve_spectrum(one, 1).eigenvalues, [1.5], rtol=1e-15)
    np.testing.assert_allclose(solve_spectrum(one, 1).eigenvectors, [[2**-0.5]], rtol=1e-15)
    assert len(solve_spectrum(one, below=2.0).eigenvalues) == 1
    with pytest.raises(
        InvalidParameterError, match=r"below must exceed the lowest eigenvalue, 1\.5; it is 1\."
    ):
        solve_spectrum(one, below=1.0)
    two = graph(path(2))
    np.testing.assert_allclose(solve_spectrum(two, 2).eigenvalues, [0, 2], atol=1e-15)
    assert solve_spectrum(two, below=2.0).certificate.n_pairs == 1


@pytest.mark.parametrize("side", [20, 100])
def test_empty_rows(side):
    torus = sp.kronsum(cycle(side), cycle(side))
    spectrum = solve_spectrum(graph(sp.block_diag([torus, sp.csr_array((7, 7))])), 12)
    first = 2 - 2 * np.cos(2 * np.pi / side)
    np.testing.assert_allclose(spectrum.eigenvalues, [0] * 8 + [first] * 4, atol=1e-12)
    assert spectrum.certificate.clusters == (8, 4)
    assert spectrum.certificate.n_split == 0


@pytest.mark.parametrize("n", [20, 80])
def test_entries_too_far_apart_for_floats(n):
    for weight in (1e300, 1e150):
        with pytest.raises(
            InvalidParameterError,
            match=rf"diagonal of stiffness .* entry [01] is {weight:.0e} and ".replace("+", r"\+"),
        ):
            solve_spectrum(with_edge(grid(n), weight), 5)
    tiny = Laplacian(1e-300 * grid(n).stiffness, unit(n * n))
    with pytest.raises(
        InvalidParameterError, match=r"entry [01] is 1e\+300 and entry \d+ is 2e-300"
    ):
        solve_spectrum(with_edge(tiny, 1e300), 5)
    for mass in (1e300, 1e-300):
        masses = np.ones(n * n)
        masses[3] = mass
        with pytest.raises(
            InvalidParameterError, match=r"diagonal of mass must .* 1e\+140; entry \d+ is 1"
        ):
            solve_spectrum(graph(sp.kronsum(path(n), path(n)), masses), 5)


@pytest.mark.parametrize("weight", [1e6, 1e9, 1e12, 1e16, 1e100])
@pytest.mark.parametrize("side", [15, 80])
def test_one_huge_entry_gives_the_right_answer_or_says_where_it_is(weight, side):
    # Two points so tightly joined are one of mass 2: eigenvalues differ by about 1/weight of themselves.
    laplacian = with_edge(grid(side), weight)
    join = sp.csr_array(
        (np.ones(side**2), (np.arange(side**2), np.maximum(np.arange(side**2) - 1, 0)))
    )
    joined = Laplacian(
        sp.csr_array(join.T @ grid(side).stiffness @ join), sp.csr_array(join.T @ join)
    )
    expected = solve_spectrum(joined, 5)
    try:
        found = solve_spectrum(laplacian, 5)
    except InvalidParameterError as error:
        assert weight > 1e10, "so much fits into floats"
        assert f"it is {weight:.3g} at point " in str(error)  # noqa: PT017
        assert "must not span more digits than floats have" in str(error)  # noqa: PT017
    else:
        errors = np.abs(found.eigenvalues - expected.eigenvalues)
        assert (errors <= found.residuals + expected.residuals + 3 / weight).all()
        assert found.residuals.max() <= 1e-2 * expected.eigenvalues[-1], "the answer says something"


def test_a_tiny_entry_is_as_good_as_none():
    link = sp.coo_array(([1e-300, 1e-300], ([0, 2], [2, 0])), shape=(400, 400))
    found = solve_spectrum(graph(path(400) + link), 5).eigenvalues
    np.testing.assert_allclose(found, solve_spectrum(graph(path(400)), 5).eigenvalues, atol=1e-14)


@pytest.mark.long
@pytest.mark.parametrize(
    ("block", "size", "gap"), [([[0.0]], 1, 0), (PAIR, 2, 2), (TRIANGLE, 3, 3)]
)
@pytest.mark.parametrize("k", [1, 50, 500])
def test_ten_thousand_components(block, size, gap, k):
    laplacian = copies(block, 10_000)
    spectrum = solve_spectrum(laplacian, k)
    assert laplacian.n_points == 10_000 * size
    np.testing.assert_allclose(spectrum.eigenvalues, np.zeros(k), atol=1e-14)
    assert spectrum.certificate.n_split == 10_000 - k
    assert spectrum.certificate.clusters == (k,)
    assert np.abs(laplacian.stiffness @ spectrum.eigenvectors).max() < 1e-14


@pytest.mark.parametrize("k", [999, 1000, 1001, 1050])
@pytest.mark.parametrize(("block", "gap"), [(PAIR, 2.0), (TRIANGLE, 3.0)])
def test_a_thousand_components_and_more_pairs_than_these(block, gap, k):
    spectrum = solve_spectrum(copies(block, 1000), k)
    many = min(k, 1000)
    np.testing.assert_allclose(spectrum.eigenvalues, [0] * many + [gap] * (k - many), atol=1e-13)
    split = 1000 - k if k <= 1000 else (len(block) - 1) * 1000 - (k - 1000)
    assert spectrum.certificate.n_split == split
    assert len(solve_spectrum(copies(block, 1000), below=1.0).eigenvalues) == 1000


@pytest.mark.long
def test_ten_thousand_triangles_and_more_pairs_than_these():
    spectrum = solve_spectrum(copies(TRIANGLE, 10_000), 10_050)  # 2.3 GiB of vectors
    np.testing.assert_allclose(spectrum.eigenvalues, [0] * 10_000 + [3] * 50, atol=1e-13)
    assert spectrum.certificate.n_split == 19_950


def test_more_pairs_than_memory_are_refused_with_numbers(monkeypatch):
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 2.0**32)
    with pytest.raises(
        InvalidParameterError,
        match=r"must fit into 90 % of the memory, 3\.6 GiB; "
        r"for 10050 pairs of 30000 points that is about 7\.0 GiB of bases.* The shape is in 10000 pieces, "
        r'.* Try repair\(mesh, \["auto", "largest_component"\]\)',
    ):
        solve_spectrum(copies(TRIANGLE, 10_000), 10_050)


@pytest.mark.long
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("k", [50, 3000])
def test_three_thousand_spheres(mass, k):
    spheres = disjoint_union(*[icosphere(0)] * 3000)
    spectrum = solve_spectrum(cotangent_laplacian(spheres, mass), k)
    assert spectrum.eigenvalues.max() < 1e-13
    assert spectrum.certificate.n_split == 3000 - k


def test_three_hundred_spheres_by_degree():
    one = dense_eigenvalues(cotangent_laplacian(icosphere(0)))
    spectrum = solve_spectrum(cotangent_laplacian(disjoint_union(*[icosphere(0)] * 300)), 1300)
    np.testing.assert_allclose(spectrum.eigenvalues, np.repeat(one, 300)[:1300], atol=1e-12)
    assert spectrum.certificate.clusters == (300, 900, 100)
    assert spectrum.certificate.n_split == 1400


@pytest.mark.filterwarnings("ignore:Both sides of a seam")
def test_parts_of_many_sizes_and_full_masses():
    meshes = [
        icosphere(0),
        icosphere(1),
        icosphere(0),
        icosphere(1),
        TriangleMesh(np.eye(3), np.array([[0, 1, 2]])),
    ]
    for mass in ("lumped", "consistent"):
        laplacian = cotangent_laplacian(disjoint_union(*meshes * 3), mass)
        expected = dense_eigenvalues(laplacian)
        spectrum = solve_spectrum(laplacian, 100)
        np.testing.assert_allclose(spectrum.eigenvalues, expected[:100], atol=1e-11)
        assert spectrum.residuals.max() < 1e-11
        gram = spectrum.eigenvectors.T @ (laplacian.mass @ spectrum.eigenvectors)
        np.testing.assert_allclose(gram, np.eye(100), atol=1e-12)


def two_sizes(ratio, level=3):
    small = icosphere(level)
    return cotangent_laplacian(
        disjoint_union(small, TriangleMesh(ratio * small.vertices, small.faces))
    )


@pytest.mark.parametrize("ratio", [1e8, 1e-8])
def test_shapes_of_very_different_sizes(ratio):
    with pytest.raises(
        InvalidParameterError, match=r"W_ii/B_ii must not span .* at point \d+ and .* at point \d+"
    ):
        solve_spectrum(
            two_sizes(ratio), 20
        )  # rounding at the small sphere is more than all of these


@pytest.mark.long
def test_shapes_of_very_different_sizes_where_floats_suffice():
    one = solve_spectrum(cotangent_laplacian(icosphere(3)), 18).eigenvalues
    found = solve_spectrum(two_sizes(1e8), 660)  # all of the large sphere, 18 of the small one
    np.testing.assert_allclose(found.eigenvalues[642:], one, atol=1e-11)
    assert found.eigenvalues[641] < 1e-12
    assert len(solve_spectrum(two_sizes(1e8), below=1.0).eigenvalues) == 643
    moderate = solve_spectrum(two_sizes(1e3), 19).eigenvalues
    np.testing.assert_allclose(moderate, [0, 0, *1e-6 * one[1:]], rtol=1e-6, atol=1e-13)


def test_a_spectrum_of_pieces_alone_is_said_to_be_one():
    pieces = [TriangleMesh(icosphere(1).vertices + 3 * n, icosphere(1).faces) for n in range(4)]
    laplacian = cotangent_laplacian(disjoint_union(*pieces))
    with pytest.warns(
        UserWarning, match="All 4 eigenvalues are 0: the shape is in 4 pieces or more"
    ):
        solve_spectrum(laplacian, 4)
    assert solve_spectrum(laplacian, 5).eigenvalues[4] > 0
