"""Axes on which guesses fail: units of length, orders of corners, ties, single rows, few samples, several components.

Every public function and method is called that `natural_slips` knows right values for. What leaves a law has its
reason beside its name.
"""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import Any, get_type_hints

import numpy as np
import pytest
import scipy.sparse as sp
from beartype.roar import BeartypeCallHintViolation
from laws import natural_slips
from laws.natural_slips import VALUES, fresh, given_as, kinds, public_callables, right_value

import eigenshape as es

pytestmark = pytest.mark.filterwarnings("ignore")
Answer = list[tuple[str, np.ndarray]] | str
PICTURES_AND_FILES = ("draw", "figure_", "part_colors", "view", "write_", "read_", "open_", "save")
# What says nothing of these axes, or has tests of its own because it takes seconds.
LEFT_OUT = {
    "BrainPrint.distances": "takes another of its kind",
    "Registration.after": "takes another of its kind",
    "CarriedLandmarks.save": "bends a collection, which takes seconds; tests/collections",
    "Collection.number": "takes a name",
    "Collection.read_placed": "takes a name",
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
    "local_triangles": "takes seconds; test_unit_laws",
    "make_creature": "takes a name",
    "self_intersections": "takes seconds; test_unit_laws",
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
            if owner not in VALUES:
                raise LookupError(owner)
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
    except (es.EigenshapeError, BeartypeCallHintViolation) as error:
        # Types are refused by the tests before the library refuses them: natural_slips asks it.
        return f"{type(error).__name__}: {error}"


def calls(names: list[str]) -> Iterator[tuple[str, Callable[..., Any], dict[str, Any] | str]]:
    """Yield functions with right arguments of the body that is given, or our error if it has none."""
    for name, code, owner in public_callables():
        if name not in names:
            continue
        try:
            yield name, code, arguments(name, code, owner)
        except es.EigenshapeError as error:
            yield name, code, str(error)
        except LookupError as error:
            if type(error) is not LookupError:
                raise


def answers(names: list[str]) -> dict[str, Answer]:
    return {
        name: given if isinstance(given, str) else answer(code, given)
        for name, code, given in calls(names)
    }


NAMES = sorted(
    name
    for name, _, _ in public_callables()
    if name not in LEFT_OUT and not name.split(".")[-1].startswith(PICTURES_AND_FILES)
)


@pytest.fixture(scope="module")
def names(in_turn):
    return in_turn(NAMES)


@pytest.fixture(scope="module")
def right(names):
    """Return the answers of all functions for the body itself."""
    found = answers(names)
    assert len(found) > len(names) / 2
    return found


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


def unexplained(found: dict[str, str], reasons: dict[str, str]) -> dict[str, str]:
    return {name: wrong for name, wrong in found.items() if name not in reasons}


def test_names_that_are_left_out_are_public():
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
AXES = "the signs of principal axes, and those along which nothing varies"
# Where the unit is no power of two, roundings decide what has no other reason to be one thing or the other.
BY_ROUNDING = {
    "closest_points": "a point on an edge is in either triangle",
    "decimate": "a point on an edge is in either triangle",
    "match_shapes": "a point on an edge is in either triangle",
    "detect_watermark": "the score where no watermark is",
    "prepare_heat_geodesics": "holds a shape in a power of two of its unit",
    "prepare_vector_heat": "holds a shape in a power of two of its unit",
    "train_codebook": AXES,
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
    assert unexplained(found, reasons) == {}


# The order of corners
BY_CORNER = "is a list of corners or of places in them"
BY_SEARCH = "searches from random points of the faces, which begin at another corner"
ORDERED = {
    "align_surfaces": BY_SEARCH,
    "carry_landmarks": BY_SEARCH,
    "closest_points": BY_CORNER,
    "compare_shapes": BY_SEARCH,
    "compress_mesh": "goes along the edges from the first corner",
    "correspondence_graph": BY_SEARCH,
    "decimate": BY_CORNER,
    "edge_table": BY_CORNER,
    "facet_table": BY_CORNER,
    "fit_surface": BY_SEARCH,
    "labels_from_votes": "names a corner of the clearest face",
    "match_shapes": BY_CORNER,
    "prepare_heat_geodesics": BY_CORNER,
    "prepare_vector_heat": BY_CORNER,
    "sample_surface": BY_SEARCH,
    "train_codebook": AXES,
    "transfer": BY_CORNER,
    "transfer_labels": "names a corner of the clearest face",
    "witness_region": BY_SEARCH,
}


def near(a: np.ndarray, b: np.ndarray) -> str | None:
    """Return a complaint unless two arrays are equal up to rounding."""
    if a.shape != b.shape:
        return f"{a.shape} became {b.shape}"
    size = max(np.abs(each[np.isfinite(each)]).max(initial=0) for each in (a, b))
    close = np.allclose(a, b, rtol=1e-6, atol=1e-6 * size, equal_nan=True)
    return None if close or size < NOISE else "differs"


def test_faces_may_begin_with_any_corner(names, right):
    mesh = natural_slips.body()
    with given_as(es.TriangleMesh(mesh.vertices, np.roll(mesh.faces, 1, axis=1))):
        rolled = answers(names)
    # Faces themselves are given back as they came.
    first, second = (
        {
            name: found
            if isinstance(found, str)
            else [part for part in found if not part[0].endswith("faces")]
            for name, found in each.items()
        }
        for each in (right, rolled)
    )
    assert unexplained(complaints(first, second, near), ORDERED) == {}


# Several components
OF_THE_WHOLE = "is measured by the whole shape"
OF_A_BASIS = "is a basis of eigenspaces that both copies share, or stands in one"
OF_ONE_COPY = "the right values are of the first copy"
NOT_FOR_EACH = {
    "ShapeMatch.pull": OF_THE_WHOLE,
    "Solver.eigs": OF_A_BASIS,
    "approximate_heat_signature": "is an estimate by random vectors",
    "boundary_load": OF_ONE_COPY,
    "closest_points": "a point on an edge is in either triangle",
    "curvature_tensors": OF_THE_WHOLE,
    "detailed_skeleton": OF_A_BASIS,
    "eigen_deformation": OF_A_BASIS,
    "eigen_skeleton": OF_A_BASIS,
    "embed_watermark": OF_THE_WHOLE,
    "export_bundle": OF_A_BASIS,
    "fit_surface": OF_THE_WHOLE,
    "labels_from_votes": OF_ONE_COPY,
    "match_shapes": OF_THE_WHOLE,
    "normalize_mesh": OF_THE_WHOLE,
    "operator_bundle": OF_A_BASIS,
    "prepare_heat_geodesics": OF_THE_WHOLE,
    "prepare_vector_heat": OF_THE_WHOLE,
    "reconstruct": OF_A_BASIS,
    "signed_heat_distance": OF_ONE_COPY,
    "solve_spectrum": OF_A_BASIS,
    "transfer_labels": OF_THE_WHOLE,
    "warp_mesh": OF_ONE_COPY,
    "wave_kernel_signature": "is a share of all modes",
}
APART = 6 * np.pi  # of waves of length 2 pi in the right values, which are the same for both copies


def test_each_of_two_copies_has_the_answer_of_one(names, right):
    mesh = natural_slips.body()
    shift = np.array([APART, 0, 0])
    copies = es.TriangleMesh(
        np.concatenate([mesh.vertices, mesh.vertices + shift]),
        np.concatenate([mesh.faces, mesh.faces + mesh.n_vertices]),
    )
    with given_as(copies, n_modes=80):
        doubled = answers(names)
    wrong, n_compared = {}, 0
    for name, found in right.items():
        if isinstance(found, str) or isinstance(doubled[name], str):
            continue  # an error that says why
        for (place, one), (_, two) in zip(found, doubled[name], strict=False):
            of_points = one.ndim and len(one) in (mesh.n_vertices, mesh.n_faces)
            if (
                one.dtype.kind != "f"
                or not of_points
                or two.shape != (2 * len(one), *one.shape[1:])
            ):
                continue
            n_compared += 1
            halves = np.split(two, 2)
            moved = one + shift if one.shape[1:] == (3,) else one
            if near(one, halves[0]) or (near(one, halves[1]) and near(moved, halves[1])):
                wrong[name] = place
    assert n_compared
    assert unexplained(wrong, NOT_FOR_EACH) == {}


# Few samples
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0.2, 1.1, 0], [0.3, 0.4, 0.9]])
FACES = {1: [[0, 1, 2]], 2: [[0, 1, 2], [1, 0, 3]], 4: [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]}
# Where NaN stands for what is not there, as the documentation says.
ABSENT = {"carry_landmarks", "unmask", "accuracy_curve"}


def assert_sound(name: str, given: Answer) -> None:
    """Assert that an answer has no NaN, unless it says what is not there."""
    if not isinstance(given, str) and name not in ABSENT:
        for place, part in given:
            assert part.dtype.kind != "f" or not np.isnan(part).any(), f"{name}{place}"


@pytest.mark.parametrize("n_faces", FACES)
def test_few_faces_are_answered_or_refused_with_a_reason(names, n_faces):
    with given_as(es.TriangleMesh(CORNERS[: np.max(FACES[n_faces]) + 1], FACES[n_faces])):
        found = answers(names)  # any error but ours fails the test
    for name, given in found.items():
        assert_sound(name, given)


def test_small_counts_are_answered_or_refused_with_a_reason(names):
    for name, code, given in calls(names):
        counts = [key for key, value in given.items() if type(value) is int and value > 2]
        for key in counts:
            for count in (1, 2):
                assert_sound(name, answer(code, given | {key: count}))


@pytest.mark.parametrize("n_points", range(1, 6))
def test_few_points_are_answered_or_refused_with_a_reason(names, n_points):
    cloud = es.PointCloud(natural_slips.body().vertices[:n_points])
    for name, code, given in calls(names):
        for key, hint in get_type_hints(code).items():
            if key in given and es.PointCloud in set(kinds(hint)):
                assert_sound(name, answer(code, given | {key: cloud}))


# Ties, plateaus and single rows
def fields_of_points() -> dict[str, np.ndarray]:
    height = natural_slips.height()
    spike = np.zeros(len(height))
    spike[5] = 1
    return {
        "zero": 0 * height,
        "constant": 0 * height + 1,
        "three values": np.round(height),
        "integers": np.round(3 * height).astype(int),
        "spike": spike,
        "pit": -spike,
        "single precision": height.astype(np.float32),
    }


def point_arguments(given: dict[str, Any]) -> list[str]:
    """Return the arguments that hold one number per point."""
    n = natural_slips.body().n_vertices
    return [
        key
        for key, value in given.items()
        if isinstance(value, np.ndarray) and value.shape == (n,) and value.dtype.kind == "f"
    ]


def test_ties_and_plateaus_are_answered_alike_each_time(names):
    for name, code, given in calls(names):
        if isinstance(given, str):
            continue
        for key in point_arguments(given):
            for kind, values in fields_of_points().items():
                one, two = (answer(code, given | {key: values.copy()}) for _ in range(2))
                if isinstance(one, str):
                    assert one == two
                    continue
                for (place, first), (_, second) in zip(one, two, strict=True):
                    where = f"{name}({key}={kind}){place}"
                    np.testing.assert_array_equal(first, second, where)
                    if name not in ABSENT and first.dtype.kind == "f":
                        assert not np.isnan(first).any(), where


JOINT = {
    "condense": "splits regions by all fields",
    "rotation_nulls": "frames that are drawn at random have a vector for each map",
    "symmetric_components": "fits the specimens to each other",
}


def test_one_column_is_the_first_of_two(names):
    for name, code, given in calls(names):
        if isinstance(given, str) or name in JOINT:
            continue
        for key in point_arguments(given):
            both = np.column_stack([given[key], given[key][::-1]])
            one, two = (answer(code, given | {key: both[:, :k]}) for k in (1, 2))
            if isinstance(two, str):
                assert isinstance(one, str), f"{name} takes one column of {key}, and not two"
                continue
            assert not isinstance(one, str), one
            for (place, first), (_, second) in zip(one, two, strict=True):
                if first.shape != second.shape:
                    (axis,) = np.flatnonzero(np.not_equal(first.shape, second.shape))
                    assert near(first, second.take([0], axis)) is None, f"{name}{place}"


def test_one_row_is_the_first_of_two(names):
    for name, code, given in calls(names):
        if isinstance(given, str) or name in JOINT:
            continue
        for key, value in given.items():
            if not isinstance(value, list | np.ndarray) or key in point_arguments(given):
                continue
            if len(value) < 2 or not isinstance(value[0], int | float | list | np.ndarray):
                continue
            one, two = (answer(code, given | {key: value[:count]}) for count in (1, 2))
            if isinstance(one, str) or isinstance(two, str):
                continue  # other arguments have as many rows
            for (place, first), (_, second) in zip(one, two, strict=True):
                assert first.ndim == second.ndim, f"{name}({key}){place} lost its rows"
                axes = np.flatnonzero(np.not_equal(first.shape, second.shape))
                if [(first.shape[axis], second.shape[axis]) for axis in axes] == [(1, 2)]:
                    assert near(first, second.take([0], axes[0])) is None, f"{name}({key}){place}"
