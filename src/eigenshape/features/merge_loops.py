"""Compiled loops of `merge_tree`: sides of faces in the order of their edges, and faces joined over them.

Vertices are named by rank here, the lowest 0. A side is filed under the higher vertex of its edge, so that a walk over
the ranks from the top meets all edges in falling order, and only the few sides at one vertex are ever sorted.
"""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit
from eigenshape.features.union_loops import find_root

FEW = 48  # sides of a vertex up to which insertion sort is the faster one


@njit
@no_type_check
def falling_corners(faces, rank):
    """Return the ranks of each face's corners, highest first."""
    corners = np.empty((len(faces), 3), dtype=rank.dtype)
    for face in range(len(faces)):
        a, b, c = rank[faces[face, 0]], rank[faces[face, 1]], rank[faces[face, 2]]
        if a < b:
            a, b = b, a
        if b < c:
            b, c = c, b
        if a < b:
            a, b = b, a
        corners[face, 0], corners[face, 1], corners[face, 2] = a, b, c
    return corners


@njit
@no_type_check
def sides_by_vertex(corners, n):
    """File the three sides of each face under the higher vertex: where each vertex' sides start, lower vertex, face."""
    starts = np.zeros(n + 1, dtype=np.int64)
    for face in range(len(corners)):
        starts[corners[face, 0] + 1] += 2
        starts[corners[face, 1] + 1] += 1
    for vertex in range(n):
        starts[vertex + 1] += starts[vertex]
    place = starts[:-1].copy()
    lower = np.empty(3 * len(corners), dtype=corners.dtype)
    owner = np.empty(3 * len(corners), dtype=corners.dtype)
    for face in range(len(corners)):
        for high, low in ((0, 1), (0, 2), (1, 2)):
            vertex = corners[face, high]
            lower[place[vertex]] = corners[face, low]
            owner[place[vertex]] = face
            place[vertex] += 1
    return starts, lower, owner


@njit
@no_type_check
def join_faces(corners, starts, lower, owner):
    """Join faces over falling edges: for each, the face it climbs to; of each basin that ends, itself, edge, neighbour.

    A face whose highest edge leads to a higher face joins its basin at once. Basins are joined as in Kruskal's
    algorithm: the one with the lower maximum ends.
    """
    n_faces = len(corners)
    climbs_to = np.arange(n_faces).astype(corners.dtype)
    highest = climbs_to.copy()
    ended = np.empty((n_faces, 4), dtype=corners.dtype)
    n_ended = 0
    for high in range(len(starts) - 2, -1, -1):
        first, end = starts[high], starts[high + 1]
        _sort_sides(corners, lower, owner, first, end)
        while first < end:
            low = lower[first]
            last = first
            while last + 1 < end and lower[last + 1] == low:
                last += 1
            for side in range(
                last - 1, first - 1, -1
            ):  # the higher face first, whose own way up it may be
                face = owner[side]
                if corners[face, 0] == high and corners[face, 1] == low and owner[side + 1] != face:
                    climbs_to[face] = climbs_to[owner[side + 1]]
            for side in range(first, last):
                one, two = climbs_to[owner[side]], climbs_to[owner[side + 1]]
                root_one, root_two = find_root(highest, one), find_root(highest, two)
                if root_one != root_two:
                    if _is_lower(corners, root_two, root_one):
                        root_one, root_two, one, two = root_two, root_one, two, one
                    highest[root_one] = root_two
                    ended[n_ended, 0], ended[n_ended, 1] = root_one, high
                    ended[n_ended, 2], ended[n_ended, 3] = low, two
                    n_ended += 1
            first = last + 1
    return climbs_to, ended[:n_ended].copy()


@njit
@no_type_check
def _is_lower(corners, one, two):
    """Say whether a face comes before another by highest, middle, lowest vertex, then number."""
    for corner in range(3):
        if corners[one, corner] != corners[two, corner]:
            return corners[one, corner] < corners[two, corner]
    return one < two


@njit
@no_type_check
def _sort_sides(corners, lower, owner, first, end):
    """Sort the sides of a vertex by falling lower vertex, of equals the lower face first."""
    if end - first > FEW:
        _sort_many(corners, lower, owner, first, end)
        return
    for place in range(first + 1, end):
        low, face = lower[place], owner[place]
        into = place
        while into > first and (
            lower[into - 1] < low
            or (lower[into - 1] == low and _is_lower(corners, face, owner[into - 1]))
        ):
            lower[into], owner[into] = lower[into - 1], owner[into - 1]
            into -= 1
        lower[into], owner[into] = low, face


@njit
@no_type_check
def _sort_many(corners, lower, owner, first, end):
    # Sides come by number of their face, and of two faces at one edge that with the lower corners is lower: stable
    # sorts by sum of corners, then by falling lower vertex.
    count = end - first
    sums = np.empty(count, dtype=np.int64)
    for place in range(count):
        face = owner[first + place]
        sums[place] = np.int64(corners[face, 0]) + corners[face, 1] + corners[face, 2]
    order = np.argsort(sums, kind="mergesort")
    order = order[np.argsort(-lower[first:end][order], kind="mergesort")]
    lower[first:end] = lower[first:end][order]
    owner[first:end] = owner[first:end][order]
