/* Loops over the sides of an intrinsic triangulation. The sides of triangle f are 3f, 3f + 1, 3f + 2,
   in order around it. Side h starts at the vertex `tails[h]`, has length `lengths[h]`, and is glued to
   side `twins[h]` of another triangle or the same. */
#include "kernels.h"

static inline int64_t next_side(int64_t side) { return side % 3 == 2 ? side - 2 : side + 1; }

/* Heron's formula in Kahan's order, which is accurate for needles too. */
static double area_of(double a, double b, double c) {
    double low = a < b ? a : b, high = a < b ? b : a;
    double small = low < c ? low : c, large = high > c ? high : c;
    double rest = high < c ? high : c, middle = low > rest ? low : rest;
    double product = (large + (middle + small)) * (small - (large - middle));
    product *= (small + (large - middle)) * (large + (middle - small));
    return 0.25 * square_root(product > 0 ? product : 0);
}

KERNEL void fill_areas(const double *lengths, double *found, int64_t f) {
    for (int64_t i = 0; i < f; i++)
        found[i] = area_of(lengths[3 * i], lengths[3 * i + 1], lengths[3 * i + 2]);
}

struct cotangent {
    double value, size;
};

/* The cotangent of the angle opposite to a side, and the size of its terms. */
static struct cotangent cotangent(const double *lengths, int64_t side) {
    int64_t second = next_side(side);
    double a = lengths[side], b = lengths[second], c = lengths[next_side(second)];
    double four_areas = 4 * area_of(a, b, c);
    return (struct cotangent){(b * b + c * c - a * a) / four_areas,
                              (a * a + b * b + c * c) / four_areas};
}

KERNEL void fill_cotangents(const double *lengths, double *found, int64_t n) {
    for (int64_t side = 0; side < n; side++) found[side] = cotangent(lengths, side).value;
}

struct apex {
    double along, above;
};

/* The coordinates of the opposite corner, along a side and perpendicular to it. */
static struct apex apex(const double *lengths, int64_t side) {
    int64_t second = next_side(side);
    double a = lengths[side], b = lengths[second], c = lengths[next_side(second)];
    return (struct apex){(a * a + c * c - b * b) / (2 * a), 2 * area_of(a, b, c) / a};
}

/* Flip the edge of a side. Triangles (u, v, w) and (v, u, x) become (x, w, u) and (w, x, v): the four
   outer sides, which are filled in, move one place. */
static void flip(int64_t *tails, int64_t *twins, double *lengths, int64_t side, int64_t *outer) {
    int64_t twin = twins[side], from[4], twin_of[4];
    double length_of[4];
    /* The length of the other diagonal of the two triangles, unfolded. */
    struct apex one = apex(lengths, side), two = apex(lengths, twin);
    double crossing = hypotenuse(lengths[side] - one.along - two.along, one.above + two.above);
    outer[0] = next_side(side), outer[1] = next_side(outer[0]);
    outer[2] = next_side(twin), outer[3] = next_side(outer[2]);
    for (int k = 0; k < 4; k++) {
        int64_t old = outer[(k + 1) % 4];
        from[k] = tails[old], twin_of[k] = twins[old], length_of[k] = lengths[old];
    }
    for (int k = 0; k < 4; k++) {
        int64_t other = twin_of[k];
        for (int j = 0; j < 4; j++) {
            if (twin_of[k] != outer[(j + 1) % 4]) continue;
            other = outer[j];
            break;
        }
        tails[outer[k]] = from[k];
        lengths[outer[k]] = length_of[k];
        twins[outer[k]] = other;
        twins[other] = outer[k];
    }
    tails[side] = tails[outer[2]];
    tails[twin] = tails[outer[0]];
    lengths[side] = lengths[twin] = crossing;
}

KERNEL int64_t flip_edges(int64_t *tails, int64_t *twins, double *lengths, double tolerance,
                          int64_t most, int64_t *queue, bool *waiting, int64_t n) {
    int64_t first = 0, length = 0, flips = 0, outer[4];
    for (int64_t side = 0; side < n; side++) {
        if (side >= twins[side]) continue;
        queue[length++] = side;
        waiting[side] = true;
    }
    while (length) {
        int64_t side = queue[first];
        first = (first + 1) % n;
        length--;
        waiting[side] = false;
        struct cotangent one = cotangent(lengths, side), two = cotangent(lengths, twins[side]);
        if (!(one.value + two.value < -tolerance * (one.size + two.size))) continue;
        if (++flips > most) return -1;
        flip(tails, twins, lengths, side, outer);
        for (int k = 0; k < 4; k++) {
            if (waiting[outer[k]] || waiting[twins[outer[k]]]) continue;
            queue[(first + length++) % n] = outer[k];
            waiting[outer[k]] = true;
        }
    }
    return flips;
}
