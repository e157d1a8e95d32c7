import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.plot.figure import save_figure
from eigenshape.plot.spectra import figure_spectra
from eigenshape.shapes.exact import sphere_eigenvalues
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.bounds.brackets import bracket_eigenvalues
from eigenshape.spectral.comparison.eigenvalues import compare_spectra
from eigenshape.spectral.solve import solve_spectrum

SPHERE = icosphere(2)
LUMPED, CONSISTENT = (
    solve_spectrum(cotangent_laplacian(SPHERE, mass), 20) for mass in ("lumped", "consistent")
)


def test_several_spectra_and_how_far_they_are_from_the_first(tmp_path):
    figure = figure_spectra(
        {"exact": sphere_eigenvalues(25), "lumped": LUMPED, "consistent": CONSISTENT}
    )
    above, below = figure.axes
    assert [text.get_text() for text in above.get_legend().get_texts()] == [
        "exact",
        "lumped",
        "consistent",
    ]
    assert above.get_ylabel() == "eigenvalue λ, 1/length²"
    assert below.get_xlabel() == "number i"
    assert below.get_ylabel() == "relative difference\nfrom exact"
    assert below.get_yscale() == "log"
    change = below.get_lines()[0].get_ydata()
    np.testing.assert_allclose(
        change[1:], np.abs(LUMPED.eigenvalues[1:] / sphere_eigenvalues(20)[1:] - 1)
    )
    assert np.isnan(change[0])  # of two zeros
    save_figure(figure, tmp_path / "spectra.png")
    save_figure(figure, tmp_path / "again.png")
    assert (tmp_path / "spectra.png").read_bytes() == (tmp_path / "again.png").read_bytes()


def test_a_comparison_with_brackets():
    brackets = bracket_eigenvalues(SPHERE, 20)
    comparison = compare_spectra(LUMPED, CONSISTENT, brackets=(brackets, brackets))
    above, below = figure_spectra(comparison, titles=("lumped", "consistent")).axes
    shown = [text.get_text() for text in above.get_legend().get_texts()]
    assert shown == ["lumped: bracket", "lumped", "consistent: bracket", "consistent"]
    np.testing.assert_allclose(below.get_lines()[0].get_ydata()[1:], comparison.relative[1:])
    bars = above.collections[0].get_segments()
    np.testing.assert_allclose([bar[:, 1] for bar in bars], comparison.intervals_one)


def test_brackets_of_one_and_differences_of_one_size():
    values = 1 + np.arange(20.0)
    spectra = {"one": values, "two": 1.1 * values, "sphere": LUMPED}
    above, _ = figure_spectra(
        spectra, brackets={"sphere": bracket_eigenvalues(SPHERE, 20)}, unit="1/area"
    ).axes
    assert "sphere: bracket" in [text.get_text() for text in above.get_legend().get_texts()]
    assert above.get_ylabel() == "eigenvalue λ, 1/area"
    figure = figure_spectra({"one": values, "two": 1.1 * values})
    assert figure.axes[1].get_yscale() == "linear"
    assert figure.axes[1].get_ylim()[0] == 0


def test_equal_spectra_differ_by_nothing():
    _, below = figure_spectra({"one": LUMPED, "two": LUMPED}).axes
    assert not below.get_lines()[0].get_ydata().any()


def test_bad_input():
    with pytest.raises(
        InvalidParameterError, match="spectra must hold two or more spectra; it holds 1"
    ):
        figure_spectra({"one": LUMPED})
    with pytest.raises(
        InvalidParameterError,
        match=r"The titles of brackets must be titles of spectra, .*; one is 'three'",
    ):
        figure_spectra(
            {"one": LUMPED, "two": LUMPED}, brackets={"three": bracket_eigenvalues(SPHERE, 20)}
        )
    interval = solve_spectrum(cotangent_laplacian(SPHERE), above=1.0, below=3.0)
    with pytest.raises(InvalidParameterError, match="two must begin with the lowest eigenvalue"):
        figure_spectra({"one": LUMPED, "two": interval})
