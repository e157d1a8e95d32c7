"""eigenshape info: what a mesh is, and what it would need."""

from typing import Any

from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json, shown
from eigenshape.cli.inputs import (
    CellsOption,
    DimOption,
    DropMissingOption,
    JsonOption,
    RepairOption,
    ShapeArgument,
)


def info(
    shape: ShapeArgument,
    *,
    repair: RepairOption = "",
    dim: DimOption = 2,
    drop_missing: DropMissingOption = False,
    cells: CellsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show the size, topology and faults of a shape, and which repairs would help."""
    found = steps.load_shape(shape, repair, dim, drop_missing=drop_missing, cells=cells)
    facts = steps.shape_facts(found)
    if as_json:
        print_json({"path": str(shape), **facts})
        return
    out.print(f"[bold]{shown(shape)}[/]")
    for name, value in facts.items():
        out.print(f"  {name.replace('_', ' '):<24}{_shown(value)}")


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(_shown(item) for item in value) or "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
