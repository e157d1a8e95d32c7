"""Named points of specimens."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from typing_extensions import TypeAliasType

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, freeze, real_numbers, whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike

SMALLEST, LARGEST = (
    1e-120,
    1e120,
)  # extents of specimens: products of squares stay in the range of floats


@dataclass(frozen=True, eq=False, init=False)
class Landmarks(ReadOnly):
    """Named points of one specimen.

    Parameters
    ----------
    names : sequence of str
        Each name once.
    points : (k, 3) float
        In the unit and the frame of the specimen's mesh. A row of NaN is a missing landmark.
    spread : (k,) float, optional
        How far each point may be from its true place, in the unit of the points. NaN if unknown.
    curves : sequence of sequences of int
        For each curve the rows of its points, in order. Its inner points are semilandmarks, which
        `fit_procrustes` may slide; its ends are landmarks. A closed curve ends with its first row.

    Raises
    ------
    InvalidParameterError
        If the numbers of names, points and spreads differ, a name is empty or occurs twice, a point
        is infinite or partly NaN, a spread is negative or infinite, or a curve refers to a row that
        does not exist.

    See Also
    --------
    read_landmarks, write_landmarks

    Examples
    --------
    >>> import eigenshape as es
    >>> es.morphometrics.Landmarks(["nasion"], [[0.0, 1.5, 2.0]]).points.tolist()
    [[0.0, 1.5, 2.0]]
    """

    names: tuple[str, ...]
    points: Float[np.ndarray, "k 3"]
    spread: Float[np.ndarray, " k"] | None
    curves: tuple[tuple[int, ...], ...]

    def __init__(
        self,
        names: Iterable[str],
        points: ArrayLike,
        spread: ArrayLike | None = None,
        curves: Sequence[Sequence[int]] = (),
    ) -> None:
        names, places = tuple(names), real_numbers(points, "points").astype(np.float64)
        if places.shape != (len(names), 3):
            raise InvalidParameterError(
                f"points must have shape (k, 3), one row for each name; there are {len(names)} "
                f"names, and the shape is {places.shape}."
            )
        first: dict[str, int] = {}
        for row, name in enumerate(names):
            require_name(name, f"names[{row}]")
            if first.setdefault(name, row) != row:
                raise InvalidParameterError(
                    f"Names of landmarks must differ; {name!r} is that of rows {first[name]} and "
                    f"{row}."
                )
        missing = np.isnan(places)
        bad = np.isinf(places).any(axis=1) | (missing.any(axis=1) & ~missing.all(axis=1))
        if bad.any():
            row = int(np.argmax(bad))
            raise InvalidParameterError(
                "Points must be finite, and all three numbers of a missing one must be NaN; "
                f"{names[row]!r}, row {row}, is {places[row].tolist()}."
            )
        widths = None
        if spread is not None:
            widths = freeze(real_numbers(spread, "spread").astype(np.float64))
            if widths.shape != (len(names),) or np.isinf(widths).any() or (widths < 0).any():
                raise InvalidParameterError(
                    f"spread must be {len(names)} numbers, one for each point, each at least 0 or "
                    f"NaN; it is {widths.tolist()}."
                )
        curves = as_curves(curves, len(names))
        vars(self).update(names=names, points=freeze(places), spread=widths, curves=curves)


Specimens = TypeAliasType("Specimens", Mapping[str, Landmarks] | Sequence[Landmarks] | ArrayLike)


def require_name(name: object, where: str) -> None:
    """Raise an error if a name could not stand in a line of a file, or would be changed there."""
    if not isinstance(name, str) or not name or name != name.strip() or not name.isprintable():
        raise InvalidParameterError(
            f"{where} must be a text without line breaks that neither begins nor ends with a space; "
            f"it is {name!r}."
        )


def as_curves(curves: Sequence[Sequence[int]], n_points: int) -> tuple[tuple[int, ...], ...]:
    """Return curves as tuples of rows; raise an error if they are none, or a row does not exist."""
    require_type(curves, Iterable, "curves")
    found = []
    for number, curve in enumerate(curves):
        require_type(curve, Iterable, f"curves[{number}]")
        rows = whole_numbers(list(curve), f"curves[{number}]", 0, n_points - 1)
        found.append(tuple(rows.tolist()))
    return tuple(found)


def as_configurations(specimens: Specimens) -> Float[np.ndarray, "n k 3"]:
    """Return points of several specimens as one array, with NaN for missing ones.

    Raise InvalidParameterError if they are no such points, or names of landmarks differ.
    """
    if isinstance(specimens, Sequence) and any(isinstance(each, Landmarks) for each in specimens):
        specimens = dict(enumerate(specimens))  # type: ignore[arg-type]
    if isinstance(specimens, Mapping):
        require_same_names(specimens)
        return np.stack([landmarks.points for landmarks in specimens.values()])
    points = real_numbers(specimens, "specimens").astype(np.float64)  # type: ignore[arg-type]
    if points.ndim != 3 or points.shape[2] != 3 or not points.size:
        raise InvalidParameterError(
            f"specimens must have shape (n, k, 3), k points of n specimens; the shape is "
            f"{points.shape}."
        )
    return points


def complete_points(specimens: Specimens) -> Float[np.ndarray, "n k 3"]:
    """Return points; raise an error if one is missing, or those of a specimen have no shape."""
    points = as_configurations(specimens)
    bad = np.argwhere(~np.isfinite(points).all(axis=2))
    if len(bad):
        specimen, row = bad[0].tolist()
        raise InvalidParameterError(
            f"Points of specimens must be finite; point {row} of specimen {specimen} is "
            f"{points[specimen, row].tolist()}. Try estimate_missing, or leave it out everywhere."
        )
    with np.errstate(over="ignore"):
        extents = np.ptp(points, axis=1).max(axis=1)
    if points.shape[1] < 3 or not extents.all():
        raise InvalidParameterError(
            f"A specimen must have 3 points or more that differ; specimen {int(np.argmax(extents == 0))} "
            f"has {points.shape[1] if extents.all() else 1}."
        )
    # The products of many lengths must not leave the range of floats.
    odd = np.flatnonzero(~((extents > SMALLEST) & (extents < LARGEST)))
    if len(odd):
        raise InvalidParameterError(
            f"The extent of a specimen must lie within {SMALLEST:g}..{LARGEST:g}; that of specimen "
            f"{odd[0]} is {extents[odd[0]]:.3g}. Give its points in another unit."
        )
    return points


def require_same_names(specimens: Mapping[Any, Landmarks], name: str = "specimens") -> None:
    """Raise an error if there is no specimen, or two differ in the names or the order of landmarks.

    `name` is that of the argument.
    """
    names: tuple[str, ...] | None = None
    for specimen, landmarks in specimens.items():
        require_type(landmarks, Landmarks, f"{name}[{specimen!r}]")
        names = landmarks.names if names is None else names
        if landmarks.names != names:
            other = next(
                (one for one, two in zip(landmarks.names, names, strict=False) if one != two),
                f"{len(landmarks.names)} landmarks",
            )
            raise InvalidParameterError(
                f"All specimens must have the same landmarks in the same order, {len(names)} from "
                f"{names[0]!r} on; {specimen!r} has {other!r}. Give missing ones as NaN."
            )
    if not names:
        raise InvalidParameterError("There must be at least one specimen with a landmark.")


def shared_curves(
    specimens: Mapping[Any, Landmarks], name: str = "specimens"
) -> tuple[tuple[int, ...], ...]:
    """Return the curves of all specimens that have some; raise an error if those of two differ.

    `name` is that of the argument.
    """
    drawn = {specimen: own.curves for specimen, own in specimens.items() if own.curves}
    first = next(iter(drawn), None)
    for specimen, curves in drawn.items():
        if curves != drawn[first]:
            raise InvalidParameterError(
                f"All curves of {name} must have the same rows; {first!r} has {drawn[first]}, and "
                f"{specimen!r} {curves}. Draw them on one, and carry them to the others."
            )
    return drawn.get(first, ())
