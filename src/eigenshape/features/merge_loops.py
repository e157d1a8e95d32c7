"""Compiled loops of `merge_tree`: sort the sides of faces by edge, and join faces across them.

Here the number of a vertex is its rank; the lowest vertex is 0. Sides are grouped by the higher
vertex of their edge, so a loop over falling ranks visits the edges in falling order, and only the
few sides at one vertex must be sorted. The caller allocates all arrays: compiling an allocation
takes longer than compiling a small loop.
"""

import numpy as np

from eigenshape._compile import njit


@njit
def find_corners(faces, rank, corners):
    """Fill the ranks of each face's corners, highest first."""
    for face in range(len(faces)):
        a, b, c = rank[faces[face, 0]], rank[faces[face, 1]], rank[faces[face, 2]]
        if a < b:
            a, b = b, a
        if b < c:
            b, c = c, b
        if a < b:
            a, b = b, a
        corners[face, 0], corners[face, 1], corners[face, 2] = a, b, c


@njit
def file_sides(corners, place, lower, owner):
    """Group the three sides of each face by their higher vertex.

    Fills the lower vertex and the face of each side. The sides of vertex v begin at place[v], which
    is moved to their end.
    """
    for face in range(len(corners)):
        for side in range(3):
            high = 1 if side == 2 else 0
            low = 1 if side == 0 else 2
            vertex = corners[face, high]
            lower[place[vertex]] = corners[face, low]
            owner[place[vertex]] = face
            place[vertex] += 1


@njit
def join_faces(corners, starts, lower, owner, climbs_to, highest, ended):
    """Join faces across edges in falling order; return the number of basins that end.

    `climbs_to` is filled with the face to which each face climbs. For each basin that ends, `ended`
    is filled with the basin, the edge and the neighbor. On entry, `climbs_to` and `highest` hold
    the number of each face; `highest` is scratch.

    A face whose highest edge leads to a higher face joins its basin at once. Basins are joined as
    in Kruskal's algorithm: the one with the lower maximum ends.
    """
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
            ):  # the higher face first: this may be its own way up
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
    return n_ended


@njit
def _is_lower(corners, one, two):
    """Return whether a face precedes another by highest, middle and lowest vertex, then number."""
    for corner in range(3):
        if corners[one, corner] != corners[two, corner]:
            return corners[one, corner] < corners[two, corner]
    return one < two


@njit
def _sort_sides(corners, lower, owner, first, end):
    """Sort the sides of a vertex by falling lower vertex; equal ones by rising face.

    This is Shell sort with Knuth's gaps (1973): most vertices have six sides, but the apex of a fan
    may have a million.
    """
    gap = 1
    while 9 * gap < end - first:  # up to nine sides plain insertion is as fast
        gap = 3 * gap + 1
    while gap:
        for place in range(first + gap, end):
            low, face = lower[place], owner[place]
            into = place
            while into >= first + gap and (
                lower[into - gap] < low
                or (lower[into - gap] == low and _is_lower(corners, face, owner[into - gap]))
            ):
                lower[into], owner[into] = lower[into - gap], owner[into - gap]
                into -= gap
            lower[into], owner[into] = low, face
        gap //= 3


@njit
def join_points(starts, neighbors, order):
    """Add points in the given order, and join each to its neighbors that are already there.

    Returns the first point of each point's component and, for each component that was joined to an
    earlier one, its first point and the point that joined them.
    """
    n = len(order)
    place = np.empty(n, dtype=np.int64)
    place[order] = np.arange(n)
    root = np.arange(n)
    ended = np.empty((n, 2), dtype=np.int64)
    n_ended = 0
    for point in order:
        for entry in range(starts[point], starts[point + 1]):
            if place[neighbors[entry]] >= place[point]:
                continue
            one, two = find_root(root, point), find_root(root, neighbors[entry])
            if one == two:
                continue
            if place[one] < place[two]:
                one, two = two, one
            root[one] = two
            if one != point:
                ended[n_ended, 0], ended[n_ended, 1] = one, point
                n_ended += 1
    for point in order:
        root[point] = root[root[point]]
    return root, ended[:n_ended].copy()


@njit
def spanning_forest(ends, order, n):
    """Return, for each edge, whether it joins two components when edges are added in order."""
    root = np.arange(n)
    joins = np.zeros(len(ends), dtype=np.bool_)
    for edge in order:
        one, two = find_root(root, ends[edge, 0]), find_root(root, ends[edge, 1])
        if one != two:
            root[max(one, two)] = min(one, two)
            joins[edge] = True
    return joins


@njit
def find_root(root, point):
    """Return the root of a point's tree, with path halving (Tarjan and van Leeuwen 1984)."""
    while root[point] != point:
        root[point] = root[root[point]]
        point = root[point]
    return point
