"""eigenshape index ls: what an index holds."""

from __future__ import annotations

import eigenshape as es
from eigenshape.cli import steps
from eigenshape.cli.console import print_json, print_table
from eigenshape.cli.inputs import FilterOption, IndexArgument, JsonOption


def ls(index: IndexArgument, *, where: FilterOption = None, as_json: JsonOption = False) -> None:
    """List the shapes of an index, with their labels, tags and attributes."""
    records = es.ShapeIndex.open(index).records(where=steps.parse_filters(where))
    if as_json:
        print_json([steps.record_facts(record) for record in records])
        return
    rows = []
    for record in records:
        attributes = ", ".join(f"{key}={value}" for key, value in record.attributes.items())
        rows.append([record.name, record.label or "", ", ".join(record.tags), attributes])
    title = steps.count_shapes(len(rows))
    print_table(title, ["shape", "label", "tags", "attributes"], rows)
