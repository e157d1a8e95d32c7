"""Vertices of one pose on another that is meshed otherwise: a functional map, refined by zooming out."""

import numpy as np
from scipy.spatial import cKDTree

import eigenshape as es

START, END, STEP = 20, 80, 4
N_ENERGIES = 60
SMOOTH = 0.3  # weight of commuting with the Laplacians


def map_between(one: es.TriangleMesh, two: es.TriangleMesh) -> np.ndarray:
    """Return for each vertex of the first shape one of the second.

    A linear map of functions is fitted to wave kernel signatures (Ovsjanikov and others 2012), and refined through
    more and more eigenfunctions (Melzi and others 2019). On symmetric shapes left and right may change places.
    """
    (values_one, phi_one, mass_one), (values_two, phi_two, mass_two) = _basis(one), _basis(two)
    down_one, down_two = (
        _signatures(values_one, phi_one, mass_one),
        _signatures(values_two, phi_two, mass_two),
    )
    known, wanted = down_two[:START], down_one[:START]
    gaps = np.abs(values_one[:START, None] - values_two[None, :START]) / values_one[START - 1]
    functional = np.zeros((START, START))  # coefficients on the second shape to those on the first
    gram, right = known @ known.T, wanted @ known.T
    scale = SMOOTH * np.trace(gram) / START
    for row in range(START):
        functional[row] = np.linalg.solve(gram + scale * np.diag(gaps[row]), right[row])
    for size in range(START, END, STEP):
        to = _nearest(phi_one, phi_two, functional)
        functional = phi_one[:, : size + STEP].T @ (mass_one[:, None] * phi_two[to, : size + STEP])
    return _nearest(phi_one, phi_two, functional)


def _nearest(phi_one: np.ndarray, phi_two: np.ndarray, functional: np.ndarray) -> np.ndarray:
    size = len(functional)
    return cKDTree(phi_two[:, :size] @ functional.T).query(phi_one[:, :size])[1]


def _basis(mesh: es.TriangleMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return eigenvalues, eigenfunctions and masses on a shape of area 1."""
    laplacian = es.cotangent_laplacian(mesh)
    spectrum, area = es.solve_spectrum(laplacian, END), laplacian.mass.sum()
    return (
        spectrum.eigenvalues * area,
        spectrum.eigenvectors * np.sqrt(area),
        laplacian.mass.diagonal() / area,
    )


def _signatures(values: np.ndarray, phi: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return the coefficients of wave kernel signatures at energies that are the same for all shapes."""
    energies = np.linspace(np.log(20.0), np.log(4 * np.pi * END * 0.8), N_ENERGIES)
    spread = 7 * (energies[1] - energies[0])
    bands = np.exp(-((np.log(values[1:, None]) - energies) ** 2) / (2 * spread**2))
    waves = phi[:, 1:] ** 2 @ (bands / bands.sum(axis=0))
    return phi.T @ (mass[:, None] * waves)
