/* Loops of `patches`: descriptors of the geodesic discs around a point, by rings. */
#include "kernels.h"

enum {
    RINGS = 4,       /* rings of equal width in a disc */
    TURN_BINS = 8,   /* bins of the cosine to the disc's normal, 0 to 1 */
    HEIGHT_BINS = 6, /* bins of the height above the point, in radii, -1 to 1 */
    RING_NUMBERS = TURN_BINS + HEIGHT_BINS + 2,
    NUMBERS = RINGS * RING_NUMBERS,
    BUCKETS = 512, /* of distances, before they are sorted */
};
static const double INNER = 0.35; /* share of the radius in which the disc's normal is averaged */
static const double LEAST_AREA = 1e-3; /* share of a flat disc's area, added before the logarithm */
static const double PI = 3.141592653589793;

struct surface {
    const double (*points)[3];
    const double (*normals)[3];
    const double *areas;
};
struct scratch {
    int64_t *order, *starts;
    double *kept, *straight;
};
struct libm {
    double (*log)(double);
};

static inline int64_t bucket_of(double distance, double reach) {
    return lesser((int64_t)(distance / reach * BUCKETS), BUCKETS - 1);
}

KERNEL int64_t sort_by_distance(const double *distances, double reach, int64_t *order,
                                int64_t *starts, int64_t n) {
    for (int bucket = 0; bucket <= BUCKETS; bucket++) starts[bucket] = 0;
    for (int64_t i = 0; i < n; i++)
        if (distances[i] <= reach) starts[bucket_of(distances[i], reach) + 1]++;
    for (int bucket = 0; bucket < BUCKETS; bucket++) starts[bucket + 1] += starts[bucket];
    int64_t total = starts[BUCKETS];
    for (int64_t i = 0; i < n; i++)
        if (distances[i] <= reach) order[starts[bucket_of(distances[i], reach)]++] = i;
    for (int64_t first = 1; first < total; first++) {
        int64_t vertex = order[first], place = first;
        for (; place && distances[order[place - 1]] > distances[vertex]; place--)
            order[place] = order[place - 1];
        order[place] = vertex;
    }
    return total;
}

static inline double dot(const double *u, const double *v) {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

/* The mean normal of the vertices near the center, by area; zero if it has no direction. */
static void mean_normal(const double *distances, const struct surface *surface,
                        const int64_t *order, int64_t count, double reach, double *normal) {
    for (int axis = 0; axis < 3; axis++) normal[axis] = 0;
    for (int64_t at = 0; at < count && distances[order[at]] <= reach; at++)
        for (int axis = 0; axis < 3; axis++)
            normal[axis] += surface->areas[order[at]] * surface->normals[order[at]][axis];
    double length = square_root(dot(normal, normal));
    for (int axis = 0; length > 0 && axis < 3; axis++) normal[axis] /= length;
}

/* Split a weight at `share`, 0 to 1, between the two of some bins with the nearest centers. */
static void add_weight(float *bins, int64_t n_bins, double share, double weight) {
    double place = share * (double)n_bins - 0.5, last = (double)n_bins - 1;
    if (!(place > 0)) place = 0;
    if (place > last) place = last;
    int64_t low = lesser((int64_t)place, n_bins - 2);
    bins[low] = (float)(bins[low] + weight * ((double)(low + 1) - place));
    bins[low + 1] = (float)(bins[low + 1] + weight * (place - (double)low));
}

/* Write the NUMBERS of the disc of a radius. `order` holds vertices by distance, at least as far as the
   disc reaches. */
static void describe_disc(const double *distances, const double *center, int64_t count,
                          const struct surface *surface, double radius,
                          const struct scratch *scratch, float *found, const struct libm *libm) {
    double normal[3], *kept = scratch->kept, *straight = scratch->straight;
    mean_normal(distances, surface, scratch->order, count, INNER * radius, normal);
    for (int place = 0; place < NUMBERS; place++) found[place] = 0;
    for (int ring = 0; ring < RINGS; ring++) kept[ring] = straight[ring] = 0;
    for (int64_t at = 0; at < count; at++) {
        int64_t i = scratch->order[at];
        if (distances[i] > radius) break;
        double away[3];
        for (int axis = 0; axis < 3; axis++) away[axis] = surface->points[i][axis] - center[axis];
        double turn = dot(surface->normals[i], normal), height = dot(away, normal);
        double beeline = square_root(dot(away, away));
        if (turn <= 0) continue;
        int64_t ring = lesser((int64_t)(RINGS * distances[i] / radius), RINGS - 1);
        float *bins = found + ring * RING_NUMBERS;
        double area = surface->areas[i];
        kept[ring] += area;
        straight[ring] += area * (distances[i] > 0 ? beeline / distances[i] : 1);
        add_weight(bins, TURN_BINS, turn, area);
        add_weight(bins + TURN_BINS, HEIGHT_BINS, (height / radius + 1) / 2, area);
    }
    double covered = 0;
    for (int ring = 0; ring < RINGS; ring++) {
        float *numbers = found + ring * RING_NUMBERS;
        covered += kept[ring];
        for (int place = 0; kept[ring] > 0 && place < TURN_BINS + HEIGHT_BINS; place++)
            numbers[place] = (float)square_root(numbers[place] / kept[ring]);
        double across = radius * (ring + 1) / RINGS, flat = PI * (across * across);
        numbers[RING_NUMBERS - 2] = (float)libm->log(LEAST_AREA + covered / flat);
        numbers[RING_NUMBERS - 1] = (float)(kept[ring] > 0 ? straight[ring] / kept[ring] : 1);
    }
}

KERNEL void describe_discs_of(const double *distances, const double *center,
                              const struct surface *surface, const double *radii,
                              const struct scratch *scratch, float *found, const struct libm *libm,
                              int64_t n, int64_t r) {
    int64_t n_near = sort_by_distance(distances, radii[r - 1], scratch->order, scratch->starts, n);
    for (int64_t row = 0; row < r; row++)
        describe_disc(distances, center, n_near, surface, radii[row], scratch,
                      found + row * NUMBERS, libm);
}
