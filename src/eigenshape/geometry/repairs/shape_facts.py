"""The size, topology and faults of a shape, in numbers."""

from typing import Any

import numpy as np

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud, Shape
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.measure import edge_lengths, enclosed_volume, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair import suggest_repairs
from eigenshape.geometry.repairs.repair_steps import drop_duplicate_points
from eigenshape.geometry.samples.spacing import neighbor_distance
from eigenshape.geometry.seams import seams
from eigenshape.geometry.simplices import degenerate_simplices, mean_side_length, simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import (
    boundary_loops,
    boundary_vertices,
    euler_characteristic,
    is_closed,
    non_manifold_edges,
    non_manifold_vertices,
    repeated_simplices,
    unreferenced_vertices,
    vertex_components,
)

KINDS = {1: "curve", 2: "surface", 3: "tetrahedral mesh"}
MEASURES = {1: "length", 2: "area"}


def shape_facts(shape: Shape) -> dict[str, Any]:
    """Return the size, topology and faults of a shape by name, in its own length unit."""
    if isinstance(shape, TriangleMesh):
        facts = _mesh_facts(shape)
    elif isinstance(shape, PointCloud):
        facts = _cloud_facts(shape)
    else:
        facts = _simplicial_facts(shape)
    low, high = shape.points.min(axis=0), shape.points.max(axis=0)
    facts |= {"box_low": low.tolist(), "box_high": high.tolist()}
    return facts | {"repairs_to_try": list(suggest_repairs(shape))}


def _cloud_facts(cloud: PointCloud) -> dict[str, Any]:
    try:
        near = neighbor_distance(cloud.points, cloud.dim)
    except InvalidShapeError:  # too few points to have one; the other facts stand
        near = None
    return {
        "kind": "point cloud",
        "points": cloud.n_points,
        "dimension": cloud.dim,
        "coordinates": cloud.points.shape[1],
        "coinciding_points": cloud.n_points - drop_duplicate_points(cloud).cloud.n_points,
        "mean_near_distance": near,
    }


def _simplicial_facts(mesh: SimplicialMesh) -> dict[str, Any]:
    return {
        "kind": KINDS.get(mesh.dim, "simplicial mesh"),
        "points": mesh.n_points,
        "simplices": mesh.n_simplices,
        "dimension": mesh.dim,
        "coordinates": mesh.points.shape[1],
        "components": vertex_components(mesh)[0],
        "boundary_points": len(boundary_vertices(mesh)),
        MEASURES.get(mesh.dim, "volume"): float(simplex_volumes(mesh).sum()),
        "mean_side_length": mean_side_length(mesh),
        "without_volume": len(degenerate_simplices(mesh)),
        "duplicates": len(repeated_simplices(mesh)),
        "loose_points": len(unreferenced_vertices(mesh)),
    }


def _mesh_facts(mesh: TriangleMesh) -> dict[str, Any]:
    closed, n_turned = is_closed(mesh), len(inconsistent_edges(mesh))
    return {
        "vertices": mesh.n_vertices,
        "faces": mesh.n_faces,
        "components": vertex_components(mesh)[0],
        "boundary_loops": len(boundary_loops(mesh)),
        "closed": closed,
        "euler_characteristic": euler_characteristic(mesh),
        "area": surface_area(mesh),
        "enclosed_volume": enclosed_volume(mesh) if closed and not n_turned else None,
        "mean_edge_length": float(edge_lengths(mesh).mean()),
        "faces_without_area": len(degenerate_simplices(mesh)),
        "duplicate_faces": len(repeated_simplices(mesh)),
        "loose_vertices": len(unreferenced_vertices(mesh)),
        "coinciding_vertices": mesh.n_vertices - len(np.unique(mesh.vertices + 0.0, axis=0)),
        "edges_on_seams": len(seams(mesh)),
        "non_manifold_edges": len(non_manifold_edges(mesh)),
        "non_manifold_vertices": len(non_manifold_vertices(mesh)),
        "turned_over_edges": n_turned,
    }
