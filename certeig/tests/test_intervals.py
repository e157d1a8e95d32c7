"""Pairs of intervals, counts, certificates of pairs from elsewhere, and what is kept in files."""

import known_spectra as known
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh

import certeig
from certeig import ConvergenceError, FileFormatError, InvalidParameterError

GRID = known.kronecker_sum(known.string(40), known.string(41))
VALUES = known.sums(known.string_values(40), known.string_values(41))


@pytest.mark.parametrize("origin", [0.0, -9.0, 50.0])
@pytest.mark.parametrize(
    ("above", "below"),
    [(-1.0, 0.2), (0.5, 0.9), (2.41, 2.49), (3.9, 4.1), (7.5, 9.0), (6.0, 1e300)],
)
def test_an_interval_holds_what_the_formula_has_there(origin, above, below):
    moved = sp.csr_array(GRID + origin * sp.eye_array(GRID.shape[0]))
    spectrum = certeig.eigenpairs(moved, above=above + origin, below=below + origin)
    inside = (above <= VALUES) & (below > VALUES)
    assert spectrum.certificate.first == np.argmax(inside)
    np.testing.assert_allclose(spectrum.eigenvalues, VALUES[inside] + origin, atol=1e-11)
    assert spectrum.certificate.complete


def test_all_below_a_value():
    spectrum = certeig.eigenpairs(-GRID, below=-7.5)
    np.testing.assert_allclose(spectrum.eigenvalues, -VALUES[VALUES > 7.5][::-1], atol=1e-11)


@pytest.mark.parametrize("matrix", [known.string(400), known.string(9), sp.csr_array((3, 3))])
@pytest.mark.parametrize("origin", [0.0, -9.0, 50.0])
@pytest.mark.parametrize(
    ("above", "below", "rule"),
    [
        (None, -0.5, r"below must exceed the lowest eigenvalue, "),
        (-2.0, -0.5, r"below must exceed the lowest eigenvalue, "),
        (4.5, 5.0, r"must be eigenvalues between above and below; \d+ lie below "),
        (1e299, 1e300, r"must be eigenvalues between above and below; \d+ lie below 1e\+299 "),
    ],
)
def test_an_empty_interval_is_named_by_the_users_values(matrix, origin, above, below, rule):
    moved = matrix + origin * sp.eye_array(matrix.shape[0])
    ends = {"below": below + origin} | ({} if above is None else {"above": above + origin})
    with pytest.raises(InvalidParameterError, match=rule) as caught:
        certeig.eigenpairs(moved, **ends)
    assert f"{below + origin:.6g}." in str(caught.value)


@pytest.mark.parametrize(
    ("options", "rule"),
    [
        ({}, r"Exactly one of k and below must be given; k is None and below is None"),
        ({"k": 1, "below": 2.0}, r"Exactly one of k and below must be given"),
        ({"k": 1, "above": 2.0}, r"above needs below, the other end of an interval; above is 2"),
        ({"below": 1.0, "above": 1.0}, r"above must be less than below; above is 1.0 and below"),
        ({"below": np.inf}, r"below must be finite"),
        ({"k": 10}, r"k must lie in 1\.\.9; it is 10"),
        ({"k": 0}, r"k must lie in 1\.\.9; it is 0"),
        pytest.param(
            {"k": 1.5}, r"k must be a whole number; it is 1\.5", marks=pytest.mark.wrong_type
        ),
        ({"k": 1, "fixed": [9]}, r"fixed must hold rows 0\.\.8; entry 0 is 9"),
        ({"k": 1, "fixed": [True] * 9}, r"a list of row numbers; .* Pass np\.flatnonzero\(mask\)"),
        ({"k": 1, "fixed": range(9)}, r"At least one unknown must be free; all 9 are fixed"),
    ],
)
def test_what_is_no_choice_of_pairs(options, rule):
    with pytest.raises(InvalidParameterError, match=rule):
        certeig.eigenpairs(known.string(9), **options)


@pytest.mark.parametrize("value", [-3.0, 0.1, 1.97, 4.0, 7.9, 9.0, 1e308, -1e308])
@pytest.mark.parametrize("scale", [1.0, -1.0, 1e-250, 1e200])
def test_counts_are_those_of_the_formula(value, scale):
    value = value * abs(scale) if abs(value) < 10 else value
    if np.isclose(VALUES * scale, value, rtol=1e-12).any():
        return
    count = certeig.count_below(scale * GRID, value=value)
    assert count == np.count_nonzero(VALUES * scale < value)


def test_a_count_of_pencils():
    rng = np.random.default_rng(5)
    values = known.random_values(120, rng)
    matrices = known.pencil_with(values, rng)
    levels = np.unique(values.round(6))
    for value in (levels[1:] + levels[:-1]) / 2:
        assert certeig.count_below(*matrices, value) == np.count_nonzero(values < value)


@pytest.mark.parametrize("value", [2.0, -1.0, 0.0])
def test_an_eigenvalue_at_the_value_is_not_counted_by_chance(value):
    matrix = sp.diags_array([-1.0, 0.0, 2.0, 2.0, 5.0])
    with pytest.raises(ConvergenceError, match=r"none may be at it, .*; -?\d is too near to one"):
        certeig.count_below(matrix, value=value)
    assert certeig.count_below(matrix, value=value + 0.01) == certeig.count_below(
        matrix, value=value - 0.01
    ) + (2 if value == 2 else 1)


@pytest.mark.parametrize(
    "value",
    [
        np.nan,
        np.inf,
        pytest.param("a", marks=pytest.mark.wrong_type),
        pytest.param([1.0, 2.0], marks=pytest.mark.wrong_type),
    ],
)
def test_a_value_that_is_none(value):
    with pytest.raises(InvalidParameterError, match=r"value must be"):
        certeig.count_below(GRID, value=value)


@pytest.mark.parametrize("origin", [0.0, -9.0, 1e5])
@pytest.mark.parametrize("full", [False, True])
def test_pairs_of_another_solver_are_certified(origin, full):
    stiffness, mass = known.random_grid(12, full=full)
    stiffness = sp.csr_array(stiffness + origin * mass)
    values, vectors = eigh(stiffness.toarray(), mass.toarray())
    for k in (1, 7, 30, 144):
        certificate = certeig.certify(stiffness, mass, values[:k], vectors[:, :k])
        assert (certificate.complete, certificate.n_pairs) == (True, k)
        if k < 144:
            assert values[k - 1] < certificate.shift < values[k]
    for lost in (0, 3, 7):
        kept = np.delete(np.arange(9), lost)
        with pytest.raises(ConvergenceError, match=r"8 eigenvalues is not proved: \d lie below"):
            certeig.certify(stiffness, mass, values[kept], vectors[:, kept])
    wrong = values[:9].copy()
    wrong[4] = (wrong[4] + wrong[5]) / 2
    with pytest.raises(ConvergenceError, match=r"Every pair must satisfy .* pair 4 is off by"):
        certeig.certify(stiffness, mass, wrong, vectors[:, :9])
    with pytest.raises(ConvergenceError, match=r"must be B-orthonormal to 1e-08"):
        certeig.certify(stiffness, mass, values[:9], 2 * vectors[:, :9])


def test_arrays_that_are_no_pairs():
    for values, vectors, rule in [
        ([0.0], np.ones((8, 1)), r"shapes \(k,\) and \(9, k\)"),
        ([1.0, 0.0], np.eye(9)[:, :2], r"must ascend; 1 is 0\.0 after 1\.0"),
        ([np.nan], np.ones((9, 1)), r"must be finite"),
    ]:
        with pytest.raises(InvalidParameterError, match=rule):
            certeig.certify(known.string(9), None, values, vectors)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_spectrum_is_kept_in_a_file_bit_for_bit(tmp_path, sign):
    spectrum = certeig.eigenpairs(sign * GRID, k=5)
    spectrum.save(tmp_path / "a.npz", key="grid")
    kept = certeig.Spectrum.load(tmp_path / "a.npz", key="grid")
    for name in ("eigenvalues", "eigenvectors", "residuals"):
        assert getattr(kept, name).tobytes() == getattr(spectrum, name).tobytes()
    assert kept.certificate == spectrum.certificate
    with pytest.raises(FileFormatError, match=r"the spectrum of the key other; its key is grid"):
        certeig.Spectrum.load(tmp_path / "a.npz", key="other")
    (tmp_path / "b.npz").write_bytes(b"none")
    with pytest.raises(FileFormatError, match=r"must hold a spectrum that certeig saved"):
        certeig.Spectrum.load(tmp_path / "b.npz")


@pytest.mark.parametrize("sign", [1, -1])
def test_a_notebook_shows_eigenvalues_inside_of_its_box(sign):
    import re

    html = certeig.eigenpairs(sign * GRID, k=5)._repr_html_()
    heights = [float(each) for each in re.findall(r'cy="(-?[\d.]+)"', html)]
    assert len(heights) == 5
    assert min(heights) >= 10
    assert max(heights) <= 110


def test_texts_of_certificates():
    text = certeig.eigenpairs(GRID, k=3).certificate.explain()
    assert text.startswith("These are the 3 lowest eigenvalues of the pencil: none is missing")
    assert "1/length" not in text
    far = certeig.eigenpairs(-GRID, k=3).certificate
    assert f"σ = {far.shift:.6g} " in far.explain()
    assert -VALUES[-3] < far.shift < -VALUES[-4]
    assert far.max_residual < 1e-12
