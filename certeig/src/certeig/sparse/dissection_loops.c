/* Loops of `dissection`: operations on one segment of a graph, whose points have its name as owner. */
#include "kernels.h"

enum {
    WORD = 63,      /* bits of a word in a set of neighbors */
    SMOOTHINGS = 4, /* smoothing passes over the keys: smooth keys have short cuts */
};

KERNEL int64_t breadth_first(const int64_t *indptr, const int64_t *indices, int64_t root,
                             int64_t *owner, int64_t name, int64_t *distance, int64_t *queue) {
    int64_t head = 0, tail = 0;
    owner[root] = -name; /* visited */
    distance[root] = 0;
    queue[tail++] = root;
    while (head < tail) {
        int64_t node = queue[head++];
        for (int64_t at = indptr[node]; at < indptr[node + 1]; at++) {
            int64_t other = indices[at];
            if (owner[other] != name) continue;
            owner[other] = -name;
            distance[other] = distance[node] + 1;
            queue[tail++] = other;
        }
    }
    for (int64_t i = 0; i < tail; i++) owner[queue[i]] = name;
    return tail;
}

struct range {
    int64_t low, high;
};

/* The mean of a point's key and the mean key of its neighbors within the segment. */
static int64_t smooth_key(const int64_t *indptr, const int64_t *indices, const int64_t *owner,
                          int64_t name, const int64_t *key, int64_t node) {
    int64_t total = 0, degree = 0;
    for (int64_t at = indptr[node]; at < indptr[node + 1]; at++) {
        if (owner[indices[at]] != name) continue;
        total += key[indices[at]];
        degree++;
    }
    int64_t beside = degree ? floor_divide(total, degree) : key[node];
    return floor_divide(key[node] + beside, 2);
}

KERNEL struct range smooth_keys(const int64_t *indptr, const int64_t *indices,
                                const int64_t *segment, const int64_t *owner, int64_t name,
                                int64_t *key, int64_t *smoothed, int64_t size) {
    for (int pass = 0; pass < SMOOTHINGS; pass++) {
        for (int64_t i = 0; i < size; i++)
            smoothed[segment[i]] = smooth_key(indptr, indices, owner, name, key, segment[i]);
        for (int64_t i = 0; i < size; i++) key[segment[i]] = smoothed[segment[i]];
    }
    struct range found = {key[segment[0]], key[segment[0]]};
    for (int64_t i = 0; i < size; i++) {
        found.low = lesser(found.low, key[segment[i]]);
        found.high = greater(found.high, key[segment[i]]);
    }
    return found;
}

KERNEL int64_t count_cuts(const int64_t *indptr, const int64_t *indices, const int64_t *segment,
                          const int64_t *owner, int64_t name, const int64_t *key, int64_t low,
                          int64_t *below, int64_t *from_above, int64_t *from_below, int64_t size) {
    int64_t joined = 0;
    for (int64_t i = 0; i < size; i++) {
        int64_t node = segment[i], least = key[node], most = key[node];
        for (int64_t at = indptr[node]; at < indptr[node + 1]; at++) {
            int64_t other = indices[at];
            if (owner[other] != name) continue;
            joined++;
            least = lesser(least, key[other]);
            most = greater(most, key[other]);
        }
        int64_t after = key[node] - low + 1;
        below[after]++;
        /* The point is on the cut from above at values in (least, key], from below in (key, most]. */
        from_above[least - low + 1]++;
        from_above[after]--;
        from_below[after]++;
        from_below[most - low + 1]--;
    }
    return joined;
}

struct cut {
    int64_t place;
    bool above;
    double cost;
};

KERNEL struct cut cheapest_cut(int64_t size, const int64_t *below, const int64_t *from_above,
                               const int64_t *from_below, int64_t count) {
    struct cut best = {0, true, INFINITE};
    int64_t under = 0, upper = 0, lower = 0;
    for (int64_t i = 0; i < count; i++) {
        under += below[i];
        upper += from_above[i];
        lower += from_below[i];
        int64_t smaller = lesser(under, size - under);
        double cost = (double)(lesser(upper, lower) + 1) / (double)greater(smaller, 1);
        if (smaller > 0 && cost < best.cost) best = (struct cut){i, upper <= lower, cost};
    }
    return best;
}

KERNEL void take_sides(const int64_t *indptr, const int64_t *indices, const int64_t *segment,
                       const int64_t *owner, int64_t name, const int64_t *key, int64_t level,
                       bool above, int8_t *side, int64_t size) {
    for (int64_t i = 0; i < size; i++) {
        int64_t node = segment[i];
        side[i] = key[node] >= level;
        if ((side[i] == 1) != above) continue;
        for (int64_t at = indptr[node]; at < indptr[node + 1]; at++) {
            int64_t other = indices[at];
            if (owner[other] == name && (key[other] < level) == above) side[i] = 2;
        }
    }
}

enum { SIDES = 3, CUT = 2, NARROWINGS = 4 };

struct pairing {
    const int64_t *indptr, *indices, *owner, *sides;
    int64_t name, near;
    int64_t *partner, *via, *queue;
};

/* Take the points beside the given one on the near side that were not reached before; return whether
   any was. A reached point without a partner ends the search. */
static bool reach(const struct pairing *it, int64_t row, int64_t *tail, int64_t *free) {
    bool found = false;
    for (int64_t at = it->indptr[row]; at < it->indptr[row + 1] && *free < 0; at++) {
        int64_t other = it->indices[at];
        if (it->owner[other] != it->name || it->sides[other] != it->near) continue;
        found = true;
        if (it->via[other] >= 0) continue;
        it->via[other] = row;
        it->queue[(*tail)++] = other;
        if (it->partner[other] < 0) *free = other;
    }
    return found;
}

/* Find a partner on the near side for a point of the cut, by a path that changes partners (Kuhn). What
   is reached in vain keeps its mark: no later path leads through it. Return whether the point has a
   neighbor on that side. */
static bool pair_up(const struct pairing *it, int64_t root) {
    int64_t tail = 0, free = -1;
    bool joined = reach(it, root, &tail, &free);
    for (int64_t head = 0; head < tail && free < 0; head++)
        reach(it, it->partner[it->queue[head]], &tail, &free);
    if (free < 0) {
        it->via[root] = root;
        for (int64_t i = 0; i < tail; i++) it->via[it->partner[it->queue[i]]] = root;
        return joined;
    }
    while (free >= 0) {
        int64_t row = it->via[free], before = it->partner[row];
        it->partner[free] = row;
        it->partner[row] = free;
        free = row == root ? -1 : before;
    }
    for (int64_t i = 0; i < tail; i++) it->via[it->queue[i]] = -1;
    return true;
}

static double cost_of_cut(const int64_t *counts) {
    int64_t smaller = lesser(counts[0], counts[1]);
    return smaller ? (double)(counts[CUT] + 1) / (double)smaller : INFINITE;
}

KERNEL void narrow_cut(const int64_t *indptr, const int64_t *indices, const int64_t *segment,
                       const int64_t *owner, int64_t name, int64_t *sides, int64_t *partner,
                       int64_t *via, int64_t *queue, int8_t *side, int64_t size) {
    int64_t counts[SIDES] = {0};
    for (int64_t i = 0; i < size; i++) counts[sides[segment[i]] = side[i]]++;
    for (int64_t pass = 0; pass < NARROWINGS; pass++) {
        int64_t near = pass % 2;
        struct pairing it = {indptr, indices, owner, sides, name, near, partner, via, queue};
        for (int64_t i = 0; i < size; i++) partner[segment[i]] = via[segment[i]] = -1;
        bool joined = false;
        for (int64_t i = 0; i < size; i++)
            if (sides[segment[i]] == CUT) joined |= pair_up(&it, segment[i]);
        if (!joined) continue;
        /* Marked points of the cut go to the opposite side, and marked ones beside it to the cut. */
        int64_t after[SIDES] = {0}, goes_to[SIDES];
        goes_to[near] = CUT;
        goes_to[CUT] = 1 - near;
        for (int64_t i = 0; i < size; i++) {
            int64_t now = sides[segment[i]];
            after[via[segment[i]] >= 0 ? goes_to[now] : now]++;
        }
        if (cost_of_cut(after) >= cost_of_cut(counts)) continue;
        for (int64_t i = 0; i < SIDES; i++) counts[i] = after[i];
        for (int64_t i = 0; i < size; i++) {
            int64_t *now = sides + segment[i];
            if (via[segment[i]] >= 0) *now = goes_to[*now];
        }
    }
    for (int64_t i = 0; i < size; i++) side[i] = (int8_t)sides[segment[i]];
}

/* Sets of neighbors: WORD bits a word. Literals of 64 bits, since 1 << 40 of an int is another set. */
static inline bool has(const int64_t *set, int64_t i) { return set[i / WORD] >> (i % WORD) & 1; }
static inline void include(int64_t *set, int64_t i) { set[i / WORD] |= INT64_C(1) << (i % WORD); }
static inline void exclude(int64_t *set, int64_t i) {
    set[i / WORD] &= ~(INT64_C(1) << (i % WORD));
}

/* Unite two sets, and return how many are in both together without two points. */
static int64_t unite(int64_t *set, const int64_t *others, int64_t words, int64_t one, int64_t two) {
    for (int64_t word = 0; word < words; word++) set[word] |= others[word];
    exclude(set, one);
    exclude(set, two);
    int64_t total = 0;
    for (int64_t word = 0; word < words; word++) total += __builtin_popcountll((uint64_t)set[word]);
    return total;
}

/* The point of least degree, the first of several; degrees are -1 where a point is eliminated. */
static int64_t find_pivot(const int64_t *degree, int64_t count) {
    int64_t pivot = -1;
    for (int64_t i = 0; i < count; i++)
        if (degree[i] >= 0 && (pivot < 0 || degree[i] < degree[pivot])) pivot = i;
    return pivot;
}

KERNEL void order_leaf(const int64_t *indptr, const int64_t *indices, int64_t *nodes, int64_t start,
                       int64_t stop, int64_t *owner, int64_t *place, int64_t *local, int64_t *order,
                       int64_t *degree, int64_t *bits) {
    /* Number the points of the leaf, then their outer neighbors. */
    int64_t *leaf = nodes + start, count = stop - start, total = count;
    for (int64_t i = 0; i < count; i++) local[leaf[i]] = i;
    for (int64_t i = 0; i < count; i++)
        for (int64_t at = indptr[leaf[i]]; at < indptr[leaf[i] + 1]; at++)
            if (local[indices[at]] < 0) local[indices[at]] = total++;
    int64_t words = (total + WORD - 1) / WORD;
    for (int64_t i = 0; i < count * words; i++) bits[i] = 0;
    for (int64_t i = 0; i < count; i++) {
        degree[i] = 0;
        for (int64_t at = indptr[leaf[i]]; at < indptr[leaf[i] + 1]; at++) {
            int64_t j = local[indices[at]];
            if (j == i) continue;
            include(bits + i * words, j);
            degree[i]++;
        }
    }
    for (int64_t i = 0; i < count; i++) {
        local[leaf[i]] = -1;
        for (int64_t at = indptr[leaf[i]]; at < indptr[leaf[i] + 1]; at++) local[indices[at]] = -1;
    }
    for (int64_t step = 0; step < count; step++) {
        int64_t pivot = find_pivot(degree, count);
        const int64_t *neighbors = bits + pivot * words;
        order[step] = leaf[pivot];
        degree[pivot] = -1;
        /* Its neighbors take over one another, but neither the pivot nor themselves. */
        for (int64_t i = 0; i < count; i++)
            if (degree[i] >= 0 && has(neighbors, i))
                degree[i] = unite(bits + i * words, neighbors, words, pivot, i);
    }
    for (int64_t i = 0; i < count; i++) {
        leaf[i] = order[i];
        place[order[i]] = start + i;
        owner[order[i]] = -1;
    }
}
