"""The road without a spectrum gives the descriptor of the road with one, nearly."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es

SMALL_RECIPE = replace(es.retrieval.SCALE_FREE, n_modes=40)


def features_off(mesh, one, two):
    """Return how far each feature of one description is from the nearest of the other."""
    apart = mesh.vertices[one.descriptor.vertices][:, None] - mesh.vertices[two.descriptor.vertices]
    return np.linalg.norm(apart, axis=2).min(axis=1) / np.sqrt(es.geometry.surface_area(mesh))


@pytest.mark.long
@pytest.mark.parametrize("recipe", [SMALL_RECIPE, replace(es.retrieval.THESIS, n_modes=40)])
@pytest.mark.parametrize("cut", [False, True])
def test_the_descriptor_is_nearly_that_of_a_spectrum(recipe, cut):
    mesh = es.make_creature("quadruped", 2, n_vertices=5500)
    mesh = es.scans.cut_by_planes(mesh, [[0, 0, 1, 0.3]]).mesh if cut else mesh
    exact, found = (
        es.retrieval.find_heat_features(mesh, recipe),
        es.retrieval.find_heat_features(mesh, recipe, accuracy=0.01),
    )
    mass = es.geometry.dual_volumes(exact.mesh)
    off = np.sqrt(mass @ (found.heat - exact.heat) ** 2 / (mass @ exact.heat**2))
    assert 0 < off < 0.01
    assert off < 1.5 * found.error
    assert np.array_equal(found.mesh.faces, mesh.faces)
    near = features_off(exact.mesh, found, exact) < 0.02
    assert near.sum() >= len(near) - 1
    assert es.retrieval.matching_score(
        found.descriptor, exact.descriptor
    ) < 0.15 * es.retrieval.matching_score(
        found.descriptor,
        es.retrieval.find_heat_features(es.make_creature("octopus", 0), recipe).descriptor,
    )


def test_small_meshes_are_described_as_ever():
    mesh = es.shapes.torus(30, 18)
    exact, found = (
        es.retrieval.find_heat_features(mesh, SMALL_RECIPE),
        es.retrieval.find_heat_features(mesh, SMALL_RECIPE, accuracy=0.01),
    )
    assert found.descriptor.vectors == pytest.approx(exact.descriptor.vectors, rel=1e-6)
    assert np.array_equal(found.descriptor.vertices, exact.descriptor.vertices)
