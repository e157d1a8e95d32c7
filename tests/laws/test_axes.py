"""Axes on which guesses fail: units of length, orders of corners, ties, single rows, few samples, several components.

Every public function and method is called that `natural_slips` knows right values for. What leaves a law has its
reason beside its name.
"""

import inspect
import warnings
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any, get_type_hints

import numpy as np
import pytest
import scipy.sparse as sp
from laws import natural_slips
from laws.natural_slips import VALUES, fresh, given_as, public_callables, right_value

import eigenshape as es

Answer = list[tuple[str, np.ndarray]] | str
PICTURES_AND_FILES = ("draw", "figure_", "part_colors", "view", "write_", "read_", "open_", "save")
# What says nothing of these axes, or has tests of its own because it takes seconds.
LEFT_OUT = {
    "CarriedLandmarks.save": "bends a collection, which takes seconds; tests/collections",
    "Collection.number": "takes a name",
    "Collection.read_specimen": "takes a name",
    "DeformationSession.commit": "needs a drag",
    "DeformationSession.preview": "needs a drag",
    "DeformationSession.redo": "needs an edit",
    "DeformationSession.undo": "needs an edit",
    "ShapeIndex.add_many": "takes descriptions",
    "ShapeIndex.remove": "takes names",
    "build_collection": "bends a collection, which takes seconds; tests/collections",
    "find_items": "takes folders",
    "install": "changes another library",
    "local_triangles": "compiles for seconds; test_unit_laws",
    "make_creature": "takes a name",
    "self_intersections": "compiles for seconds; test_unit_laws",
    "set_threads": "changes the process",
    "to_pyvista": "is a value of another library",
    "uninstall": "changes another library",
}
NOISE = 1e-9  # of an answer; below it are the roundings that residuals and certificates measure


def numbers(value: Any, place: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Yield all arrays and numbers of an answer, with their places in it."""
    if sp.issparse(value):
        yield place, value.toarray()
    elif isinstance(value, np.ndarray | np.generic | float | int):
        array = np.asarray(value)
        if array.dtype.kind in "biufc":
            yield place, array
    elif is_dataclass(value):
        for field in fields(value):
            yield from numbers(getattr(value, field.name), f"{place}.{field.name}")
    elif isinstance(value, dict | list | tuple):
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for key, entry in pairs:
            yield from numbers(entry, f"{place}[{key}]")


def arguments(name: str, code: Callable[..., Any], owner: type | None) -> dict[str, Any]:
    """Return what a function must be given, and what a table names for it.

    Raises
    ------
    LookupError
        If no right value of an argument is known.
    """
    hints = get_type_hints(code)
    given = {}
    for key, parameter in inspect.signature(code).parameters.items():
        if key == "self":
            given[key] = VALUES[owner]()
        elif f"{name}.{key}" in natural_slips.NAMED or (
            parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD
        ):
            given[key] = right_value(name, key, hints.get(key))
    return given


def answer(code: Callable[..., Any], given: dict[str, Any]) -> Answer:
    """Return the numbers of an answer, or our error; any other error is one of the test."""
    given = {key: fresh(value) for key, value in given.items()}
    starred = [
        given.pop(key)
        for key, each in inspect.signature(code).parameters.items()
        if each.kind is each.VAR_POSITIONAL
    ]
    try:
        return list(numbers(code(*starred, **given)))
    except es.EigenshapeError as error:
        return f"{type(error).__name__}: {error}"


def calls(names: list[str]) -> Iterator[tuple[str, Callable[..., Any], dict[str, Any]]]:
    """Yield functions with right arguments of the body that is given."""
    for name, code, owner in public_callables():
        if name in names:
            try:
                yield name, code, arguments(name, code, owner)
            except LookupError:
                continue


def answers(names: list[str]) -> dict[str, Answer]:
    return {name: answer(code, given) for name, code, given in calls(names)}


NAMES = sorted(
    name
    for name, _, _ in public_callables()
    if name not in LEFT_OUT and not name.split(".")[-1].startswith(PICTURES_AND_FILES)
)


@pytest.fixture(scope="module", autouse=True)
def quietly():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.fixture(scope="module")
def names(in_turn):
    return in_turn(NAMES)


@pytest.fixture(scope="module")
def right(names):
    """Return the answers of all functions for the body itself."""
    return answers(names)


def complaints(
    one: dict[str, Answer], other: dict[str, Answer], compare: Callable[..., str | None]
) -> dict[str, str]:
    """Return for each function what differs between its answers, if anything does."""
    assert one.keys() == other.keys()
    found = {}
    for name, first in one.items():
        second = other[name]
        if isinstance(first, str) or isinstance(second, str):
            if isinstance(first, str) != isinstance(second, str):
                found[name] = f"{first}; {second}" if isinstance(first, str) else second
            continue
        if [place for place, _ in first] != [place for place, _ in second]:
            found[name] = "has other parts"
            continue
        for (place, a), (_, b) in zip(first, second, strict=True):
            wrong = compare(a, b)
            if wrong:
                found[name] = f"{place}: {wrong}"
                break
    return found


def test_most_public_functions_are_called():
    known = {name for name, _, _ in calls(NAMES)}
    assert len(known) > 200
    assert LEFT_OUT.keys() <= {name for name, _, _ in public_callables()}


# The unit of length
IN_LOGARITHMS = "logarithms of values with a unit are moved by it, not scaled"
OF_TWO_UNITS = "rows of four numbers, of which three have a unit"
NO_POWER = {
    "default_energies": IN_LOGARITHMS,
    "fit_allometry": IN_LOGARITHMS,
    "detailed_skeleton": OF_TWO_UNITS,
    "skeleton_response": OF_TWO_UNITS,
    "random_planes": OF_TWO_UNITS,
    "sphere_functional_eigenvalues": "the sphere has radius 1",
}
# Where the unit is no power of two, roundings decide what has no other reason to be one thing or the other.
BY_ROUNDING = {
    "closest_points": "a point on an edge is in either triangle",
    "decimate": "a point on an edge is in either triangle",
    "match_shapes": "a point on an edge is in either triangle",
    "detect_watermark": "the score where no watermark is",
    "prepare_heat_geodesics": "holds a shape in a power of two of its unit",
    "prepare_vector_heat": "holds a shape in a power of two of its unit",
}


def power_of(unit: float, a: np.ndarray, b: np.ndarray) -> str | None:
    """Return a complaint unless b is a times a half or whole power of the unit."""
    if a.shape != b.shape or a.dtype != b.dtype:
        return f"{a.dtype} {a.shape} became {b.dtype} {b.shape}"
    if a.dtype.kind in "biu":
        return None if np.array_equal(a, b) else "integers changed"
    finite = np.isfinite(a)
    if not np.array_equal(finite, np.isfinite(b)):
        return "is finite in one unit only"
    a, b = a[finite], b[finite]
    large, other = np.abs(a).max(initial=0), np.abs(b).max(initial=0)
    if large == 0 or other == 0:
        return None if large == other else "is zero in one unit only"
    if not np.log2(unit).is_integer() and max(large, other) < NOISE:
        return None
    power = round(2 * np.log(other / large) / np.log(unit)) / 2
    error = np.abs(b / unit**power - a).max() / large
    return None if error < 1e-6 else f"power {power}, of which it is off by {error:.0e}"


@pytest.mark.parametrize("unit", [2.0**40, 2.0**-40, 1e3])
def test_every_number_scales_by_a_power_of_the_unit(names, right, unit):
    with given_as(unit=unit):
        scaled = answers(names)
    found = complaints(right, scaled, lambda a, b: power_of(unit, a, b))
    reasons = NO_POWER | ({} if np.log2(unit).is_integer() else BY_ROUNDING)
    assert {name: wrong for name, wrong in found.items() if name not in reasons} == {}
