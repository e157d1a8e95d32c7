"""Ask every public function for a billion of whatever it counts, each in a process of its own.

Run as a script, it prints what went wrong as JSON. An answer is right, and so is an error that names the number; a
function that runs on, that fills the memory, or that ends in another error is not.
"""

import inspect
import json
import multiprocessing
import resource
import sys
import warnings
from collections.abc import Callable, Iterator
from queue import Empty
from typing import Any, SupportsIndex, get_type_hints

import numpy as np
from laws.natural_slips import (
    VALUES,
    fresh,
    kinds,
    public_callables,
    right_value,
    stand_in_for_the_studio,
)

import eigenshape as es

COUNT = 10**9
LONGEST = 20  # seconds, on a slow machine; right errors take milliseconds
MEMORY = 4 * 2**30  # bytes, above which NumPy gets no more
# The arguments that are whole numbers, but count nothing.
NO_COUNTS = {"dim", "seed", "pose", "individual", "part", "start", "end", "source", "fixed"}


def count_names(code: Callable[..., Any]) -> list[str]:
    """Return the arguments that are counts."""
    hints = get_type_hints(code)
    return [
        name
        for name in inspect.signature(code).parameters
        if {int, SupportsIndex} & set(kinds(hints.get(name))) and name not in NO_COUNTS
    ]


def arguments_of(
    function: str, code: Callable[..., Any], owner: type | None, counted: str
) -> dict[str, Any]:
    """Return right values of the arguments that must be given, and a billion for the count."""
    hints = get_type_hints(code)
    given: dict[str, Any] = {}
    for name, parameter in inspect.signature(code).parameters.items():
        if name == counted:
            given[name] = COUNT
        elif name == "self":
            given[name] = VALUES[owner]()
        elif parameter.default is parameter.empty and parameter.kind in (
            parameter.POSITIONAL_OR_KEYWORD,
            parameter.KEYWORD_ONLY,
        ):
            given[name] = fresh(right_value(function, name, hints.get(name)))
    return given


def call(code: Callable[..., Any], arguments: dict[str, Any], answers: Any) -> None:
    """Call a function with little memory, and put what is wrong with what it does."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        code(**arguments)
    except es.EigenshapeError as error:
        answers.put(None if str(COUNT) in str(error) else f"does not name the number: {error}")
    except BaseException as error:  # noqa: BLE001 - the law is that there is none
        answers.put(f"{type(error).__name__}: {error}")
    else:
        answers.put(None)


def complaints() -> Iterator[tuple[str, str]]:
    """Yield each function and count that does not end well."""
    here = multiprocessing.get_context("fork")
    for function, code, owner in public_callables():
        for name in count_names(code):
            where = f"{function}({name}={COUNT})"
            try:
                arguments = arguments_of(function, code, owner, name)
            except LookupError as error:
                yield where, f"cannot be called: {error}"
                continue
            answers = here.Queue()
            process = here.Process(target=call, args=(code, arguments, answers))
            process.start()
            try:
                found = answers.get(timeout=LONGEST)
            except Empty:
                found = f"no answer in {LONGEST} s"
                process.kill()
            process.join()
            if found:
                yield where, found


def main() -> None:
    warnings.simplefilter("ignore")
    stand_in_for_the_studio()
    np.set_printoptions(threshold=10)
    sys.stdout.write(json.dumps(list(complaints())))


if __name__ == "__main__":
    main()
