"""eigenshape info: what a mesh is, and what it would need."""

from typing import Any

from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, print_json
from eigenshape.cli.inputs import (
    CellsOption,
    DimOption,
    JsonOption,
    RepairOption,
    ShapeArgument,
)


def info(
    shape: ShapeArgument,
    *,
    repair: RepairOption = "",
    dim: DimOption = 2,
    cells: CellsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the size, topology and faults of a shape, and which repairs would help."""
    found = steps.load_shape(shape, repair, dim, cells)
    facts = steps.shape_facts(found)
    if as_json:
        print_json({"path": str(shape), **facts})
        return
    out.print(f"[bold]{escape_text(shape)}[/]")
    for name, value in facts.items():
        inward = name == "enclosed_volume" and value is not None and value < 0
        remark = " (faces point inward)" if inward else ""
        out.print(f"  {name.replace('_', ' '):<24}{_format(value)}{remark}")


def _format(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(_format(item) for item in value) or "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
