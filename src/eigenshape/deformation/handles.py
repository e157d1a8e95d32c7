"""Handles: how a region is to be moved, and by how much of that."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import finite_values, frozen
from eigenshape._errors import InvalidParameterError
from eigenshape._typing import ArrayLike


@dataclass(frozen=True, eq=False, init=False)
class Rotation:
    """Turn about an axis through a pivot, by any angle.

    Parameters
    ----------
    pivot : (3,) float
        A point of the axis, in length.
    axis : (3,) float
        Its direction, of any length but 0.
    angle : float
        In radians, counter-clockwise seen from the axis' tip; beyond ±π it goes on turning.

    Raises
    ------
    InvalidParameterError
        If a number is not finite, or the axis has no direction.
    """

    pivot: Float[np.ndarray, " 3"]
    axis: Float[np.ndarray, " 3"]
    angle: float

    def __init__(self, pivot: ArrayLike, axis: ArrayLike, angle: float) -> None:
        direction = vector(axis, "axis")
        largest = np.abs(direction).max()
        if largest == 0:
            raise InvalidParameterError("axis must have a direction; it is [0, 0, 0].")
        length = largest * np.linalg.norm(direction / largest)
        if (
            abs(length - 1) > 4 * np.finfo(float).eps
        ):  # what is of length 1 is kept to the last digit
            direction = direction / largest
            direction = direction / np.linalg.norm(direction)
        object.__setattr__(self, "pivot", frozen(vector(pivot, "pivot")))
        object.__setattr__(self, "axis", frozen(direction))
        object.__setattr__(self, "angle", float(finite_values(angle, "angle")[0]))

    @property
    def turn(self) -> Float[np.ndarray, " 3"]:
        """Axis times angle."""
        return self.axis * self.angle

    def carry(
        self, points: Float[np.ndarray, "n 3"], share: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Return how far each point goes by its share of the angle (Rodrigues' formula)."""
        from_pivot = points - self.pivot
        angle = share[:, None] * self.angle
        across = np.cross(self.axis, from_pivot)
        return np.sin(angle) * across + 2 * np.sin(angle / 2) ** 2 * np.cross(self.axis, across)


@dataclass(frozen=True, eq=False, init=False)
class Translation:
    """Move by a vector.

    Parameters
    ----------
    vector : (3,) float
        In length.

    Raises
    ------
    InvalidParameterError
        If a number is not finite.
    """

    vector: Float[np.ndarray, " 3"]

    def __init__(self, vector_: ArrayLike) -> None:
        object.__setattr__(self, "vector", frozen(vector(vector_, "vector")))

    @property
    def turn(self) -> Float[np.ndarray, " 3"]:
        """Nothing turns."""
        return np.zeros(3)

    def carry(
        self, points: Float[np.ndarray, "n 3"], share: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Return the share of the vector by which each point goes."""
        return share[:, None] * self.vector


Handle = Rotation | Translation


def affine_offset(handle: Handle) -> Float[np.ndarray, "3 4"]:
    """Return D with D [x, 1] = how far the whole motion takes x."""
    shift = handle.carry(np.zeros((1, 3)), np.ones(1))[0]
    if isinstance(handle, Translation):
        return np.column_stack([np.zeros((3, 3)), shift])
    about_origin = Rotation(np.zeros(3), handle.axis, handle.angle)  # a far pivot would cost digits
    return np.column_stack([about_origin.carry(np.eye(3), np.ones(3)).T, shift])


def rotation_from_drag(pivot: ArrayLike, start: ArrayLike, end: ArrayLike) -> Rotation:
    """Return the least rotation about a pivot that turns one point towards another (thesis 6.2.1).

    Parameters
    ----------
    pivot, start, end : (3,) float
        In length; the distances to the pivot may differ.

    Raises
    ------
    InvalidParameterError
        If a point is the pivot, or the two lie on opposite sides of it, so that no axis is told.
    """
    center = vector(pivot, "pivot")
    before, after = vector(start, "start") - center, vector(end, "end") - center
    for arm, name in ((before, "start"), (after, "end")):
        if not arm.any():
            raise InvalidParameterError(
                f"{name} must be another point than the pivot; both are {center.tolist()}."
            )
    before, after = (arm / np.abs(arm).max() for arm in (before, after))
    axis, along = np.cross(before, after), float(before @ after)
    across = float(np.linalg.norm(axis))
    if across <= 1e-12 * abs(along):
        if along < 0:
            raise InvalidParameterError(
                "start and end must not be opposite about the pivot: no axis is told then."
            )
        return Rotation(center, [0, 0, 1], 0.0)
    return Rotation(center, axis, float(np.arctan2(across, along)))


def vector(value: ArrayLike, name: str) -> Float[np.ndarray, " 3"]:
    """Return three finite numbers.

    Raises
    ------
    InvalidParameterError
    """
    numbers = finite_values(value, name)
    if numbers.shape != (3,):
        raise InvalidParameterError(
            f"{name} must have three numbers; the shape is {numbers.shape}."
        )
    return numbers
