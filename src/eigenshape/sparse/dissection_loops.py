"""Compiled loops of `dissection`: operations on one segment of a graph.

The points of a segment are those whose `owner` is its name. The caller allocates all arrays, also
scratch: compiling an allocation takes longer than compiling a small loop.
"""

import numpy as np

from eigenshape._compile import njit

LEAF = 160  # most points of a segment that is ordered by minimum degree
WORD = 63  # bits of an int64 in a set of neighbors, without its sign
SMOOTHINGS = 4  # smoothing passes over the keys: smooth keys have short cuts


@njit
def breadth_first(indptr, indices, root, owner, name, distance, queue):
    """Fill the distances from a root within a segment; return the number of points reached.

    `queue` is filled with these points by distance.
    """
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
def smooth_keys(indptr, indices, segment, owner, name, key, smoothed):
    """Smooth the keys within a segment, which shortens cuts; return the least and the largest.

    `smoothed` is scratch.
    """
    for _ in range(SMOOTHINGS):
        for i in range(len(segment)):
            node = segment[i]
            total = degree = 0
            for at in range(indptr[node], indptr[node + 1]):
                if owner[indices[at]] == name:
                    total += key[indices[at]]
                    degree += 1
            smoothed[node] = (key[node] + total // degree) // 2
        for i in range(len(segment)):
            key[segment[i]] = smoothed[segment[i]]
    low = high = key[segment[0]]
    for i in range(len(segment)):
        low, high = min(low, key[segment[i]]), max(high, key[segment[i]])
    return low, high


@njit
def count_cuts(indptr, indices, segment, owner, name, key, low, below, from_above, from_below):
    """Count the points below and on the cut at each value of the keys.

    `low` is the smallest key. The last three arrays come filled with 0 and have one entry for each
    value from `low` to the largest key plus 1. Their cumulative sums, which `cheapest_cut` takes, are
    the number of points below the value, and the number of points on the cut if it is taken from
    above or from below.

    Returns the number of entries of the adjacency matrix within the segment.
    """
    joined = 0
    for i in range(len(segment)):
        node = segment[i]
        least = most = key[node]
        for at in range(indptr[node], indptr[node + 1]):
            other = indices[at]
            if owner[other] == name:
                joined += 1
                least = min(least, key[other])
                most = max(most, key[other])
        below[key[node] - low + 1] += 1
        # The point is on the cut from above at values in (least, key], from below in (key, most].
        from_above[least - low + 1] += 1
        from_above[key[node] - low + 1] -= 1
        from_below[key[node] - low + 1] += 1
        from_below[most - low + 1] -= 1
    return joined


@njit
def cheapest_cut(size, below, from_above, from_below):
    """Return the place of the value at which a cut costs least, whether from above, and its cost.

    The cost is the points on the cut, and one more, over those on its smaller side, of `size` in
    all. The arrays are those of `count_cuts`.
    """
    place, above, lowest = 0, True, np.inf
    under = upper = lower = 0
    for i in range(len(below)):
        under += below[i]
        upper += from_above[i]
        lower += from_below[i]
        smaller = min(under, size - under)
        cost = (min(upper, lower) + 1) / max(smaller, 1)
        if smaller > 0 and cost < lowest:
            place, above, lowest = i, upper <= lower, cost
    return place, above, lowest


@njit
def take_sides(indptr, indices, segment, owner, name, key, level, above, side):
    """Fill the side of each point of a segment: 0 below the level, 1 above, 2 on the cut."""
    for i in range(len(segment)):
        node = segment[i]
        side[i] = key[node] >= level
        if (side[i] == 1) == above:
            for at in range(indptr[node], indptr[node + 1]):
                other = indices[at]
                if owner[other] == name and (key[other] < level) == above:
                    side[i] = 2


@njit
def order_leaf(indptr, indices, nodes, start, stop, owner, place, local, order, degree, bits):
    """Order a leaf by minimum degree, with its outer neighbors counted in the degrees.

    The segment is nodes[start:stop]. The elimination graph is a matrix of bits. The other arrays
    are scratch: `local` has an entry for each point of the graph, -1 on entry and on return;
    `order` and `degree` have LEAF entries; `bits` has a bit for each of LEAF rows and each point of
    the graph. No neighbor is listed twice.
    """
    count = stop - start
    for i in range(count):
        local[nodes[start + i]] = i
    total = count
    for i in range(start, stop):
        node = nodes[i]
        for at in range(indptr[node], indptr[node + 1]):
            if local[indices[at]] < 0:
                local[indices[at]] = total
                total += 1
    words = (total + WORD - 1) // WORD
    for i in range(count * words):
        bits[i] = 0
    for i in range(count):
        node = nodes[start + i]
        degree[i] = 0
        for at in range(indptr[node], indptr[node + 1]):
            j = local[indices[at]]
            if j != i:
                bits[i * words + j // WORD] |= 1 << (j % WORD)
                degree[i] += 1
    for i in range(start, stop):
        node = nodes[i]
        local[node] = -1
        for at in range(indptr[node], indptr[node + 1]):
            local[indices[at]] = -1
    for step in range(count):
        pivot = -1
        for i in range(count):
            if degree[i] >= 0 and (pivot < 0 or degree[i] < degree[pivot]):
                pivot = i
        order[step] = nodes[start + pivot]
        degree[pivot] = -1
        given = pivot * words
        for i in range(count):
            if degree[i] < 0 or not bits[given + i // WORD] >> (i % WORD) & 1:
                continue
            # Row i takes over the neighbors of the pivot, but neither the pivot nor itself.
            taken = i * words
            for word in range(words):
                bits[taken + word] |= bits[given + word]
            bits[taken + pivot // WORD] &= ~(1 << (pivot % WORD))
            bits[taken + i // WORD] &= ~(1 << (i % WORD))
            total = 0
            for word in range(words):
                # The bits of a word are added up in parallel: by 2, by 4, by 8, then all.
                x = bits[taken + word]
                x -= (x >> 1) & 0x5555555555555555
                x = (x & 0x3333333333333333) + ((x >> 2) & 0x3333333333333333)
                x = (x + (x >> 4)) & 0x0F0F0F0F0F0F0F0F
                total += (x * 0x0101010101010101) >> 56
            degree[i] = total
    for i in range(count):
        nodes[start + i] = order[i]
        place[order[i]] = start + i
        owner[order[i]] = -1
