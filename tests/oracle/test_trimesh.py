"""Topology and measure beside trimesh's, on real shapes."""

import warnings

import numpy as np
import pytest
import trimesh

from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.measure import edge_lengths, enclosed_volume, face_normals, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import degenerate_simplices
from eigenshape.geometry.topology import (
    boundary_edges,
    boundary_loops,
    edge_table,
    euler_characteristic,
    is_closed,
    non_manifold_edges,
    vertex_components,
)
from eigenshape.shapes.surfaces import icosphere, torus

SHAPES = [
    "classics/3holes.off",
    "classics/bunny.off",
    "classics/decimated-max.obj",
    "classics/eight.off",
    "classics/elk.off",
    "classics/genus3.off",
    "classics/horse.ply",
    "classics/spot.obj",
    "nasty/geometrycentral/fan3.obj",
    "nasty/geometrycentral/hourglass_ico.obj",
    "nasty/geometrycentral/moebius.obj",
    "nasty/geometrycentral/triple_vierbein.obj",
    "nasty/trimesh/joined_tetrahedra.obj",
]


def require_agreement(theirs):
    ours = TriangleMesh(theirs.vertices, theirs.faces)
    assert degenerate_simplices(ours).size == 0  # trimesh gives no normal to such a face
    np.testing.assert_array_equal(edge_table(ours).edges, np.unique(theirs.edges_sorted, axis=0))
    assert euler_characteristic(ours) == theirs.euler_number
    assert is_closed(ours) == theirs.is_watertight
    alone = trimesh.grouping.group_rows(theirs.edges_sorted, require_count=1)
    np.testing.assert_array_equal(
        np.unique(boundary_edges(ours), axis=0),
        np.unique(theirs.edges[alone].reshape(-1, 2), axis=0),
    )
    if is_closed(ours):
        assert (inconsistent_edges(ours).size == 0) == theirs.is_winding_consistent
    assert (
        vertex_components(ours)[0]
        == trimesh.graph.connected_component_labels(
            theirs.edges, node_count=len(theirs.vertices)
        ).max()
        + 1
    )
    np.testing.assert_allclose(surface_area(ours), theirs.area, rtol=1e-6)
    np.testing.assert_allclose(
        edge_lengths(ours).sum(), theirs.edges_unique_length.sum(), rtol=1e-6
    )
    np.testing.assert_allclose(face_normals(ours), theirs.face_normals, atol=1e-6)
    if is_closed(ours):
        np.testing.assert_allclose(enclosed_volume(ours), theirs.volume, rtol=1e-6)


@pytest.mark.data
@pytest.mark.parametrize("name", SHAPES)
def test_real_shapes(data, name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the reader, not ours
        theirs = trimesh.load(data / name, process=False, maintain_order=True, force="mesh")
    require_agreement(theirs)
    ours = TriangleMesh(theirs.vertices, theirs.faces)
    if not len(inconsistent_edges(ours)) and not len(non_manifold_edges(ours)):
        assert sum(len(loop) for loop in boundary_loops(ours)) == len(boundary_edges(ours))


@pytest.mark.parametrize("mesh", [icosphere(2), torus(20, 12)])
def test_made_up_shapes(mesh):
    require_agreement(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False))
