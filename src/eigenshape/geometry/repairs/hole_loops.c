/* The cheapest triangulation of a closed chain of points: documented in hole_loops.py. */
#include "kernels.h"

/* The share of the squared sides of a triangle in its cost, beside the area: all triangulations of
   a flat hole have one area, and this term chooses that without slivers. */
static const double SHAPE = 0.01;
/* A triangle with at most this share of its squared sides as area is degenerate: it is not used. */
static const double FLAT = 1e-7;

static double dot(const double u[3], const double v[3]) {
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
}

static double cost_of(const double a[3], const double b[3], const double c[3]) {
    double u[3], v[3], w[3];
    for (int i = 0; i < 3; i++) {
        u[i] = b[i] - a[i];
        v[i] = c[i] - a[i];
        w[i] = c[i] - b[i];
    }
    const double normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                              u[0] * v[1] - u[1] * v[0]};
    double area = square_root(dot(normal, normal)) / 2;
    double sides = dot(u, u) + dot(v, v) + dot(w, w);
    return area > FLAT * sides ? area + SHAPE * sides : INFINITE;
}

/* costs[i][j] is the least cost of the chain from i to j, closed by the side between its ends; the
   corner opposite to that side is middles[i][j]. */
KERNEL void fill_chains(const double (*points)[3], const bool *taken, double *costs,
                        int64_t *middles, int64_t n) {
    for (int64_t i = 0; i < n * n; i++) {
        costs[i] = INFINITE;
        middles[i] = 0;
    }
    for (int64_t i = 0; i + 1 < n; i++) costs[i * n + i + 1] = 0;
    for (int64_t span = 2; span < n; span++) {
        for (int64_t i = 0; i < n - span; i++) {
            int64_t j = i + span, chain = i * n + j;
            if (span < n - 1 && taken[chain]) continue;
            for (int64_t m = i + 1; m < j; m++) {
                double known = costs[i * n + m] + costs[m * n + j];
                if (!(known < costs[chain])) continue;
                double total = known + cost_of(points[i], points[m], points[j]);
                if (!(total < costs[chain])) continue;
                costs[chain] = total;
                middles[chain] = m;
            }
        }
    }
}
