/* Loop of `holes`: the cheapest triangulation of a closed chain of points. */
#include "kernels.h"

/* Share of the squared sides of a triangle in its cost, beside the area. In a flat hole all
   triangulations have the same area, and this term chooses the one without slivers. */
static const double SHAPE = 0.01;
/* A triangle with at most this share of its squared sides as area counts as degenerate and is not
   used. */
static const double FLAT = 1e-7;

static double square(const double *v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

static double cost_of(const double *a, const double *b, const double *c) {
    double u[3], v[3], w[3];
    for (int axis = 0; axis < 3; axis++) {
        u[axis] = b[axis] - a[axis];
        v[axis] = c[axis] - a[axis];
        w[axis] = c[axis] - b[axis];
    }
    double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2];
    double z = u[0] * v[1] - u[1] * v[0];
    double area = square_root(x * x + y * y + z * z) / 2;
    double sides = square(u) + square(v) + square(w);
    return area > FLAT * sides ? area + SHAPE * sides : INFINITE;
}

/* Dynamic programming over the chains i..j (Barequet and Sharir 1995): the cost of each, and the corner
   of its triangle at the side i, j. */
static void fill_costs(const double (*points)[3], const bool *taken, double *costs,
                       int64_t *middles, int64_t n) {
    for (int64_t i = 0; i < n * n; i++) costs[i] = INFINITE;
    for (int64_t i = 0; i < n - 1; i++) costs[i * n + i + 1] = 0;
    for (int64_t span = 2; span < n; span++) {
        for (int64_t i = 0; i < n - span; i++) {
            int64_t j = i + span;
            if (span < n - 1 && taken[i * n + j]) continue;
            double *least = costs + i * n + j;
            for (int64_t m = i + 1; m < j; m++) {
                double known = costs[i * n + m] + costs[m * n + j];
                if (!(known < *least)) continue;
                double total = known + cost_of(points[i], points[m], points[j]);
                if (!(total < *least)) continue;
                *least = total;
                middles[i * n + j] = m;
            }
        }
    }
}

KERNEL bool fill_polygon(const double (*points)[3], const bool *taken, double *costs,
                         int64_t *middles, int64_t (*waiting)[2], int64_t (*triangles)[3],
                         int64_t n) {
    fill_costs(points, taken, costs, middles, n);
    if (costs[n - 1] == INFINITE) return false;
    int64_t height = 0;
    waiting[height][0] = 0, waiting[height++][1] = n - 1;
    for (int64_t place = 0; place < n - 2; place++) {
        int64_t i = waiting[--height][0], j = waiting[height][1], m = middles[i * n + j];
        triangles[place][0] = j, triangles[place][1] = m, triangles[place][2] = i;
        if (m - i > 1) waiting[height][0] = i, waiting[height++][1] = m;
        if (j - m > 1) waiting[height][0] = m, waiting[height++][1] = j;
    }
    return true;
}
