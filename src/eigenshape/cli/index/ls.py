"""eigenshape index ls: what an index holds."""

from __future__ import annotations

from pathlib import Path

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import count_shapes, print_json, print_table, result_facts


def ls(index: Path, *, where: list[str] | None = None, as_json: bool = False) -> None:
    """List the shapes of an index, with their labels, tags and attributes."""
    records = es.ShapeIndex.open(index).records(where=steps.parse_filters(where))
    if as_json:
        # A recipe holds a codebook, and its name says which it is.
        names = [[recipe.name for recipe in record.recipes] for record in records]
        facts = [result_facts(record, "recipes") for record in records]
        print_json([fact | {"recipes": each} for fact, each in zip(facts, names, strict=True)])
        return
    rows = []
    for record in records:
        attributes = ", ".join(f"{key}={value}" for key, value in record.attributes.items())
        rows.append([record.name, record.label or "", ", ".join(record.tags), attributes])
    title = count_shapes(len(rows))
    print_table(title, ["shape", "label", "tags", "attributes"], rows)
