"""Checks of arrays and numbers, with errors that name the argument, and read-only copies."""

import operator
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, TypeVar, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from certeig.kit.arguments import describe_value
from certeig.kit.errors import CerteigError, InvalidParameterError
from certeig.kit.memory import require_memory
from certeig.kit.text import Shown
from certeig.kit.typing import ArrayLike, Integer

EPS = float(np.finfo(np.float64).eps)  # rounding of a number near 1, relative
TINY = float(np.finfo(np.float64).tiny)  # least number of full precision, to divide by instead of 0
# Share of the memory of the machine that one array may take while it is checked and copied. A
# larger share would leave too little for the computation.
SHARE_OF_ARRAYS = 0.5
BYTES_OF_ENTRY = 17  # memory per entry meanwhile: two copies of 8 bytes and one bool


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
    error: type[CerteigError] = InvalidParameterError,
) -> NDArray[Any]:
    """Return `value` as an array. All arrays that callers pass go through here.

    Raise `error` if an entry is masked, or if checking and
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


def as_interval(
    k: Integer | None,
    above: float | None,
    below: float | None,
    as_end: Callable[[float, str], float],
) -> NDArray[np.float64]:
    """Return the interval of the eigenvalues that are requested, or zeros if the lowest k are.

    `as_end` checks an end by its name.
    """
    if (k is None) == (below is None):
        raise InvalidParameterError(
            f"Exactly one of k and below must be given; k is {k} and below is {below}."
        )
    if below is None:
        if above is not None:
            raise InvalidParameterError(
                f"above needs below, the other end of an interval; above is {above}."
            )
        return np.zeros(2)
    high = as_end(below, "below")
    low = -np.inf if above is None else as_end(above, "above")
    if low >= high:
        raise InvalidParameterError(
            f"above must be less than below; above is {above} and below is {below}."
        )
    return np.array([low, high])


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
    return all_finite(_list_of_numbers(value, name), name)


def all_finite(values: NDArray[Any], name: str) -> NDArray[np.float64]:
    """Return `values` as finite float64 numbers; raise an error that names the first that is not."""
    numbers = values.astype(np.float64, order="C")
    bad = np.argwhere(~np.isfinite(numbers))
    if len(bad):
        place = tuple(bad[0].tolist())
        entry = place[0] if len(place) == 1 else place
        raise InvalidParameterError(f"{name} must be finite; entry {entry} is {numbers[place]}.")
    return numbers


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


def whole_numbers(value: ArrayLike, name: str, low: int, high: int) -> NDArray[np.int64]:
    """Return `value` as an int64 array with entries from `low` to `high`.

    `name` is the name of one entry.
    """
    numbers = np.atleast_1d(as_array(value, name)).ravel()
    typed = numbers.dtype.kind in "iu"
    for suspect in numbers[(numbers < low) | (numbers > high)] if typed else numbers:
        whole_number(suspect, name, low, high)
    return numbers.astype(np.int64)


def require_no_mask(numbers: NDArray[Any], name: str, n_points: int) -> None:
    """Raise an error if numbers of points are the zeros and ones of a mask: they would name points 0 and 1."""
    if 2 < len(numbers) == n_points and numbers.max() <= 1:
        raise InvalidParameterError(
            f"{name} must hold numbers of points; it has {n_points} entries, 0 or 1 for each point. "
            "Pass np.flatnonzero(mask) for a mask."
        )
