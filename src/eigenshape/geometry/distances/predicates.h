/* Predicates with exact signs: on which side of a line or a plane a point lies.

   A sum of rounded products is accepted if it exceeds the bound of its rounding error (Shewchuk 1997,
   "Adaptive precision floating-point arithmetic and fast robust geometric predicates", figures 21 and
   22). Otherwise it is computed exactly, as an expansion: floats that do not overlap, ascending in
   size (section 2 there). Coordinates must be at most 2 in size and whole multiples of 2^-300, so
   that no product of three underflows. */
#pragma once
#include "kernels.h"

#include "space.h"

typedef const double (*rows)[3]; /* points */

#define UNIT 0x1p-53 /* unit roundoff: half the distance from 1 to the next float */

/* Largest rounding error of the two determinants, relative to the sum of the absolute products
   (Shewchuk 1997, bounds A of figures 21 and 22). */
static const double LINE_BOUND = (3 + 16 * UNIT) * UNIT, PLANE_BOUND = (7 + 56 * UNIT) * UNIT;
static const double SPLITTER = 0x1p27 + 1; /* splits a float into halves of 26 bits (Dekker) */

/* Most terms of an exact determinant: 6 products of three differences, each difference being two
   floats (8 products of three floats), each of these products being four floats. */
enum { MOST_TERMS = 192 };

/* Floats whose sum is a number: of two, the rounded result and its error. */
struct pair {
    double terms[2];
};

struct expansion {
    double terms[MOST_TERMS];
    int length;
};

/* The rounded sum, and its rounding error (Knuth). */
static inline struct pair two_sum(double a, double b) {
    double total = a + b, of_b = total - a;
    return (struct pair){{total, (a - (total - of_b)) + (b - of_b)}};
}

/* The rounded product, and its rounding error (Dekker, Veltkamp): halves have exact products. */
static inline struct pair two_product(double a, double b) {
    double product = a * b;
    double wide_a = SPLITTER * a, wide_b = SPLITTER * b;
    double high_a = wide_a - (wide_a - a), high_b = wide_b - (wide_b - b);
    double low_a = a - high_a, low_b = b - high_b;
    double left = ((product - high_a * high_b) - low_a * high_b) - high_a * low_b;
    return (struct pair){{product, low_a * low_b - left}};
}

/* Add a float, without zeros: GROW-EXPANSION of Shewchuk (1997). */
static inline void add_term(struct expansion *sum, double value) {
    int kept = 0;
    for (int place = 0; place < sum->length; place++) {
        struct pair grown = two_sum(value, sum->terms[place]);
        value = grown.terms[0];
        if (grown.terms[1] != 0) sum->terms[kept++] = grown.terms[1];
    }
    if (value != 0) sum->terms[kept++] = value;
    sum->length = kept;
}

static inline void add_product(struct expansion *sum, double a, double b) {
    struct pair product = two_product(a, b);
    add_term(sum, product.terms[0]);
    add_term(sum, product.terms[1]);
}

static inline int sign(double value) { return (value > 0) - (value < 0); }

/* The last term is larger than all others together. */
static inline int sign_of_sum(const struct expansion *sum) {
    return sum->length ? sign(sum->terms[sum->length - 1]) : 0;
}

static inline bool same_place(rows points, int64_t a, int64_t b) {
    return points[a][0] == points[b][0] && points[a][1] == points[b][1] &&
           points[a][2] == points[b][2];
}

static inline int exact_side_of_line(rows points, int u, int v, int64_t a, int64_t b, int64_t c) {
    struct expansion area;
    area.length = 0;
    for (int turn = 0; turn < 2; turn++) {
        struct pair x = two_sum(points[a][turn ? v : u], -points[c][turn ? v : u]);
        struct pair y = two_sum(points[b][turn ? u : v], -points[c][turn ? u : v]);
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++)
                add_product(&area, turn ? -x.terms[i] : x.terms[i], y.terms[j]);
    }
    return sign_of_sum(&area);
}

/* The sign of the area of a, b, c projected to axes u and v: 1 if they turn left. */
static inline int side_of_line(rows points, int u, int v, int64_t a, int64_t b, int64_t c) {
    double left = (points[a][u] - points[c][u]) * (points[b][v] - points[c][v]);
    double right = (points[a][v] - points[c][v]) * (points[b][u] - points[c][u]);
    double area = left - right, rounding = LINE_BOUND * (absolute(left) + absolute(right));
    if (absolute(area) > rounding || rounding == 0) return sign(area);
    return exact_side_of_line(points, u, v, a, b, c);
}

static inline int exact_side_of_plane(rows points, int64_t a, int64_t b, int64_t c, int64_t d) {
    if (same_place(points, a, b) || same_place(points, a, c) || same_place(points, b, c)) return 0;
    struct expansion volume;
    volume.length = 0;
    for (int i = 0; i < 3; i++) {
        struct pair x = two_sum(points[a][i], -points[d][i]);
        for (int turn = 0; turn < 2; turn++) {
            int j = (i + 1 + turn) % 3, k = (i + 2 - turn) % 3;
            struct pair y = two_sum(points[b][j], -points[d][j]);
            struct pair z = two_sum(points[c][k], -points[d][k]);
            for (int place = 0; place < 4; place++) {
                double factor = turn ? -y.terms[place / 2] : y.terms[place / 2];
                struct pair yz = two_product(factor, z.terms[place % 2]);
                for (int term = 0; term < 4; term++)
                    if (yz.terms[term / 2] != 0 && x.terms[term % 2] != 0)
                        add_product(&volume, x.terms[term % 2], yz.terms[term / 2]);
            }
        }
    }
    return sign_of_sum(&volume);
}

/* The sign of det[a - d, b - d, c - d]: 1 if a, b, c turn left as seen from the side of their plane
   away from d. */
static inline int side_of_plane(rows points, int64_t a, int64_t b, int64_t c, int64_t d) {
    struct vector one = difference(points[a], points[d]), two = difference(points[b], points[d]);
    struct vector three = difference(points[c], points[d]);
    double left_x = two.x * three.y, right_x = three.x * two.y;
    double left_y = three.x * one.y, right_y = one.x * three.y;
    double left_z = one.x * two.y, right_z = two.x * one.y;
    double volume =
        one.z * (left_x - right_x) + two.z * (left_y - right_y) + three.z * (left_z - right_z);
    double size = (absolute(left_x) + absolute(right_x)) * absolute(one.z) +
                  (absolute(left_y) + absolute(right_y)) * absolute(two.z) +
                  (absolute(left_z) + absolute(right_z)) * absolute(three.z);
    double rounding = PLANE_BOUND * size;
    if (absolute(volume) > rounding || rounding == 0) return sign(volume);
    return exact_side_of_plane(points, a, b, c, d);
}
