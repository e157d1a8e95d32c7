import numpy as np
import pytest

from eigenshape.features.crease_parts import crease_tree
from eigenshape.features.parts import find_parts
from eigenshape.features.segmentation import segment
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere

# Steps of a height map of blocks, from above: a plate with a boss; a plate with a wall along one
# side; a tray; a block with a small pocket; a block.
BOSS = [[1, 1, 1, 1], [1, 3, 3, 1], [1, 3, 3, 1], [1, 1, 1, 1]]
WALL = [[4, 4, 4, 4], [1, 1, 1, 1], [1, 1, 1, 1], [1, 1, 1, 1]]
TRAY = [[3] * 6, *[[3, 1, 1, 1, 1, 3]] * 4, [3] * 6]
POCKET = [[4] * 5, [4] * 5, [4, 4, 2, 4, 4], [4] * 5, [4] * 5]
BLOCK = [[2, 2], [2, 2]]
TOWER = [[1] * 5, [1, 3, 3, 3, 1], [1, 3, 6, 3, 1], [1, 3, 3, 3, 1], [1] * 5]


def blocks(heights):
    """Return the closed surface of unit cubes piled up to a height at each place."""
    heights = np.array(heights)
    solid = np.zeros((*np.array(heights.shape) + 2, heights.max() + 2), dtype=bool)
    for (i, j), height in np.ndenumerate(heights):
        solid[i + 1, j + 1, 1 : height + 1] = True
    corners, sides = [], []
    for axis in range(3):
        for sign in (1, -1):
            one, two = np.eye(3, dtype=int)[[(axis + 1) % 3, (axis + 2) % 3]][::sign]
            step = np.eye(3, dtype=int)[axis]
            free = solid & ~np.roll(solid, -sign, axis)
            for cell in np.argwhere(free):
                base = cell + (step if sign > 0 else 0)
                start = len(corners)
                corners += [base, base + one, base + one + two, base + two]
                sides += [[start, start + 1, start + 2], [start, start + 2, start + 3]]
    vertices, places = np.unique(np.array(corners), axis=0, return_inverse=True)
    return TriangleMesh(vertices.astype(float), places.ravel()[np.array(sides)])


@pytest.mark.parametrize(("heights", "count"), [(BOSS, 2), (WALL, 2), (TRAY, 2), (TOWER, 3)])
def test_what_rises_from_a_ledge_is_a_part_that_ends_at_the_crease(heights, count):
    found = find_parts(blocks(heights))
    labels = found.parts.labels
    assert len(np.unique(labels)) == count
    # Below the plane of the lowest ledge, at height 2 of the grid, all is plate.
    below = found.mesh.vertices[found.mesh.faces].mean(axis=1)[:, 2] <= 2
    (plate,) = np.unique(labels[below])
    assert (labels[~below] != plate).all()


@pytest.mark.parametrize("heights", [POCKET, BLOCK])
def test_a_small_pocket_makes_no_part_and_a_block_is_one(heights):
    assert len(find_parts(blocks(heights)).parts.features.vertices) == 1


def test_a_level_cuts_the_tree_of_creases():
    mesh = blocks(TOWER)
    counts = [len(find_parts(mesh, level=level).parts.features.vertices) for level in (-5, 0, 1)]
    assert counts == [1, 3, 3]


def test_parts_of_two_bodies_do_not_depend_on_the_unit():
    two = disjoint_union(blocks(BOSS), blocks(WALL))
    labels = [
        find_parts(TriangleMesh(two.vertices * scale, two.faces)).parts.labels
        for scale in (1, 2.0**-300, 2.0**300)
    ]
    assert len(np.unique(labels[0])) == 4
    np.testing.assert_array_equal(labels[0], labels[1])
    np.testing.assert_array_equal(labels[0], labels[2])


def test_each_part_has_its_hottest_vertex_and_the_tree_says_where_it_rises_from():
    mesh = blocks(TOWER)
    heat = mesh.vertices[:, 2]
    tree = crease_tree(mesh, heat)
    parts = segment(tree, persistence=0.3)
    assert heat[parts.features.vertices[np.argsort(tree.values)]].tolist() == [2, 4, 7]
    # By odds: the plate, the tip, the step. When the tip ends, it lies on the plate: the step, which
    # has lower odds, has ended before.
    assert heat[tree.maxima].tolist() == [2, 7, 4]
    assert tree.parent.tolist() == [-1, 0, 0]
    # On a ledge of 16 squares a step of 9, on a ledge of 8 a tip of 1, with creases all around
    odds = tree.persistence[1:] / (1 - tree.persistence[1:])
    np.testing.assert_allclose(odds, [3 * 8, 3 * 16 / 9])


@pytest.mark.parametrize("mesh", [icosphere(2), make_creature("biped", n_vertices=1000)])
def test_organic_shapes_have_no_ledges(mesh):
    assert len(crease_tree(mesh, np.zeros(mesh.n_vertices)).maxima) == 1
