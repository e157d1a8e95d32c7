"""What must hold for the merge tree of any function on any mesh."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from eigenshape.features.merge_tree import merge_tree
from eigenshape.features.segmentation import segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union, submesh
from eigenshape.shapes.surfaces import grid, icosphere, torus

seeds = st.integers(0, 2**32 - 1)
spreads = st.sampled_from([1, 3, 10, 1000])
some = settings(deadline=None, max_examples=40)

SHAPES = (
    icosphere(0),
    icosphere(1),
    torus(5, 4),
    grid(4, 3),
    disjoint_union(icosphere(0), torus(4, 3), grid(2, 2)),
)


def tiny(seed, spread):
    """A small mesh, at times with holes, and whole numbers on it: the smaller the spread, the more ties."""
    rng = np.random.default_rng(seed)
    mesh = SHAPES[seed % len(SHAPES)]
    if seed % 2:
        mesh = submesh(mesh, np.append(True, rng.random(mesh.n_faces - 1) < 0.8))[0]
    return mesh, rng.integers(0, spread, mesh.n_vertices).astype(float)


def soup(seed, spread):
    """Random triangles on a few vertices: edges with any number of faces, faces twice."""
    rng = np.random.default_rng(seed)
    faces = [rng.choice(7, 3, replace=False) for _ in range(rng.integers(1, 16))]
    return TriangleMesh(rng.random((7, 3)), faces), rng.integers(0, spread, 7).astype(float)


def in_order(mesh, values):
    """Faces and edges as tuples of vertex ranks, highest first; the vertex of each rank."""
    vertex = np.lexsort((np.arange(mesh.n_vertices), values))
    rank = np.argsort(vertex)
    faces = [tuple(sorted(rank[face].tolist(), reverse=True)) for face in mesh.faces]
    return faces, [[(a, b), (a, c), (b, c)] for a, b, c in faces], vertex


def lasting(pairs, values):
    """Maximum and saddle of the pairs that persist, by vertex; (-1, -1) for no saddle."""
    return sorted(
        (top, *edge) for top, edge in pairs if edge == (-1, -1) or values[top] > values[edge[0]]
    )


def pairs_of(tree):
    return sorted(zip(tree.maxima.tolist(), *tree.saddles.T.tolist(), strict=True))


def pairs_by_matrix_reduction(mesh, values):
    """Reduce the columns of the boundary matrix modulo 2, triangles in ascending order, without boundary edges."""
    faces, sides, vertex = in_order(mesh, values)
    every = [side for three in sides for side in three]
    inner = {side for side in every if every.count(side) == 2}
    column_of, pairs = {}, []
    for face in sorted(range(len(faces)), key=faces.__getitem__):
        column = inner.intersection(sides[face])
        while column and max(column) in column_of:
            column ^= column_of[max(column)]
        edge = (-1, -1)
        if column:
            column_of[max(column)] = column
            edge = tuple(vertex[list(max(column))].tolist())
        pairs.append((int(vertex[faces[face][0]]), edge))
    return lasting(pairs, values)


def pairs_by_naming_regions(mesh, values):
    """Join the regions of all faces at each edge, highest edge first; of those joined, the highest face lives on."""
    faces, sides, vertex = in_order(mesh, values)
    order = sorted(range(len(faces)), key=faces.__getitem__)
    name = {face: place for place, face in enumerate(order)}
    pairs = []
    for edge in sorted({side for three in sides for side in three}, reverse=True):
        met = {name[face] for face in name if edge in sides[face]}
        for ending in met - {max(met)}:
            top = vertex[faces[order[ending]][0]]
            pairs.append((int(top), tuple(vertex[list(edge)].tolist())))
        name = {face: max(met) if region in met else region for face, region in name.items()}
    pairs += [(int(vertex[faces[order[region]][0]]), (-1, -1)) for region in set(name.values())]
    return lasting(pairs, values)


def diagram(tree):
    """Height of each maximum and of its saddle, minus infinity where there is none."""
    return np.column_stack([tree.values, tree.values - tree.persistence])


def within(one, two, eps):
    """Say whether the bottleneck distance of two diagrams is at most eps."""
    near = (one[:, None] <= two + eps) & (two <= one[:, None] + eps)
    size = len(one) + len(two)
    fits = np.ones((size, size), dtype=bool)
    fits[: len(one), : len(two)] = near.all(axis=2)
    fits[: len(one), len(two) :] = (
        np.eye(len(one), dtype=bool) & (one[:, 0] - one[:, 1] <= 2 * eps)[:, None]
    )
    fits[len(one) :, : len(two)] = np.eye(len(two), dtype=bool) & (two[:, 0] - two[:, 1] <= 2 * eps)
    return bool((maximum_bipartite_matching(csr_array(fits)) >= 0).all())


def partition(labels):
    return {tuple(np.flatnonzero(labels == label).tolist()) for label in set(labels.tolist())}


@some
@given(seeds, spreads)
def test_pairs_are_those_of_the_reduced_boundary_matrix(seed, spread):
    mesh, values = tiny(seed, spread)
    assert pairs_of(merge_tree(mesh, values)) == pairs_by_matrix_reduction(mesh, values)


@some
@given(seeds, spreads)
def test_pairs_are_those_of_regions_joined_by_name_whatever_the_triangles(seed, spread):
    for mesh, values in (tiny(seed, spread), soup(seed, spread)):
        assert pairs_of(merge_tree(mesh, values)) == pairs_by_naming_regions(mesh, values)


@some
@given(seeds, st.integers(0, 40))
def test_a_change_by_eps_moves_the_diagram_by_eps_at_most(seed, eps):
    mesh, values = tiny(seed, 1000)
    change = np.random.default_rng(seed + 1).integers(-eps, eps + 1, mesh.n_vertices)
    one, two = diagram(merge_tree(mesh, values)), diagram(merge_tree(mesh, values + change))
    assert within(one, two, eps)
    if eps:
        assert not within(one, one[1:], eps)  # the first never dies, so nothing may stand in for it


@some
@given(seeds, spreads)
def test_a_rising_function_of_the_values_keeps_pairs_and_basins(seed, spread):
    mesh, values = tiny(seed, spread)
    one, two = merge_tree(mesh, values), merge_tree(mesh, values**3 + values - 7)
    assert pairs_of(one) == pairs_of(two)
    assert np.array_equal(one.maxima[one.basins], two.maxima[two.basins])


@some
@given(seeds, spreads, st.integers(-900, 900))
def test_a_change_of_unit_changes_nothing_else(seed, spread, power):
    mesh, values = tiny(seed, spread)
    one, two = merge_tree(mesh, values), merge_tree(mesh, values * 2.0**power)
    for name in ("maxima", "saddles", "parent", "basins"):
        assert np.array_equal(getattr(one, name), getattr(two, name))
    assert np.array_equal(one.persistence * 2.0**power, two.persistence)


@some
@given(seeds)
def test_new_names_for_vertices_and_faces_keep_the_parts(seed):
    mesh, rng = tiny(seed, 10)[0], np.random.default_rng(seed)
    values = rng.permutation(mesh.n_vertices).astype(float)
    new_of_old, old_faces = rng.permutation(mesh.n_vertices), rng.permutation(mesh.n_faces)
    old_of_new = np.argsort(new_of_old)
    faces = new_of_old[mesh.faces[old_faces]]
    renamed = TriangleMesh(mesh.vertices[old_of_new], np.roll(faces, 1, axis=1))
    one, two = merge_tree(mesh, values), merge_tree(renamed, values[old_of_new])
    for count in range(1, len(one.maxima) + 1):
        before, after = segment(one, n_regions=count), segment(two, n_regions=count)
        assert np.array_equal(before.labels[old_faces], after.labels)
        assert np.array_equal(before.features.vertices, old_of_new[after.features.vertices])


@some
@given(seeds, spreads)
def test_cuts_are_nested_and_merge_one_region_at_a_time(seed, spread):
    tree = merge_tree(*tiny(seed, spread))
    everlasting = int((tree.parent < 0).sum())
    finer = partition(segment(tree, n_regions=len(tree.maxima)).labels)
    for count in range(len(tree.maxima) - 1, everlasting - 1, -1):
        parts = segment(tree, n_regions=count)
        coarser = partition(parts.labels)
        assert len(coarser) == len(parts.features.vertices) == count
        assert len(finer - coarser) == 2
        assert len(coarser - finer) == 1
        finer = coarser


@some
@given(seeds, spreads, st.lists(st.floats(0, 1200), min_size=2, max_size=8))
def test_fewer_regions_persist_longer(seed, spread, lengths):
    mesh, values = tiny(seed, spread)
    tree = merge_tree(mesh, values)
    left = [len(segment(tree, persistence=length).features.vertices) for length in sorted(lengths)]
    assert left == sorted(left, reverse=True)
    for length in lengths:
        parts = segment(tree, persistence=length)
        n_left = len(parts.features.vertices)
        assert n_left == (tree.persistence >= length).sum()
        assert np.array_equal(parts.labels, segment(tree, n_regions=n_left).labels)


@some
@given(seeds, spreads)
def test_features_stand_by_persistence_and_top_their_own_part(seed, spread):
    mesh, values = tiny(seed, spread)
    parts = segment(merge_tree(mesh, values), n_regions=3)
    points = parts.features
    order = list(zip(-points.persistence, -points.values, strict=True))
    assert order == sorted(order)
    for label, vertex in enumerate(points.vertices):
        corners = mesh.faces[parts.labels == label]
        assert vertex in corners
        assert values[corners].max() == values[vertex] == points.values[label]
