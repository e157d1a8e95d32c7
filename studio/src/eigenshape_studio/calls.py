"""What a call of the page brings: whole numbers, files, arrays."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Meta = dict[str, Any]
Arrays = Mapping[str, np.ndarray]
Reply = tuple[Any, dict[str, np.ndarray]]
# What changes something, by the kind of the call; it may return vertices to show.
Works = Mapping[str, Callable[[Meta, Arrays], np.ndarray | None]]
# What returns an array, by the first part of its name, of the rest of the name.
Families = Mapping[str, Callable[[str], np.ndarray]]


class RequestError(ValueError):
    """A call asks for what cannot be; the text says what."""


def whole(meta: Meta, name: str, low: int, high: int, default: int | None = None) -> int:
    """Return a whole number of a call; `default` is its value if it is missing.

    Raises
    ------
    RequestError
        If it is not in low..high.
    """
    value = meta.get(name)
    value = default if value is None else value
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise RequestError(f"{name} must be a whole number in {low}..{high}; it is {value!r:.80}.")
    return value


def file_bytes(arrays: Arrays, name: str) -> bytes:
    """Return the bytes of a file that a call brings.

    Raises
    ------
    RequestError
        If it brings none.
    """
    if name not in arrays or arrays[name].dtype != np.uint8 or arrays[name].ndim != 1:
        raise RequestError(f"The call must have an array {name!r} with the bytes of a file.")
    return arrays[name].tobytes()
