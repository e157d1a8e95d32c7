"""Hexahedra, wedges and pyramids in tetrahedra that match and fill them."""

import numpy as np
import pytest

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.facets import boundary_surface, facet_table
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.solids import split_solids
from eigenshape.geometry.topology import is_closed

RING = [[0, 0], [1, 0], [1, 1], [0, 1]]
CUBE = [[x, y, z] for z in (0.0, 1.0) for x, y in RING]
SHAPES = {
    "hexahedron": (CUBE, 6, 1),
    "wedge": ([CUBE[i] for i in (0, 1, 3, 4, 5, 7)], 3, 1 / 2),
    "pyramid": ([*CUBE[:4], [0.5, 0.5, 1.0]], 2, 1 / 3),
}


def bricks(n, rng):
    """Return n³ hexahedra with points in any order, each listed from any of its corners of the base."""
    axis = np.arange(n + 1)
    grid = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    at = [grid[x : x + n, y : y + n, z : z + n].ravel() for z in (0, 1) for x, y in RING]
    names = rng.permutation(len(points))
    turns = (np.arange(4) + rng.integers(4, size=(n**3, 1))) % 4
    solids = names[np.column_stack(at)]
    solids = np.take_along_axis(solids, np.concatenate([turns, 4 + turns], axis=1), axis=1)
    return points[np.argsort(names)] * 1.0, solids


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("seed", range(4))
def test_a_solid_is_filled_whichever_corner_is_the_smallest(name, seed):
    points, count, volume = SHAPES[name]
    order = np.random.default_rng(seed).permutation(len(points))
    solid = split_solids(np.array(points)[np.argsort(order)], order[None])
    assert solid.n_simplices == count
    assert simplex_volumes(solid).sum() == pytest.approx(volume)
    assert enclosed_volume(boundary_surface(solid)) == pytest.approx(volume)


def test_tetrahedra_of_neighbors_match():
    points, solids = bricks(3, np.random.default_rng(0))
    solid = split_solids(points, solids)
    surface = boundary_surface(solid)
    assert is_closed(surface)
    assert surface.n_faces == 2 * 6 * 9  # two triangles for each square outside, and none inside
    assert facet_table(solid).n_simplices.max() == 2
    assert simplex_volumes(solid).sum() == pytest.approx(27)


def test_mirrored_solids_are_taken():
    assert simplex_volumes(split_solids(CUBE, [[4, 5, 6, 7, 0, 1, 2, 3]])).sum() == pytest.approx(1)


def test_what_cannot_be_split_is_named():
    points, solids = bricks(2, np.random.default_rng(1))
    solids[5] = solids[5, [4, 5, 6, 7, 0, 1, 2, 3]]
    with pytest.raises(InvalidShapeError, match=r"hexahedron 5 with the corners .* \(1 such\)"):
        split_solids(points, solids)
    with pytest.raises(
        InvalidShapeError, match=r"must be indices of the 8 points; solid 0 is \[1, 2"
    ):
        split_solids(CUBE, [[1, 2, 3, 4, 5, 6, 7, 8]])
    with pytest.raises(
        InvalidShapeError, match=r"8, 6 or 5 whole numbers a row; it is int64 of shape \(1, 7\)"
    ):
        split_solids(CUBE, [list(range(7))])
