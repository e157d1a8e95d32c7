"""Handles: the motions of regions."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from typing_extensions import TypeAliasType

from certeig.kit.arguments import require_each, require_type
from certeig.kit.arrays import EPS, ReadOnly, finite_number, finite_values, freeze, record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape._vectors import unit_vector


class _Motion(ReadOnly):
    """A motion that neither turns nor stretches anything, unless a handle says so."""

    @property
    def turn(self) -> Float[np.ndarray, " 3"]:
        """Rotation vector: zero."""
        return np.zeros(3)

    @property
    def linear(self) -> Float[np.ndarray, "3 3"]:
        """Linear part of the displacement: zero."""
        return np.zeros((3, 3))

    def stretch(
        self, points: Float[np.ndarray, "n 3"], share: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Return the displacement by which lengths at rest change: zero for rigid motions."""
        return np.zeros_like(points)


@record
class Rotation(_Motion):
    """A rotation about an axis through a pivot, by any angle.

    Parameters
    ----------
    pivot : (3,) float
        A point on the axis, in length.
    axis : (3,) float
        Direction of the axis. It is scaled to length 1 and must not be zero.
    angle : float
        In radians, counter-clockwise if the axis points towards the viewer. Angles beyond ±π are
        full turns and more, which `deform` spreads over the shape.

    Raises
    ------
    InvalidParameterError
        If a number is not finite, or the axis is zero.

    See Also
    --------
    Translation : A motion along a vector.
    deform : Move a region of a shape by a rotation or a translation.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> quarter = es.Rotation(pivot=[0, 0, 0], axis=[0, 0, 2], angle=np.pi / 2)
    >>> quarter.axis
    array([0., 0., 1.])
    """

    pivot: Float[np.ndarray, " 3"]
    axis: Float[np.ndarray, " 3"]
    angle: float

    def __init__(self, pivot: ArrayLike, axis: ArrayLike, angle: float) -> None:
        direction = as_vector(axis, "axis")
        largest = np.abs(direction).max()
        if largest == 0:
            raise InvalidParameterError("axis must have a direction; it is [0, 0, 0].")
        length = largest * np.linalg.norm(direction / largest)
        # An axis of length 1 keeps its last digits.
        if abs(length - 1) > 4 * EPS:
            direction = unit_vector(direction)
        vars(self).update(
            pivot=freeze(as_vector(pivot, "pivot")),
            axis=freeze(direction),
            angle=finite_number(angle, "angle"),
        )

    @property
    def turn(self) -> Float[np.ndarray, " 3"]:
        """Rotation vector: axis times angle, in radians."""
        return self.axis * self.angle

    @property
    def linear(self) -> Float[np.ndarray, "3 3"]:
        """Linear part of the displacement: the rotation matrix less the identity."""
        # From a rotation about the origin: a distant pivot would cost digits.
        return Rotation(np.zeros(3), self.axis, self.angle).carry(np.eye(3), np.ones(3)).T

    def carry(
        self, points: Float[np.ndarray, "n 3"], share: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Return the displacement of each point under its share of the angle.

        Rodrigues' formula, with 1 - cos x = 2 sin²(x/2) for small angles.

        Parameters
        ----------
        points : (n, 3) float
        share : (n,) float
            Share of the motion that each point follows, usually 0 to 1.
        """
        from_pivot = points - self.pivot
        angle = share[:, None] * self.angle
        across = np.cross(self.axis, from_pivot)
        return np.sin(angle) * across + 2 * np.sin(angle / 2) ** 2 * np.cross(self.axis, across)


@record
class Translation(_Motion):
    """A translation by a vector.

    Parameters
    ----------
    vector : (3,) float
        In length.

    Raises
    ------
    InvalidParameterError
        If a number is not finite.

    See Also
    --------
    Rotation : A motion about an axis.
    deform : Move a region of a shape by a rotation or a translation.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.Translation([0, 0, 0.5]).vector
    array([0. , 0. , 0.5])
    """

    vector: Float[np.ndarray, " 3"]

    def __init__(self, vector: ArrayLike) -> None:
        vars(self).update(vector=freeze(as_vector(vector, "vector")))

    def carry(
        self, points: Float[np.ndarray, "n 3"], share: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Return the displacement of each point: its share of the vector.

        Parameters
        ----------
        points : (n, 3) float
        share : (n,) float
            Share of the motion that each point follows, usually 0 to 1.
        """
        return share[:, None] * self.vector


@record
class Scaling(_Motion):
    """A scaling about a pivot, by a factor along each axis of the coordinates.

    Parameters
    ----------
    pivot : (3,) float
        The point that stays, in length.
    factors : (3,) float
        Above 0; 1 keeps the size along that axis.

    Raises
    ------
    InvalidParameterError
        If a number is not finite, or a factor is not above 0.

    See Also
    --------
    Rotation : A motion about an axis.
    Translation : A motion along a vector.

    Examples
    --------
    Make the upper part of a sphere twice as wide:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> wider = es.deformation.Scaling(pivot=[0, 0, 1], factors=[2, 2, 1])
    >>> bent = es.deform(es.rig_shape(mesh), mesh.vertices[:, 2] > 0.2, wider)
    >>> float(bent.vertices[:, 0].max().round(1))
    1.7
    """

    pivot: Float[np.ndarray, " 3"]
    factors: Float[np.ndarray, " 3"]

    def __init__(self, pivot: ArrayLike, factors: ArrayLike) -> None:
        sizes = as_vector(factors, "factors")
        if sizes.min() <= 0:
            raise InvalidParameterError(
                f"factors must be above 0; the factor along {'xyz'[sizes.argmin()]} is "
                f"{sizes.min()}. A factor of 0.5 halves a length."
            )
        vars(self).update(pivot=freeze(as_vector(pivot, "pivot")), factors=freeze(sizes))

    @property
    def linear(self) -> Float[np.ndarray, "3 3"]:
        """Linear part of the displacement: the diagonal matrix of the factors less 1."""
        return np.diag(self.factors - 1)

    def carry(
        self, points: Float[np.ndarray, "n 3"], share: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Return the displacement of each point: its share of the whole displacement.

        Parameters
        ----------
        points : (n, 3) float
        share : (n,) float
            Share of the motion that each point follows, usually 0 to 1.
        """
        return share[:, None] * (self.factors - 1) * (points - self.pivot)

    def stretch(
        self, points: Float[np.ndarray, "n 3"], share: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, "n 3"]:
        """Return the displacement by which lengths at rest change: the whole of it.

        Parameters
        ----------
        points : (n, 3) float
        share : (n,) float
            Share of the motion that each point follows, usually 0 to 1.
        """
        return self.carry(points, share)


# `help` shows the name.
Handle = TypeAliasType("Handle", Rotation | Translation | Scaling)


def require_handle(value: object) -> None:
    """Raise an error if a value is no handle."""
    require_type(value, Handle.__value__, "handle")


def require_handles(handles: Sequence[Handle], n_regions: int) -> None:
    """Raise an error if there is not one handle for each region."""
    require_each(handles, Handle.__value__, "handles")
    if len(handles) != n_regions:
        raise InvalidParameterError(
            "Each region must have one handle; "
            f"there are {n_regions} regions and {len(handles)} handles."
        )


def affine_offset(handle: Handle) -> Float[np.ndarray, "3 4"]:
    """Return D, for which D [x, 1] is the displacement of x under the whole motion."""
    return np.column_stack([handle.linear, handle.carry(np.zeros((1, 3)), np.ones(1))[0]])


def as_vector(value: ArrayLike, name: str) -> Float[np.ndarray, " 3"]:
    """Return `value` as three finite numbers."""
    numbers = finite_values(value, name)
    if numbers.shape != (3,):
        raise InvalidParameterError(
            f"{name} must have three numbers; the shape is {numbers.shape}."
        )
    return numbers
