"""Signatures beside pyFM's, from the same eigenpairs, and curvatures beside libigl's."""

import igl
import numpy as np
import pytest
from pyFM.signatures.HKS_functions import HKS
from pyFM.signatures.WKS_functions import WKS

import eigenshape as es


@pytest.fixture(scope="module", params=["torus", pytest.param("horse", marks=pytest.mark.data)])
def mesh(request):
    if request.param == "torus":
        return es.shapes.torus(24, 12)
    return es.read_mesh(
        request.getfixturevalue("data") / "retrieval" / "horse" / "sumner_horse-02.ply"
    )


@pytest.fixture(scope="module")
def spectrum(mesh):
    return es.solve_spectrum(es.cotangent_laplacian(mesh), 40)


def test_heat(spectrum):
    times = es.spectral.default_times(spectrum, 12)
    theirs = HKS(spectrum.eigenvalues, spectrum.eigenvectors, times)
    np.testing.assert_allclose(es.heat_kernel_signature(spectrum, times), theirs, rtol=1e-12)


def test_waves(spectrum):
    energies, sigma = es.spectral.default_energies(spectrum, 30)
    theirs = WKS(spectrum.eigenvalues, spectrum.eigenvectors, energies, sigma, scaled=True)
    np.testing.assert_allclose(
        es.wave_kernel_signature(spectrum, energies, sigma=sigma), theirs, rtol=1e-9
    )


def test_gaussian_curvature(mesh):
    inside = ~np.isin(np.arange(mesh.n_vertices), es.geometry.boundary_vertices(mesh))
    theirs = igl.gaussian_curvature(
        np.array(mesh.vertices), np.array(mesh.faces)
    )  # the angle defect
    ours = es.geometry.gaussian_curvature(mesh) * es.geometry.dual_volumes(mesh)
    np.testing.assert_allclose(ours[inside], theirs[inside], atol=1e-9)
