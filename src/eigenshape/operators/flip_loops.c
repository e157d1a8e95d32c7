/* Loops over the sides of an intrinsic triangulation: documented in flip_loops.py. */
#include "hypotenuse.h"

static int64_t next_side(int64_t side) { return side % 3 == 2 ? side - 2 : side + 1; }

/* A side of a triangle, and the two that follow it. */
struct sides {
    double a, b, c;
};

static struct sides sides_from(const double *lengths, int64_t side) {
    int64_t next = next_side(side);
    return (struct sides){lengths[side], lengths[next], lengths[next_side(next)]};
}

/* Heron's formula in Kahan's order, which is accurate for needles too. */
static double area_of(struct sides of) {
    double low = minimum(of.a, of.b), high = maximum(of.a, of.b);
    double small = minimum(low, of.c), large = maximum(high, of.c);
    double middle = maximum(low, minimum(high, of.c));
    double product = (large + (middle + small)) * (small - (large - middle));
    product *= (small + (large - middle)) * (large + (middle - small));
    return 0.25 * square_root(maximum(product, 0.0));
}

/* The cotangent of the angle opposite to side a, and the size of its terms. */
struct cotangent {
    double value, size;
};

static struct cotangent cotangent_opposite(struct sides of) {
    double four_areas = 4 * area_of(of), aa = of.a * of.a, bb = of.b * of.b, cc = of.c * of.c;
    return (struct cotangent){(bb + cc - aa) / four_areas, (aa + bb + cc) / four_areas};
}

/* The place of the corner opposite to side a: along the side, and perpendicular to it. */
struct apex {
    double along, above;
};

static struct apex apex_over(struct sides of) {
    double along = (of.a * of.a + of.c * of.c - of.b * of.b) / (2 * of.a);
    return (struct apex){along, 2 * area_of(of) / of.a};
}

KERNEL void fill_areas(const double *lengths, double *found, int64_t n_faces) {
    for (int64_t f = 0; f < n_faces; f++) found[f] = area_of(sides_from(lengths, 3 * f));
}

KERNEL void fill_cotangents(const double *lengths, double *found, int64_t n_sides) {
    for (int64_t side = 0; side < n_sides; side++)
        found[side] = cotangent_opposite(sides_from(lengths, side)).value;
}

/* Return whether the angles opposite to an edge sum to more than 180°, beyond rounding. */
static bool is_crossed(const double *lengths, int64_t side, int64_t twin, double tolerance) {
    struct cotangent one = cotangent_opposite(sides_from(lengths, side));
    struct cotangent two = cotangent_opposite(sides_from(lengths, twin));
    return one.value + two.value < -tolerance * (one.size + two.size);
}

/* Triangles (u, v, w) and (v, u, x) become (x, w, u) and (w, x, v): the edge becomes the other
   diagonal, and each outer side moves to the place of the one before it. */
static void flip_edge(int64_t *tails, int64_t *twins, double *lengths, int64_t side,
                      const int64_t outer[4]) {
    int64_t twin = twins[side];
    /* The other diagonal of the two triangles, unfolded into the plane. */
    struct apex one = apex_over(sides_from(lengths, side));
    struct apex two = apex_over(sides_from(lengths, twin));
    double diagonal = hypotenuse(lengths[side] - one.along - two.along, one.above + two.above);
    int64_t old_tails[4], old_twins[4];
    double old_lengths[4];
    for (int k = 0; k < 4; k++) {
        old_tails[k] = tails[outer[(k + 1) % 4]];
        old_twins[k] = twins[outer[(k + 1) % 4]];
        old_lengths[k] = lengths[outer[(k + 1) % 4]];
    }
    for (int k = 0; k < 4; k++) {
        /* The twin may be one of the outer sides, which has a new place too. */
        int64_t other = old_twins[k];
        for (int j = 0; j < 4; j++) {
            if (old_twins[k] == outer[(j + 1) % 4]) other = outer[j];
        }
        tails[outer[k]] = old_tails[k];
        lengths[outer[k]] = old_lengths[k];
        twins[outer[k]] = other;
        twins[other] = outer[k];
    }
    tails[side] = tails[outer[2]];
    tails[twin] = tails[outer[0]];
    lengths[side] = lengths[twin] = diagonal;
}

KERNEL int64_t flip_edges(int64_t *tails, int64_t *twins, double *lengths, double tolerance,
                          int64_t most, int64_t *queue, bool *is_waiting, int64_t n_sides) {
    int64_t first = 0, length = 0, n_flips = 0;
    for (int64_t side = 0; side < n_sides; side++) {
        is_waiting[side] = side < twins[side];
        if (is_waiting[side]) queue[length++] = side;
    }
    while (length > 0) {
        int64_t side = queue[first], twin = twins[side];
        first = (first + 1) % n_sides;
        length--;
        is_waiting[side] = false;
        if (!is_crossed(lengths, side, twin, tolerance)) continue;
        n_flips++;
        if (n_flips > most) return -1;
        int64_t outer[4] = {next_side(side), next_side(next_side(side)), next_side(twin),
                            next_side(next_side(twin))};
        flip_edge(tails, twins, lengths, side, outer);
        for (int k = 0; k < 4; k++) {
            if (is_waiting[outer[k]] || is_waiting[twins[outer[k]]]) continue;
            queue[(first + length) % n_sides] = outer[k];
            is_waiting[outer[k]] = true;
            length++;
        }
    }
    return n_flips;
}
