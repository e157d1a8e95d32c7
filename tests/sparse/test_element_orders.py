"""Patterns of finite elements are eliminated with fewer entries by what is known of their corners."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial import Delaunay

from certeig.sparse import dissection, elimination
from certeig.sparse.elimination import analyze_pattern
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.operators.elements import mass
from eigenshape.operators.fem import fem_laplacian
from eigenshape.shapes.domains import box


@pytest.mark.parametrize("order", [2, 3])
def test_nodes_of_elements_are_ordered_by_the_corners_that_dominate_them(order, monkeypatch):
    mesh = box(6, 6, 6)
    pattern = sp.csc_array(fem_laplacian(mesh, order).mass)
    reduced = analyze_pattern(pattern)
    # Corners alone are dissected, and each other node is eliminated before some corner of its element.
    place = np.argsort(reduced.order)
    for node in range(mesh.n_points, len(place)):
        neighbors = pattern[:, [node]].indices
        assert place[node] < place[neighbors[neighbors < mesh.n_points]].max()
    monkeypatch.setattr(elimination, "DENSE", np.inf)
    monkeypatch.setattr(dissection, "DENSE", np.inf)
    assert reduced.n_entries < 0.9 * analyze_pattern(pattern).n_entries


def test_solids_have_fewer_entries_with_several_keys_and_narrow_cuts(monkeypatch):
    points = np.random.default_rng(0).random((1500, 3))
    mesh = SimplicialMesh(points, Delaunay(points).simplices)
    pattern = sp.csc_array(mass(mesh, mesh.simplices, 1))
    narrow = analyze_pattern(pattern).n_entries
    monkeypatch.setattr(dissection, "DENSE", np.inf)
    assert narrow < 0.9 * analyze_pattern(pattern).n_entries
