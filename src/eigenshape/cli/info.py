"""eigenshape info: what a mesh is, and what it would need."""

from pathlib import Path
from typing import Any

from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, print_json
from eigenshape.io.formats.registry import CellKind


def info(
    shape: Path,
    *,
    repair: str = "none",
    dim: int = 2,
    cells: CellKind | None = None,
    as_json: bool = False,
) -> None:
    """Show the size, topology and faults of a shape, and which repairs would help."""
    found = steps.load_shape(shape, repair, dim, cells)
    facts = steps.shape_facts(found)
    if as_json:
        print_json({"path": shape, **facts})
        return
    out.print(f"[bold]{escape_text(shape)}[/]")
    for name, value in facts.items():
        inward = name == "enclosed_volume" and value is not None and value < 0
        remark = " (faces point inward)" if inward else ""
        out.print(f"  {name.replace('_', ' '):<24}{format_fact(value)}{remark}")


def format_fact(value: Any) -> str:
    """Return a fact of a shape as people read it."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(format_fact(item) for item in value) or "none"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
