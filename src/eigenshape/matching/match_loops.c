/* Agreement of pairs, points placed by distances, and nearest points of faces. Documented in
   match_loops.py. */
#include "kernels.h"

typedef struct {
    float real, imaginary;
} complex64_t;

/* Distances between the points of a shape, the same transposed, and directions as unit numbers. */
struct shape {
    const float *forth, *back;
    const complex64_t *ways;
};

enum { BLOCK = 256 };

/* What the couplings of one pair take: its row of the distances of either shape. */
struct row {
    int64_t point;
    const float *ours, *theirs;
};

/* How much each of up to BLOCK pairs agrees with the pair of a row: 0 from a share `slack` of the
   distance on, and where a distance is infinite. Without branches, so that several are computed at
   once. */
static void fill_agreements(const struct row *row, const int64_t *points, const int64_t *images,
                            double slack, double least, double longer, double *agreements,
                            int64_t n_pairs) {
    for (int64_t j = 0; j < n_pairs; j++) {
        float one = row->ours[points[j]], two = row->theirs[images[j]], apart = one - two;
        double error = absolute(apart) / maximum(maximum(one, two), least);
        error *= one > two ? longer : 1;
        double share = error < slack && points[j] != row->point ? error / slack : 1;
        agreements[j] = 1 - share * share;
    }
}

/* Write value · a · conj(b), rounded once at the end, for directions a on the whole and b on the part
   towards each of up to BLOCK pairs; real and imaginary parts follow each other. */
static void fill_turns(const double *values, const complex64_t *theirs, const complex64_t *ours,
                       const int64_t *images, const int64_t *points, float *restrict turns,
                       int64_t n_pairs) {
    for (int64_t j = 0; j < n_pairs; j++) {
        double a = theirs[images[j]].real, b = ours[points[j]].real;
        double a_imaginary = theirs[images[j]].imaginary, b_imaginary = -ours[points[j]].imaginary;
        /* The zeros are the imaginary part of the value: they keep the signs of zeros. */
        double real = values[j] * a - 0.0 * a_imaginary;
        double imaginary = values[j] * a_imaginary + 0.0 * a;
        turns[2 * j] = values[j] > 0 ? (float)(real * b - imaginary * b_imaginary) : 0;
        turns[2 * j + 1] = values[j] > 0 ? (float)(real * b_imaginary + imaginary * b) : 0;
    }
}

/* Each row is written from left to right: to write both entries of two pairs at once, a column apart,
   takes three times as long. */
KERNEL void couple_pairs(const int64_t *points, const int64_t *images, const struct shape *part,
                         const struct shape *whole, double slack, double least, double longer,
                         complex64_t *couplings, int64_t n_pairs, int64_t n_ours,
                         int64_t n_theirs) {
    double agreements[BLOCK];
    for (int64_t i = 0; i < n_pairs; i++) {
        int64_t ours = points[i] * n_ours, theirs = images[i] * n_theirs;
        /* The distance of two pairs is that from the later one. */
        struct row earlier = {points[i], &part->forth[ours], &whole->forth[theirs]};
        struct row later = {points[i], &part->back[ours], &whole->back[theirs]};
        for (int64_t first = 0, end; first < n_pairs; first = end) {
            end = lesser(first + BLOCK, first < i ? i : n_pairs);
            fill_agreements(first < i ? &earlier : &later, &points[first], &images[first], slack,
                            least, longer, agreements, end - first);
            fill_turns(agreements, &whole->ways[theirs], &part->ways[ours], &images[first],
                       &points[first], (float *)&couplings[i * n_pairs + first], end - first);
        }
    }
}

/* Rounded once at the end. */
static float modulus(double real, double imaginary) {
    return (float)square_root(real * real + imaginary * imaginary);
}

/* A block of further pairs at a time, whose sums lie in the frame. */
KERNEL void support_extensions(const int64_t *chosen, const complex64_t *sums,
                               const complex64_t *forth, const complex64_t *back, int64_t first,
                               float *support, int64_t n_rows, int64_t n_chosen,
                               int64_t n_candidates, int64_t count) {
    for (int64_t place = 0; place < n_rows * count;) {
        int64_t row = place / count, begin = place % count, size = lesser(count - begin, BLOCK);
        complex64_t by_chosen[BLOCK] = {{0, 0}};
        float found[BLOCK] = {0};
        for (int64_t at = row * n_chosen; at < (row + 1) * n_chosen; at++) {
            int64_t pair = chosen[at] * n_candidates + first + begin;
            for (int64_t j = 0; j < size; j++) {
                found[j] += modulus(sums[at].real + forth[pair + j].real,
                                    sums[at].imaginary + forth[pair + j].imaginary);
                by_chosen[j].real += back[pair + j].real;
                by_chosen[j].imaginary += back[pair + j].imaginary;
            }
        }
        for (int64_t j = 0; j < size; j++)
            support[place++] = found[j] + modulus(by_chosen[j].real, by_chosen[j].imaginary);
    }
}

static bool is_finite(double value) { return absolute(value) < INFINITE; }

/* Row by row, as they lie in memory; each column keeps the least entries so far in order. */
KERNEL void fill_nearest_rows(const double *rows, double *least, int64_t *found, int64_t n_rows,
                              int64_t n, int64_t count) {
    for (int64_t i = 0; i < n_rows && count; i++) {
        int64_t last = lesser(i, count - 1);
        for (int64_t v = 0; v < n; v++) {
            double value = rows[i * n + v], *kept = &least[v * count];
            int64_t *numbers = &found[v * count], place = last;
            if (i >= count && value >= kept[last]) continue;
            while (place > 0 && kept[place - 1] > value) {
                kept[place] = kept[place - 1];
                numbers[place] = numbers[place - 1];
                place--;
            }
            kept[place] = value;
            numbers[place] = i;
        }
    }
}

/* Of the pairs near a point: the distances to them on the part, the weights of errors, and their
   points of the whole; then vertices of the whole that are tried. */
struct scratch {
    double *lengths, *weights;
    int64_t *ends, *tried;
};

/* The weighted sum of squared errors at a vertex of the whole, or more than `best`. */
static double misfit_at(int64_t vertex, const struct scratch *near, int64_t n_near,
                        const float *theirs, int64_t n_vertices, double cap, double longer,
                        double best) {
    double sum = 0;
    for (int64_t j = 0; j < n_near; j++) {
        double error = theirs[near->ends[j] * n_vertices + vertex] - near->lengths[j];
        if (error < 0) error *= longer;
        sum += near->weights[j] * minimum(error * error, cap);
        if (sum >= best) break;
    }
    return sum;
}

enum { CHUNK = 16 };

/* Whether one of CHUNK distances lies between two: the computer asks that of all at once. */
static bool has_between(const float *distances, double low, double high) {
    bool any = false;
    for (int64_t w = 0; w < CHUNK; w++) any |= (low <= distances[w]) & (distances[w] <= high);
    return any;
}

KERNEL void fill_places(const float *rows, const int64_t *partners, const float *theirs,
                        const int64_t *near, const int64_t *starts, double softness, double cap,
                        double longer, int64_t *found, double *misfits,
                        const struct scratch *scratch, int64_t n_points, int64_t count,
                        int64_t n_vertices) {
    double *lengths = scratch->lengths, *weights = scratch->weights;
    int64_t *tried = scratch->tried;
    for (int64_t v = 0; v < n_points; v++) {
        int64_t n_near = 0;
        double total = 0;
        for (int64_t place = 0; place < count; place++) {
            int64_t i = near[v * count + place];
            if (i < 0 || !is_finite(rows[i * n_points + v])) continue;
            double length = rows[i * n_points + v], soft = length + softness;
            lengths[n_near] = length;
            weights[n_near] = 1 / (soft * soft);
            scratch->ends[n_near] = partners[i];
            total += weights[n_near++];
        }
        found[v] = starts[v];
        misfits[v] = INFINITE;
        if (n_near == 0) continue;

        double best =
            misfit_at(starts[v], scratch, n_near, theirs, n_vertices, cap, longer, INFINITE);
        /* A vertex is no better if its error to the first pair alone is as large, give or take
           rounding. */
        double reach = best < weights[0] * cap ? square_root(best / weights[0]) : INFINITE;
        double low = lengths[0] - 1.0001 * reach / longer, high = lengths[0] + 1.0001 * reach;
        const float *firsts = &theirs[scratch->ends[0] * n_vertices];
        int64_t n_tried = 0;
        for (int64_t begin = 0; begin < n_vertices; begin += CHUNK) {
            int64_t end = lesser(begin + CHUNK, n_vertices);
            if (end == begin + CHUNK && !has_between(&firsts[begin], low, high)) continue;
            for (int64_t w = begin; w < end; w++) {
                tried[n_tried] = w;
                n_tried += (low <= firsts[w]) & (firsts[w] <= high);
            }
        }
        for (int64_t number = 0; number < n_tried; number++) {
            double misfit =
                misfit_at(tried[number], scratch, n_near, theirs, n_vertices, cap, longer, best);
            if (!(misfit < best)) continue;
            best = misfit;
            found[v] = tried[number];
        }
        misfits[v] = best / total;
    }
}

/* Inner products of two sides of a face, from a corner, and of a point seen from there. */
struct products {
    double one_one, one_two, two_two, one_point, two_point, point_point;
};

static struct products inner_products(const double *corner, const double *first,
                                      const double *second, const double *place, int64_t k) {
    struct products sum = {0, 0, 0, 0, 0, 0};
    for (int64_t d = 0; d < k; d++) {
        double one = first[d] - corner[d], two = second[d] - corner[d],
               point = place[d] - corner[d];
        sum.one_one += one * one;
        sum.one_two += one * two;
        sum.two_two += two * two;
        sum.one_point += one * point;
        sum.two_point += two * point;
        sum.point_point += point * point;
    }
    return sum;
}

/* A place in a triangle: shares of its two sides. */
struct foot {
    double s, t;
};

/* The place in a triangle, s, t >= 0 and s + t <= 1, that is nearest to a point. */
static struct foot nearest_foot(struct products of) {
    double area = of.one_one * of.two_two - of.one_two * of.one_two;
    if (area > 1e-12 * of.one_one * of.two_two) {
        double s = (of.two_two * of.one_point - of.one_two * of.two_point) / area;
        double t = (of.one_one * of.two_point - of.one_two * of.one_point) / area;
        if (s >= 0 && t >= 0 && s + t <= 1) return (struct foot){s, t};
    }
    /* Otherwise the nearest point lies on a side: try all three. */
    double s = of.one_one > 0 ? minimum(maximum(of.one_point / of.one_one, 0), 1) : 0;
    double best = s * s * of.one_one - 2 * s * of.one_point;
    struct foot foot = {s, 0};
    double t = of.two_two > 0 ? minimum(maximum(of.two_point / of.two_two, 0), 1) : 0;
    double value = t * t * of.two_two - 2 * t * of.two_point;
    if (value < best) {
        best = value;
        foot = (struct foot){0, t};
    }
    double across = of.one_one - 2 * of.one_two + of.two_two;
    if (!(across > 0)) return foot;
    t = (of.one_one - of.one_two + of.two_point - of.one_point) / across;
    t = minimum(maximum(t, 0), 1);
    s = 1 - t;
    value = s * s * of.one_one + 2 * s * t * of.one_two + t * t * of.two_two;
    value -= 2 * (s * of.one_point + t * of.two_point);
    return value < best ? (struct foot){s, t} : foot;
}

KERNEL void fill_face_points(const double *points, const double *corners, const int64_t (*faces)[3],
                             const int64_t *starts, const int64_t *around, const int64_t *places,
                             int64_t *found, double (*weights)[3], int64_t n_points, int64_t k) {
    for (int64_t v = 0; v < n_points; v++) {
        double best = INFINITE;
        for (int64_t entry = starts[places[v]]; entry < starts[places[v] + 1]; entry++) {
            const int64_t *face = faces[around[entry]];
            struct products of = inner_products(&corners[face[0] * k], &corners[face[1] * k],
                                                &corners[face[2] * k], &points[v * k], k);
            struct foot foot = nearest_foot(of);
            double s = foot.s, t = foot.t;
            double value = of.point_point - 2 * (s * of.one_point + t * of.two_point) +
                           s * s * of.one_one + 2 * s * t * of.one_two + t * t * of.two_two;
            if (!(value < best)) continue;
            best = value;
            found[v] = around[entry];
            weights[v][0] = maximum(1 - s - t, 0);
            weights[v][1] = s;
            weights[v][2] = t;
        }
    }
}
