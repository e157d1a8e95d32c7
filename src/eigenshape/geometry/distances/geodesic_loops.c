/* A wave that starts at some vertices and crosses unfolded triangles. Documented in geodesic_loops.py. */
#include "kernels.h"

/* Stands for the source of a vertex that a straight front of several sources reached. */
enum { FRONT = -1 };

/* Entries starts[v] to starts[v + 1] are the triangles at vertex v. */
struct fans {
    const int64_t *starts, *first_corner, *second_corner;
    const double (*sides)[7];
};

/* Memory of a wave: for each vertex its distance, whether it is settled, its source, and a list of
   those touched; then the heap. The sender is the source from which a vertex was reached. */
struct scratch {
    double *distance;
    bool *settled;
    int64_t *sender, *touched;
    double *heap_keys;
    int64_t *heap_ids;
};

/* A corner of a triangle, seen from a vertex v: its distance from v, and its place along the edge
   from v to the other corner and away from it. */
struct corner {
    int64_t vertex;
    double away, x, y;
};

/* The distance of a triangle's third corner from a source beyond the opposite edge.

   `near` and `far` are the distances of the edge's ends from the source, which is unfolded into the
   plane of the triangle. The third corner is at (x, y): along the edge from the near end, and away
   from it. The distance is infinite if the straight line misses the edge. */
static double through_edge(double near, double far, double length, double x, double y) {
    if (length == 0) return INFINITE; /* the wave walks around this point along the other edges */
    double along = (near * near - far * far + length * length) / (2 * length);
    double square = near * near - along * along;
    double away = square_root(maximum(square, 0));
    double depth = away + y;
    if (depth == 0) return INFINITE;
    double crossing = along + (x - along) * away / depth;
    if (crossing < 0 || crossing > length) return INFINITE;
    return hypotenuse(x - along, depth);
}

/* The distance of the third corner from a straight front (Kimmel and Sethian 1998). A front is
   straight if both ends of the edge are sources, because then the whole edge is one. */
static double across_edge(double near, double far, double length, double x, double y) {
    if (length == 0) return INFINITE;
    double climb = (far - near) / length;
    double square = 1 - climb * climb;
    double steep = square_root(maximum(square, 0));
    if (steep == 0) return INFINITE;
    double crossing = x - y * climb / steep;
    if (crossing < 0 || crossing > length) return INFINITE;
    return near + climb * x + steep * y;
}

/* Put an entry into a heap of some height. */
static void raise_entry(double *keys, int64_t *ids, int64_t height, double key, int64_t id) {
    int64_t place = height;
    while (place) {
        int64_t above = (place - 1) / 2;
        if (keys[above] <= key) break;
        keys[place] = keys[above];
        ids[place] = ids[above];
        place = above;
    }
    keys[place] = key;
    ids[place] = id;
}

/* Put the last entry of a heap in place of the first; the height is that without it. */
static void sink_last(double *keys, int64_t *ids, int64_t height) {
    double key = keys[height];
    int64_t id = ids[height], place = 0;
    for (;;) {
        int64_t below = 2 * place + 1;
        if (below >= height) break;
        if (below + 1 < height && keys[below + 1] < keys[below]) below++;
        if (keys[below] >= key) break;
        keys[place] = keys[below];
        ids[place] = ids[below];
        place = below;
    }
    keys[place] = key;
    ids[place] = id;
}

/* A wave on its way. */
struct wave {
    struct scratch at;
    int64_t n_touched, height;
};

/* When a wave from a settled vertex reaches a corner, and from which source: along the edge, or
   through the triangle if its other corner is settled as well. */
static double arrival_at(const struct scratch *at, int64_t vertex, const struct corner *corner,
                         const struct corner *other, int64_t *source) {
    double key = at->distance[vertex], arrival = key + corner->away;
    *source = at->sender[vertex];
    if (!at->settled[other->vertex]) return arrival;
    double far = at->distance[other->vertex];
    bool same = *source == at->sender[other->vertex] && *source != FRONT;
    double flat = same ? through_edge(key, far, other->away, corner->x, corner->y)
                       : across_edge(key, far, other->away, corner->x, corner->y);
    if (!(flat < arrival)) return arrival;
    if (!same) *source = FRONT;
    return flat;
}

/* Send a wave from a settled vertex to one corner of a triangle there. */
static void reach_corner(struct wave *wave, int64_t vertex, const struct corner *corner,
                         const struct corner *other) {
    const struct scratch *at = &wave->at;
    int64_t to = corner->vertex, source;
    if (at->settled[to]) return;
    double arrival = arrival_at(at, vertex, corner, other, &source);
    if (!(arrival < at->distance[to])) return;
    if (at->distance[to] == INFINITE) at->touched[wave->n_touched++] = to;
    at->distance[to] = arrival;
    at->sender[to] = source;
    raise_entry(at->heap_keys, at->heap_ids, wave->height++, arrival, to);
}

KERNEL int64_t spread_wave(const struct fans *fans, double radius, const int64_t *sources,
                           const struct scratch *scratch, int64_t *reached, double *distances,
                           int64_t n_sources) {
    struct scratch at = *scratch;
    struct wave wave = {at, n_sources, n_sources};
    for (int64_t i = 0; i < n_sources; i++) {
        int64_t source = sources[i];
        at.distance[source] = at.heap_keys[i] = 0;
        at.sender[source] = at.touched[i] = at.heap_ids[i] = source;
    }
    int64_t n_reached = 0;
    while (wave.height) {
        double key = at.heap_keys[0];
        int64_t vertex = at.heap_ids[0];
        sink_last(at.heap_keys, at.heap_ids, --wave.height);
        if (at.settled[vertex]) continue;
        if (key > radius) break;
        at.settled[vertex] = true;
        reached[n_reached] = vertex;
        distances[n_reached++] = key;
        for (int64_t entry = fans->starts[vertex]; entry < fans->starts[vertex + 1]; entry++) {
            const double *side = fans->sides[entry];
            struct corner one = {fans->first_corner[entry], side[0], side[3], side[4]};
            struct corner two = {fans->second_corner[entry], side[1], side[5], side[6]};
            reach_corner(&wave, vertex, &one, &two);
            reach_corner(&wave, vertex, &two, &one);
        }
    }
    for (int64_t i = 0; i < wave.n_touched; i++) {
        at.distance[at.touched[i]] = INFINITE;
        at.settled[at.touched[i]] = false;
    }
    return n_reached;
}

KERNEL int64_t spread_waves(const struct fans *fans, double radius, const int64_t *sources,
                            const struct scratch *scratch, int64_t *counts, int64_t *reached,
                            double *distances, int64_t n_starts, int64_t n_sources, int64_t room) {
    int64_t total = 0, n = n_starts - 1;
    for (int64_t i = 0; i < n_sources; i++) {
        if (total + n > room) return i;
        counts[i] =
            spread_wave(fans, radius, &sources[i], scratch, &reached[total], &distances[total], 1);
        total += counts[i];
    }
    return n_sources;
}
