"""eigenshape repair: a mesh repaired, or converted, and written."""

from pathlib import Path

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, print_repairs, print_table, print_written
from eigenshape.cli.info import format_fact
from eigenshape.io.formats.registry import CellKind


def repair(
    mesh: Path,
    *,
    output: Path,
    repair: str = "auto",
    cells: CellKind | None = None,
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
    before, done = steps.load_repaired(mesh, repair, cells)
    if not isinstance(done.mesh, es.TriangleMesh):
        steps.require_output(output, (".vtu",), "A mesh of tetrahedra or segments")
    print_repairs(done.report)
    if isinstance(done.mesh, es.TriangleMesh):
        steps.save_like(mesh, done.mesh, output)
    else:
        es.io.write_fields(done.mesh, output, {})
        print_written(output)
    facts = {"before": steps.shape_facts(before), "after": steps.shape_facts(done.mesh)}
    if as_json:
        print_json({"path": mesh, "output": output, "report": done.report, **facts})
        return
    rows = []
    for name, value in facts["before"].items():
        if isinstance(value, int):  # counts, and yes or no
            texts = [format_fact(fact[name]) for fact in facts.values()]
            rows.append([name.replace("_", " "), *texts])
    print_table("Repaired", ["", *facts], rows)
