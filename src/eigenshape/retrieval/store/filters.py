"""Which shapes of an index a filter chooses."""

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool

from eigenshape._arguments import require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.store.snapshot import Shapes

RESERVED = ("label", "tag")  # keys of a filter that are no attributes
RANGE = 2  # numbers of a range, the least and the largest


def choose_shapes(shapes: Shapes, where: Mapping[str, Any]) -> Bool[np.ndarray, " n"]:
    """Return which shapes agree with all conditions of a filter.

    Parameters
    ----------
    shapes : Shapes
    where : mapping
        As of `ShapeIndex.query`.

    Raises
    ------
    InvalidParameterError
        If a condition is none.
    """
    require_type(where, Mapping, "where")
    tests = {key: _condition(key, value) for key, value in where.items()}
    chosen = np.ones(len(shapes.ids), dtype=bool)
    label = tests.pop("label", None)
    if label is not None:  # by the codes alone: no text is read
        known = [label(each) for each in shapes.labels]
        chosen = np.array(known, dtype=bool)[shapes.label_codes] if known else chosen
    for place in np.flatnonzero(chosen).tolist() if tests else []:
        row = shapes.row(place)
        attributes = json.loads(row.attributes)
        for key, test in tests.items():
            if key == "tag":
                agrees = any(test(tag) for tag in json.loads(row.tags))
            else:
                agrees = key in attributes and test(attributes[key])
            if not agrees:
                chosen[place] = False
                break
    return chosen


def _condition(key: str, value: Any) -> Callable[[Any], bool]:
    """Return the test of one condition: a value, a list of values, or a range of numbers."""
    if isinstance(value, tuple) and len(value) == RANGE and all(map(_is_bound, value)):
        low, high = (
            (-np.inf if value[0] is None else value[0]),
            (np.inf if value[1] is None else value[1]),
        )
        return lambda found: _is_number(found) and low <= found <= high
    several = isinstance(value, Sequence) and not isinstance(value, str)
    allowed = list(value) if several else [value]
    for each in allowed:
        if not (isinstance(each, str) or _is_number(each) or (key == "label" and each is None)):
            raise InvalidParameterError(
                f"A filter gives for each key a text, a number, a list of them, or a range (low, "
                f"high); for {key!r} it gives {value!r}. Try where={{'label': 'cat', 'height': "
                "(1.5, None)}."
            )
    return lambda found: found in allowed


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_bound(value: Any) -> bool:
    return value is None or _is_number(value)
