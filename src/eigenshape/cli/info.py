"""eigenshape info: what a mesh is, and what it would need."""

from typing import Any

import numpy as np
from rich.markup import escape

from eigenshape.cli.console import JsonOption, MeshArgument, RepairOption, load_mesh, out, print_json
from eigenshape.geometry.measure import bounding_box, edge_lengths, enclosed_volume, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import degenerate_simplices
from eigenshape.geometry.topology import (
    boundary_loops,
    euler_characteristic,
    inconsistent_edges,
    is_closed,
    non_manifold_edges,
    non_manifold_vertices,
    unreferenced_vertices,
    vertex_components,
)


def info(mesh: MeshArgument, *, repair: RepairOption = "", as_json: JsonOption = False) -> None:
    """Show size, topology and health of a mesh, and which repairs it would need."""
    facts = mesh_facts(load_mesh(mesh, repair))
    if as_json:
        print_json({"path": str(mesh), **facts})
        return
    out.print(f"[bold]{escape(str(mesh))}[/]")
    for name, value in facts.items():
        out.print(f"  {name.replace('_', ' '):<24}{_shown(value)}")


def mesh_facts(mesh: TriangleMesh) -> dict[str, Any]:
    """Gather what there is to say about a mesh, in the mesh's own length unit."""
    n_components, _ = vertex_components(mesh)
    low, high = bounding_box(mesh)
    closed = is_closed(mesh)
    facts = {
        "vertices": mesh.n_vertices,
        "faces": mesh.n_faces,
        "components": n_components,
        "boundary_loops": len(boundary_loops(mesh)),
        "closed": closed,
        "euler_characteristic": euler_characteristic(mesh),
        "area": surface_area(mesh),
        "enclosed_volume": enclosed_volume(mesh) if closed else None,
        "mean_edge_length": float(edge_lengths(mesh).mean()),
        "box_low": low.tolist(),
        "box_high": high.tolist(),
    }
    return facts | _faults(mesh)


def _faults(mesh: TriangleMesh) -> dict[str, Any]:
    n_distinct = len(np.unique(np.sort(mesh.faces, axis=1), axis=0))
    n_places = len(np.unique(mesh.vertices + 0.0, axis=0))
    faults = {
        "faces_without_area": len(degenerate_simplices(mesh)),
        "duplicate_faces": mesh.n_faces - n_distinct,
        "loose_vertices": len(unreferenced_vertices(mesh)),
        "coinciding_vertices": mesh.n_vertices - n_places,
        "non_manifold_edges": len(non_manifold_edges(mesh)),
        "non_manifold_vertices": len(non_manifold_vertices(mesh)),
        "turned_over_edges": len(inconsistent_edges(mesh)),
    }
    cures = {
        "coinciding_vertices": "weld",
        "faces_without_area": "drop_degenerate",
        "duplicate_faces": "drop_duplicate_faces",
        "loose_vertices": "drop_unreferenced",
    }
    return faults | {"repairs_to_try": [cure for fault, cure in cures.items() if faults[fault]]}


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(_shown(item) for item in value) or "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
