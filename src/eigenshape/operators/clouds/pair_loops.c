/* Loops over clouds: documented in pair_loops.py. */
#include "kernels.h"

struct libm {
    double (*exp)(double);
};

/* Points in the order of cells, the first of each cell, and the runs, half-open ranges, that hold
   all partners of the points of a cell. */
struct cells {
    const double *points;
    const int64_t *firsts;
    const int64_t (*runs)[2];
};

static double square_between(const double *one, const double *two, int64_t dim) {
    double total = 0;
    for (int64_t axis = 0; axis < dim; axis++) {
        double step = one[axis] - two[axis];
        total += step * step;
    }
    return total;
}

KERNEL void count_pairs(const struct cells *cells, const int64_t *order, double farthest,
                        const bool *wanted, int64_t *counts, int64_t begin, int64_t end,
                        int64_t dim, int64_t n_runs) {
    const double *points = cells->points;
    for (int64_t cell = begin; cell < end; cell++) {
        for (int64_t i = cells->firsts[cell]; i < cells->firsts[cell + 1]; i++) {
            if (!wanted[order[i]]) continue;
            int64_t found = 0;
            for (int64_t run = cell * n_runs; run < (cell + 1) * n_runs; run++) {
                for (int64_t j = cells->runs[run][0]; j < cells->runs[run][1]; j++)
                    found += square_between(points + i * dim, points + j * dim, dim) <= farthest;
            }
            counts[order[i]] = found;
        }
    }
}

/* Sort numbers by Shell sort with Knuth's gaps (1973). */
static void sort(int64_t *numbers, int64_t n) {
    int64_t gap = 1;
    while (3 * gap < n) gap = 3 * gap + 1;
    for (; gap > 0; gap /= 3) {
        for (int64_t i = gap; i < n; i++) {
            int64_t number = numbers[i], into = i;
            for (; into >= gap && numbers[into - gap] > number; into -= gap)
                numbers[into] = numbers[into - gap];
            numbers[into] = number;
        }
    }
}

KERNEL void fill_pairs(const struct cells *cells, const int64_t *order, const int64_t *place,
                       double farthest, double rate, const struct libm *libm, const double *weights,
                       const int64_t *starts, int32_t *columns, double *values, int64_t *numbers,
                       double *near, int64_t begin, int64_t end, int64_t dim, int64_t n_runs) {
    const double *points = cells->points;
    for (int64_t cell = begin; cell < end; cell++) {
        /* The numbers of points that may lie within reach, before they were sorted into cells,
           ascending. */
        int64_t n_near = 0;
        for (int64_t run = cell * n_runs; run < (cell + 1) * n_runs; run++) {
            for (int64_t j = cells->runs[run][0]; j < cells->runs[run][1]; j++)
                numbers[n_near++] = order[j];
        }
        sort(numbers, n_near);
        for (int64_t j = 0; j < n_near; j++) {
            const double *point = points + place[numbers[j]] * dim;
            for (int64_t axis = 0; axis < dim; axis++) near[j * dim + axis] = point[axis];
        }
        for (int64_t i = cells->firsts[cell]; i < cells->firsts[cell + 1]; i++) {
            int64_t row = order[i], entry = starts[row];
            for (int64_t j = 0; j < n_near; j++) {
                double square = square_between(points + i * dim, near + j * dim, dim);
                if (!(square <= farthest)) continue;
                columns[entry] = (int32_t)numbers[j];
                values[entry] = weights[row] * weights[numbers[j]] * libm->exp(-rate * square);
                entry++;
            }
        }
    }
}

KERNEL void sum_differences(const struct cells *cells, double farthest, double rate,
                            const struct libm *libm, const double *weights, const double *values,
                            double *sums, int64_t begin, int64_t end, int64_t dim, int64_t n_runs,
                            int64_t n_values) {
    const double *points = cells->points;
    for (int64_t cell = begin; cell < end; cell++) {
        for (int64_t i = cells->firsts[cell]; i < cells->firsts[cell + 1]; i++) {
            const double *own = values + i * n_values;
            double *sum = sums + i * n_values;
            for (int64_t b = 0; b < n_values; b++) sum[b] = 0;
            for (int64_t run = cell * n_runs; run < (cell + 1) * n_runs; run++) {
                for (int64_t j = cells->runs[run][0]; j < cells->runs[run][1]; j++) {
                    double square = square_between(points + i * dim, points + j * dim, dim);
                    if (!(square <= farthest)) continue;
                    double pair = weights[i] * weights[j] * libm->exp(-rate * square);
                    for (int64_t b = 0; b < n_values; b++)
                        sum[b] += pair * (own[b] - values[j * n_values + b]);
                }
            }
        }
    }
}

KERNEL void fill_labels(const int64_t *starts, const int32_t *columns, int64_t *labels,
                        int64_t *stack, int64_t n) {
    int64_t n_components = 0;
    for (int64_t row = 0; row < n; row++) labels[row] = -1;
    for (int64_t first = 0; first < n; first++) {
        if (labels[first] >= 0) continue;
        int64_t height = 0;
        labels[first] = n_components;
        stack[height++] = first;
        while (height > 0) {
            int64_t row = stack[--height];
            for (int64_t entry = starts[row]; entry < starts[row + 1]; entry++) {
                int64_t other = columns[entry];
                if (labels[other] >= 0) continue;
                labels[other] = n_components;
                stack[height++] = other;
            }
        }
        n_components++;
    }
}

/* Return whether a point comes before another by x, then y, then number. */
static bool precedes(const double *x, const double *y, int64_t one, int64_t two) {
    if (x[one] != x[two]) return x[one] < x[two];
    if (y[one] != y[two]) return y[one] < y[two];
    return one < two;
}

/* Write the numbers of points in that order, by Shell sort. */
static void order_points(const double *x, const double *y, int64_t *order, int64_t n) {
    int64_t gap = 1;
    while (3 * gap < n) gap = 3 * gap + 1;
    for (int64_t i = 0; i < n; i++) order[i] = i;
    for (; gap > 0; gap /= 3) {
        for (int64_t i = gap; i < n; i++) {
            int64_t point = order[i], into = i;
            for (; into >= gap && precedes(x, y, point, order[into - gap]); into -= gap)
                order[into] = order[into - gap];
            order[into] = point;
        }
    }
}

/* Return whether the path over three points turns left. */
static bool turns_left(const double *x, const double *y, int64_t one, int64_t two, int64_t three) {
    return (x[two] - x[one]) * (y[three] - y[one]) > (y[two] - y[one]) * (x[three] - x[one]);
}

KERNEL void local_rings(const double *x, const double *y, int64_t *rings, int64_t *order,
                        int64_t *hull, int64_t n_points, int64_t n) {
    for (int64_t offset = 0; offset < n_points * n; offset += n) {
        const double *row_x = x + offset, *row_y = y + offset;
        int64_t size = 0;
        order_points(row_x, row_y, order, n);
        for (int upper = 0; upper < 2; upper++) {
            int64_t start = size;
            for (int64_t step = 0; step < n; step++) {
                int64_t node = order[upper ? n - 1 - step : step];
                while (size - start >= 2 &&
                       !turns_left(row_x, row_y, hull[size - 2], hull[size - 1], node))
                    size--;
                hull[size++] = node;
            }
            size--; /* the last of each half begins the other */
        }
        for (int64_t j = 0; j < n; j++) rings[offset + j] = j < size ? hull[j] : -1;
    }
}
