/* Ear clipping of polygons: documented in polygon_loops.py. */
#include "kernels.h"

/* In place of the shape of a corner that was cut off. */
static const double GONE = -2;
/* Steps from 0 to 1: shapes that agree to a step are equal, so that rounding decides nothing. */
static const double STEPS = 0x1p20;

struct point {
    double x, y;
};

/* A polygon, and the neighbors on both sides of each corner that is left of it. Points nearer than
   `rounding` to a line lie on it. */
struct ring {
    const struct point *points;
    int64_t *before, *after;
    int64_t n;
    double rounding;
};

static double length_of(struct point from, struct point to) {
    return hypotenuse(to.x - from.x, to.y - from.y);
}

/* Return twice the area of a triangle; it is positive if its corners turn left. */
static double turn(struct point a, struct point b, struct point c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static bool is_same(struct point a, struct point b) { return a.x == b.x && a.y == b.y; }

/* Return the area of the triangle at a corner over its longest side squared, in steps from 1. It
   is 0 if the triangle has no area, and -1 if it cannot be cut off: the corner turns right, or
   another one is in the triangle or on its sides. */
static double shape_of(struct ring ring, int64_t corner) {
    int64_t start = ring.before[corner], end = ring.after[corner];
    struct point a = ring.points[start], b = ring.points[corner], c = ring.points[end];
    double longest = maximum(maximum(length_of(a, b), length_of(b, c)), length_of(c, a));
    double area = turn(a, b, c), margin = ring.rounding * longest;
    if (area <= margin) return area >= -margin ? 0 : -1;
    for (int64_t at = ring.after[end]; at != start; at = ring.after[at]) {
        struct point d = ring.points[at];
        double nearest = minimum(minimum(turn(a, b, d), turn(b, c, d)), turn(c, a, d));
        /* A bridge to a hole has two corners at each of its ends. */
        bool is_corner = is_same(d, a) || is_same(d, b) || is_same(d, c);
        if (nearest >= -margin && !is_corner) return -1;
    }
    return maximum(1, __builtin_rint(STEPS * area / (longest * longest)));
}

static int64_t best_of(const double *shapes, int64_t n) {
    int64_t best = 0;
    for (int64_t i = 1; i < n; i++) {
        if (shapes[i] > shapes[best]) best = i;
    }
    return best;
}

/* Return whether the line from a to b passes between c and d. */
static bool parts(struct point a, struct point b, struct point c, struct point d, double rounding) {
    double one = turn(a, b, c), two = turn(a, b, d);
    return minimum(one, two) < -rounding && maximum(one, two) > rounding;
}

/* Return whether two sides of a polygon cross. */
static bool crosses_itself(struct ring ring) {
    const struct point *points = ring.points, *last = points + ring.n - 1;
    for (int64_t i = 0; i < ring.n; i++) {
        struct point a = i > 0 ? points[i - 1] : *last, b = points[i];
        for (int64_t j = 0; j < i; j++) {
            struct point c = j > 0 ? points[j - 1] : *last, d = points[j];
            if (parts(a, b, c, d, ring.rounding) && parts(c, d, a, b, ring.rounding)) return true;
        }
    }
    return false;
}

/* Cut one polygon; return whether it does not cross itself. */
static bool clip_polygon(struct ring ring, double *shapes, int64_t (*triangles)[3]) {
    for (int64_t i = 0; i < ring.n; i++) {
        ring.before[i] = i > 0 ? i - 1 : ring.n - 1;
        ring.after[i] = i + 1 < ring.n ? i + 1 : 0;
        shapes[i] = -1;
    }
    for (int64_t place = 0; place < ring.n - 2; place++) {
        int64_t best = best_of(shapes, ring.n);
        if (shapes[best] <= 0) {
            /* What was in the way of a corner may be gone. */
            for (int64_t i = 0; i < ring.n; i++) {
                if (shapes[i] != GONE) shapes[i] = shape_of(ring, i);
            }
            best = best_of(shapes, ring.n);
        }
        if (shapes[best] < 0) return false;
        int64_t start = ring.before[best], end = ring.after[best];
        triangles[place][0] = start;
        triangles[place][1] = best;
        triangles[place][2] = end;
        ring.after[start] = end;
        ring.before[end] = start;
        shapes[best] = GONE;
        shapes[start] = shape_of(ring, start);
        shapes[end] = shape_of(ring, end);
    }
    return !crosses_itself(ring);
}

KERNEL void clip_ears(const double *outlines, double rounding, int64_t *triangles, bool *is_simple,
                      int64_t *neighbors, double *shapes, int64_t n_polygons, int64_t n) {
    for (int64_t polygon = 0; polygon < n_polygons; polygon++) {
        const struct point *points = (const struct point *)outlines + polygon * n;
        struct ring ring = {points, neighbors, neighbors + n, n, rounding};
        int64_t (*cut)[3] = (int64_t (*)[3])triangles + polygon * (n - 2);
        is_simple[polygon] = clip_polygon(ring, shapes, cut);
    }
}
