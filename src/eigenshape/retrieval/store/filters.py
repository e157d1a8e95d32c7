"""Which shapes of an index a filter chooses."""

import csv
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Int

from certeig.kit.arguments import require_each, require_type
from certeig.kit.errors import InvalidParameterError
from eigenshape.retrieval.store.facts import RESERVED
from eigenshape.retrieval.store.state import IndexState

RANGE = ".."  # between the least and the largest number of a filter as text
NOT = "!="  # after a key: shapes that do not meet the condition


def parse_filters(texts: Sequence[str] | None) -> dict[str, Any] | None:
    """Return the conditions of filters such as "label=cat,dog", "height=1.5..3" or "kind!=cat".

    Raise InvalidParameterError if a text is no condition, or two are about the same key.

    Returns
    -------
    dict or None
        As of `ShapeIndex.query`; None if there are none.
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


def choose_shapes(
    state: IndexState, where: Mapping[str, Any] | None, *, must_know: bool = True
) -> Int[np.ndarray, " k"] | None:
    """Return the numbers of the shapes that agree with all conditions of a filter.

    Raise InvalidParameterError if a condition is none, or about an attribute that no shape has.

    Parameters
    ----------
    state : IndexState
    where : mapping, optional
        As of `ShapeIndex.query`; without it all are chosen, and None is returned.
    must_know : bool
        Whether an attribute that no shape has is an error: it is often misspelled.
    """
    if where is None:
        return None
    require_type(where, Mapping, "where")
    require_each(list(where), str, "where")
    # The key without its sign, whether the condition must be met, and its test
    tests = [
        (key.removesuffix(NOT), not key.endswith(NOT), _condition(key.removesuffix(NOT), value))
        for key, value in where.items()
    ]
    keys = {key for key, _, _ in tests}
    chosen = state.shape_ids
    if "label" in keys:  # by the labels without duplicates: no row is read
        labels, codes = state.labels
        ids = chosen
        chosen = ids[codes >= 0]
        for _, wanted, test in (each for each in tests if each[0] == "label"):
            agrees = np.array([test(label) == wanted for label in labels], dtype=bool)
            chosen = np.intersect1d(chosen, ids[agrees[codes]] if labels else chosen)
    tests = [each for each in tests if each[0] != "label"]
    if not tests:
        return chosen
    found, known = [], set(RESERVED)
    for facts in state.every():
        tags, attributes = facts.tags_and_attributes()
        known |= attributes.keys()
        for key, wanted, test in tests:
            values = tags if key == "tag" else [attributes[key]] if key in attributes else []
            if any(map(test, values)) != wanted:
                break
        else:
            found.append(facts.id)
    missing = sorted(keys - known)
    if missing and must_know and len(state.shape_ids):
        raise InvalidParameterError(
            f"A filter must be about label, tag or an attribute that a shape has; no shape has "
            f"{missing[0]!r}. The attributes are: {', '.join(sorted(known - set(RESERVED))) or 'none'}."
        )
    return np.intersect1d(chosen, np.array(found, dtype=np.int64))


def _condition(key: str, value: Any) -> Callable[[Any], bool]:
    """Return the test of one condition: a value, a list of values, or a range of numbers."""
    if isinstance(value, tuple) and len(value) == 2:
        low = -np.inf if value[0] is None else value[0]
        high = np.inf if value[1] is None else value[1]
        if _is_number(low) and _is_number(high):
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
