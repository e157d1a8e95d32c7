"""How the tests check types at run time: as mypy does, an int serves where a float is asked for (PEP 484).

jaxtyping's own decorator binds the arguments by name, checks them, calls the function, then checks the arguments
again beside the result. On short functions that takes ten times as long as the call. Here beartype checks both in one
wrapper, within a context of jaxtyping, so that an axis has one length in all of a signature.

A check still takes as long as ten lines of NumPy. A loop that calls a function ten thousand times would spend nine
tenths of its time in checks of the same types, so each test checks the first calls of each function and no more.
"""

import dataclasses
import functools
import inspect
from collections import Counter
from typing import Any

import jaxtyping
from beartype import BeartypeConf, beartype

_jaxtyped: Any = jaxtyping.jaxtyped
# Without state: each `with` opens a context of its own, in its own thread.
_AXES = _jaxtyped("context")
_with_types = beartype(conf=BeartypeConf(is_pep484_tower=True))


class Limit:
    """How many calls of each function are checked in a test, and the number and file of the test."""

    calls = 10
    test = 0
    file = ""


_inner: set[object] = set()
# How many tests of each file call a function: `tests/house/mutants.py` asks which.
callers: dict[str, Counter[str]] = {}


def install() -> None:
    """Check the types of all functions and dataclasses of the package, which must not be loaded yet."""
    jaxtyping.install_import_hook(["certeig", "eigenshape"], "runtime_types.checked")
    jaxtyping.jaxtyped = lambda typechecker: checked  # type: ignore[assignment]


def checked(thing: Any) -> Any:
    """Check arguments and result of a function or descriptor, or the arguments of a dataclass."""
    if inspect.isclass(thing):
        if dataclasses.is_dataclass(thing) and "__init__" in vars(thing):
            thing.__init__ = checked(thing.__init__)  # type: ignore[misc]
        return thing
    if isinstance(thing, classmethod | staticmethod):
        return type(thing)(checked(thing.__func__))
    if isinstance(thing, property):
        return property(*(part and checked(part) for part in (thing.fget, thing.fset, thing.fdel)))
    if inspect.isgeneratorfunction(thing):
        # It runs after the call, and beartype would check its arguments then, in the axes of another function.
        return _jaxtyped(thing, typechecker=_with_types)
    # A function inside another is made anew in each call. One of them is checked, as that takes 2 ms.
    inner = thing.__code__ if "<locals>" in thing.__qualname__ else None
    if inner in _inner or not getattr(thing, "__annotations__", None):
        return thing
    if inner:
        _inner.add(inner)

    name = f"{thing.__module__}:{thing.__qualname__}"
    typed = None  # many functions are loaded and never called
    test, left = 0, Limit.calls

    @functools.wraps(thing)
    def call(*args: Any, **kwargs: Any) -> Any:
        nonlocal typed, test, left
        if test != Limit.test:
            test, left = Limit.test, Limit.calls
            callers.setdefault(name, Counter())[Limit.file] += 1
        if left <= 0:
            return thing(*args, **kwargs)
        left -= 1
        typed = typed or _with_types(thing)
        with _AXES:
            return typed(*args, **kwargs)

    return call
