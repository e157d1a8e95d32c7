"""eigenshape index stats: how much an index holds."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import escape_text, out, print_json, print_table

KILOBYTE = 1000  # bytes


def stats(index: Path, *, as_json: bool = False) -> None:
    """Show how many shapes an index holds, how they are described, and the space they take."""
    shelf = es.ShapeIndex.open(index)
    records = shelf.records()
    labels = Counter(record.label for record in records)
    recipes = Counter(str(recipe.name) for record in records for recipe in record.recipes)
    n_bytes = sum(path.stat().st_size for path in index.rglob("*") if path.is_file())
    stage = steps.read_stage(index)
    if as_json:
        print_json(
            {
                "index": str(index),
                "stage": stage,
                "shapes": len(records),
                "bytes": n_bytes,
                "recipes": dict(recipes),
                "labels": {label or "": count for label, count in labels.items()},
            }
        )
        return
    each = n_bytes / max(len(records), 1) / KILOBYTE
    out.print(f"{len(records)} shapes, {n_bytes / KILOBYTE:,.0f} KB, {each:.1f} KB a shape")
    if stage is not None:
        out.print(f"{escape_text(stage)}; shapes are added after that")
    rows = [[name, str(count)] for name, count in recipes.most_common()]
    print_table("Descriptions", ["recipe", "shapes"], rows)
    rows = [[label or "(none)", str(count)] for label, count in labels.most_common()]
    print_table("Labels", ["label", "shapes"], rows)
