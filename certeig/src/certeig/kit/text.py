"""Text for people: names from outside made safe to print, and values in one line."""

from dataclasses import fields, is_dataclass
from html import escape
from typing import Any

LONGEST = 60  # characters of an entry that stands in full in the text of a value


def printable(text: str) -> str:
    r"""Return text with characters that are not printable as escapes, such as ``\x1b``.

    Control characters change the state of terminals and are not allowed in SVG, and those that
    reverse the direction of writing disguise names. Letters of any script do not change.

    Examples
    --------
    >>> print(printable("a\x1b[31mb\nc"))
    a\x1b[31mb\nc
    """
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def literal(text: str) -> str:
    r"""Return text that a figure shows letter by letter, such as a file's name: no ``$`` begins a formula.

    Examples
    --------
    >>> print(literal("a$b$.ply"))
    a\$b\$.ply
    """
    return printable(text).replace("$", r"\$")


def short_repr(value: Any) -> str:
    """Return a dataclass in one line, where long arrays are given by their type and shape.

    A spectrum of 50,000 vertices would fill a screen with numbers otherwise. Values take it as their
    `__repr__`, from the base class `Shown`.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import numpy as np
    >>> @dataclass(repr=False)
    ... class Walk:
    ...     steps: np.ndarray
    ...     names: tuple
    ...     __repr__ = short_repr
    >>> Walk(np.zeros((900, 3)), ("left", "right"))
    Walk(steps=<float64 (900, 3)>, names=('left', 'right'))
    """
    entries = [f"{field.name}={_shorten(getattr(value, field.name))}" for field in fields(value)]
    return f"{type(value).__name__}({', '.join(entries)})"


def html_repr(value: Any) -> str:
    """Return a value as a small table, which notebooks show: one row for each field.

    All public values take it as their `_repr_html_`. A value without fields stands as its `repr`. If
    a class has a method `_portrait`, its HTML follows: a picture, a plot or a list.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass
    ... class Step:
    ...     side: str
    ...     _repr_html_ = html_repr
    >>> print(Step("<left>")._repr_html_())
    <table>
    <caption>Step</caption>
    <tr><th>side</th><td><code>&#x27;&lt;left&gt;&#x27;</code></td></tr>
    </table>
    """
    portrait = value._portrait() if hasattr(value, "_portrait") else ""
    if not is_dataclass(value):
        return f"<code>{escape(repr(value))}</code>{portrait}"
    rows = []
    for field in fields(value):
        text = escape(_shorten(getattr(value, field.name)))
        rows.append(f"<tr><th>{field.name}</th><td><code>{text}</code></td></tr>")
    title = f"<caption>{type(value).__name__}</caption>"
    return "\n".join(["<table>", title, *rows, f"</table>{portrait}"])


def repr_of_changes(value: Any) -> str:
    """Return a dataclass in one line: its first field, and the fields that differ from their defaults.

    The signature of a function that takes a recipe stays readable so.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(repr=False)
    ... class Plan:
    ...     name: str
    ...     steps: int = 5
    ...     limit: float = 0.1
    ...     __repr__ = repr_of_changes
    >>> Plan("usual"), Plan("long", steps=50)
    (Plan(name='usual'), Plan(name='long', steps=50))
    """
    first, *others = fields(value)
    changed = [field for field in others if getattr(value, field.name) != field.default]
    entries = [f"{field.name}={getattr(value, field.name)!r}" for field in (first, *changed)]
    return f"{type(value).__name__}({', '.join(entries)})"


def _shorten(entry: Any) -> str:
    """Return a field as text of at most `LONGEST` characters, or its type and size."""
    text = repr(entry)
    in_full = len(text) <= LONGEST and "\n" not in text and "..." not in text
    if in_full:
        return text
    # NumPy arrays and sparse matrices have both
    if hasattr(entry, "dtype") and hasattr(entry, "shape"):
        return f"<{entry.dtype} {entry.shape}>"
    count = f"{len(entry)} entries" if isinstance(entry, list | tuple | dict) else "..."
    return f"{type(entry).__name__}({count})"


class Shown:
    """Base class of values: they print in one line, and notebooks show a table.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> import numpy as np
    >>> @dataclass
    ... class Walk(Shown):
    ...     steps: np.ndarray
    >>> Walk(np.zeros((900, 3)))
    Walk(steps=<float64 (900, 3)>)
    """

    _repr_html_ = html_repr

    def __init_subclass__(cls, **settings: Any) -> None:
        super().__init_subclass__(**settings)
        # `dataclass` would write a text with all numbers of arrays.
        if "__repr__" not in vars(cls):
            cls.__repr__ = short_repr  # type: ignore[method-assign]
