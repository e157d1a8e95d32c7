"""Beside CGAL's exact kernel, by way of libigl: the same pairs, but for what each takes for a crossing by rule."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from igl.copyleft import cgal

from eigenshape.geometry.distances.crossings import self_intersections
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.mesh_files import read_mesh

CLASSICS = {
    "3holes.off": 0, "armadillo.obj": 0, "bunny.off": 0, "camel.off": 20, "decimated-max.obj": 0, "eight.off": 0,
    "elk.off": 0, "fertility.off": 0, "genus3.off": 0, "horse.ply": 4, "koala.obj": 0, "penguin.obj": 0, "spot.obj": 0,
}  # fmt: skip


def theirs(mesh):
    _, _, found, _, _ = cgal.remesh_self_intersections(mesh.vertices, mesh.faces, detect_only=True)
    return {tuple(pair) for pair in np.sort(found, axis=1).tolist()}


def ours(mesh):
    return {tuple(pair) for pair in self_intersections(mesh).tolist()}


def corners_in_common(mesh, i, j):
    return len(np.intersect1d(mesh.faces[i], mesh.faces[j]))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_random_triangles(seed):
    """Many with a vertex or an edge in common; none twice, which is an overlap to us alone."""
    rng = np.random.default_rng(seed)
    faces = np.unique(np.sort([rng.permutation(20)[:3] for _ in range(40)], axis=1), axis=0)
    mesh = TriangleMesh(rng.standard_normal((20, 3)), faces)
    found = ours(mesh)
    assert found == theirs(mesh)
    assert found


@pytest.mark.data
@pytest.mark.parametrize("name", CLASSICS)
def test_real_meshes(data, name):
    mesh = read_mesh(data / "classics" / name)
    found = ours(mesh)
    assert found == theirs(mesh)
    assert len(found) == CLASSICS[name]


@pytest.mark.data
def test_neighbors_folded_flat_are_ours_alone(data):
    """The dragon's coordinates have two decimals, so that some of its slivers lie upon each other to the last digit."""
    mesh = read_mesh(data / "classics" / "dragon.off")
    found, known = ours(mesh), theirs(mesh)
    assert len(found) == 19
    assert known < found
    assert all(corners_in_common(mesh, *pair) == 2 for pair in found - known)


@pytest.mark.data
def test_sides_that_meet_are_theirs_alone(data):
    """A mouth whose two lips meet in the plane of symmetry, one from the left and one from the right."""
    mesh = read_mesh(data / "classics" / "human_neutral.obj")
    found, known = ours(mesh), theirs(mesh)
    assert len(found) == 322
    assert found < known
    for i, j in known - found:
        x, plane = mesh.vertices[mesh.faces[[i, j]], 0], 1e-6
        assert (x == plane).sum() == 4
        assert (x[0] - plane).sum() * (x[1] - plane).sum() < 0
