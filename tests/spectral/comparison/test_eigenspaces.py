import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import ortho_group

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.exact import sphere_eigenvalues
from eigenshape.shapes.harmonics import sphere_harmonics
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.comparison.eigenspaces import eigenspace_errors, separated_groups
from eigenshape.spectral.solve import solve_spectrum

SPHERE = icosphere(2)
SPECTRUM = solve_spectrum(cotangent_laplacian(SPHERE, "consistent"), 16)
HARMONICS = sphere_harmonics(SPHERE.vertices, 16)
EXACT = sphere_eigenvalues(17)


def test_by_hand():
    # Two points of mass 1 and 4: φ_1 = (4, -1)/√20, and the exact function is (1, 0).
    laplacian = Laplacian(
        sp.csr_array([[1.0, -1.0], [-1.0, 1.0]]), sp.csr_array(np.diag([1.0, 4.0]))
    )
    spectrum = solve_spectrum(laplacian, 2)
    functions = np.array([[1.0, 1.0], [1.0, 0.0]])
    np.testing.assert_allclose(
        eigenspace_errors(spectrum, [0, 1, 9], functions), [0, (4 / 20) ** 0.5], atol=1e-14
    )


def test_eigenvectors_lie_in_their_own_span():
    values = np.append(SPECTRUM.eigenvalues, 99.0)
    assert eigenspace_errors(SPECTRUM, values, SPECTRUM.eigenvectors).max() < 1e-12


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-100, 1.0, 1e100]))
def test_any_basis_of_a_group_serves(seed, size):
    turned = HARMONICS.copy()
    for degree in (1, 2, 3):
        group = slice(degree**2, (degree + 1) ** 2)
        mixed = HARMONICS[:, group] @ ortho_group(2 * degree + 1, seed=seed).rvs()
        turned[:, group] = size * mixed * np.geomspace(1, 100, 2 * degree + 1)
    expected = eigenspace_errors(SPECTRUM, EXACT, HARMONICS)
    np.testing.assert_allclose(
        eigenspace_errors(SPECTRUM, EXACT, turned), expected, rtol=1e-9, atol=1e-12
    )


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_errors_on_the_sphere_fall_with_the_square_of_the_edge(mass):
    medians = []
    for n in (3, 4):
        mesh = icosphere(n)
        spectrum = solve_spectrum(cotangent_laplacian(mesh, mass), 36)
        found = eigenspace_errors(
            spectrum, sphere_eigenvalues(37), sphere_harmonics(mesh.vertices, 36)
        )
        assert found[0] < 1e-9
        medians.append(np.median(found))
    assert np.log2(medians[0] / medians[1]) == pytest.approx(2, abs=0.2)  # the edge is half as long
    assert medians[1] < 0.01


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_errors_have_no_unit(scale):
    far = solve_spectrum(
        cotangent_laplacian(TriangleMesh(scale * SPHERE.vertices, SPHERE.faces), "consistent"), 16
    )
    found, expected = (eigenspace_errors(each, EXACT, HARMONICS) for each in (far, SPECTRUM))
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-12)


def test_as_many_errors_as_there_are_of_both():
    more = sphere_harmonics(SPHERE.vertices, 25)
    assert len(eigenspace_errors(SPECTRUM, sphere_eigenvalues(26), more)) == 16
    assert len(eigenspace_errors(SPECTRUM, EXACT, HARMONICS[:, :9])) == 9
    few = solve_spectrum(cotangent_laplacian(SPHERE, "consistent"), 6)
    assert (
        eigenspace_errors(few, EXACT, HARMONICS).max() < 0.1
    )  # a group of discrete ones may be cut


def test_bad_input_to_errors():
    interval = solve_spectrum(cotangent_laplacian(SPHERE), above=1.0, below=3.0)
    with pytest.raises(
        InvalidParameterError, match="spectrum must begin with the lowest eigenvalue"
    ):
        eigenspace_errors(interval, EXACT, HARMONICS)
    with pytest.raises(
        InvalidParameterError, match=r"one row for each of 162 points; the shape is \(161, 16\)"
    ):
        eigenspace_errors(SPECTRUM, EXACT, HARMONICS[1:])
    with pytest.raises(InvalidParameterError, match="functions must be finite; that of point 3 is"):
        eigenspace_errors(
            SPECTRUM, EXACT, np.where(np.arange(162)[:, None] == 3, np.nan, HARMONICS)
        )
    with pytest.raises(
        InvalidParameterError, match="eigenvalues must ascend; number 1 is 2 and number 2 is 1"
    ):
        eigenspace_errors(SPECTRUM, [0, 2, 1, 3], HARMONICS[:, :3])
    with pytest.raises(
        InvalidParameterError,
        match="to show that the last group is complete; there are 16 eigenvalues",
    ):
        eigenspace_errors(SPECTRUM, EXACT[:16], HARMONICS)
    with pytest.raises(
        InvalidParameterError,
        match=r"eigenvalue 12 is 12 as that of function 11 is.*or the first 9",
    ):
        eigenspace_errors(SPECTRUM, EXACT, HARMONICS[:, :12])
    doubled = HARMONICS.copy()
    doubled[:, 3] = doubled[:, 1] + doubled[:, 2]
    with pytest.raises(
        InvalidParameterError, match="functions 1 to 3 must be independent at the points"
    ):
        eigenspace_errors(SPECTRUM, EXACT, doubled)


def groups_of(values, **options):
    return [(group.start, group.stop) for group in separated_groups(values, **options)]


def test_groups_by_hand():
    assert groups_of([0, 2, 2, 2, 6, 6, 6, 6, 6, 12]) == [(0, 1), (1, 4), (4, 9), (9, 10)]
    assert groups_of([0, 0.9, 1.0, 1.1, 3]) == [(0, 1), (1, 4), (4, 5)]
    assert groups_of([0, 0.9, 1.0, 1.1, 3], ratio=10) == [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5)]
    assert groups_of([0, 1e-4, 1, 2, 3]) == [
        (0, 2),
        (2, 3),
        (3, 4),
        (4, 5),
    ]  # two parts that are nearly apart
    assert groups_of([0, 0, 0]) == [(0, 3)]
    assert groups_of([5.0]) == [(0, 1)]


def test_groups_of_the_sphere_are_its_multiplicities():
    spectrum = solve_spectrum(cotangent_laplacian(fibonacci_sphere(2000)), 60)
    expected = [(degree**2, (degree + 1) ** 2) for degree in range(7)]
    assert groups_of(spectrum.eigenvalues) == [*expected, (49, 60)]  # the last is cut


spectra = st.lists(st.floats(0, 100).map(lambda x: round(x, 2)), min_size=1, max_size=15).map(
    sorted
)


@given(spectra, st.sampled_from([1.5, 4.0]))
def test_groups_are_separated_runs_and_no_larger_run_is(values, ratio):
    values = np.array(values)
    gaps = np.concatenate([[np.inf], np.diff(values), [np.inf]])

    def separated(start, stop):
        all_of_them = (start, stop) == (0, len(values)) and values[-1] > values[0]
        return not all_of_them and min(gaps[start], gaps[stop]) >= ratio * (
            values[stop - 1] - values[start]
        )

    found = groups_of(values, ratio=ratio)
    runs = [
        (i, j) for i in range(len(values)) for j in range(i + 1, len(values) + 1) if separated(i, j)
    ]
    largest = [
        (i, j) for i, j in runs if not any(a <= i and j <= b and (a, b) != (i, j) for a, b in runs)
    ]
    assert found == largest


@given(spectra, st.integers(-600, 600))
def test_groups_have_no_unit(values, power):
    assert groups_of(np.ldexp(values, power)) == groups_of(values)


def test_bad_input_to_groups():
    with pytest.raises(InvalidParameterError, match="ratio must be above 1, and finite; it is 1"):
        separated_groups([0, 1], ratio=1.0)
    with pytest.raises(InvalidParameterError, match="number 1 is 3 and number 2 is 2"):
        separated_groups([0, 3, 2])


def test_a_torus_without_symmetry_has_small_groups():
    spectrum = solve_spectrum(cotangent_laplacian(torus(20, 12)), 30)
    sizes = [stop - start for start, stop in groups_of(spectrum.eigenvalues)]
    assert sum(sizes) == 30
    assert max(sizes) <= 4
