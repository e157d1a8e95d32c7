"""Maps of functions and points beside pyFM's, from the same eigenpairs."""

import numpy as np
import pytest

import eigenshape as es

zoomout = pytest.importorskip("pyFM.refine.zoomout")
convert = pytest.importorskip("pyFM.spectral.convert")

N_MODES = 50


@pytest.fixture(scope="module", params=["hand", pytest.param("cat", marks=pytest.mark.data)])
def poses(request):
    """Two shapes whose vertices have the same numbers, their spectra, and five of these numbers."""
    if request.param == "hand":
        mesh = es.make_creature("hand", 1, n_vertices=1200)
        meshes = (
            mesh,
            es.TriangleMesh(
                mesh.vertices + 0.05 * np.sin(4 * mesh.vertices[:, [1, 2, 0]]), mesh.faces
            ),
        )
    else:
        folder = request.getfixturevalue("data") / "retrieval" / "cat"
        meshes = tuple(
            es.read_mesh(folder / f"sumner_cat-{name}.ply") for name in ("reference", "05")
        )
    spectra = [es.solve_spectrum(es.cotangent_laplacian(mesh), N_MODES) for mesh in meshes]
    return *spectra, es.geometry.farthest_points(meshes[0], 6)[0]


def unit_modes(spectrum):
    """Area 1, as we have it, so that matrices are the same."""
    return spectrum.eigenvectors * np.sqrt(spectrum.mass.sum()), spectrum.mass / spectrum.mass.sum()


def test_zoomout_of_all_vertices_is_theirs(poses):
    source, target, ends = poses
    start = es.functional_map(source, target, np.column_stack([ends, ends]))
    (ours, _), (theirs, mass) = unit_modes(source), unit_modes(target)
    expected, points = zoomout.zoomout_refine(
        start.matrix, ours, theirs, nit=6, step=5, A2=mass, return_p2p=True
    )
    found = es.spectral.refine_map(start, N_MODES, step=5, n_samples=len(theirs))
    assert np.mean(es.spectral.point_map(found) == points) > 0.999  # a tie may break otherwise
    np.testing.assert_allclose(found.matrix, expected, atol=1e-7)


def test_a_point_map_and_its_matrix_are_theirs(poses):
    source, target, ends = poses
    start = es.functional_map(source, target, np.column_stack([ends, ends]))
    (ours, _), (theirs, mass) = unit_modes(source), unit_modes(target)
    points = convert.FM_to_p2p(start.matrix, ours, theirs)
    assert np.array_equal(es.spectral.point_map(start), points)
    expected = convert.p2p_to_FM(points, ours, theirs, A2=mass)
    np.testing.assert_allclose(
        es.spectral.map_from_points(source, target, points, n_modes=N_MODES).matrix,
        expected,
        atol=1e-9,
    )
