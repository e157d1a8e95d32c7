"""Shapes of an index on the command line: which of them a filter chooses, and what is printed."""

from typing import Any

from eigenshape.retrieval.store.batch import read_stage
from eigenshape.retrieval.store.filters import parse_filters, require_attributes
from eigenshape.retrieval.store.records import Record

__all__ = ["count_shapes", "parse_filters", "read_stage", "record_facts", "require_attributes"]


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
