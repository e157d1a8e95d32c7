/* A wave that starts at some vertices and crosses unfolded triangles. Documented in geodesic_loops.py. */
#include "kernels.h"

/* Stands for the source of a vertex that a straight front of several sources reached. */
enum { FRONT = -1 };
enum { CHILDREN = 4 };                 /* of an entry of the heap: fewer levels than with two */
static const double ABOVE = 1 + 1e-14; /* more than the rounding of a square */
static const double LEAST_SQUARE = 0x1p-900; /* smaller ones are not exact to so many digits */
/* A vertex halfway between two chosen ones, as on a split edge, belongs to the first, however sums are
   rounded. */
static const double NEARER = 1 - 1e-9;

/* Entries starts[v] to starts[v + 1] are the neighbors of vertex v, one after the other around it: each
   by its number, its distance, and its distance from the next. The last is -1 where no triangle is in
   between, since there the triangles end or have come full circle. */
struct fans {
    const int64_t *starts;
    const int32_t *corners;
    const double (*lengths)[2];
};

/* Fans while they are listed. */
struct open_fans {
    int64_t *starts;
    int32_t *corners;
    double (*lengths)[2];
};

/* Memory of the listing: the corners of triangles by vertex, and where those of each begin; then, of the
   vertex whose triangles are in a row, those that start at each neighbor, as chains, and how many end
   there. Neighbors have -1 and 0 on entry and on return. */
struct listing {
    int64_t *corners, *begins, *later, *first, *n_ending;
};

/* Memory of a wave: for each vertex its distance, whether it is settled, its source, and its place in
   the heap; then the heap, which has one entry a vertex. */
struct scratch {
    double *distance;
    bool *settled;
    int64_t *sender, *place;
    double *keys;
    int64_t *ids;
};

/* The distance of a triangle's third corner from a source beyond the opposite edge.

   `near` and `far` are the distances of the edge's ends from the source, which is unfolded into the
   plane of the triangle. The third corner is at (x, y): along the edge from the near end, and away
   from it. The distance is infinite if the straight line misses the edge, or if it is longer than
   `limit`, which is found out first because it is cheaper. */
static double through_edge(double near, double far, double length, double x, double y,
                           double limit) {
    if (length == 0) return INFINITE; /* the wave walks around this point along the other edges */
    double along = (near * near - far * far + length * length) / (2 * length);
    double square = near * near - along * along;
    double away = square_root(maximum(square, 0));
    double depth = away + y, across = x - along;
    double longest = limit * limit;
    if (longest > LEAST_SQUARE && across * across + depth * depth > ABOVE * longest)
        return INFINITE;
    if (depth == 0) return INFINITE;
    double crossing = along + across * away / depth;
    if (crossing < 0 || crossing > length) return INFINITE;
    return hypotenuse(across, depth);
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

/* Move an entry of the heap up from a place to where it belongs. */
static void raise_entry(const struct scratch *at, int64_t place, double key, int64_t id) {
    while (place) {
        int64_t above = (place - 1) / CHILDREN;
        if (at->keys[above] <= key) break;
        at->keys[place] = at->keys[above];
        at->ids[place] = at->ids[above];
        at->place[at->ids[place]] = place;
        place = above;
    }
    at->keys[place] = key;
    at->ids[place] = id;
    at->place[id] = place;
}

/* The place of the least of the children of an entry, of which the first is there. Without a branch if
   all four are there: which one is least cannot be foreseen. */
static int64_t least_child(const double *keys, int64_t first, int64_t height) {
    if (first + CHILDREN <= height) {
        int64_t one = first + (keys[first + 1] < keys[first]);
        int64_t two = first + 2 + (keys[first + 3] < keys[first + 2]);
        return keys[two] < keys[one] ? two : one;
    }
    int64_t least = first;
    for (int64_t other = first + 1; other < height; other++)
        least = keys[other] < keys[least] ? other : least;
    return least;
}

/* Put the last entry of a heap in place of the first; the height is that without it. */
static void sink_last(const struct scratch *at, int64_t height) {
    double key = at->keys[height];
    int64_t id = at->ids[height], place = 0;
    for (int64_t first = 1; first < height; first = CHILDREN * place + 1) {
        int64_t below = least_child(at->keys, first, height);
        if (at->keys[below] >= key) break;
        at->keys[place] = at->keys[below];
        at->ids[place] = at->ids[below];
        at->place[at->ids[place]] = place;
        place = below;
    }
    at->keys[place] = key;
    at->ids[place] = id;
    at->place[id] = place;
}

/* Note an arrival at a vertex if it is the earliest so far; return the height of the heap. */
static int64_t arrive(const struct scratch *at, int64_t height, int64_t to, double arrival,
                      int64_t source) {
    double before = at->distance[to];
    if (!(arrival < before)) return height;
    at->distance[to] = arrival;
    at->sender[to] = source;
    bool is_new = before == INFINITE;
    raise_entry(at, is_new ? height : at->place[to], arrival, to);
    return height + is_new;
}

/* A triangle in which two corners are settled, the nearer one first: lengths from each of these to the
   third corner, and between them. */
struct crossing {
    double near, far, from_near, from_far, between;
};

/* When a wave reaches the third corner of a triangle through its inside, if not after `limit`. */
static double arrival_through(struct crossing at, bool same, double limit) {
    double length = at.between;
    double edge = length > 0 ? length : 1; /* no wave passes through an edge without length */
    /* The place of the corner along the edge between the others, and away from it. */
    double x = (at.from_near * at.from_near - at.from_far * at.from_far + length * length);
    x /= 2 * edge;
    double square = at.from_near * at.from_near - x * x, y = square_root(maximum(square, 0));
    return same ? through_edge(at.near, at.far, length, x, y, limit)
                : across_edge(at.near, at.far, length, x, y);
}

/* Send a wave on from a settled vertex, along its edges and through its triangles; return the height of
   the heap. */
static inline int64_t send_on(const struct scratch *at, int64_t height, int64_t vertex,
                              const struct fans *fans) {
    double key = at->distance[vertex], side = -1, last_length = 0;
    int64_t source = at->sender[vertex], last = vertex;
    bool was_settled = true;
    for (int64_t entry = fans->starts[vertex]; entry < fans->starts[vertex + 1]; entry++) {
        int64_t corner = fans->corners[entry];
        double length = fans->lengths[entry][0];
        bool is_settled = at->settled[corner];
        /* One branch: which corners are settled cannot be foreseen. */
        if (!is_settled & (key + length < at->distance[corner]))
            height = arrive(at, height, corner, key + length, source);
        if (side >= 0 && is_settled != was_settled) {
            int64_t to = is_settled ? last : corner, other = is_settled ? corner : last;
            double from_near = is_settled ? last_length : length;
            double between = is_settled ? length : last_length;
            bool same = source == at->sender[other] && source != FRONT;
            struct crossing crossing = {key, at->distance[other], from_near, side, between};
            double flat = arrival_through(crossing, same, at->distance[to]);
            height = arrive(at, height, to, flat, same ? source : FRONT);
        }
        was_settled = is_settled;
        last = corner;
        last_length = length;
        side = fans->lengths[entry][1];
    }
    return height;
}

/* Have the neighbors of a vertex in the cache when it is settled: they wait for memory otherwise. */
static void fetch_neighbors(const struct fans *fans, int64_t vertex) {
    int64_t first = fans->starts[vertex];
    __builtin_prefetch(&fans->corners[first]);
    __builtin_prefetch(&fans->lengths[first]);
    __builtin_prefetch((const char *)&fans->lengths[first] + 64);
}

/* Spread a wave from some sources. Write the vertices within the radius and their distances, the
   nearest first, and return their number. */
static int64_t spread(const struct fans *fans, double radius, const int64_t *sources,
                      int64_t n_sources, const struct scratch *scratch, int64_t *reached,
                      double *distances) {
    const struct scratch at = *scratch;
    int64_t height = 0, n_reached = 0;
    for (int64_t i = 0; i < n_sources; i++) height = arrive(&at, height, sources[i], 0, sources[i]);
    while (height && at.keys[0] <= radius) {
        int64_t vertex = at.ids[0];
        reached[n_reached] = vertex;
        distances[n_reached++] = at.keys[0];
        sink_last(&at, --height);
        if (height) fetch_neighbors(fans, at.ids[0]);
        at.settled[vertex] = true;
        height = send_on(&at, height, vertex, fans);
    }
    /* Leave the scratch as it was: vertices that were reached are settled or in the heap. */
    for (int64_t i = 0; i < n_reached; i++) {
        at.distance[reached[i]] = INFINITE;
        at.settled[reached[i]] = false;
    }
    for (int64_t i = 0; i < height; i++) at.distance[at.ids[i]] = INFINITE;
    return n_reached;
}

/* List the corners of triangles by vertex, each as three times its triangle plus its place there. */
static void list_corners(const int64_t (*faces)[3], const struct listing *listing, int64_t n_faces,
                         int64_t n) {
    int64_t *begins = listing->begins;
    for (int64_t v = 0; v <= n; v++) begins[v] = 0;
    for (int64_t corner = 0; corner < 3 * n_faces; corner++)
        begins[faces[corner / 3][corner % 3]]++;
    for (int64_t v = 0; v < n; v++) begins[v + 1] += begins[v];
    /* Now they are the ends, which move to the begins. */
    for (int64_t corner = 3 * n_faces; corner-- > 0;)
        listing->corners[--begins[faces[corner / 3][corner % 3]]] = corner;
}

/* List neighbors from one on, as long as a triangle starts at the latest; return the end of the list. */
static int64_t follow(const int64_t (*faces)[3], const double (*sides)[3],
                      const struct listing *listing, int64_t neighbor, const struct open_fans *fans,
                      int64_t end) {
    double length = 0;
    for (int64_t at; (at = listing->first[neighbor]) >= 0; end++) {
        int64_t corner = listing->corners[at], face = corner / 3, place = corner % 3;
        listing->first[neighbor] = listing->later[at];
        fans->corners[end] = (int32_t)neighbor;
        fans->lengths[end][0] = sides[face][place];
        fans->lengths[end][1] = sides[face][(place + 1) % 3];
        neighbor = faces[face][(place + 2) % 3];
        length = sides[face][(place + 2) % 3];
    }
    fans->corners[end] = (int32_t)neighbor;
    fans->lengths[end][0] = length;
    fans->lengths[end][1] = -1;
    return end + 1;
}

KERNEL void list_fans(const int64_t (*faces)[3], const double (*sides)[3],
                      const struct listing *listing, const struct open_fans *fans, int64_t n_faces,
                      int64_t n) {
    list_corners(faces, listing, n_faces, n);
    int64_t end = 0, *first = listing->first, *n_ending = listing->n_ending;
    for (int64_t v = 0; v < n; v++) {
        fans->starts[v] = end;
        int64_t begin = listing->begins[v], stop = listing->begins[v + 1];
        for (int64_t at = stop; at-- > begin;) {
            int64_t corner = listing->corners[at], face = corner / 3, place = corner % 3;
            int64_t neighbor = faces[face][(place + 1) % 3];
            listing->later[at] = first[neighbor];
            first[neighbor] = at;
            n_ending[faces[face][(place + 2) % 3]]++;
        }
        /* From where no triangle ends, then around what is left. */
        for (int round = 0; round < 2; round++) {
            for (int64_t at = begin; at < stop; at++) {
                int64_t corner = listing->corners[at];
                int64_t neighbor = faces[corner / 3][(corner + 1) % 3];
                if (first[neighbor] >= 0 && (round || !n_ending[neighbor]))
                    end = follow(faces, sides, listing, neighbor, fans, end);
            }
        }
        for (int64_t at = begin; at < stop; at++) {
            int64_t corner = listing->corners[at];
            n_ending[faces[corner / 3][(corner + 2) % 3]] = 0;
        }
    }
    fans->starts[n] = end;
}

KERNEL int64_t spread_waves(const struct fans *fans, double radius, const int64_t *sources,
                            const struct scratch *scratch, int64_t *counts, int64_t *reached,
                            double *distances, int64_t n_starts, int64_t n_sources, int64_t room) {
    int64_t total = 0, n = n_starts - 1;
    for (int64_t i = 0; i < n_sources; i++) {
        if (total + n > room) return i;
        counts[i] =
            spread(fans, radius, &sources[i], 1, scratch, &reached[total], &distances[total]);
        total += counts[i];
    }
    return n_sources;
}

/* Write distances into a row of all vertices. */
static void fill_row(double *row, int64_t n, const int64_t *reached, const double *distances,
                     int64_t count) {
    for (int64_t i = 0; i < n; i++) row[i] = INFINITE;
    for (int64_t i = 0; i < count; i++) row[reached[i]] = distances[i];
}

KERNEL void fill_rows(const struct fans *fans, double radius, const int64_t *sources,
                      const int64_t *ends, const struct scratch *scratch, int64_t *reached,
                      double *distances, double *rows, int64_t n_starts, int64_t n_rows) {
    int64_t first = 0, n = n_starts - 1;
    for (int64_t i = 0; i < n_rows; first = ends[i++]) {
        int64_t count =
            spread(fans, radius, &sources[first], ends[i] - first, scratch, reached, distances);
        fill_row(&rows[i * n], n, reached, distances, count);
    }
}

KERNEL void choose_farthest(const struct fans *fans, double radius, const struct scratch *scratch,
                            int64_t *reached, double *distances, int64_t *chosen, double *least,
                            int64_t *nearest, double *rows, int64_t n_starts, int64_t n_chosen,
                            int64_t n_rows) {
    int64_t n = n_starts - 1, farthest = 0;
    /* The first is that farthest from vertex 0, which a wave finds before. */
    for (int64_t number = -1; number < n_chosen; number++) {
        for (int64_t v = 0; v < n && number <= 0; v++) {
            least[v] = INFINITE;
            nearest[v] = 0;
        }
        if (number >= 0) chosen[number] = farthest;
        double needed = maximum(radius, least[farthest]);
        int64_t count = spread(fans, needed, &farthest, 1, scratch, reached, distances);
        if (number >= 0 && number < n_rows)
            fill_row(&rows[number * n], n, reached, distances, count);
        for (int64_t i = 0; i < count; i++) {
            int64_t v = reached[i];
            if (distances[i] < NEARER * least[v]) nearest[v] = greater(number, 0);
            least[v] = minimum(distances[i], least[v]);
        }
        farthest = 0;
        for (int64_t v = 1; v < n; v++) farthest = least[v] > least[farthest] ? v : farthest;
    }
}
