"""Ask every public function for a billion of whatever it counts, each in a process of its own.

Run as a script with names of `counts`, or without for all, it prints what went wrong as JSON. An answer is right, and
so is an error that names the number; a function that runs on, that fills the memory, or that ends in another error is
not.
"""

import inspect
import json
import multiprocessing
import resource
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from queue import Empty
from typing import Any, SupportsIndex, get_type_hints

import numpy as np
from laws.natural_slips import (
    VALUES,
    bent,
    body,
    fresh,
    kinds,
    public_callables,
    recipe,
    right_value,
    stand_in_for_the_studio,
)

import eigenshape as es

COUNT = 10**9
LONGEST = 20  # seconds, on a slow machine; right errors take milliseconds
MEMORY = 4 * 2**30  # bytes, above which NumPy gets no more
# The arguments that are whole numbers, but count nothing.
NO_COUNTS = {"dim", "seed", "pose", "individual", "part", "start", "end", "source", "fixed"}

# What a database does with a count is not ours.
ENGINES = {es.retrieval.FaissEngine, es.retrieval.QdrantEngine}


def compare_by(**options: Any) -> Callable[[], Any]:
    plan = {"k": 5, "n_samples": 100, "times": (0.1,)} | options
    return lambda: es.compare_shapes(body(), bent(), es.stability.StabilityPlan(**plan))


def scan_by(**options: Any) -> Callable[[], Any]:
    rng = np.random.default_rng(0)
    return lambda: es.scans.simulate_scan(body(), rng, camera=es.scans.DepthCamera(**options))


def describe_by(**options: Any) -> Callable[[], Any]:
    return lambda: es.describe(body(), replace(es.retrieval.SCALE_FREE, name="ours", **options))


# Counts that a value carries to a function.
CARRIED: dict[str, Callable[[], Any]] = {
    "StabilityPlan(k)": compare_by(k=COUNT),
    "StabilityPlan(n_samples)": compare_by(n_samples=COUNT),
    "DepthCamera(resolution)": scan_by(resolution=COUNT),
    "DepthCamera(n_holes)": scan_by(n_holes=COUNT),
    "HeatRecipe(n_features)": describe_by(n_features=COUNT),
    "HeatRecipe(n_modes)": describe_by(n_modes=COUNT),
    "HeatRecipe(n_shifts)": describe_by(n_shifts=COUNT),
    "PatchRecipe(n_frames)": lambda: es.describe(body(), replace(recipe(), n_frames=COUNT)),
    "Camera(size)": lambda: es.plot.draw(body(), es.plot.Camera(np.eye(3), COUNT)),
    "Workers(count)": lambda: es.retrieval.Workers(COUNT),
    "SpectralClusterer": lambda: es.spectral.SpectralClusterer(COUNT).fit(body().vertices),
    "SpectralEmbedder": lambda: es.spectral.SpectralEmbedder(COUNT).fit(body().vertices),
}


def count_names(code: Callable[..., Any]) -> list[str]:
    """Return the arguments that are counts."""
    hints = get_type_hints(code)
    found = []
    for name in inspect.signature(code).parameters:
        types = set(kinds(hints.get(name)))
        # NumPy 1 lists all numbers, complex ones too, as what an array can be made of.
        if {int, SupportsIndex} & types and complex not in types and name not in NO_COUNTS:
            found.append(name)
    return found


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


def callables() -> dict[str, tuple[Callable[..., Any], type | None]]:
    """Return the public functions and methods that are asked, each with its class."""
    return {name: (code, owner) for name, code, owner in public_callables() if owner not in ENGINES}


def counts() -> list[str]:
    """Return the name of everything that is counted, as `grid(n)`."""
    return [
        *CARRIED,
        *(
            f"{name}({count})"
            for name, (code, _) in callables().items()
            for count in count_names(code)
        ),
    ]


def call_of(where: str) -> Callable[[], Any]:
    """Return the call with a billion of what is counted."""
    if where in CARRIED:
        return CARRIED[where]
    function, counted = where.removesuffix(")").split("(")
    code, owner = callables()[function]
    return partial(code, **arguments_of(function, code, owner, counted))


def run(call: Callable[[], Any], answers: Any) -> None:
    """Call with little memory, and put what is wrong with what happens."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        call()
    except es.EigenshapeError as error:
        answers.put(None if str(COUNT) in str(error) else f"does not name the number: {error}")
    except BaseException as error:  # noqa: BLE001 - the law is that there is none
        answers.put(f"{type(error).__name__}: {error}")
    else:
        answers.put(None)


def outcome(call: Callable[[], Any]) -> str | None:
    """Return what is wrong with what a call does in a process of its own; None if nothing is."""
    here = multiprocessing.get_context("fork")
    answers = here.Queue()
    process = here.Process(target=run, args=(call, answers))
    process.start()
    try:
        found: str | None = answers.get(timeout=LONGEST)
    except Empty:
        found = f"no answer in {LONGEST} s"
    process.kill()  # what has answered may still wait for threads that it started
    process.join()
    return found


def main() -> None:
    warnings.simplefilter("ignore")
    stand_in_for_the_studio()
    np.set_printoptions(threshold=10)
    chosen = sys.argv[1:] or counts()
    complaints = [(where, what) for where in chosen if (what := outcome(call_of(where)))]
    sys.stdout.write(json.dumps({"complaints": complaints}))


if __name__ == "__main__":
    main()
