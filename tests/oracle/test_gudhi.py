"""Persistence and pairs beside GUDHI's, bit for bit, on real meshes: closed, open, and with quantized values."""

import gudhi
import numpy as np
import pytest

from eigenshape.features.merge_tree import merge_tree
from eigenshape.geometry.topology import boundary_loops, is_closed, is_manifold
from eigenshape.io.mesh_files import read_mesh
from eigenshape.scans.partial import cut_by_planes
from eigenshape.shapes.surfaces import grid, icosphere, torus

CLOSED = (
    "retrieval/airplane/psb68.ply", "retrieval/ant/psb84.ply", "retrieval/armadillo/psb284.ply",
    "retrieval/bearing/psb342.ply", "retrieval/bust/psb302.ply", "retrieval/cat/tosca_cat0.ply",
    "retrieval/centaur/tosca_centaur0.ply", "retrieval/chair/psb102.ply", "retrieval/cup/psb22.ply",
    "retrieval/dog/tosca_dog0.ply", "retrieval/fish/psb222.ply", "retrieval/glasses/psb42.ply",
    "retrieval/octopus/psb122.ply", "retrieval/plier/psb202.ply", "retrieval/teddy/psb162.ply",
    "classics/3holes.off", "classics/eight.off", "classics/elk.off", "classics/fertility.off", "classics/genus3.off",
)  # fmt: skip
OPEN = (
    "retrieval/horse/sumner_horse-02.ply", "retrieval/horse/sumner_horse-05.ply", "retrieval/horse/sumner_horse-07.ply",
)  # fmt: skip


def sealed(mesh):
    """Close each boundary loop by a fan around a vertex of its own, which stands below all others."""
    faces = mesh.faces.tolist()
    for number, loop in enumerate(boundary_loops(mesh)):
        peak = mesh.n_vertices + number
        faces += [[int(a), int(b), peak] for a, b in zip(loop, np.roll(loop, -1), strict=True)]
    return np.array(faces)


def in_order(faces, rank):
    """The vertices, edges and triangles, and the place of each among all: by ranks of vertices, highest first."""
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    lists = [np.arange(len(rank))[:, None], np.unique(sides, axis=0), faces]
    keys = [
        np.pad(
            -np.sort(-rank[some], axis=1),
            ((0, 0), (0, 3 - some.shape[1])),
            constant_values=-len(rank),
        )
        for some in lists
    ]
    order = np.lexsort(np.concatenate(keys).T[::-1])
    places = np.argsort(order).astype(float)
    starts = np.cumsum([len(some) for some in lists])[:-1]
    return list(zip(lists, np.split(places, starts), strict=True))


def pairs_by_gudhi(mesh, values):
    """Pair triangles with edges in a filtration by (highest, middle, lowest vertex), a face before what it bounds."""
    n, faces = mesh.n_vertices, sealed(mesh)
    rank = np.empty(faces.max() + 1, dtype=int)
    rank[np.lexsort((np.arange(n), values))] = np.arange(n)
    rank[n:] = -1 - np.arange(len(rank) - n)
    simplices = gudhi.SimplexTree()
    for listed, place in in_order(faces, rank):
        simplices.insert_batch(listed.T, place)
    simplices.compute_persistence(homology_coeff_field=2, persistence_dim_max=True)
    pairs = []
    for edge, triangle in simplices.persistence_pairs():
        if len(edge) == 2 and len(triangle) == 3:
            top = max(triangle, key=lambda v: rank[v])
            high, low = sorted(edge, key=lambda v: -rank[v])
            if high < n and values[top] > values[high]:
                pairs.append((top, high, low, values[top] - values[high]))
    return sorted(pairs)


def our_pairs(mesh, values):
    tree = merge_tree(mesh, values)
    finite = np.isfinite(tree.persistence)
    columns = (tree.maxima[finite], *tree.saddles[finite].T, tree.persistence[finite])
    return sorted(zip(*(column.tolist() for column in columns), strict=True))


def waves(mesh, quantized):
    x, y, z = (mesh.vertices - mesh.vertices.mean(axis=0)).T / np.ptp(mesh.vertices, axis=0).max()
    heights = np.sin(9 * x + 1) * np.cos(11 * y) + 0.4 * np.sin(14 * z)
    return np.round(8 * heights) / 8 if quantized else heights


@pytest.mark.parametrize("quantized", [False, True])
@pytest.mark.parametrize(
    "mesh", [icosphere(3), torus(30, 18), grid(17, 13)], ids=["sphere", "torus", "flat"]
)
def test_made_up_surfaces(mesh, quantized):
    values = waves(mesh, quantized)
    expected = pairs_by_gudhi(mesh, values)
    assert expected
    assert our_pairs(mesh, values) == expected


@pytest.mark.data
@pytest.mark.parametrize("quantized", [False, True])
@pytest.mark.parametrize("path", CLOSED)
def test_closed_shapes(data, path, quantized):
    mesh = read_mesh(data / path)
    assert is_closed(mesh)
    values = waves(mesh, quantized)
    expected = pairs_by_gudhi(mesh, values)
    assert expected
    assert our_pairs(mesh, values) == expected


@pytest.mark.data
@pytest.mark.parametrize("quantized", [False, True])
@pytest.mark.parametrize("path", OPEN)
def test_open_shapes(data, path, quantized):
    mesh = read_mesh(data / path)
    values = waves(mesh, quantized)
    assert boundary_loops(mesh)
    assert is_manifold(mesh)
    assert our_pairs(mesh, values) == pairs_by_gudhi(mesh, values)


@pytest.mark.data
@pytest.mark.parametrize("path", CLOSED[:10])
def test_shapes_cut_open(data, path):
    mesh = read_mesh(data / path)
    for normal in np.eye(3):
        part = cut_by_planes(mesh, [*normal, np.quantile(mesh.vertices @ normal, 0.6)]).mesh
        if is_manifold(
            part
        ):  # sealing a loop by one vertex means the same only where each vertex has one fan
            break
    else:
        pytest.fail("no cut of this shape is a manifold")
    values = waves(part, quantized=True)
    assert boundary_loops(part)
    assert our_pairs(part, values) == pairs_by_gudhi(part, values)
