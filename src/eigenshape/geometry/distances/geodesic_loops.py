"""Compiled loops of `geodesic`: a wave that starts at some vertices and crosses unfolded triangles.

The caller allocates all arrays: compiling an allocation takes longer than compiling a small loop.
"""

import numpy as np

from eigenshape._compile import njit

FRONT = -1  # stands for the source of a vertex that a straight front of several sources reached


@njit
def through_edge(near, far, length, corner_x, corner_y):
    """Return the distance of a triangle's third corner from a source beyond the opposite edge.

    `near` and `far` are the distances of the edge's ends from the source, which is unfolded into
    the plane of the triangle. The third corner is at `corner_x` along the edge, from the near end,
    and `corner_y` away from it. The distance is infinite if the straight line misses the edge.
    """
    if length == 0.0:  # both ends are one point, and the wave walks around it along the other edges
        return np.inf
    x = (near * near - far * far + length * length) / (2 * length)
    y = np.sqrt(max(near * near - x * x, 0.0))
    depth = y + corner_y
    if depth == 0.0:
        return np.inf
    crossing = x + (corner_x - x) * y / depth
    if crossing < 0.0 or crossing > length:
        return np.inf
    return np.hypot(corner_x - x, depth)


@njit
def across_edge(near, far, length, corner_x, corner_y):
    """Return the distance of the third corner from a straight front (Kimmel and Sethian 1998).

    The arguments are those of `through_edge`. A front is straight if both ends of the edge are
    sources, because then the whole edge is one.
    """
    if length == 0.0:
        return np.inf
    climb = (far - near) / length
    steep = np.sqrt(max(1.0 - climb * climb, 0.0))
    if steep == 0.0:
        return np.inf
    crossing = corner_x - corner_y * climb / steep
    if crossing < 0.0 or crossing > length:
        return np.inf
    return near + climb * corner_x + steep * corner_y


@njit
def spread_wave(fans, radius, sources, scratch, reached, distances):
    """Fill the vertices within `radius` of some sources and their distances; return their number.

    `fans` holds `starts`, `first_corner`, `second_corner` and `sides`. Entries starts[v] to
    starts[v + 1] are the triangles at vertex v: their other two corners, and seven lengths: from v
    to each of these, between them, and the place of either as `through_edge` takes it, in
    coordinates along the edge from v to the other one and away from it.

    `scratch` holds, for each vertex: its distance (infinite on entry and on return), whether it is
    settled (False on entry and on return), its source, and a list of the vertices that were
    touched. It also holds the keys and vertices of the heap, which has one entry for each corner of
    a triangle and each source, since a triangle sends at most three waves.
    """
    starts, first_corner, second_corner, sides = fans
    # The sender is the source from which a vertex was reached, or FRONT if there were several.
    distance, settled, sender, touched, heap_keys, heap_ids = scratch
    n_touched = n_reached = 0
    for i in range(len(sources)):
        source = sources[i]
        distance[source] = 0.0
        sender[source] = source
        touched[i] = source
        heap_keys[i] = 0.0
        heap_ids[i] = source
        n_touched += 1
    height = n_touched
    while height:
        key, vertex = heap_keys[0], heap_ids[0]
        height -= 1
        _sink(heap_keys, heap_ids, height)
        if settled[vertex]:
            continue
        if key > radius:
            break
        settled[vertex] = True
        reached[n_reached] = vertex
        distances[n_reached] = key
        n_reached += 1
        for entry in range(starts[vertex], starts[vertex + 1]):
            corner, other = first_corner[entry], second_corner[entry]
            to_corner, to_other = sides[entry, 0], sides[entry, 1]
            x, y, other_x, other_y = (
                sides[entry, 3],
                sides[entry, 4],
                sides[entry, 5],
                sides[entry, 6],
            )
            for _ in range(2):
                if not settled[corner]:
                    arrival, origin = key + to_corner, sender[vertex]
                    if settled[other]:
                        far = distance[other]
                        if origin == sender[other] and origin != FRONT:
                            flat = through_edge(key, far, to_other, x, y)
                        else:
                            flat = across_edge(key, far, to_other, x, y)
                            if flat < arrival:
                                origin = FRONT
                        arrival = min(arrival, flat)
                    if arrival < distance[corner]:
                        if distance[corner] == np.inf:
                            touched[n_touched] = corner
                            n_touched += 1
                        distance[corner] = arrival
                        sender[corner] = origin
                        _rise(heap_keys, heap_ids, height, arrival, corner)
                        height += 1
                # The second turn is about the other corner.
                corner, other = other, corner
                to_corner, to_other = to_other, to_corner
                x, y, other_x, other_y = other_x, other_y, x, y
    for i in range(n_touched):
        distance[touched[i]] = np.inf
        settled[touched[i]] = False
    return n_reached


@njit
def spread_waves(fans, radius, sources, scratch, counts, reached, distances):
    """Spread one wave from each source, and return for how many sources there was room.

    Wave i fills the next counts[i] entries of `reached` and `distances`. It begins only if a wave
    over all vertices would fit there. The other arguments are those of `spread_wave`.
    """
    total, n = 0, len(fans[0]) - 1
    for i in range(len(sources)):
        if total + n > len(reached):
            return i
        counts[i] = spread_wave(
            fans, radius, sources[i : i + 1], scratch, reached[total:], distances[total:]
        )
        total += counts[i]
    return len(sources)


@njit
def _rise(keys, ids, height, key, vertex):
    place = height
    while place:
        above = (place - 1) // 2
        if keys[above] <= key:
            break
        keys[place], ids[place] = keys[above], ids[above]
        place = above
    keys[place], ids[place] = key, vertex


@njit
def _sink(keys, ids, height):
    key, vertex = keys[height], ids[height]
    place = 0
    while True:
        below = 2 * place + 1
        if below >= height:
            break
        if below + 1 < height and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[place], ids[place] = keys[below], ids[below]
        place = below
    keys[place], ids[place] = key, vertex
