"""Compiled loops of `elimination`: nested dissection of a graph, minimum degree at its leaves."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit

LEAF = 160  # points that minimum degree orders
WORD = 64
FINE = 64  # parts of an edge
SMOOTHINGS = 4


@njit
@no_type_check
def dissect(indptr, indices):
    """Return the points of a graph, separators after what they separate (George 1973).

    Two points far from each other are found, and every point is told by how much nearer it is to one than to the
    other, in edges; of all cuts at a value of that difference the shortest for its smaller side is taken.
    """
    n = len(indptr) - 1
    nodes = np.arange(n)
    place = np.arange(n)  # nodes[place[v]] = v
    owner = np.zeros(
        n, dtype=np.int64
    )  # the segment that a point lies in; -1 when its place is final
    one, two = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    queue, key = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    side = np.empty(n, dtype=np.int8)
    starts, stops, whole = [0], [n], [False]
    name = 0
    while starts:
        start, stop, connected = starts.pop(), stops.pop(), whole.pop()
        name += 1
        for i in range(start, stop):
            owner[nodes[i]] = name
        if stop - start <= LEAF:
            _eliminate(indptr, indices, nodes, start, stop, owner, place)
            continue
        if not connected:
            pieces = _pieces(indptr, indices, nodes, start, stop, owner, name, place, one, queue)
            for i in range(len(pieces) - 1):
                starts.append(pieces[i])
                stops.append(pieces[i + 1])
                whole.append(True)
            name += len(pieces) - 1
            continue
        reached = _breadth_first(indptr, indices, nodes[start], owner, name, one, queue)
        far = queue[reached - 1]
        _breadth_first(indptr, indices, far, owner, name, one, queue)
        far = queue[reached - 1]
        _breadth_first(indptr, indices, far, owner, name, two, queue)
        _tell_apart(indptr, indices, nodes, start, stop, owner, name, one, two, key)
        level, above = _cheapest_cut(indptr, indices, nodes, start, stop, owner, name, key)
        n_first, n_cut = _take_sides(
            indptr, indices, nodes, start, stop, owner, name, key, level, above, side
        )
        parted = n_first > 0 and n_first + n_cut < stop - start
        full = not parted and _half_full(indptr, indices, nodes, start, stop, owner, name)
        if (
            n_cut == stop - start or n_cut == 0 or full
        ):  # a clique or nearly, or nothing left to cut
            for i in range(start, stop):
                owner[nodes[i]] = -1
            continue
        ends = np.array([start, start + n_first, stop - n_cut])
        for i in range(start, stop):
            queue[i - start] = nodes[i]
        for i in range(stop - start):
            node = queue[i]
            at = ends[side[node]]
            ends[side[node]] += 1
            nodes[at], place[node] = node, at
            if side[node] == 2:
                owner[node] = -1
        if n_first:
            starts.append(start)
            stops.append(start + n_first)
            whole.append(False)
        if start + n_first < stop - n_cut:
            starts.append(start + n_first)
            stops.append(stop - n_cut)
            whole.append(False)
    return nodes


@njit
@no_type_check
def _pieces(indptr, indices, nodes, start, stop, owner, name, place, distance, queue):
    """Put the connected pieces of a segment one after the other, named name + 1 on, and return where each begins."""
    begins = [start]
    total = 0
    for i in range(start, stop):
        if owner[nodes[i]] == name:
            found = _breadth_first(indptr, indices, nodes[i], owner, name, distance, queue[total:])
            for j in range(total, total + found):
                owner[queue[j]] = name + len(begins)
            total += found
            begins.append(start + total)
    for i in range(total):
        nodes[start + i], place[queue[i]] = queue[i], start + i
    return begins


@njit
@no_type_check
def _tell_apart(indptr, indices, nodes, start, stop, owner, name, one, two, key):
    """Fill `key` with the difference of two distances, smoothed: a ragged cut is a long one. The first is used up."""
    for i in range(start, stop):
        key[nodes[i]] = FINE * (one[nodes[i]] - two[nodes[i]])
    for _ in range(SMOOTHINGS):
        for i in range(start, stop):
            node = nodes[i]
            total, degree = 0, 0
            for at in range(indptr[node], indptr[node + 1]):
                if owner[indices[at]] == name:
                    total += key[indices[at]]
                    degree += 1
            one[node] = (key[node] + total // degree) // 2
        for i in range(start, stop):
            key[nodes[i]] = one[nodes[i]]


@njit
@no_type_check
def _take_sides(indptr, indices, nodes, start, stop, owner, name, key, level, above, side):
    """Fill `side` with 0 below the level, 1 above, 2 on the cut; return how many are 0, and how many 2."""
    n_first = n_cut = 0
    for i in range(start, stop):
        node = nodes[i]
        side[node] = 0 if key[node] < level else 1
        if (side[node] == 1) == above:
            for at in range(indptr[node], indptr[node + 1]):
                other = indices[at]
                if owner[other] == name and (key[other] < level) == above:
                    side[node] = 2
                    break
        if side[node] == 2:
            n_cut += 1
        elif side[node] == 0:
            n_first += 1
    return n_first, n_cut


@njit
@no_type_check
def _half_full(indptr, indices, nodes, start, stop, owner, name):
    """Say whether half of all pairs of a segment are joined: no order saves much, and one point a cut takes long."""
    joined = 0
    for i in range(start, stop):
        for at in range(indptr[nodes[i]], indptr[nodes[i] + 1]):
            if owner[indices[at]] == name:
                joined += 1
    return 2 * joined >= (stop - start) ** 2


@njit
@no_type_check
def _breadth_first(indptr, indices, root, owner, name, distance, queue):
    """Fill `distance` from the root within a segment, `queue` with its points by distance; return how many."""
    owner[root] = -name  # visited
    distance[root] = 0
    queue[0] = root
    head, tail = 0, 1
    while head < tail:
        node = queue[head]
        head += 1
        for at in range(indptr[node], indptr[node + 1]):
            other = indices[at]
            if owner[other] == name:
                owner[other] = -name
                distance[other] = distance[node] + 1
                queue[tail] = other
                tail += 1
    for i in range(tail):
        owner[queue[i]] = name
    return tail


@njit
@no_type_check
def _cheapest_cut(indptr, indices, nodes, start, stop, owner, name, key):
    """Return the value to cut at, and whether the cut is taken from above it: key < value | key ≥ value."""
    low = high = key[nodes[start]]
    for i in range(start, stop):
        low, high = min(low, key[nodes[i]]), max(high, key[nodes[i]])
    width = high - low + 2
    below, from_above, from_below = np.zeros(width), np.zeros(width), np.zeros(width)
    for i in range(start, stop):
        node = nodes[i]
        least = most = key[node]
        for at in range(indptr[node], indptr[node + 1]):
            other = indices[at]
            if owner[other] == name:
                least, most = min(least, key[other]), max(most, key[other])
        below[key[node] - low + 1] += 1
        # On the cut from above at values in (least, key], from below at values in (key, most].
        from_above[least - low + 1] += 1
        from_above[key[node] - low + 1] -= 1
        from_below[key[node] - low + 1] += 1
        from_below[most - low + 1] -= 1
    size = stop - start
    best, level, above, first, cut_a, cut_b = np.inf, low + 1, True, 0.0, 0.0, 0.0
    for value in range(width):
        first += below[value]
        cut_a += from_above[value]
        cut_b += from_below[value]
        smaller = min(first, size - first)
        for cut, way in ((cut_a, True), (cut_b, False)):
            cost = (cut + 1) / max(smaller, 1)
            if smaller > 0 and cost < best:
                best, level, above = cost, low + value, way
    return level, above


@njit
@no_type_check
def _eliminate(indptr, indices, nodes, start, stop, owner, place):
    """Order a leaf by minimum degree, its neighbours outside counted, its elimination graph in bits."""
    count = stop - start
    local = {nodes[start]: 0}
    for i in range(start, stop):
        local[nodes[i]] = i - start
    for i in range(start, stop):
        node = nodes[i]
        for at in range(indptr[node], indptr[node + 1]):
            if indices[at] not in local:
                local[indices[at]] = len(local)
    total = len(local)
    words = (total + WORD - 1) // WORD
    bits = np.zeros((count, words), dtype=np.uint64)
    for i in range(count):
        node = nodes[start + i]
        for at in range(indptr[node], indptr[node + 1]):
            j = local[indices[at]]
            if j != i:
                bits[i, j // WORD] |= np.uint64(1) << np.uint64(j % WORD)
    degree = np.empty(count, dtype=np.int64)
    for i in range(count):
        degree[i] = _ones(bits[i])
    order = np.empty(count, dtype=np.int64)
    for step in range(count):
        pivot = -1
        for i in range(count):
            if degree[i] >= 0 and (pivot < 0 or degree[i] < degree[pivot]):
                pivot = i
        order[step] = nodes[start + pivot]
        degree[pivot] = -1
        clear = ~(np.uint64(1) << np.uint64(pivot % WORD))
        for i in range(count):
            if degree[i] >= 0 and (bits[pivot, i // WORD] >> np.uint64(i % WORD)) & np.uint64(1):
                for word in range(words):
                    bits[i, word] |= bits[pivot, word]
                bits[i, pivot // WORD] &= clear
                bits[i, i // WORD] &= ~(np.uint64(1) << np.uint64(i % WORD))
                degree[i] = _ones(bits[i])
    for i in range(count):
        nodes[start + i], place[order[i]] = order[i], start + i
        owner[order[i]] = -1


@njit
@no_type_check
def _ones(words):
    total = 0
    for word in words:
        x = word
        x = x - ((x >> np.uint64(1)) & np.uint64(0x5555555555555555))
        x = (x & np.uint64(0x3333333333333333)) + (
            (x >> np.uint64(2)) & np.uint64(0x3333333333333333)
        )
        x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
        total += np.int64((x * np.uint64(0x0101010101010101)) >> np.uint64(56))
    return total
