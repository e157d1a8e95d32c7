import numpy as np
import pytest
from broken_meshes import moebius

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.homology import betti_numbers
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import disjoint_union, euler_characteristic
from eigenshape.shapes.domains import ball, box, disc, interval
from eigenshape.shapes.surfaces import icosphere, torus


def test_surfaces():
    assert betti_numbers(icosphere(1)) == (1, 0, 1)
    assert betti_numbers(torus(8, 6)) == (1, 2, 1)
    assert betti_numbers(disc(3)) == (1, 0, 0)
    two = disjoint_union(torus(8, 6), disc(3))
    assert betti_numbers(two) == (2, 2, 1)
    b0, b1, b2 = betti_numbers(two)
    assert b0 - b1 + b2 == euler_characteristic(two)


def test_a_strip_with_one_side_has_one_loop():
    assert betti_numbers(moebius()) == (1, 1, 0)


def test_solids():
    assert betti_numbers(ball(4)) == (1, 0, 0, 0)
    cube = box(3, 3, 3)
    middles = cube.points[cube.simplices].mean(axis=1)
    inner = (np.abs(middles - 0.5) < 1 / 6).all(axis=1)
    hollow = SimplicialMesh(cube.points, cube.simplices[~inner])
    assert betti_numbers(hollow) == (1, 0, 1, 0)


def test_bad_input_is_named():
    with pytest.raises(InvalidShapeError, match="Betti numbers need triangles"):
        betti_numbers(interval(3))
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]
    with pytest.raises(InvalidShapeError, match="Betti numbers need a manifold; the surface"):
        betti_numbers((points, [[0, 1, 2], [0, 3, 4]]))
