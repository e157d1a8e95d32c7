from dataclasses import replace

import numpy as np

import eigenshape as es
from eigenshape.spectral.certificate import Certificate

WHOLE = Certificate(
    n_pairs=30,
    shift=2.5,
    count=30,
    n_found=30,
    gap=(2.4, 2.5),
    resolution=1e-6,
    orthonormality=2e-15,
    max_residual=3e-12,
    n_split=0,
)


def test_a_whole_spectrum_is_explained_with_its_numbers():
    text = WHOLE.explain()
    assert text.startswith(
        "These are the 30 lowest eigenvalues of the operator: none is missing and none is extra."
    )
    assert "σ = 2.5 (1/length²) has 30 negative pivots" in text
    assert "cluster" not in text


def test_a_cut_cluster_is_never_silent():
    text = replace(WHOLE, count=26, n_found=26, n_split=3).explain()
    assert "The last 4 belong to a cluster of 7 eigenvalues" in text
    assert "of which 3 were not asked for" in text
    assert "k = 26 or k = 33 keeps it whole" in text


def test_an_incomplete_spectrum_says_so_first():
    partial = replace(WHOLE, count=31)
    assert not partial.complete
    assert partial.explain().startswith(
        "This set of 30 eigenvalues is not proved: 31 lie below 2.5"
    )


def test_all_eigenvalues_need_no_factor():
    assert "all that a matrix with 30 rows has" in replace(WHOLE, shift=np.inf).explain()


def test_neighbors_count_as_equal_to_a_resolution_that_is_named():
    """Their own bounds may tell them apart, so they are not called equal."""
    split = es.TriangleMesh(
        es.icosphere(3).vertices * [1.0, 1.0 + 1e-6, 1.0 - 1e-6], es.icosphere(3).faces
    )
    spectrum = es.solve_spectrum(es.cotangent_laplacian(split), 4)
    apart = np.diff(spectrum.eigenvalues[1:])
    assert (apart > 2 * spectrum.residuals.max()).all()
    assert spectrum.certificate.clusters == (1, 3)
    text = spectrum.certificate.explain()
    assert (
        f"Neighbors closer than {spectrum.certificate.resolution:.1e} (1/length²) count as" in text
    )
    assert "Some are equal" not in text
