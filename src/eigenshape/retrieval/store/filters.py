"""Which shapes of an index a filter chooses."""

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool

from eigenshape._arguments import require_each, require_type
from eigenshape._errors import InvalidParameterError
from eigenshape.retrieval.store.snapshot import Shapes

RESERVED = ("label", "tag")  # keys of a filter that are no attributes; their values are texts
RANGE = ".."  # between the least and the largest number of a filter as text
NOT = "!="  # after a key: shapes that do not meet the condition


def parse_filters(texts: Sequence[str] | None) -> dict[str, Any] | None:
    """Return the conditions of filters such as "label=cat,dog", "height=1.5..3" or "kind!=cat".

    Returns
    -------
    dict or None
        As of `ShapeIndex.query`; None if there are none.

    Raises
    ------
    InvalidParameterError
        If a text is no condition, or two are about the same key.
    """
    conditions: dict[str, Any] = {}
    for text in texts or ():
        key, sign, value = (part.strip() for part in text.partition("="))
        if key.endswith("!"):
            key = key.removesuffix("!").strip() + NOT
        if not sign or key in ("", NOT) or not value:
            raise InvalidParameterError(
                f"A filter is a condition such as label=cat, label!=cat or height=1.5..3; it is {text!r}."
            )
        if key in conditions:
            raise InvalidParameterError(
                f"A filter has one condition for each key; {key!r} has two. Either of two values "
                f"is {key.removesuffix(NOT)}=one,other."
            )
        conditions[key] = _parse_condition(text, key, value)
    return conditions or None


def _parse_condition(text: str, key: str, value: str) -> Any:
    if key.removesuffix(NOT) in RESERVED:  # also "7" and "1..2", which are good names of folders
        return _split(value)
    if RANGE not in value:
        return [_number_or_text(part) for part in _split(value)]
    ends = [_number_or_text(part.strip()) if part.strip() else None for part in value.split(RANGE)]
    if len(ends) != 2 or any(isinstance(end, str) for end in ends):
        raise InvalidParameterError(
            "A range of a filter has a least and a largest number, such as height=1.5..3 or "
            f"height=1.5..; it is {text!r}."
        )
    return tuple(ends)


def _split(value: str) -> list[str]:
    """Return the values between commas; one in double quotes may have commas itself."""
    return [part.strip() for part in next(csv.reader([value], skipinitialspace=True))]


def _number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def choose_shapes(shapes: Shapes, where: Mapping[str, Any] | None) -> Bool[np.ndarray, " n"]:
    """Return which shapes agree with all conditions of a filter.

    Parameters
    ----------
    shapes : Shapes
    where : mapping, optional
        As of `ShapeIndex.query`; without it all are chosen.

    Raises
    ------
    InvalidParameterError
        If a condition is none.
    """
    chosen = np.ones(len(shapes.ids), dtype=bool)
    if where is None:
        return chosen
    require_type(where, Mapping, "where")
    require_each(list(where), str, "where")
    # The key without its sign, whether the condition must be met, and its test
    tests = [
        (key.removesuffix(NOT), not key.endswith(NOT), _condition(key.removesuffix(NOT), value))
        for key, value in where.items()
    ]
    for key, wanted, test in tests:
        if key == "label" and shapes.labels:  # by the codes alone: no text is read
            known = np.array([test(each) == wanted for each in shapes.labels], dtype=bool)
            chosen &= known[shapes.label_codes]
    tests = [each for each in tests if each[0] != "label"]
    for place in np.flatnonzero(chosen).tolist() if tests else []:
        row = shapes.row(place)
        attributes = json.loads(row.attributes)
        for key, wanted, test in tests:
            if key == "tag":
                agrees = any(test(tag) for tag in json.loads(row.tags))
            else:
                agrees = key in attributes and test(attributes[key])
            if agrees != wanted:
                chosen[place] = False
                break
    return chosen


def require_attributes(shapes: Shapes, where: Mapping[str, Any] | None) -> None:
    """Raise an error if a condition is about an attribute of no shape, which is often misspelled."""
    if where is None:
        return
    keys = {key.removesuffix(NOT) for key in where} - set(RESERVED)
    known: set[str] = set()
    for place in range(len(shapes.ids)):
        if keys <= known:  # usually after the first shape
            return
        known |= json.loads(shapes.row(place).attributes).keys()
    missing = sorted(keys - known)
    if missing and len(shapes.ids):
        raise InvalidParameterError(
            f"A filter must be about label, tag or an attribute that a shape has; no shape has "
            f"{missing[0]!r}. The attributes are: {', '.join(sorted(known)) or 'none'}."
        )


def _condition(key: str, value: Any) -> Callable[[Any], bool]:
    """Return the test of one condition: a value, a list of values, or a range of numbers."""
    if isinstance(value, tuple) and len(value) == 2 and all(map(_is_bound, value)):
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
