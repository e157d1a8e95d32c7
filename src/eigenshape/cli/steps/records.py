"""Shapes of an index on the command line: which of them a filter chooses, and what is printed."""

from collections.abc import Sequence
from typing import Any

from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.store.records import Record

RANGE = ".."  # between the least and the largest number of a filter


def parse_filters(texts: Sequence[str] | None) -> dict[str, Any] | None:
    """Return the conditions of filters such as "label=cat,dog" or "height=1.5..3"."""
    conditions: dict[str, Any] = {}
    for text in texts or ():
        key, sign, value = text.partition("=")
        if not sign or not key.strip() or not value.strip():
            raise InvalidParameterError(
                f"--filter takes a condition such as label=cat or height=1.5..3; it is {text!r}."
            )
        conditions[key.strip()] = _condition(text, value)
    return conditions or None


def _condition(text: str, value: str) -> Any:
    if RANGE not in value:
        return [_number_or_text(part.strip()) for part in value.split(",")]
    ends = [_number_or_text(part.strip()) if part.strip() else None for part in value.split(RANGE)]
    if len(ends) != 2 or any(isinstance(end, str) for end in ends):
        raise InvalidParameterError(
            f"A range of --filter has a least and a largest number, such as 1.5..3 or 1.5..; it is "
            f"{text!r}."
        )
    return tuple(ends)


def _number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def record_facts(record: Record) -> dict[str, Any]:
    """Return what is known of a shape, for JSON."""
    return {
        "name": record.name,
        "class": record.label,
        "source": record.source,
        "digest": record.digest,
        "tags": record.tags,
        "attributes": dict(record.attributes),
        "recipes": [recipe.name for recipe in record.recipes],
    }


def count_shapes(number: int) -> str:
    """Return a number of shapes in words."""
    return f"{number} shape" if number == 1 else f"{number} shapes"
