"""Semilandmark curves: their points, spaced evenly along a curve or a surface."""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from certeig.kit.arguments import require_type
from certeig.kit.arrays import whole_numbers
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.morphometrics.landmarks import Landmarks
from eigenshape.morphometrics.placement import farthest_place

MOST_ON_CURVE = 10_000  # points; hundreds are the most that people use
# Places per step along a curve by which its length is measured: gaps are even to about 1e-4.
N_PLACES = 64


def resample_curves(
    landmarks: Landmarks, n_points: ArrayLike, *, mesh: MeshLike | None = None
) -> Landmarks:
    """Place the same number of points evenly along each curve.

    A cubic spline passes through the points of a curve. New points have equal distances along it, or
    along its image on the surface.

    Parameters
    ----------
    landmarks : Landmarks
        Drawn on one specimen, the template: `Landmarks.curves` with two points or more each.
    n_points : int or sequence of int
        Number of points of all curves, or of each, its ends included: at least 2, or 3 where a curve
        is closed.
    mesh : MeshLike, optional
        The surface on which the curves lie, in the unit and frame of the landmarks.

    Returns
    -------
    Landmarks
        All points that are not inside a curve, unchanged, then those inside of each curve. The ends
        of curves stay landmarks.

    Raises
    ------
    InvalidShapeError
        If `mesh` is none.
    InvalidParameterError
        If a number is out of range, there are more numbers than curves or fewer, a point of a curve
        is missing, all its points coincide, or the curve leaves the surface.

    See Also
    --------
    es.collections.carry_landmarks : Carry curves to all specimens of a collection.
    fit_procrustes : Slide their points.

    Examples
    --------
    >>> import eigenshape as es
    >>> drawn = es.morphometrics.Landmarks(
    ...     ["nasion", "between", "bregma"], [[0, 0, 0], [1, 0, 0], [4, 0, 0]], curves=[[0, 1, 2]]
    ... )
    >>> even = es.morphometrics.resample_curves(drawn, 5)
    >>> even.names
    ('nasion', 'bregma', 'curve 1 point 1', 'curve 1 point 2', 'curve 1 point 3')
    >>> even.points[list(even.curves[0]), 0].round(6).tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0]
    """
    require_type(landmarks, Landmarks, "landmarks")
    surface = None if mesh is None else as_mesh(mesh)
    curves = landmarks.curves
    given = whole_numbers(n_points, "n_points", 2, MOST_ON_CURVE)
    if len(given) not in (1, len(curves)):
        raise InvalidParameterError(
            f"n_points must be one number, or one for each curve; there are {len(given)} numbers and "
            f"{len(curves)} curves."
        )
    ends = {row for curve in curves for row in (curve[0], curve[-1])}
    inside = {row for curve in curves for row in curve} - ends
    kept = [row for row in range(len(landmarks.names)) if row not in inside]
    names = [landmarks.names[row] for row in kept]
    places = [landmarks.points[kept]]
    found = []
    counts = np.broadcast_to(given, len(curves)).tolist()
    for number, (curve, count) in enumerate(zip(curves, counts, strict=True)):
        is_closed = curve[0] == curve[-1]
        if is_closed and count < 3:
            raise InvalidParameterError(
                f"A closed curve must have 3 points or more; curves[{number}] would have {count}."
            )
        points = landmarks.points[list(curve)]
        even = _space_evenly(points, count + is_closed, surface, f"curves[{number}]")[1:-1]
        inner = range(len(names), len(names) + len(even))
        names += [f"curve {number + 1} point {place + 1}" for place in range(len(even))]
        places.append(even)
        found.append([kept.index(curve[0]), *inner, kept.index(curve[-1])])
    spread = landmarks.spread
    if spread is not None:
        spread = np.append(spread[kept], np.full(len(names) - len(kept), np.nan))
    return Landmarks(names, np.concatenate(places), spread, found)


def space_curves(
    points: Float[np.ndarray, "k 3"],
    curves: tuple[tuple[int, ...], ...],
    surface: TriangleMesh,
    name: str,
) -> Float[np.ndarray, "k 3"]:
    """Return points, those inside of each curve spaced evenly on the surface of the named specimen."""
    spaced = points.copy()
    for number, curve in enumerate(curves):
        what = f"curve {number} on {name!r}"
        even = _space_evenly(points[list(curve)], len(curve), surface, what)
        spaced[list(curve[1:-1])] = even[1:-1]
    return spaced


def _space_evenly(
    points: Float[np.ndarray, "m 3"], n_points: int, surface: TriangleMesh | None, name: str
) -> Float[np.ndarray, "n 3"]:
    """Return points with equal distances along a curve, from its first point to its last.

    Raise InvalidParameterError if it has no length, misses a point, or leaves the surface; `name` is
    that of the curve.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if not steps.sum() > 0:
        raise InvalidParameterError(
            f"Points of a curve must be known, and must not all coincide; those of {name} are "
            f"{points.tolist()}. Leave the curve out, or place its points."
        )
    moved = np.append(True, steps > 0)
    knots = np.append(0, np.cumsum(steps))[moved]
    is_closed = len(knots) > 3 and (points[0] == points[-1]).all()
    boundary = "periodic" if is_closed else "not-a-knot"
    spline = CubicSpline(knots, points[moved], bc_type=boundary)
    shares = np.linspace(0, 1, N_PLACES, endpoint=False)
    fine = np.append((knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1])
    line = spline(fine)
    if surface is not None:
        line = _on_surface(surface, line, name)
    lengths = np.append(0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
    even = np.linspace(0, lengths[-1], n_points)
    places = np.column_stack([np.interp(even, lengths, axis) for axis in line.T])
    return places if surface is None else closest_points(surface, places).points


def _on_surface(
    surface: TriangleMesh, line: Float[np.ndarray, "p 3"], name: str
) -> Float[np.ndarray, "p 3"]:
    there, farthest = closest_points(surface, line).points, farthest_place(surface)
    gaps = np.linalg.norm(there - line, axis=1)
    worst = int(np.argmax(gaps))
    if gaps[worst] > farthest:
        raise InvalidParameterError(
            f"A curve must lie on the surface; {name} lies {gaps[worst]:.3g} from it at "
            f"{line[worst].round(6).tolist()}, and {farthest:.3g} is the most. Place more of its "
            "points there, or points and surface in one unit and frame."
        )
    return there
