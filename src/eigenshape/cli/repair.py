"""eigenshape info, repair, decimate and tetrahedralize: what a mesh is, what it needs, fewer faces, and its inside."""

from pathlib import Path
from typing import Any

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.cli import steps
from eigenshape.cli.console import (
    escape_text,
    out,
    print_json,
    print_repairs,
    print_table,
    print_written,
)
from eigenshape.cli.inputs import SEAMS
from eigenshape.io.formats.registry import CellKind


def info(
    shape: Path,
    *,
    repair: str = "none",
    dim: int = 2,
    cells: CellKind | None = None,
    scene: str | None = None,
    as_json: bool = False,
) -> None:
    """Show the size, topology and faults of a shape, and which repairs would help."""
    found = steps.load_shape(shape, repair, dim, cells, scene)
    facts = steps.shape_facts(found)
    if as_json:
        print_json({"path": shape, **facts})
        return
    out.print(f"[bold]{escape_text(shape)}[/]")
    for name, value in facts.items():
        inward = name == "enclosed_volume" and value is not None and value < 0
        remark = " (faces point inward)" if inward else ""
        out.print(f"  {name.replace('_', ' '):<24}{_format_fact(value)}{remark}")


def _format_fact(value: Any) -> str:
    """Return a fact of a shape as people read it."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(_format_fact(item) for item in value) or "none"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def repair(
    mesh: Path,
    *,
    output: Path,
    repair: str = "auto",
    cells: CellKind | None = None,
    scene: str | None = None,
    as_json: bool = False,
) -> None:
    """Repair a mesh and write it, and report what was done. All else that the file holds stays, or is named.

    Hexahedra, wedges and pyramids are split into tetrahedra, which a .vtu file holds.

    For instance: eigenshape repair scan.ply --repair auto -o clean.ply

    Parameters
    ----------
    repair : NAMES
        Repairs to apply in this order, separated by commas: auto, drop_missing, weld, weld_seams,
        collapse_needles, drop_degenerate, drop_duplicate_faces, drop_unreferenced, orient,
        largest_component, fill_holes, cut_one_sided. none only converts the file. By default
        auto.
    """
    steps.require_mesh_path(output)
    before, done = steps.load_repaired(mesh, repair, cells, scene)
    print_repairs(done.report)
    if isinstance(done.mesh, es.TriangleMesh):
        steps.save_like(mesh, done.mesh, output, cells=cells, scene=scene)
    else:
        steps.require_output(output, (".vtu",), "A mesh of tetrahedra or segments")
        es.io.write_fields(done.mesh, output, {})
        print_written(output)
    facts = {"before": steps.shape_facts(before), "after": steps.shape_facts(done.mesh)}
    if as_json:
        print_json({"path": mesh, "output": output, "report": done.report, **facts})
        return
    rows = []
    for name in facts["before"] | facts["after"]:  # of points, others than of the surface
        values = [fact.get(name) for fact in facts.values()]
        if any(isinstance(value, int) for value in values):  # counts, and yes or no
            rows.append([name.replace("_", " "), *map(_format_fact, values)])
    print_table("Repaired", ["", *facts], rows)


def decimate(
    mesh: Path,
    *,
    output: Path,
    n_faces: int | None = None,
    ratio: float | None = None,
    repair: str = SEAMS,
    as_json: bool = False,
) -> None:
    """Write a mesh with fewer faces and the same topology, by collapsing edges.

    All else that the file holds stays, or is named: textures, materials, colors, groups, fields.
    Vertices that are double along seams are joined first.

    For instance: eigenshape decimate scan.ply --ratio 0.1 -o small.ply

    Parameters
    ----------
    n_faces
        Number of faces to keep.
    ratio
        Instead of -n: the share of faces to keep, between 0 and 1.
    """
    steps.require_mesh_path(output)
    if (n_faces is None) == (ratio is None):
        raise InvalidParameterError(
            "The number of faces must be given by one of --n-faces and --ratio."
        )
    surface = steps.load_surface(mesh, repair)
    done = es.geometry.decimate(surface, n_faces, ratio=ratio)
    steps.save_like(mesh, done.mesh, output)
    if as_json:
        facts = {"n_vertices": done.mesh.n_vertices, "n_faces": done.mesh.n_faces}
        print_json({"path": mesh, "output": output, "report": done.report, **facts})
    else:
        out.print(escape_text("\n".join(done.report)))


def tetrahedralize(
    mesh: Path,
    *,
    output: Path,
    side_length: float | None = None,
    repair: str = "none",
    as_json: bool = False,
) -> None:
    """Fill a closed surface with tetrahedra, and write them to a .vtu file.

    For instance: eigenshape tetrahedralize thalamus.gii --side-length 2 -o thalamus.vtu

    Parameters
    ----------
    output
        Write the tetrahedra to this file (.vtu).
    side_length
        Largest length of sides to aim at inside, in the unit of the file. By default sides grow
        from those of the surface inward.
    """
    steps.require_output(output, (".vtu",), "A mesh of tetrahedra")
    solid = es.geometry.tetrahedralize(steps.load_surface(mesh, repair), side_length)
    es.io.write_fields(solid, output, {})
    print_written(output)
    facts = {"n_points": solid.n_points, "n_tetrahedra": solid.n_simplices}
    if as_json:
        print_json({"path": mesh, "output": output, **facts})
    else:
        out.print(f"{solid.n_simplices:,} tetrahedra of {solid.n_points:,} points")
