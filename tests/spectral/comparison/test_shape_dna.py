import lapy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lapy import shapedna
from scipy.spatial.transform import Rotation

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError

few = settings(deadline=None, max_examples=10)


def bumpy(seed):
    rng = np.random.default_rng(seed)
    mesh = es.shapes.torus(14, 9) if seed % 2 else es.icosphere(2)
    return es.TriangleMesh(
        mesh.vertices + 0.03 * rng.standard_normal(mesh.vertices.shape), mesh.faces
    )


def test_on_a_sphere_it_is_known():
    exact = 4 * np.pi * es.shapes.sphere_eigenvalues(21)[1:] / np.arange(1, 21)
    np.testing.assert_allclose(es.spectral.shape_dna(es.icosphere(4)), exact, rtol=0.02)


def test_lapy_divides_by_one_more():
    mesh = es.shapes.torus(20, 12)
    fem = lapy.TriaMesh(mesh.vertices, mesh.faces)
    values = shapedna.compute_shapedna(fem, k=21, lump=True)["Eigenvalues"]
    theirs = shapedna.reweight_ev(shapedna.normalize_ev(fem, values))[1:]
    rank = np.arange(1, 21)
    np.testing.assert_allclose(theirs, es.spectral.shape_dna(mesh) * rank / (rank + 1), rtol=1e-6)


@few
@given(st.integers(0, 2**32 - 1), st.floats(-100, 100))
def test_size_place_and_numbering_drop_out(seed, power):
    mesh, rng = bumpy(seed), np.random.default_rng(seed)
    turn, order = Rotation.random(random_state=seed), rng.permutation(mesh.n_vertices)
    moved = np.empty_like(mesh.vertices)
    moved[order] = 10.0**power * (mesh.vertices @ turn.as_matrix().T + rng.standard_normal(3))
    there = es.TriangleMesh(moved, order[mesh.faces])
    np.testing.assert_allclose(es.spectral.shape_dna(there), es.spectral.shape_dna(mesh), rtol=1e-8)


def test_poses_are_nearer_than_other_shapes():
    one, two = (es.spectral.shape_dna(es.make_creature("biped", seed)) for seed in (0, 1))
    other = es.spectral.shape_dna(es.icosphere(3))
    assert np.linalg.norm(one - two) < np.linalg.norm(one - other)


def test_bad_input_is_named():
    mesh = es.icosphere(0)
    with pytest.raises(InvalidParameterError, match=r"n_values must lie in 1\.\.11; it is 12"):
        es.spectral.shape_dna(mesh, n_values=12)
    flat = es.TriangleMesh(np.outer(range(4), [1.0, 0, 0]), [[0, 1, 2], [1, 2, 3]])
    with pytest.raises(InvalidShapeError):
        es.spectral.shape_dna(flat, n_values=1)
