/* Voronoi cells in the plane: documented in cell_loops.py. */
#include "kernels.h"

struct point {
    double x, y;
};

/* Return whether a point lies on the right of the line through two others, or on the line. */
static bool is_not_left(struct point from, struct point to, struct point of) {
    return (to.x - from.x) * (of.y - from.y) <= (to.y - from.y) * (of.x - from.x);
}

/* Write the convex hull of points that are sorted by x, then y, by Andrew's monotone chain (1979):
   the lower side from left to right, then the upper one back. */
static int64_t fill_hull(const struct point *points, int64_t n, struct point *hull) {
    int64_t n_corners = 0;
    for (int upper = 0; upper < 2; upper++) {
        int64_t floor = n_corners;
        for (int64_t step = 0; step < n; step++) {
            struct point next = points[upper ? n - 1 - step : step];
            while (n_corners >= floor + 2 &&
                   is_not_left(hull[n_corners - 2], hull[n_corners - 1], next)) {
                n_corners--;
            }
            hull[n_corners++] = next;
        }
        n_corners--; /* the end of one chain begins the next */
    }
    return n_corners;
}

/* Write what of a convex cell is nearer to the origin than to a point. */
static int64_t cut_cell(const struct point *cell, int64_t n_corners, struct point beyond,
                        struct point *found) {
    double level = (beyond.x * beyond.x + beyond.y * beyond.y) / 2;
    int64_t n_kept = 0;
    for (int64_t i = 0; i < n_corners; i++) {
        struct point from = cell[i], to = cell[(i + 1) % n_corners];
        double here = beyond.x * from.x + beyond.y * from.y - level;
        double there = beyond.x * to.x + beyond.y * to.y - level;
        if (here <= 0) found[n_kept++] = from;
        if ((here <= 0) != (there <= 0)) {
            double share = here / (here - there);
            double x = from.x + share * (to.x - from.x), y = from.y + share * (to.y - from.y);
            found[n_kept++] = (struct point){x, y};
        }
    }
    return n_kept;
}

static double area_of(const struct point *cell, int64_t n_corners) {
    double area = 0;
    for (int64_t i = 0; i < n_corners; i++) {
        struct point from = cell[i], to = cell[(i + 1) % n_corners];
        area += (from.x * to.y - from.y * to.x) / 2;
    }
    return area;
}

KERNEL void cell_areas(const double *places, double *areas, double *scratch, int64_t n_sets,
                       int64_t n_points) {
    struct point *cell = (struct point *)scratch, *other = cell + 2 * n_points + 4;
    for (int64_t set = 0; set < n_sets; set++) {
        const struct point *points = (const struct point *)places + set * n_points;
        int64_t n_corners = fill_hull(points, n_points, cell);
        for (int64_t j = 0; j < n_points; j++) {
            n_corners = cut_cell(cell, n_corners, points[j], other);
            struct point *cut = other;
            other = cell;
            cell = cut;
        }
        areas[set] = area_of(cell, n_corners);
    }
}
