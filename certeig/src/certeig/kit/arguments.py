"""Type checks of arguments, with errors that say what to pass instead."""

import os
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from types import UnionType
from typing import Any, get_args

from certeig.kit.errors import InvalidParameterError
from certeig.kit.makers import CONVERSIONS, MAKERS, READERS


def require_type(value: object, kind: type | UnionType, name: str) -> None:
    """Raise an error if an argument is not an instance of `kind`.

    The message names the type of the value and says what to pass instead.
    """
    if not isinstance(value, kind):
        raise InvalidParameterError(
            f"{name} must be {describe_kind(kind)}; the value is {describe_value(value)}. "
            f"{suggest_argument(value, kind)}"
        )


def require_unicode(value: object, what: str) -> None:
    """Raise an error if a name or another text is none, or could not be stored."""
    if not isinstance(value, str) or value != value.encode(errors="replace").decode():
        raise InvalidParameterError(f"{what} must be Unicode text; {value!r} is not.")


def require_choice(value: object, choice: Any, name: str) -> None:
    """Raise an error if an option is none of the names that a Literal lists."""
    *names, last = get_args(choice)
    if value not in (*names, last):
        listed = "', '".join(names)
        raise InvalidParameterError(f"{name} must be '{listed}' or '{last}'; it is {value!r}.")


def require_each(values: object, kind: type | UnionType, name: str) -> None:
    """Raise an error if an argument is not a list of instances of `kind`."""
    if (
        isinstance(values, kind)
        or not isinstance(values, Iterable)
        or isinstance(values, str | bytes)
    ):
        remedy = f"Pass [{name}]." if isinstance(values, kind) else suggest_argument(values, kind)
        raise InvalidParameterError(
            f"{name} must be a list, each entry {describe_kind(kind)}; "
            f"it is {describe_value(values)}. {remedy}"
        )
    for index, value in enumerate(values):
        require_type(value, kind, f"{name}[{index}]")


def describe_kind(kind: type | UnionType) -> str:
    """Return the name of a type with its article; several types are joined by "or"."""
    names = [
        "None" if each is type(None) else f"{_article(each.__name__)} {each.__name__}"
        for each in _kinds(kind)
    ]
    return " or ".join(names)


def describe_value(value: object) -> str:
    """Return the type of a value with its article, and a text or number itself."""
    if value is None:
        return "None"
    name = type(value).__name__
    text = os.fspath(value) if isinstance(value, os.PathLike) else value
    shown = f" ({text!r})" if isinstance(text, str | int | float) else ""
    return f"{_article(name)} {name}{shown}"


def suggest_argument(value: object, kind: type | UnionType) -> str:
    """Say what to pass instead of a value.

    This is one of its attributes, the call that reads a file, or the call that makes such a value.
    """
    part = attribute_of(value, kind)
    if part:
        return f"Pass its attribute {part}."
    wanted = [each.__name__ for each in _kinds(kind) if each is not type(None)]
    if isinstance(value, str | os.PathLike):
        readers = [
            READERS[name].format(path=repr(os.fspath(value))) for name in wanted if name in READERS
        ]
        if readers:
            return f"Pass {readers[0]}."
    given = "sparse" if hasattr(value, "tocsr") else type(value).__name__
    calls = [CONVERSIONS.get((given, name)) or MAKERS.get(name) for name in wanted]
    return f"Pass {' or '.join(call for call in calls if call)}." if any(calls) else ""


def attribute_of(value: object, kind: type | UnionType) -> str | None:
    """Return the name of the first attribute that is an instance of `kind`, if there is one.

    For example, `mesh` is such an attribute of a RepairedMesh.
    """
    parts = fields(value) if is_dataclass(value) else ()
    return next(
        (part.name for part in parts if isinstance(getattr(value, part.name, None), kind)), None
    )


def _kinds(kind: type | UnionType) -> tuple[type, ...]:
    """Return the members of a union, or the type itself."""
    return get_args(kind) or (kind,)


def _article(name: str) -> str:
    return "an" if name.lower().startswith(("a", "e", "i", "o", "un", "nd")) else "a"
