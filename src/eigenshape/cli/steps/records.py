"""Shapes of an index on the command line: which of them a filter chooses, and what is printed."""

from typing import Any

from eigenshape.retrieval.building.batch import read_stage
from eigenshape.retrieval.store.conversion import convert_index
from eigenshape.retrieval.store.filters import choose_shapes, parse_filters
from eigenshape.retrieval.store.records import Record

__all__ = [
    "choose_shapes",
    "convert_index",
    "count_shapes",
    "parse_filters",
    "read_stage",
    "record_facts",
]


def record_facts(record: Record) -> dict[str, Any]:
    """Return what is known of a shape, for JSON."""
    return {
        "name": record.name,
        "label": record.label,
        "source": record.source,
        "digest": record.digest,
        "tags": record.tags,
        "attributes": dict(record.attributes),
        "recipes": [recipe.name for recipe in record.recipes],
    }


def count_shapes(number: int) -> str:
    """Return a number of shapes in words."""
    return f"{number} shape" if number == 1 else f"{number} shapes"
