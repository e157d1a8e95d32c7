"""Maps of functions and points beside pyFM's, from the same eigenpairs."""

from itertools import permutations
from types import SimpleNamespace

import numpy as np
import pytest

import eigenshape as es

zoomout = pytest.importorskip("pyFM.refine.zoomout")
convert = pytest.importorskip("pyFM.spectral.convert")
functional = pytest.importorskip("pyFM.functional")
energies = pytest.importorskip("pyFM.optimize")
trimesh = pytest.importorskip("pyFM.mesh")
networks = pytest.importorskip("pyFM.FMN")
differences = pytest.importorskip("pyFM.spectral.shape_difference")

N_MODES = 50


@pytest.fixture(scope="module", params=["hand", pytest.param("cat", marks=pytest.mark.data)])
def meshes(request):
    """Two shapes of area 1 whose vertices have the same numbers."""
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
    return [es.geometry.normalize_mesh(mesh, "area") for mesh in meshes]


@pytest.fixture(scope="module")
def poses(meshes):
    """Their spectra, and six of these numbers."""
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


def fitted_by_them(meshes, spectra, descriptors, k):
    """Their model with our eigenpairs and descriptors, and the weights of its terms in our units."""
    theirs = []
    for mesh, spectrum in zip(meshes, spectra, strict=True):
        theirs.append(trimesh.TriMesh(np.array(mesh.vertices), np.array(mesh.faces)))
        theirs[-1].process(k)
        theirs[-1].eigenvalues = spectrum.eigenvalues
        theirs[-1].eigenvectors = spectrum.eigenvectors
    model = functional.FunctionalMapping(*theirs)
    model.add_descriptors(*descriptors)
    model._set_k(k)
    ours, others = (
        mesh.project(values, k=k)
        for mesh, values in ((model.mesh1, model.descr1), (model.mesh2, model.descr2))
    )
    products, turns = model._compute_descr_op(), model._compute_orientation_op()
    one, two = (spectrum.eigenvalues[:k] for spectrum in spectra)
    gaps = (two[:, None] - one) ** 2
    weights = (
        k / np.sum(ours**2),
        0.1 / max(one[-1], two[-1]) ** 2,
        k / np.sum(products[0] ** 2),
        k / np.sum(turns[0] ** 2),
    )
    return model, weights, (ours, others, products, turns, gaps)


@pytest.mark.parametrize("turned", [True, False])
def test_descriptors_products_and_orientation_give_their_map(meshes, poses, turned):
    """Their L-BFGS stops where our linear system has its solution, and nothing below it is found."""
    source, target, _ = poses
    k = 12
    descriptors = [
        values - spectrum.mass.sum(axis=1) @ values
        for spectrum in (source, target)
        for values in [es.wave_kernel_signature(spectrum)[:, ::10]]
    ]
    model, weights, terms = fitted_by_them(meshes, (source, target), descriptors, k)
    if not turned:
        weights = (*weights[:3], 0.0)
    found = es.functional_map(
        source,
        target,
        n_modes=k,
        descriptors=descriptors,
        meshes=meshes if turned else None,
    ).matrix

    energy, slope = energies.energy_and_grad_std(found.ravel(), *weights, *terms)
    assert np.abs(slope).max() < 1e-9 * energy
    # their weights are divided by sizes of the terms, which are taken out here
    sizes = energies.weights.canonical_taus(*terms)
    names = ("w_descr", "w_lap", "w_dcomm", "w_orient")
    scaled = {name: w * size for name, w, size in zip(names, weights, sizes, strict=True)}
    model.fit(
        K=(k, k), use_resolvent_laplacian=False, optinit="identity", factr=1, pgtol=1e-12, **scaled
    )
    np.testing.assert_allclose(found, model.FM_12, atol=1e-4)
    assert energy <= energies.energy_func_std(model.FM_12, *weights, *terms) * (1 + 1e-12)


@pytest.fixture(scope="module")
def network():
    """Return three individuals and the maps of all their pairs."""
    mesh = es.make_creature("hand", 1, n_vertices=600)
    shapes = [
        es.TriangleMesh(mesh.vertices + 0.04 * np.sin(4 * mesh.vertices + phase), mesh.faces)
        for phase in range(3)
    ]
    spectra = [
        es.solve_spectrum(es.cotangent_laplacian(es.geometry.normalize_mesh(each, "area")), 16)
        for each in shapes
    ]
    return {
        (i, j): es.spectral.map_from_points(
            spectra[i], spectra[j], np.arange(mesh.n_vertices), n_modes=16
        )
        for i, j in permutations(range(3), 2)
    }


def test_a_limit_shape_and_differences_from_it_are_theirs(network):
    """With all functions kept; theirs drop the least consistent ones, ours those of the highest frequency."""
    latent = es.spectral.latent_basis(network, n_functions=16)
    theirs = networks.FMN(
        [SimpleNamespace(eigenvalues=each.eigenvalues) for each in latent.spectra]
    )
    theirs.set_maps({pair: np.array(mapping.matrix) for pair, mapping in network.items()})
    theirs.set_weights(weight_type="adjacency")
    theirs.compute_CCLB(16, verbose=False)
    np.testing.assert_allclose(latent.eigenvalues, theirs.cclb_eigenvalues, rtol=1e-6, atol=1e-6)
    roots = np.sqrt(latent.eigenvalues[1:])
    for i in range(3):
        areas, angles = theirs.get_CSD(i)
        signs = np.sign((latent.matrices * theirs.CCLB).sum(axis=(0, 1)))
        np.testing.assert_allclose(
            latent.differences("area")[i], signs[:, None] * areas * signs, atol=1e-5
        )
        symmetric = roots[:, None] * (signs[:, None] * angles * signs)[1:, 1:] / roots
        np.testing.assert_allclose(latent.differences("conformal")[i][1:, 1:], symmetric, atol=1e-5)


def test_shape_differences_are_theirs(network):
    mapping = network[0, 1]
    values = [each.eigenvalues for each in (mapping.source, mapping.target)]
    area, conformal = (
        es.spectral.shape_difference(mapping, kind) for kind in ("area", "conformal")
    )
    np.testing.assert_allclose(area, differences.area_SD(mapping.matrix), atol=1e-12)
    roots = np.sqrt(values[0][1:])
    expected = differences.conformal_SD(mapping.matrix, *values)[1:, 1:]
    np.testing.assert_allclose(conformal[1:, 1:], roots[:, None] * expected / roots, atol=1e-9)
