"""Compiled loops of `patches`: describe the discs around points, ring by ring."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit

RINGS = 4  # of equal width, from the center of a disc to its radius
TURN_BINS = 8  # of the cosine to the disc's normal, on 0..1
HEIGHT_BINS = 6  # of the height over the point, in radii, on -1..1
# The two histograms, the logarithm of the area, and the ratio of distances
RING_NUMBERS = TURN_BINS + HEIGHT_BINS + 2
NUMBERS = RINGS * RING_NUMBERS
INNER = 0.35  # of the radius: where the disc's normal is taken
LEAST_AREA = 1e-3  # of a flat disc's, added before the logarithm


@njit
@no_type_check
def describe_discs(rows, chosen, surface, radii, found):
    """Describe the discs around each chosen point; `surface` holds points, normals and areas."""
    for sample in range(len(chosen)):
        reach = np.flatnonzero(rows[sample] <= radii[-1])
        order = reach[np.argsort(rows[sample][reach], kind="mergesort")]
        for place in range(len(radii)):
            _describe_disc(
                rows[sample],
                surface[0][chosen[sample]],
                order,
                surface,
                radii[place],
                found[sample, place],
            )


@njit
@no_type_check
def _describe_disc(distances, center, order, surface, radius, found):
    points, normals, areas = surface
    normal = np.zeros(3)
    for i in order:
        if distances[i] > INNER * radius:
            break
        for axis in range(3):
            normal[axis] += areas[i] * normals[i, axis]
    length = np.sqrt((normal * normal).sum())
    if length > 0:
        normal /= length
    found[:] = 0
    kept, straight = np.zeros(RINGS), np.zeros(RINGS)
    for i in order:
        if distances[i] > radius:
            break
        turn, height, beeline = 0.0, 0.0, 0.0
        for axis in range(3):
            away = points[i, axis] - center[axis]
            turn += normals[i, axis] * normal[axis]
            height += away * normal[axis]
            beeline += away * away
        if turn <= 0:
            continue
        ring = min(int(RINGS * distances[i] / radius), RINGS - 1)
        first = ring * RING_NUMBERS
        kept[ring] += areas[i]
        straight[ring] += areas[i] * (np.sqrt(beeline) / distances[i] if distances[i] > 0 else 1.0)
        _add(found[first : first + TURN_BINS], turn, areas[i])
        _add(
            found[first + TURN_BINS : first + TURN_BINS + HEIGHT_BINS],
            (height / radius + 1) / 2,
            areas[i],
        )
    covered = 0.0
    for ring in range(RINGS):
        first = ring * RING_NUMBERS
        covered += kept[ring]
        if kept[ring] > 0:
            for place in range(first, first + TURN_BINS + HEIGHT_BINS):
                found[place] = np.sqrt(found[place] / kept[ring])
        flat = np.pi * (radius * (ring + 1) / RINGS) ** 2
        found[first + RING_NUMBERS - 2] = np.log(LEAST_AREA + covered / flat)
        found[first + RING_NUMBERS - 1] = straight[ring] / kept[ring] if kept[ring] > 0 else 1.0


@njit
@no_type_check
def _add(bins, share, weight):
    """Share a weight at 0..1 between the two bins whose centers it lies between."""
    place = min(max(share * len(bins) - 0.5, 0.0), len(bins) - 1.0)
    low = min(int(place), len(bins) - 2)
    bins[low] += weight * (low + 1 - place)
    bins[low + 1] += weight * (place - low)
