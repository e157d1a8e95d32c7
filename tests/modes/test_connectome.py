import numpy as np
import pytest

import eigenshape as es

MESH = es.make_creature("quadruped", n_vertices=500)
N = MESH.n_vertices
SPECTRUM = es.solve_spectrum(es.cotangent_laplacian(MESH), 20)


def test_weights_are_the_green_function_without_its_diagonal():
    found = es.modes.geometric_connectome(SPECTRUM, length_scale=0.3, n_modes=20)
    phi = SPECTRUM.eigenvectors
    green = phi @ np.diag(1 / (1 + 0.09 * SPECTRUM.eigenvalues)) @ phi.T
    np.fill_diagonal(green, 0)
    green = np.maximum(green, 0)
    np.testing.assert_allclose(found, green / green.max(), atol=1e-12)


def test_weights_of_parcels_are_means_over_them_by_area():
    labels = np.where(MESH.vertices[:, 0] > 0.3, -1, (MESH.vertices[:, 1] > 0) + 0)
    labels[:5] = 2
    found = es.modes.geometric_connectome(SPECTRUM, length_scale=0.3, n_modes=9, labels=labels)
    areas = SPECTRUM.mass.diagonal()
    means = np.array(
        [
            areas[labels == p] @ SPECTRUM.eigenvectors[labels == p, :9] / areas[labels == p].sum()
            for p in range(3)
        ]
    )
    green = means @ np.diag(1 / (1 + 0.09 * SPECTRUM.eigenvalues[:9])) @ means.T
    green = np.maximum(green - np.diag(np.diag(green)), 0)
    np.testing.assert_allclose(found, green / green.max(), atol=1e-12)


@pytest.mark.parametrize(
    ("labels", "fact"),
    [
        (np.arange(N) % 3 - 2, "the least is -2"),
        (np.arange(N) % 2 * 2, "label 1 has no points"),
        (np.full(N, -1), "the least is -1"),
    ],
)
def test_labels_with_holes_are_named(labels, fact):
    with pytest.raises(es.InvalidParameterError, match=f"or -1 for none; {fact}"):
        es.modes.geometric_connectome(SPECTRUM, n_modes=4, labels=labels)


def test_bad_input_is_named():
    with pytest.raises(es.InvalidParameterError, match=r"n_modes must lie in 1\.\.20; it is 108"):
        es.modes.geometric_connectome(SPECTRUM)
    with pytest.raises(
        es.InvalidParameterError, match="labels must hold one whole number per point"
    ):
        es.modes.geometric_connectome(SPECTRUM, n_modes=4, labels=np.zeros(N))
