"""Checks of arrays and numbers, with errors that name the argument, and read-only copies."""

import operator
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from eigenshape._arguments import describe_value
from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape._memory import require_memory
from eigenshape._text import Shown
from eigenshape._typing import ArrayLike, Integer

# Names of rows in messages, and what rows of indices refer to.
SINGULAR = {"vertices": "vertex", "faces": "face", "points": "point", "simplices": "simplex"}
INDEXED = {"faces": "vertices", "simplices": "points"}

# Share of the memory of the machine that one array may take while it is checked and copied. A
# larger share would leave too little for the computation.
SHARE_OF_ARRAYS = 0.5
BYTES_OF_ENTRY = 17  # memory per entry meanwhile: two copies of 8 bytes and one bool

# Steps of a loop at most. One takes 0.1 ms or more, so that a number mistyped would run for days.
MOST_STEPS = 1_000_000
MOST_COORDINATES = 3  # of a row that messages show as a vector: those of a point in space

ArrayT = TypeVar("ArrayT", bound=NDArray[Any])
T = TypeVar("T")


def freeze(array: ArrayT) -> ArrayT:
    """Return a contiguous copy that is read-only."""
    copy = np.array(array, order="C")
    copy.flags.writeable = False
    return copy  # type: ignore[return-value]


class ReadOnly(Shown):
    """Base class of values that hold arrays: nobody can change them, nor those of any copy.

    An array that its caller can write to is copied. NumPy makes the arrays of a pickle, and of
    `copy.deepcopy`, writable; here they become read-only again. Its text gives long arrays by their
    type and shape, and notebooks show a value as a table.
    """

    def __post_init__(self) -> None:
        for name, entry in vars(self).items():
            if any(array.flags.writeable for array in _arrays_of(entry)):
                vars(self)[name] = deepcopy(entry)
        self.__setstate__(vars(self))

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for entry in state.values():
            for array in _arrays_of(entry):
                array.flags.writeable = False


@dataclass_transform(frozen_default=True, eq_default=False)
def record(kind: type[T]) -> type[T]:
    """Make a class a frozen dataclass whose values are equal to themselves alone.

    Whether arrays are equal has no one answer, so values that hold arrays are not compared.
    """
    return dataclass(frozen=True, eq=False)(kind)


def _arrays_of(entry: Any) -> Iterator[NDArray[Any]]:
    """Yield the arrays of an entry of a value: an array, a sparse matrix, or a tuple or dict of them."""
    if isinstance(entry, np.ndarray):
        yield entry
    elif isinstance(entry, tuple | dict):
        for each in entry.values() if isinstance(entry, dict) else entry:
            yield from _arrays_of(each)
    elif hasattr(entry, "indptr"):
        yield from (entry.data, entry.indices, entry.indptr)


def as_array(
    value: ArrayLike,
    name: str,
    error: type[InvalidShapeError | InvalidParameterError] = InvalidParameterError,
) -> NDArray[Any]:
    """Return `value` as an array. All arrays that callers pass go through here.

    Raise InvalidShapeError or InvalidParameterError if an entry is masked, or if checking and
    copying would take more than half of the memory: a broadcast array can be far larger than the
    memory that it occupies. Raise ValueError if rows differ in length.
    """
    nested = isinstance(value, list | tuple) and any(
        isinstance(row, np.ma.MaskedArray) for row in value
    )
    array = np.ma.asarray(value) if nested else np.asanyarray(value)
    masked = np.ma.getmask(array)
    if np.any(masked):
        place = tuple(int(index) for index in np.argwhere(masked)[0])
        raise error(
            f"{name} must not be masked; entry {place[0] if len(place) == 1 else place} is "
            f"({masked.sum()} such). Fill masked entries with numbers, or remove them."
        )
    require_memory(
        name,
        f"checking and copying an array of shape {array.shape}",
        {"copies": array.size * BYTES_OF_ENTRY},
        share=SHARE_OF_ARRAYS,
        error=error,
    )
    return np.asarray(array)


def finite_rows(value: ArrayLike, name: str, columns: int | None = None) -> NDArray[np.float64]:
    """Return `value` as an (n, columns) float64 array; raise an error if an entry is not finite.

    Without `columns` any number of columns is accepted.
    """
    rows = _table(value, name, columns)
    if rows.dtype.kind not in "iuf":
        raise InvalidShapeError(f"{name} must be real numbers; the type is {rows.dtype}.")
    # Long doubles that overflow become infinite, which raises the error below.
    with np.errstate(over="ignore"):
        rows = rows.astype(np.float64, order="C")  # as kernels take them
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if bad.size:
        raise InvalidShapeError(
            f"{name} must be finite; {SINGULAR.get(name, 'row')} {bad[0]} is {rows[bad[0]].tolist()} "
            f"({bad.size} such)."
        )
    return rows


def index_rows(
    value: ArrayLike, name: str, columns: int | None, n_vertices: int
) -> NDArray[np.int64]:
    """Return `value` as (f, columns) int64 indices from 0 to `n_vertices` - 1."""
    rows = _table(value, name, columns)
    # Integers beyond 64 bits come as objects; they are out of range, and the message shows them.
    huge = rows.dtype.kind == "O" and all(
        isinstance(entry, int | np.integer) for entry in rows.flat
    )
    if rows.dtype.kind not in "iuf" and not huge:
        raise InvalidShapeError(f"{name} must be integers; the type is {rows.dtype}.")
    if rows.dtype.kind == "f" and (rows != np.floor(rows)).any():
        fact = _first(name, rows, rows != np.floor(rows))
        raise InvalidShapeError(f"{name} must be whole numbers; {fact}.")
    outside = (rows < 0) | (rows >= n_vertices)
    if outside.any():
        indexed = INDEXED[name]
        raise InvalidShapeError(
            f"{name} must index {indexed} 0..{n_vertices - 1}; {_first(name, rows, outside)}."
        )
    return rows.astype(np.int64, order="C")


def _table(value: ArrayLike, name: str, columns: int | None) -> NDArray[Any]:
    wanted = f"(n, {columns or 'd'})"
    try:
        rows = as_array(value, name, InvalidShapeError)
    except InvalidShapeError:
        raise
    except ValueError as err:
        raise InvalidShapeError(
            f"{name} must have shape {wanted}; the rows differ in length."
        ) from err
    if rows.size == 0:
        return np.empty((0, columns or 0), dtype=np.int64)
    if rows.ndim != 2 or columns not in (None, rows.shape[1]):
        hint = " Transpose it." if rows.ndim == 2 and rows.shape[0] == columns else ""
        raise InvalidShapeError(
            f"{name} must have shape {wanted}; the shape is {rows.shape}.{hint}"
        )
    if len(rows) > 1 and rows.strides[0] == 0:
        raise InvalidShapeError(
            f"{name} must not be one broadcast row; all {len(rows)} rows are {rows[0].tolist()} "
            "at one place in memory. Copy the array if this is intended."
        )
    return rows


def _first(name: str, rows: NDArray[Any], bad: NDArray[np.bool_]) -> str:
    row = int(np.flatnonzero(bad.any(axis=1))[0])
    return f"{SINGULAR[name]} {row} is {rows[row].tolist()}"


def positive_values(value: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return `value` as a one-dimensional float64 array of positive and finite numbers."""
    values = _list_of_numbers(value, name)
    bad = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
    if bad.size:
        raise InvalidParameterError(
            f"{name} must be positive and finite; entry {bad[0]} is {values[bad[0]]}."
        )
    return values


def finite_number(value: ArrayLike, name: str) -> float:
    """Return `value` as a finite float, given as a number or a list of one."""
    return _one(finite_values(value, name), name)


def positive_number(value: ArrayLike, name: str) -> float:
    """Return `value` as a positive and finite float, given as a number or a list of one."""
    return _one(positive_values(value, name), name)


def number_from_zero(value: ArrayLike, name: str) -> float:
    """Return `value` as a float from zero on, which may be infinite."""
    number = real_numbers(value, name)
    if number.ndim or not number >= 0:
        raise InvalidParameterError(
            f"{name} must be a number of at least 0; it is {describe_value(value)}."
        )
    return float(number)


def _one(values: NDArray[np.float64], name: str) -> float:
    if len(values) != 1:
        raise InvalidParameterError(f"{name} must be one number; there are {len(values)}.")
    return float(values[0])


def finite_values(value: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return `value` as a one-dimensional float64 array of finite numbers."""
    return _all_finite(_list_of_numbers(value, name), name)


def vertex_values(value: ArrayLike, name: str, n_vertices: int) -> NDArray[np.float64]:
    """Return `value` as a float64 array with one finite number per vertex."""
    values = real_numbers(value, name)
    if values.shape != (n_vertices,):
        raise InvalidParameterError(
            f"{name} must hold one number per vertex, shape ({n_vertices},); "
            f"the shape is {values.shape}."
        )
    return _all_finite(values, name)


def point_functions(value: ArrayLike, name: str, n_points: int) -> NDArray[np.float64]:
    """Return `value` as finite float64 numbers: one per point, or a column for each function."""
    values = real_numbers(value, name)
    if values.ndim not in (1, 2) or len(values) != n_points:
        hint = " Transpose it." if values.ndim == 2 and values.shape[1] == n_points else ""
        raise InvalidParameterError(
            f"{name} must hold one number per point, shape ({n_points},) or ({n_points}, k) for k "
            f"functions; the shape is {values.shape}.{hint}"
        )
    return _all_finite(values, name)


def simplex_vectors(
    value: ArrayLike, name: str, n_simplices: int, ambient: int
) -> NDArray[np.float64]:
    """Return `value` as finite float64 numbers: one vector per simplex, or k of them, (s, d, k)."""
    vectors = real_numbers(value, name)
    if vectors.ndim not in (2, 3) or vectors.shape[:2] != (n_simplices, ambient):
        raise InvalidParameterError(
            f"{name} must hold one vector per simplex, shape ({n_simplices}, {ambient}) or "
            f"({n_simplices}, {ambient}, k) for k fields; the shape is {vectors.shape}."
        )
    return _all_finite(vectors, name)


def face_labels(value: ArrayLike, name: str, n_faces: int) -> NDArray[Any]:
    """Return `value` as an array with one whole number per face, of any integer type."""
    labels = as_array(value, name)
    if labels.shape != (n_faces,) or labels.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"{name} must hold one whole number per face, shape ({n_faces},); "
            f"the shape is {labels.shape} and the type {labels.dtype}."
        )
    return labels


def _all_finite(values: NDArray[Any], name: str) -> NDArray[np.float64]:
    numbers = values.astype(np.float64, order="C")
    bad = np.argwhere(~np.isfinite(numbers))
    if len(bad):
        place = tuple(bad[0].tolist())
        entry = place[0] if len(place) == 1 else place
        raise InvalidParameterError(f"{name} must be finite; entry {entry} is {numbers[place]}.")
    return numbers


def require_finite_rows(rows: NDArray[np.float64], name: str, noun: str) -> None:
    """Raise an error if a number is not finite; `noun` says what each row belongs to."""
    bad = np.argwhere(~np.isfinite(rows))
    if len(bad):
        row = bad[0][0]
        # A vector is shown as a whole; of many functions, the value of the first bad one.
        is_vector = rows[row].size <= MOST_COORDINATES
        value = rows[row].tolist() if is_vector else rows[tuple(bad[0])]
        raise InvalidParameterError(f"{name} must be finite; that of {noun} {row} is {value}.")


def _list_of_numbers(value: ArrayLike, name: str) -> NDArray[np.float64]:
    values = np.atleast_1d(real_numbers(value, name))
    if values.ndim != 1 or not values.size:
        raise InvalidParameterError(
            f"{name} must be a list of numbers; the shape is {values.shape}."
        )
    return values.astype(np.float64)


def real_numbers(value: ArrayLike, name: str) -> NDArray[Any]:
    """Return `value` as an array of real numbers of any shape, without changing its type.

    Raise InvalidParameterError if it contains anything else, or rows differ in length.
    """
    try:
        numbers = as_array(value, name)
    except InvalidParameterError:
        raise
    except ValueError as err:
        raise InvalidParameterError(
            f"{name} must be a list of numbers; its entries differ in length."
        ) from err
    if numbers.dtype.kind not in "biuf":
        is_array = isinstance(value, list | tuple | np.ndarray)
        given = f"the type is {numbers.dtype}" if is_array else f"it is {describe_value(value)}"
        raise InvalidParameterError(f"{name} must be real numbers; {given}.")
    return numbers


def whole_number(
    value: Integer, name: str, low: int, high: int | None = None, reason: str = ""
) -> int:
    """Return `value` as an int from `low` to `high`; without `high` there is no upper bound.

    `reason` says why there is an upper bound, where the number alone does not.
    """
    try:
        number = int(operator.index(value))  # of True, too
    except TypeError as err:
        raise InvalidParameterError(f"{name} must be a whole number; it is {value!r}.") from err
    if number < low and (high is None or reason):
        raise InvalidParameterError(f"{name} must be at least {low}; it is {number}.")
    if high is not None and number > high and reason:
        raise InvalidParameterError(
            f"{name} must be at most {high}, because {reason}; it is {number}."
        )
    if high is not None and not low <= number <= high:
        raise InvalidParameterError(f"{name} must lie in {low}..{high}; it is {number}.")
    return number


def step_number(value: Integer, name: str) -> int:
    """Return `value` as an int from 1 to a million, the number of steps of a loop."""
    return whole_number(value, name, 1, MOST_STEPS, "no shape needs more steps")


def whole_numbers(value: ArrayLike, name: str, low: int, high: int) -> NDArray[np.int64]:
    """Return `value` as an int64 array with entries from `low` to `high`.

    `name` is the name of one entry.
    """
    numbers = np.atleast_1d(as_array(value, name)).ravel()
    typed = numbers.dtype.kind in "iu"
    for suspect in numbers[(numbers < low) | (numbers > high)] if typed else numbers:
        whole_number(suspect, name, low, high)
    return numbers.astype(np.int64)
