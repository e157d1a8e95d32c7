"""Seams: where the boundary of a mesh lies on itself, up to the rounding of stored coordinates."""

from decimal import Decimal

import numpy as np
import scipy  # which loads scipy.spatial where it is used: it takes 0.1 s
from jaxtyping import Float, Int

from certeig.kit.arrays import TINY
from eigenshape._arrays import label_components, number_places, sorted_rows
from eigenshape._corners import side_lengths
from eigenshape._vectors import size_one
from eigenshape.geometry.facets import boundary_facets
from eigenshape.geometry.simplicial import Mesh

# How far both sides of a seam are apart when each was computed for itself, in roundings of the size
# of the mesh: the cosine and sine of 0 and 2π differ by 3.
ROUNDINGS = 16
# and in units of the last digit that is stored: one for each side.
LAST_DIGITS = 2
# Decimals are taken for rounded ones if their last digit is at most this share of the size, and if
# that many different digits come last. In lengths that someone typed, halved or moved it is mostly
# the same one.
COARSEST_DIGIT = 1e-5
FEWEST_LAST_DIGITS = 6
MOST_DIGITS = 12  # of rounded decimals; floats have 15 to 17
# The precision is seen from this many coordinates.
MOST_COORDINATES = 10_000
# No tolerance is above the shortest side of the mesh divided by this. So chains of near points
# cannot join the corners of a simplex.
SIDES_PER_GAP = 8


def seams(mesh: Mesh) -> Int[np.ndarray, "k 2 m"]:
    """Return pairs of boundary facets with corners at the same places but different vertices.

    Places are the same if they differ by a few roundings of the coordinates as they were stored: in
    single precision if all coordinates fit into it, as decimals if all have few digits, and
    otherwise in double precision. Of several facets at one place each is paired with the next, so
    that the pairs connect them all.
    """
    facets = boundary_facets(mesh)
    used, numbers = np.unique(facets, return_inverse=True)
    places = _round_places(mesh, used)[numbers.reshape(facets.shape)]
    by_place = np.argsort(places, axis=1, kind="stable")
    facets, places = (np.take_along_axis(rows, by_place, axis=1) for rows in (facets, places))
    order, _, repeats = sorted_rows(places)
    second = np.flatnonzero(repeats)
    return np.stack([facets[order[second - 1]], facets[order[second]]], axis=1)


def _round_places(mesh: Mesh, used: Int[np.ndarray, " k"]) -> Int[np.ndarray, " k"]:
    """Return for each of some points the number of its place, up to rounding."""
    place = number_places(mesh.points[used])
    if not len(used):
        return place
    points, scale = size_one(mesh.points)
    tolerance = _stored_precision(mesh.points[np.unique(mesh.simplices)]) / scale
    spots = points[used[np.unique(place, return_index=True)[1]]]
    near = scipy.spatial.cKDTree(spots).query_pairs(
        tolerance.max(), p=np.inf, output_type="ndarray"
    )
    if not len(near):
        return place
    lengths = side_lengths(points[mesh.simplices])
    shortest = lengths.min(initial=np.inf, where=lengths > 0)
    tolerance = np.minimum(tolerance, shortest / SIDES_PER_GAP)
    within = (np.abs(spots[near[:, 0]] - spots[near[:, 1]]) <= tolerance).all(axis=1)
    _, joined = label_components(len(spots), *near[within].T)
    return joined[place]


def _stored_precision(points: Float[np.ndarray, "n d"]) -> Float[np.ndarray, " d"]:
    """Return how far along each axis points may be apart by the rounding of stored coordinates."""
    sizes = np.abs(points).max(axis=0)
    extent = float((points.max(axis=0) / 2 - points.min(axis=0) / 2).max())
    values = np.abs(points.ravel()[:: 1 + points.size // MOST_COORDINATES])
    values = values[values > 0]
    n_decimals, n_digits = _rounded_digits(values)

    def last_digits(numbers: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        leading = np.floor(np.log10(np.maximum(numbers, TINY)))
        return np.maximum(10.0**-n_decimals, 10.0 ** (leading - n_digits + 1))

    with np.errstate(over="ignore"):
        off_single = np.abs(values - values.astype(np.float32))
    single = (off_single <= last_digits(values) / 2).all()
    rounding = 2.0**-24 if single else 2.0**-53
    decimal = last_digits(sizes)
    decimal[decimal > 2 * COARSEST_DIGIT * extent] = 0.0
    steps = np.maximum(decimal, 2 * rounding * sizes)
    return LAST_DIGITS * steps + 2 * ROUNDINGS * rounding * extent


def _rounded_digits(values: Float[np.ndarray, " k"]) -> tuple[float, float]:
    """Return how many decimals and digits rounded values have at most, infinitely many for others."""
    decimals = [Decimal(repr(value)).normalize().as_tuple() for value in values.tolist()]
    n_decimals = max((-float(value.exponent) for value in decimals), default=0.0)
    n_digits = max((len(value.digits) for value in decimals), default=0)
    last = {
        value.digits[-1]
        for value in decimals
        if len(value.digits) == n_digits or value.exponent == -n_decimals
    }
    if n_digits > MOST_DIGITS or len(last) < FEWEST_LAST_DIGITS:
        return np.inf, np.inf
    return n_decimals, n_digits
