"""Compiled loops of `geodesic`: a wave that leaves some vertices and crosses triangles laid flat."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit

FRONT = -1  # sender of a vertex that several sources reached as one straight front


@njit
@no_type_check
def through_edge(near, far, length, left, right):
    """Return the distance of a triangle's third corner from a source seen through the opposite edge, or infinity.

    `near` and `far` are the distances of the edge's ends; the source is laid flat beyond the edge. `left` and `right`
    are the third corner's distances from the same ends. Infinity where the straight line misses the edge.
    """
    if length == 0.0:  # both ends are one point, and the wave walks around it along the other edges
        return np.inf
    x = (near * near - far * far + length * length) / (2 * length)
    y = np.sqrt(max(near * near - x * x, 0.0))
    corner_x = (left * left - right * right + length * length) / (2 * length)
    corner_y = np.sqrt(max(left * left - corner_x * corner_x, 0.0))
    depth = y + corner_y
    if depth == 0.0:
        return np.inf
    crossing = x + (corner_x - x) * y / depth
    if crossing < 0.0 or crossing > length:
        return np.inf
    return np.hypot(corner_x - x, depth)


@njit
@no_type_check
def across_edge(near, far, length, left, right):
    """Return the same where no point sends the wave: its front is straight (Kimmel and Sethian 1998).

    So it is before an edge whose ends are both sources, which is one all along.
    """
    if length == 0.0:
        return np.inf
    climb = (far - near) / length
    corner_x = (left * left - right * right + length * length) / (2 * length)
    corner_y = np.sqrt(max(left * left - corner_x * corner_x, 0.0))
    steep = np.sqrt(max(1.0 - climb * climb, 0.0))
    if steep == 0.0:
        return np.inf
    crossing = corner_x - corner_y * climb / steep
    if crossing < 0.0 or crossing > length:
        return np.inf
    return near + climb * corner_x + steep * corner_y


@njit
@no_type_check
def balls(starts, first_corner, second_corner, sides, radius, sources, begins):
    """Return for each set of sources how many vertices lie within `radius`, which, and how far from the nearest.

    Set i is sources[begins[i]:begins[i+1]].
    Entry k of `starts[v]` to `starts[v + 1]` is a triangle at vertex v with its other two corners; `sides[k]` are the
    lengths from v to each of them, and between them.
    """
    n = len(starts) - 1
    distance = np.full(n, np.inf)
    sender = np.empty(
        n, dtype=np.int64
    )  # the source that a vertex was reached from; FRONT where several sent the wave
    settled = np.zeros(n, dtype=np.bool_)
    counts = np.zeros(len(begins) - 1, dtype=np.int64)
    columns, values = np.empty(1024, dtype=np.int64), np.empty(1024)
    heap_keys, heap_ids = np.empty(1024), np.empty(1024, dtype=np.int64)
    touched = np.empty(n, dtype=np.int64)
    total = 0
    for number in range(len(begins) - 1):
        before = total
        n_touched = 0
        if begins[number + 1] - begins[number] > len(heap_keys):
            heap_keys = np.empty(begins[number + 1] - begins[number])
            heap_ids = np.empty(len(heap_keys), dtype=np.int64)
        for source in sources[begins[number] : begins[number + 1]]:
            distance[source] = 0.0
            sender[source] = source
            heap_keys[n_touched], heap_ids[n_touched] = 0.0, source
            touched[n_touched] = source
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
            if total == len(columns):
                columns, values = (
                    np.append(columns, np.empty_like(columns)),
                    np.append(values, np.empty_like(values)),
                )
            columns[total], values[total] = vertex, key
            total += 1
            for entry in range(starts[vertex], starts[vertex + 1]):
                if height + 2 > len(heap_keys):
                    heap_keys = np.append(heap_keys, np.empty_like(heap_keys))
                    heap_ids = np.append(heap_ids, np.empty_like(heap_ids))
                for turn in range(2):
                    corner, other = first_corner[entry], second_corner[entry]
                    to_corner, to_other = sides[entry, 0], sides[entry, 1]
                    if turn:
                        corner, other, to_corner, to_other = other, corner, to_other, to_corner
                    if settled[corner]:
                        continue
                    reached, origin = key + to_corner, sender[vertex]
                    if settled[other]:
                        if origin == sender[other] and origin != FRONT:
                            flat = through_edge(
                                key, distance[other], to_other, to_corner, sides[entry, 2]
                            )
                        else:
                            flat = across_edge(
                                key, distance[other], to_other, to_corner, sides[entry, 2]
                            )
                            origin = FRONT if flat < reached else origin
                        reached = min(reached, flat)
                    if reached < distance[corner]:
                        if distance[corner] == np.inf:
                            touched[n_touched] = corner
                            n_touched += 1
                        distance[corner], sender[corner] = reached, origin
                        _rise(heap_keys, heap_ids, height, reached, corner)
                        height += 1
        counts[number] = total - before
        for place in range(n_touched):
            distance[touched[place]] = np.inf
            settled[touched[place]] = False
    return counts, columns[:total].copy(), values[:total].copy()


@njit
@no_type_check
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
@no_type_check
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
