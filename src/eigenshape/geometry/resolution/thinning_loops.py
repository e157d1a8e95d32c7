"""The compiled loops of `thinning`: edges that collapse into one of their ends.

A corner is a number 3f + i, for corner i of face f. The corners at a vertex v form a list: `heads[v]`,
`links` of that, and so on to -1. A face that has collapsed has `alive` False; its corners stay in
the lists until these are joined.
"""

import numpy as np

from eigenshape._compile import njit

LEAST_HEIGHT = 0.03  # of a face above its longest side, as a share of that; less is a sliver
FREE, RIM, FIXED = 0, 1, 2  # kinds of vertices: FIXED ones never move


@njit
def collapse_short_edges(points, faces, alive, heads, links, kinds, marks, limits):
    """Collapse edges shorter than a limit, vertex by vertex, and return how many did.

    Each vertex moves into the nearest neighbor into which it may. `heads` of a vertex that is gone
    is -1. `marks` is scratch, two numbers for each vertex; `marks[-1, 0]` is the last number that
    was used as a mark. `limits` are the length, the most neighbors of a vertex, and the least
    cosine between the normals of a face before and after.
    """
    length, most_neighbors, least_cosine = limits
    count = 0
    for vertex in range(len(heads)):
        if heads[vertex] < 0 or kinds[vertex] == FIXED:
            continue
        tried = -1.0
        while True:
            # The nearest neighbor that is farther than the last one that was tried.
            nearest, best = -1, length * length
            corner = heads[vertex]
            while corner >= 0:
                if alive[corner // 3]:
                    for turn in range(1, 3):
                        other = faces[corner // 3, (corner + turn) % 3]
                        square = _square(points, vertex, other)
                        if tried < square < best:
                            nearest, best = other, square
                corner = links[corner]
            if nearest < 0:
                break
            if _may_collapse(
                points,
                faces,
                alive,
                heads,
                links,
                kinds,
                marks,
                vertex,
                nearest,
                most_neighbors,
                least_cosine,
            ):
                _join(faces, alive, heads, links, vertex, nearest)
                count += 1
                break
            tried = best
    return count


@njit
def _square(points, one, two):
    x = points[one, 0] - points[two, 0]
    y = points[one, 1] - points[two, 1]
    z = points[one, 2] - points[two, 2]
    return x * x + y * y + z * z


@njit
def _may_collapse(
    points, faces, alive, heads, links, kinds, marks, gone, kept, most_neighbors, least_cosine
):
    """Tell whether a vertex may move into a neighbor: the surface must keep its topology.

    The link condition (Dey, Edelsbrunner, Guha and Nekhayev 1999): both have exactly the vertices
    opposite to their edge as common neighbors, and no face would occur twice.
    """
    mark = marks[-1, 0] + 1
    marks[-1, 0] = mark
    n_kept = 0
    corner = heads[kept]
    while corner >= 0:
        if alive[corner // 3]:
            for turn in range(1, 3):
                other = faces[corner // 3, (corner + turn) % 3]
                if marks[other, 0] != mark:
                    marks[other, 0] = mark
                    n_kept += 1
        corner = links[corner]

    n_shared = n_common = n_gone = 0
    corner = heads[gone]
    while corner >= 0:
        if alive[corner // 3]:
            one, two = faces[corner // 3, (corner + 1) % 3], faces[corner // 3, (corner + 2) % 3]
            if kept in (one, two):
                n_shared += 1
            elif marks[one, 0] == mark and marks[two, 0] == mark:
                return False  # this face would lie on another one
            elif not _keeps_normal(points, gone, kept, one, two, least_cosine):
                return False
            for turn in range(2):
                other = one if turn == 0 else two
                if other != kept and marks[other, 1] != mark:
                    marks[other, 1] = mark
                    n_gone += 1
                    if marks[other, 0] == mark:
                        n_common += 1
        corner = links[corner]
    if n_common != n_shared or n_kept + n_gone - 1 - n_common > most_neighbors:
        return False
    if kinds[gone] == RIM:
        return n_shared == 1 and kinds[kept] != FREE
    return n_shared == 2


@njit
def _keeps_normal(points, gone, kept, one, two, least_cosine):
    """Tell whether a face is no sliver and faces nearly the same way when its corner has moved."""
    before = _normal(points, gone, one, two)
    after = _normal(points, kept, one, two)
    longest = max(_square(points, kept, one), _square(points, kept, two), _square(points, one, two))
    # The length of a normal is the longest side times the height above it.
    if np.sqrt(_dot(after, after)) < LEAST_HEIGHT * longest:
        return False
    sizes = np.sqrt(_dot(before, before) * _dot(after, after))
    return _dot(before, after) >= least_cosine * sizes


@njit
def _normal(points, a, b, c):
    ux, uy, uz = (
        points[b, 0] - points[a, 0],
        points[b, 1] - points[a, 1],
        points[b, 2] - points[a, 2],
    )
    vx, vy, vz = (
        points[c, 0] - points[a, 0],
        points[c, 1] - points[a, 1],
        points[c, 2] - points[a, 2],
    )
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit
def _dot(one, two):
    return one[0] * two[0] + one[1] * two[1] + one[2] * two[2]


@njit
def _join(faces, alive, heads, links, gone, kept):
    """Give the corners of one vertex to another, and remove the faces that have both."""
    corner = heads[gone]
    while corner >= 0:
        face = corner // 3
        if alive[face]:
            if faces[face, 0] == kept or faces[face, 1] == kept or faces[face, 2] == kept:
                alive[face] = False
            else:
                faces[face, corner % 3] = kept
        corner = links[corner]
    # Link what is alive of both lists anew.
    first = -1
    for turn in range(2):
        corner = heads[gone] if turn == 0 else heads[kept]
        while corner >= 0:
            after = links[corner]
            if alive[corner // 3]:
                links[corner] = first
                first = corner
            corner = after
    heads[kept], heads[gone] = first, -1


@njit
def link_corners(faces, heads, links):
    """Fill the lists of corners; `heads` is -1 on entry."""
    for corner in range(3 * len(faces) - 1, -1, -1):
        vertex = faces[corner // 3, corner % 3]
        links[corner] = heads[vertex]
        heads[vertex] = corner
