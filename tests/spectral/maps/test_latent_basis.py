"""Consistent maps of a collection, how shapes differ by area and by angles, and where they do."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

import eigenshape as es

N_MODES = 36
BALL = es.icosphere(3)
HAND = es.make_creature("hand", 1, n_vertices=600)
TURN = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]


def solve(mesh, k=N_MODES):
    return es.solve_spectrum(es.cotangent_laplacian(mesh), k)


def moved(mesh, vertices):
    return es.TriangleMesh(vertices, mesh.faces)


def vertex_maps(spectra, pairs=None, points=None):
    """Return maps by the numbers of vertices, from the first shape to each other one or of these pairs."""
    same = np.arange(len(spectra[0].eigenvectors)) if points is None else points
    return {
        (i, j): es.spectral.map_from_points(
            spectra[i], spectra[j], same, n_modes=len(spectra[i].eigenvalues)
        )
        for i, j in pairs or [(0, j) for j in range(1, len(spectra))]
    }


def grown_bump(size):
    """Return a hand with a bump of some size at the tip of a finger, and how near each vertex is to it."""
    tip = HAND.vertices[HAND.vertices[:, 1].argmax()]
    near = np.exp(-50 * ((HAND.vertices - tip) ** 2).sum(axis=1))
    out = es.geometry.vertex_normals(HAND)
    return moved(HAND, HAND.vertices + size * near[:, None] * out), near


def wavy(phase):
    """Return another individual of a hand."""
    return moved(HAND, HAND.vertices + 0.03 * np.sin(5 * HAND.vertices[:, [1, 2, 0]] + phase))


def relative_area(mesh):
    areas = es.geometry.dual_volumes(mesh)
    return areas / areas.sum()


@pytest.fixture(scope="module")
def individuals():
    return [solve(wavy(phase)) for phase in range(4)]


@pytest.fixture(scope="module")
def all_pairs(individuals):
    return vertex_maps(individuals, list(permutations(range(4), 2)))


@pytest.mark.parametrize("kind", ["area", "conformal"])
def test_isometric_copies_do_not_differ(kind):
    copies = [HAND, moved(HAND, 7 * HAND.vertices @ TURN.T), moved(HAND, HAND.vertices + 1.0)]
    latent = es.spectral.latent_basis(vertex_maps([solve(each) for each in copies]))
    np.testing.assert_allclose(
        latent.differences(kind), np.broadcast_to(np.eye(18), (3, 18, 18)), atol=1e-7
    )
    assert max(latent.misfits.values()) < 1e-7


@pytest.mark.parametrize("kind", ["area", "conformal"])
def test_the_mean_difference_is_the_identity(all_pairs, kind):
    latent = es.spectral.latent_basis(all_pairs)
    np.testing.assert_allclose(latent.differences(kind).mean(axis=0), np.eye(18), atol=1e-9)
    assert np.ptp(latent.differences(kind), axis=0).max() > 0.02


def test_a_limit_shape_of_equal_shapes_is_that_shape():
    spectrum = solve(HAND)
    latent = es.spectral.latent_basis(vertex_maps([spectrum] * 3))
    area = es.geometry.surface_area(HAND)
    np.testing.assert_allclose(latent.eigenvalues, spectrum.eigenvalues[:18] * area, atol=1e-8)


def test_two_shapes_differ_from_their_mean_as_singular_values_say(individuals):
    # With Y_1 = C Y_0 and Y_0ᵀ(I + CᵀC)Y_0 = 2 I, eigenvalues of Y_0ᵀY_0 are 2 / (1 + c²).
    maps = vertex_maps(individuals[:2])
    latent = es.spectral.latent_basis(maps, n_functions=N_MODES)
    stretches = np.linalg.svd(maps[0, 1].matrix, compute_uv=False)
    np.testing.assert_allclose(
        np.linalg.eigvalsh(latent.differences("area")[0]), 2 / (1 + stretches**2), atol=1e-9
    )


def test_consistent_maps_compose_exactly(all_pairs):
    latent = es.spectral.latent_basis(all_pairs)
    direct = latent.map_between(0, 2).matrix
    by_way_of = (latent.map_between(1, 2) @ latent.map_between(0, 1)).matrix
    np.testing.assert_allclose(by_way_of, direct, atol=1e-9)
    given = (all_pairs[1, 2] @ all_pairs[0, 1]).matrix
    assert np.abs(given - all_pairs[0, 2].matrix).max() > 0.05


def test_consistent_maps_are_those_that_were_given(all_pairs):
    latent = es.spectral.latent_basis(all_pairs)
    # Of functions that are smooth enough to be mapped by 36 modes
    difference = latent.map_between(0, 3).matrix - all_pairs[0, 3].matrix
    assert np.abs(difference[:9, :9]).max() < 0.02


def test_a_wrong_map_stands_out(individuals, all_pairs):
    wrong = np.random.default_rng(0).permutation(HAND.n_vertices)
    bad = vertex_maps(individuals, [(1, 3)], wrong)
    latent = es.spectral.latent_basis({**all_pairs, **bad})
    worst, second = sorted(latent.misfits, key=latent.misfits.get)[:-3:-1]
    assert worst == (1, 3)
    assert latent.misfits[worst] > 2 * latent.misfits[second]


def test_the_area_difference_lives_on_the_bump():
    meshes = [grown_bump(size)[0] for size in (0, 0, 0.1, 0.1)]
    near = grown_bump(0)[1]
    latent = es.spectral.latent_basis(vertex_maps([solve(mesh) for mesh in meshes]))
    areas = latent.differences("area")
    found = es.spectral.difference_regions(latent, 0, areas[2:].mean(axis=0) - areas[0])
    shares = [relative_area(mesh) for mesh in meshes]
    truth = (shares[2] - shares[0]) / np.mean(shares, axis=0)
    assert np.corrcoef(found, truth)[0, 1] > 0.8
    assert near[found.argmax()] > 0.3
    assert np.abs(found[near < 1e-3]).max() < 0.3 * found.max()


def test_principal_components_tell_groups_apart():
    sizes = [0, 0.1, 0, 0.1, 0]
    meshes = [
        moved(HAND, grown_bump(size)[0].vertices + 0.002 * np.sin(9 * HAND.vertices + number))
        for number, size in enumerate(sizes)
    ]
    latent = es.spectral.latent_basis(vertex_maps([solve(mesh) for mesh in meshes]))
    rows = latent.differences("area").reshape(5, -1)
    scores = np.linalg.svd(rows - rows.mean(axis=0), full_matrices=False)[0][:, 0]
    scores = scores * np.sign(scores[1])
    assert scores[[1, 3]].min() > scores[[0, 2, 4]].max() + 0.5


def test_eigenvectors_of_a_difference_lie_on_the_bump():
    meshes, near = [grown_bump(size)[0] for size in (0, 0.1)], grown_bump(0)[1]
    spectra = [solve(mesh) for mesh in meshes]
    difference = es.spectral.shape_difference(vertex_maps(spectra)[0, 1])
    function = spectra[0].eigenvectors @ np.linalg.eigh(difference)[1][:, -1]
    weight = relative_area(HAND) * function**2
    assert weight[near > 0.1].sum() > 0.5 * weight.sum()


def moebius(stretch):
    """Return a ball moved by a conformal map of the sphere: a stretch of the plane below it."""
    x, y, z = BALL.vertices.T
    plane = stretch * (x + 1j * y) / np.maximum(1 - z, 1e-12)
    size = np.abs(plane) ** 2
    points = np.column_stack([2 * plane.real, 2 * plane.imag, size - 1]) / (size + 1)[:, None]
    return moved(BALL, np.where(z[:, None] > 1 - 1e-12, [0.0, 0.0, 1.0], points))


def twisted(angle):
    """Return a ball turned about its axis by an angle that grows with height: areas stay."""
    x, y, z = BALL.vertices.T
    turned = (x + 1j * y) * np.exp(1j * angle * z)
    return moved(BALL, np.column_stack([turned.real, turned.imag, z]))


@pytest.mark.parametrize(
    ("other", "unchanged", "changed"),
    [(moebius(1.3), "conformal", "area"), (twisted(0.6), "area", "conformal")],
)
def test_conformal_and_area_preserving_maps_of_the_sphere(other, unchanged, changed):
    spectra = [solve(BALL, 64), solve(other, 64)]
    latent = es.spectral.latent_basis(vertex_maps(spectra), n_functions=9)
    same, differing = (latent.differences(kind)[1] - np.eye(9) for kind in (unchanged, changed))
    assert np.linalg.norm(same) < 0.05
    assert np.linalg.norm(differing) > 0.25


def test_differences_are_the_integrals_that_they_stand_for(individuals):
    mapping = vertex_maps(individuals[:2])[0, 1]
    one, two = (HAND.vertices[:, axis] ** 2 for axis in (0, 1))
    carried = [es.spectral.transfer_function(mapping, each) for each in (one, two)]
    target = es.cotangent_laplacian(wavy(1))
    area = individuals[0].mass.sum()
    a, b = (es.spectral.project(each, individuals[0]) / np.sqrt(area) for each in (one, two))
    by_area = es.spectral.shape_difference(mapping, "area")
    np.testing.assert_allclose(
        a @ by_area @ b, carried[0] @ target.mass @ carried[1] / target.mass.sum(), rtol=1e-9
    )
    roots = np.sqrt(individuals[0].eigenvalues * area)
    by_angles = es.spectral.shape_difference(mapping, "conformal")
    np.testing.assert_allclose(
        (a * roots) @ by_angles @ (b * roots), carried[0] @ target.stiffness @ carried[1], rtol=1e-7
    )


@pytest.mark.parametrize("kind", ["area", "conformal"])
def test_eigenvectors_and_vertex_numbers_are_free(kind):
    """Signs, rotations of the threefold modes of a ball, and an order of vertices change nothing."""
    bumps = np.exp(-4 * ((BALL.vertices - BALL.vertices[7]) ** 2).sum(axis=1))[:, None]
    meshes = [BALL, moved(BALL, BALL.vertices * (1 + 0.4 * bumps)), twisted(0.3)]
    spectra = [solve(mesh) for mesh in meshes]
    order = np.random.default_rng(1).permutation(BALL.n_vertices)
    mixed = solve(es.TriangleMesh(meshes[1].vertices[order], np.argsort(order)[meshes[1].faces]))
    vectors = spectra[0].eigenvectors.copy()
    vectors[:, 1:4] = vectors[:, 1:4] @ TURN
    vectors[:, 4:] *= np.random.default_rng(3).choice([-1, 1], vectors.shape[1] - 4)
    turned = replace(spectra[0], eigenvectors=vectors)
    others = vertex_maps([turned, mixed], [(0, 1)], order) | vertex_maps(
        [turned, mixed, spectra[2]], [(0, 2)]
    )
    regions, distances = [], []
    for maps in (vertex_maps(spectra), others):
        latent = es.spectral.latent_basis(maps)
        found = latent.differences(kind)
        distances.append(np.linalg.norm(found[:, None] - found, axis=(2, 3)))
        regions.append(es.spectral.difference_regions(latent, 1, found[1] - found[2], kind))
    np.testing.assert_allclose(distances[0], distances[1], atol=1e-6)
    np.testing.assert_allclose(regions[0][order], regions[1], atol=1e-6)


def test_maps_of_another_form_are_refused(individuals, all_pairs):
    with pytest.raises(
        es.InvalidParameterError, match=r"maps must be a mapping from pairs \(i, j\)"
    ):
        es.spectral.latent_basis({})
    with pytest.raises(
        es.InvalidParameterError, match=r"pairs of different numbers of shapes; one is \(0, 0\)"
    ):
        es.spectral.latent_basis({(0, 0): all_pairs[0, 1]})
    with pytest.raises(
        es.InvalidParameterError, match=r"A number of a shape must be at least 0; it is -1"
    ):
        es.spectral.latent_basis({(0, -1): all_pairs[0, 1]})
    fewer = es.spectral.map_from_points(*individuals[1:3], np.arange(600), n_modes=9)
    with pytest.raises(
        es.InvalidParameterError, match=r"the first one, 36; .* is \(9, 9\). Pass n_modes=36"
    ):
        es.spectral.latent_basis({(0, 1): all_pairs[0, 1], (1, 2): fewer})


def test_networks_that_do_not_fit_are_refused(all_pairs):
    with pytest.raises(
        es.InvalidParameterError, match=r"in maps\[\(1, 2\)\] that of shape 1 has other modes"
    ):
        es.spectral.latent_basis({(0, 1): all_pairs[0, 1], (1, 2): all_pairs[2, 3]})
    with pytest.raises(
        es.InvalidParameterError, match="from 0 to 3 without gaps; no map has shape 1"
    ):
        es.spectral.latent_basis({(0, 2): all_pairs[0, 2], (2, 3): all_pairs[2, 3]})
    with pytest.raises(es.InvalidParameterError, match="none leads from shape 0 to shape 2"):
        es.spectral.latent_basis({(0, 1): all_pairs[0, 1], (2, 3): all_pairs[2, 3]})


def test_maps_that_change_constants_are_refused(all_pairs):
    tilted = replace(all_pairs[0, 1], matrix=2 * all_pairs[0, 1].matrix)
    with pytest.raises(
        es.InvalidParameterError, match=r"preserve constant functions; .* maps\[\(0, 1\)\] begins"
    ):
        es.spectral.latent_basis({(0, 1): tilted})
    with pytest.raises(es.InvalidParameterError, match="the first column of mapping begins with"):
        es.spectral.shape_difference(tilted)


def test_numbers_and_kinds_out_of_range_are_refused(all_pairs):
    latent = es.spectral.latent_basis(all_pairs)
    with pytest.raises(
        es.InvalidParameterError, match=r"n_functions must lie in 2\.\.36; it is 37"
    ):
        es.spectral.latent_basis(all_pairs, n_functions=37)
    with pytest.raises(es.InvalidParameterError, match=r"target must lie in 0\.\.3; it is 4"):
        latent.map_between(0, 4)
    for call in (
        lambda: latent.differences("size"),
        lambda: es.spectral.shape_difference(all_pairs[0, 1], "size"),
        lambda: es.spectral.difference_regions(latent, 0, np.eye(18), "size"),
    ):
        with pytest.raises(
            es.InvalidParameterError, match="kind must be 'area' or 'conformal'; it is 'size'"
        ):
            call()
    with pytest.raises(es.InvalidParameterError, match=r"shape must lie in 0\.\.3; it is 4"):
        es.spectral.difference_regions(latent, 4, np.eye(18))
    with pytest.raises(
        es.InvalidParameterError, match=r"difference must have 18 rows.*; it has 17"
    ):
        es.spectral.difference_regions(latent, 0, np.eye(18)[:17])


def test_more_than_memory_holds_is_refused(all_pairs, monkeypatch):
    monkeypatch.setattr("certeig.kit.memory.machine_memory", lambda: 1000.0)
    with pytest.raises(
        es.InvalidParameterError, match=r"for 4 shapes of 36 modes .* Take fewer modes"
    ):
        es.spectral.latent_basis(all_pairs)
