"""EVD, a method that the thesis compares with."""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import eigenshape as es

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "experiments" / "ch5_retrieval")]
from affinity import affinity_distance, affinity_eigenvalues  # noqa: E402

few = settings(deadline=None, max_examples=10)


def test_two_points_by_hand():
    mesh = es.TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]])
    # From vertex 0 the farthest is 2, and from 2 it is 1: the longest distance 5, affinity exp(-1/2).
    found = affinity_eigenvalues(mesh, n_values=2, n_samples=2)
    np.testing.assert_allclose(found, [(1 + np.exp(-0.5)) / 2, (1 - np.exp(-0.5)) / 2], rtol=1e-14)


def test_with_all_points_they_are_the_eigenvalues_of_all_affinities():
    mesh = es.shapes.torus(12, 7)
    distances = es.geometry.geodesic_distances(mesh, np.arange(mesh.n_vertices))
    distances = np.minimum(distances, distances.T)
    affinity = np.exp(-(distances**2) / (2 * distances.max() ** 2))
    exact = np.linalg.eigvalsh(affinity)[::-1][:10] / len(affinity)
    found = affinity_eigenvalues(mesh, n_values=10, n_samples=mesh.n_vertices)
    np.testing.assert_allclose(found, exact, rtol=1e-9)


@few
@given(st.integers(0, 2**32 - 1), st.floats(-100, 100))
def test_size_and_place_drop_out(seed, power):
    mesh, rng = es.make_creature("hand", seed % 7, n_vertices=600), np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed)
    there = es.TriangleMesh(
        10.0**power * (mesh.vertices @ turn.as_matrix().T + rng.standard_normal(3)), mesh.faces
    )
    one, two = (
        affinity_eigenvalues(mesh),
        affinity_eigenvalues(there),
    )
    # Rounding may choose another of two equally far samples.
    np.testing.assert_allclose(two, one, rtol=1e-3, atol=1e-5)


def test_resolution_drops_out():
    meshes = es.icosphere(3), es.icosphere(4), es.shapes.torus(40, 20)
    one, two, other = (affinity_eigenvalues(mesh, n_samples=100) for mesh in meshes)
    assert affinity_distance(one, two) < 0.1 * affinity_distance(one, other)


def test_pieces_without_a_way_between_them_have_no_affinity():
    piece = es.icosphere(1)
    both = es.geometry.disjoint_union(piece, piece)
    one = affinity_eigenvalues(piece, n_values=4, n_samples=piece.n_vertices)
    two = affinity_eigenvalues(both, n_values=8, n_samples=both.n_vertices)
    np.testing.assert_allclose(two, np.repeat(one, 2) / 2, rtol=1e-9)


def test_the_distance_by_hand():
    found = affinity_distance(np.array([4.0, 1.0, 0.0]), np.array([1.0, 1.0, 0.0]))
    assert found == pytest.approx((2 - 1) ** 2 / (2 + 1) / 2)
