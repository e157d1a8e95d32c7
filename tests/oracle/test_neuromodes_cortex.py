"""Cortices of the neuromodes wheel: our masks and heterogeneity beside its own."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from neuromodes.eigen import EigenSolver
from neuromodes.mesh import unmask_data

import eigenshape as es

CORTICES = Path(str(resources.files("neuromodes") / "data"))
START = "sp-human_tpl-fsLR_den-4k_hemi-L_"


@pytest.fixture(scope="module")
def cortex():
    mesh = es.read_mesh(CORTICES / f"{START}midthickness.surf.gii")
    mask = es.io.read_fields(CORTICES / f"{START}medmask.label.gii")["values"]
    return mesh, mask


@pytest.fixture(scope="module")
def theirs(cortex):
    mesh, mask = cortex
    return EigenSolver({"vertices": mesh.vertices, "faces": mesh.faces}, mask.astype(bool))


def test_a_masked_cortex_is_that_of_neuromodes(cortex, theirs):
    mesh, mask = cortex
    part = es.geometry.mask_surface(mesh, mask)
    np.testing.assert_array_equal(part.mesh.vertices, theirs.geometry.v)
    np.testing.assert_array_equal(part.mesh.faces, theirs.geometry.t)
    values = np.random.default_rng(0).normal(size=(part.mesh.n_vertices, 2))
    np.testing.assert_array_equal(
        es.geometry.unmask(values, part.source_vertices, mesh.n_vertices),
        unmask_data(values, mask.astype(bool)),
    )


def test_a_conductivity_is_their_heterogeneity(cortex, theirs):
    mesh, mask = cortex
    part = es.geometry.mask_surface(mesh, mask).mesh
    values = np.random.default_rng(1).uniform(0.2, 2, part.n_vertices)
    ours = es.cotangent_laplacian(part, "consistent", conductivity=values)
    theirs.compute_lbo(hetero=values)
    largest = abs(ours.stiffness).max()
    assert abs(ours.stiffness - theirs.stiffness).max() < 1e-11 * largest
    assert abs(ours.mass - theirs.mass).max() < 1e-12 * abs(ours.mass).max()
