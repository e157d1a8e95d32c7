from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.resolution.subdivision import subdivide
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.surfaces import icosphere, torus
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.comparison.eigenvalues import compare_spectra, spectral_hausdorff_distance
from eigenshape.spectral.solve import solve_spectrum

SPHERE = icosphere(2)
SPECTRUM = solve_spectrum(cotangent_laplacian(SPHERE), 20)


def of(values, residuals=None):
    """Return a spectrum with these eigenvalues."""
    values = np.asarray(values, dtype=float)
    residuals = np.zeros(len(values)) if residuals is None else np.asarray(residuals, dtype=float)
    vectors = SPECTRUM.eigenvectors[:, : len(values)]
    return replace(SPECTRUM, eigenvalues=values, eigenvectors=vectors, residuals=residuals)


def scaled(scale):
    mesh = TriangleMesh(scale * SPHERE.vertices, SPHERE.faces)
    return solve_spectrum(cotangent_laplacian(mesh), 20)


def test_by_hand():
    found = compare_spectra(
        of([0, 1, 4, 10], [0, 0.1, 0.1, 0]), of([0, 1.15, 3, 10, 12], [0, 0.1, 0.1, 0, 0])
    )
    np.testing.assert_allclose(found.relative, [0, 0.15, 0.25, 0])
    assert found.proved_changes.tolist() == [
        False,
        False,
        True,
        False,
    ]  # .15 is within the two bars of .1
    assert found.index_distance == 1
    assert found.hausdorff == pytest.approx(1)
    assert found.median_relative == pytest.approx(0.15)
    assert found.mean_relative == pytest.approx(0.4 / 3)
    np.testing.assert_allclose(found.intervals_one[1], [0.9, 1.1])
    says = found.explain()
    assert "number 2 changes most, from 4 to 3" in says
    assert "1 of the 4 changes are proved: the error bars of the operators'" in says


def test_zeros_to_rounding_are_equal_and_a_lost_one_is_heard():
    whole, apart = of([1e-16, 2.0, 3.0]), of([3e-16, 1e-15, 3.0])
    np.testing.assert_array_equal(compare_spectra(whole, apart).relative, [0, np.inf, 0])
    np.testing.assert_array_equal(compare_spectra(apart, whole).relative, [0, np.inf, 0])
    assert compare_spectra(whole, apart).mean_relative == np.inf
    assert (
        compare_spectra(of([1e-17], [1e-16]), of([0.0])).median_relative == 0
    )  # one eigenvalue, within its residual


def test_two_spheres_have_one_zero_more():
    two = solve_spectrum(cotangent_laplacian(disjoint_union(SPHERE, SPHERE)), 20)
    found = compare_spectra(SPECTRUM, two)
    assert found.relative[0] == 0
    assert found.relative[1] == np.inf
    assert found.proved_changes[1]


@pytest.mark.parametrize("scale", [1e-100, 1e100])
def test_results_scale_with_the_shape(scale):
    mesh = torus(12, 8)
    far = TriangleMesh(scale * mesh.vertices, mesh.faces)
    other, here = (solve_spectrum(cotangent_laplacian(each), 20) for each in (far, mesh))
    there, near = compare_spectra(scaled(scale), other), compare_spectra(SPECTRUM, here)
    np.testing.assert_allclose(there.relative, near.relative, rtol=1e-8)
    np.testing.assert_array_equal(there.proved_changes, near.proved_changes)
    assert there.hausdorff == pytest.approx(near.hausdorff / scale / scale, rel=1e-9)
    assert there.index_distance == pytest.approx(near.index_distance / scale / scale, rel=1e-9)


def test_brackets_prove_changes_of_shapes_alone():
    # The same sphere, cut finer where it lies: operators differ, shapes do not.
    cut = subdivide(SPHERE)
    fine = solve_spectrum(cotangent_laplacian(cut), 20)
    brackets = bracket_eigenvalues(SPHERE, 20), bracket_eigenvalues(cut, 20)
    by_residuals, by_brackets = (
        compare_spectra(SPECTRUM, fine),
        compare_spectra(SPECTRUM, fine, brackets=brackets),
    )
    assert by_residuals.proved_changes[1:].all()
    assert not by_brackets.proved_changes.any()
    assert "brackets of the shapes' eigenvalues" in by_brackets.explain()
    twice = TriangleMesh(2 * SPHERE.vertices, SPHERE.faces)
    pair = brackets[0], bracket_eigenvalues(twice, 20)
    assert compare_spectra(SPECTRUM, scaled(2.0), brackets=pair).proved_changes[1:].all()


def test_hausdorff_by_hand():
    assert spectral_hausdorff_distance([0, 1, 4], [0, 2, 4]) == 1
    assert spectral_hausdorff_distance([0, 1, 4], [4, 1, 0, 0, 1]) == 0  # sets: copies do not count
    assert (
        spectral_hausdorff_distance([0, 5], [0, 1, 2]) == 2
    )  # 5 may have a neighbor beyond 2; 2 has none
    assert spectral_hausdorff_distance([0.0], [3.0]) == 3


sets = st.lists(st.floats(0, 100), min_size=1, max_size=12).map(sorted)


@given(sets, sets)
def test_hausdorff_is_symmetric_and_below_the_index_distance(one, two):
    distance = spectral_hausdorff_distance(one, two)
    assert distance == spectral_hausdorff_distance(two, one)
    k = min(len(one), len(two))
    assert (
        spectral_hausdorff_distance(one[:k], two[:k]) <= np.abs(np.subtract(one[:k], two[:k])).max()
    )


@given(sets, sets, st.integers(1, 12))
def test_what_is_told_of_cut_spectra_is_true_of_whole_ones(one, two, k):
    # Distances counted of the first k are distances to the whole other set.
    def farthest(values, others, last):
        told = [value for value in values if value <= last]
        return max((min(abs(value - other) for other in others) for value in told), default=0.0)

    cut = spectral_hausdorff_distance(one[:k], two[:k])
    whole = max(farthest(one[:k], two, two[:k][-1]), farthest(two[:k], one, one[:k][-1]))
    assert cut == whole


def test_bad_input():
    interval = solve_spectrum(cotangent_laplacian(SPHERE), above=1.0, below=3.0)
    with pytest.raises(
        InvalidParameterError,
        match="one must begin with the lowest eigenvalue; it begins with number 1",
    ):
        compare_spectra(interval, SPECTRUM)
    with pytest.raises(InvalidParameterError, match="two must begin with the lowest eigenvalue"):
        compare_spectra(SPECTRUM, interval)
    few, enough = bracket_eigenvalues(SPHERE, 5), bracket_eigenvalues(SPHERE, 20)
    with pytest.raises(
        InvalidParameterError, match="there are 20 eigenvalues, and 5 brackets of two"
    ):
        compare_spectra(SPECTRUM, SPECTRUM, brackets=(enough, few))
    with pytest.raises(InvalidParameterError, match="two must be finite; entry 1 is nan"):
        spectral_hausdorff_distance([0.0], [0.0, np.nan])
