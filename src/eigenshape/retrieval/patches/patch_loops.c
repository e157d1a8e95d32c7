/* Descriptors of the geodesic discs around points, by rings: documented in patch_loops.py, where
   the numbers below are explained. */
#include "kernels.h"

enum {
    RINGS = 4,
    TURN_BINS = 8,
    HEIGHT_BINS = 6,
    RING_NUMBERS = TURN_BINS + HEIGHT_BINS + 2,
    BUCKETS = 448 /* of distances, before they are sorted; more need a larger frame than a page */
};
static const double INNER = 0.35; /* share of the radius in which the disc's normal is averaged */
static const double PI = 0x1.921fb54442d18p1;

/* The points, normals and areas of all vertices. */
struct surface {
    const double (*points)[3];
    const double (*normals)[3];
    const double *areas;
};

/* The vertices around a point, the nearest first. */
struct disc {
    const double *center, *distances;
    const int64_t *order;
    int64_t n_near;
};

static int64_t bucket_of(double distance, double reach) {
    return lesser((int64_t)(distance / reach * BUCKETS), BUCKETS - 1);
}

/* Vertices are put into buckets of equal width first. Then few are out of place, and insertion
   takes a fifth of the time of a sort of all. */
KERNEL int64_t sort_by_distance(const double *distances, double reach, int64_t *order, int64_t n) {
    int64_t starts[BUCKETS + 1] = {0};
    for (int64_t i = 0; i < n; i++) {
        if (distances[i] <= reach) starts[bucket_of(distances[i], reach) + 1]++;
    }
    for (int bucket = 0; bucket < BUCKETS; bucket++) starts[bucket + 1] += starts[bucket];
    int64_t total = starts[BUCKETS];
    for (int64_t i = 0; i < n; i++) {
        if (distances[i] <= reach) order[starts[bucket_of(distances[i], reach)]++] = i;
    }
    for (int64_t first = 1; first < total; first++) {
        int64_t vertex = order[first], place = first;
        for (; place > 0 && distances[order[place - 1]] > distances[vertex]; place--) {
            order[place] = order[place - 1];
        }
        order[place] = vertex;
    }
    return total;
}

static double dot(const double u[3], const double v[3]) {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

/* Write the mean normal of the vertices within a radius; zeros, if it has no length. */
static void fill_normal(const struct surface *surface, struct disc disc, double radius,
                        double normal[3]) {
    normal[0] = normal[1] = normal[2] = 0;
    for (int64_t at = 0; at < disc.n_near; at++) {
        int64_t i = disc.order[at];
        if (disc.distances[i] > radius) break;
        for (int axis = 0; axis < 3; axis++)
            normal[axis] += surface->areas[i] * surface->normals[i][axis];
    }
    double length = square_root(dot(normal, normal));
    for (int axis = 0; axis < 3 && length > 0; axis++) normal[axis] /= length;
}

/* Split a weight at `share`, 0 to 1, between the two bins with the nearest centers. */
static void add_to_bins(float *bins, int n_bins, double share, double weight) {
    double place = minimum(maximum(share * n_bins - 0.5, 0), n_bins - 1);
    int64_t low = lesser((int64_t)place, n_bins - 2);
    bins[low] = (float)(bins[low] + weight * (low + 1 - place));
    bins[low + 1] = (float)(bins[low + 1] + weight * (place - low));
}

/* Write the numbers of a disc, ring by ring, and the share of a flat disc that each ring and those
   within it cover. */
static void describe_disc(const struct surface *surface, struct disc disc, double radius,
                          float found[RINGS][RING_NUMBERS], double covered[RINGS]) {
    double normal[3], kept[RINGS] = {0}, straight[RINGS] = {0};
    fill_normal(surface, disc, INNER * radius, normal);
    for (int ring = 0; ring < RINGS; ring++) {
        for (int place = 0; place < RING_NUMBERS; place++) found[ring][place] = 0;
    }
    for (int64_t at = 0; at < disc.n_near; at++) {
        int64_t i = disc.order[at];
        double distance = disc.distances[i], area = surface->areas[i], arm[3];
        if (distance > radius) break;
        for (int axis = 0; axis < 3; axis++)
            arm[axis] = surface->points[i][axis] - disc.center[axis];
        double turn = dot(surface->normals[i], normal);
        if (turn <= 0) continue;
        double height = dot(arm, normal), beeline = square_root(dot(arm, arm));
        int64_t ring = lesser((int64_t)(RINGS * distance / radius), RINGS - 1);
        kept[ring] += area;
        straight[ring] += area * (distance > 0 ? beeline / distance : 1);
        add_to_bins(found[ring], TURN_BINS, turn, area);
        add_to_bins(found[ring] + TURN_BINS, HEIGHT_BINS, (height / radius + 1) / 2, area);
    }
    double total = 0;
    for (int ring = 0; ring < RINGS; ring++) {
        bool is_empty = !(kept[ring] > 0);
        for (int place = 0; place < TURN_BINS + HEIGHT_BINS && !is_empty; place++)
            found[ring][place] = (float)square_root(found[ring][place] / kept[ring]);
        double across = radius * (ring + 1) / RINGS;
        total += kept[ring];
        covered[ring] = total / (PI * (across * across));
        found[ring][RING_NUMBERS - 1] = is_empty ? 1 : (float)(straight[ring] / kept[ring]);
    }
}

KERNEL void fill_discs(const double *rows, const int64_t *centers, const struct surface *surface,
                       const double *radii, int64_t *order, float (*found)[RINGS][RING_NUMBERS],
                       double (*covered)[RINGS], int64_t n_centers, int64_t n, int64_t n_radii) {
    for (int64_t number = 0; number < n_centers; number++) {
        const double *distances = rows + number * n;
        int64_t n_near = sort_by_distance(distances, radii[n_radii - 1], order, n);
        struct disc disc = {surface->points[centers[number]], distances, order, n_near};
        for (int64_t size = 0; size < n_radii; size++) {
            int64_t place = number * n_radii + size;
            describe_disc(surface, disc, radii[size], found[place], covered[place]);
        }
    }
}

/* The method of Floyd and Warshall (1962). */
KERNEL void shorten_paths(double *lengths, int64_t n) {
    for (int64_t middle = 0; middle < n; middle++) {
        const double *onward = lengths + middle * n;
        for (int64_t from = 0; from < n; from++) {
            double *own = lengths + from * n, first = own[middle];
            if (first == INFINITE || from == middle) continue;
            for (int64_t to = 0; to < n; to++) own[to] = minimum(own[to], first + onward[to]);
        }
    }
}
