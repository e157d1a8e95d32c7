"""Compiled loops of `patches`: descriptors of the geodesic discs around a point, by rings."""

import numpy as np

from eigenshape._compile import njit

RINGS = 4  # rings of equal width in a disc
TURN_BINS = 8  # bins of the cosine to the disc's normal, 0 to 1
HEIGHT_BINS = 6  # bins of the height above the point, in radii, -1 to 1
# The two histograms, the logarithm of the area, and the ratio of distances
RING_NUMBERS = TURN_BINS + HEIGHT_BINS + 2
NUMBERS = RINGS * RING_NUMBERS
INNER = 0.35  # share of the radius in which the disc's normal is averaged
BUCKETS = 512  # of distances, before they are sorted
LEAST_AREA = 1e-3  # share of a flat disc's area, added before the logarithm


@njit
def describe_discs_of(distances, center, surface, radii, scratch, found):
    """Write the NUMBERS of the discs around one point, a row for each of the ascending radii.

    `surface` holds the points, normals and areas of all vertices. `scratch` holds vertices, as many
    as there are, BUCKETS + 1 starts, and twice RINGS numbers.
    """
    order, starts, kept, straight = scratch
    n_near = sort_by_distance(distances, radii[-1], order, starts)
    for row in range(len(radii)):
        describe_disc(
            distances, center, order[:n_near], surface, radii[row], kept, straight, found[row]
        )


@njit
def sort_by_distance(distances, reach, order, starts):
    """Write the vertices within reach by distance, equals by index, and return their number.

    Vertices are put into buckets of equal width first. Then few are out of place, and insertion
    takes a fifth of the time of a sort of all.
    """
    for bucket in range(BUCKETS + 1):
        starts[bucket] = 0
    for i in range(len(distances)):
        if distances[i] <= reach:
            starts[_bucket(distances[i], reach) + 1] += 1
    for bucket in range(BUCKETS):
        starts[bucket + 1] += starts[bucket]
    total = starts[BUCKETS]
    for i in range(len(distances)):
        if distances[i] <= reach:
            bucket = _bucket(distances[i], reach)
            order[starts[bucket]] = i
            starts[bucket] += 1
    for first in range(1, total):
        vertex, place = order[first], first
        while place and distances[order[place - 1]] > distances[vertex]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = vertex
    return total


@njit
def _bucket(distance, reach):
    return min(int(distance / reach * BUCKETS), BUCKETS - 1)


@njit
def describe_disc(distances, center, order, surface, radius, kept, straight, found):
    """Write the NUMBERS that describe the disc of a radius around one point.

    `order` holds the vertices by distance, at least as far as the disc reaches; `surface` holds the
    points, normals and areas of all vertices. `kept` and `straight` are scratch of RINGS numbers.
    """
    points, normals, areas = surface
    x = y = z = 0.0
    for at in range(len(order)):
        i = order[at]
        if distances[i] > INNER * radius:
            break
        x += areas[i] * normals[i, 0]
        y += areas[i] * normals[i, 1]
        z += areas[i] * normals[i, 2]
    length = np.sqrt(x * x + y * y + z * z)
    if length > 0:
        x, y, z = x / length, y / length, z / length
    for place in range(NUMBERS):
        found[place] = 0.0
    for ring in range(RINGS):
        kept[ring] = straight[ring] = 0.0
    for at in range(len(order)):
        i = order[at]
        if distances[i] > radius:
            break
        u, v, w = points[i, 0] - center[0], points[i, 1] - center[1], points[i, 2] - center[2]
        turn = normals[i, 0] * x + normals[i, 1] * y + normals[i, 2] * z
        height = u * x + v * y + w * z
        beeline = np.sqrt(u * u + v * v + w * w)
        if turn <= 0:
            continue
        ring = min(int(RINGS * distances[i] / radius), RINGS - 1)
        first = ring * RING_NUMBERS
        kept[ring] += areas[i]
        straight[ring] += areas[i] * (beeline / distances[i] if distances[i] > 0 else 1.0)
        _add(found, first, TURN_BINS, turn, areas[i])
        _add(found, first + TURN_BINS, HEIGHT_BINS, (height / radius + 1) / 2, areas[i])
    covered = 0.0
    for ring in range(RINGS):
        first = ring * RING_NUMBERS
        covered += kept[ring]
        if kept[ring] > 0:
            for place in range(first, first + TURN_BINS + HEIGHT_BINS):
                found[place] = np.sqrt(found[place] / kept[ring])
        across = radius * (ring + 1) / RINGS
        flat = np.pi * (across * across)
        found[first + RING_NUMBERS - 2] = np.log(LEAST_AREA + covered / flat)
        found[first + RING_NUMBERS - 1] = straight[ring] / kept[ring] if kept[ring] > 0 else 1.0


@njit
def _add(found, first, n_bins, share, weight):
    """Split a weight at `share`, 0 to 1, between the two bins with the nearest centers.

    The bins are the entries of `found` from `first` on.
    """
    place = min(max(share * n_bins - 0.5, 0.0), n_bins - 1.0)
    low = min(int(place), n_bins - 2)
    found[first + low] += weight * (low + 1 - place)
    found[first + low + 1] += weight * (place - low)
