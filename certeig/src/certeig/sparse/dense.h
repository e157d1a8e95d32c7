/* Eliminate the first columns of one dense front, which is flat, row by row. Only entries on and below
   the diagonal are used. Both functions return whether all pivots are finite and not zero. */
#pragma once
#include "sparse/blas.h"

enum {
    NARROW = 16, /* columns that are eliminated one by one */
    TALL = 96,   /* rows that are updated at once */
    LONG = 256,  /* terms of a sum in one product: shorter sums have less rounding error */
};

static inline bool is_usable(double pivot) {
    return 0 < absolute(pivot) && absolute(pivot) < INFINITE;
}

/* One column after the other. */
static bool eliminate_plain(double *front, int64_t height, int64_t width, double *pivots) {
    for (int64_t j = 0; j < width; j++) {
        double *corner = front + j * height + j, pivot = *corner;
        if (!is_usable(pivot)) return false;
        pivots[j] = pivot;
        *corner = 1;
        for (int64_t i = j + 1; i < height; i++) {
            double *row = front + i * height, share = row[j] / pivot;
            if (share == 0) continue;
            for (int64_t k = j + 1; k <= i; k++) row[k] -= share * front[k * height + j];
        }
        for (int64_t i = j + 1; i < height; i++) front[i * height + j] /= pivot;
    }
    return true;
}

/* The triangular block on the diagonal of columns start to end - 1, column by column. */
static bool eliminate_triangle(double *front, int64_t height, int64_t width, double *pivots,
                               double *times, int64_t start, int64_t end) {
    for (int64_t j = start; j < end; j++) {
        double *corner = front + j * height + j, pivot = *corner;
        if (!is_usable(pivot)) return false;
        pivots[j] = pivot;
        *corner = 1;
        for (int64_t i = j + 1; i < end; i++) {
            double *row = front + i * height, share = row[j];
            times[i * width + j] = share;
            row[j] = share / pivot;
            for (int64_t k = j + 1; k <= i; k++) row[k] -= share * front[k * height + j];
        }
    }
    return true;
}

/* By recursive halving, so that most work is in matrix products: the left half of a block of columns
   is eliminated, then updates the right half by a product. This loop does so in the order of the
   recursion: after every NARROW columns, the largest block of 2^k NARROW columns that is complete
   updates as many columns after it. At the end all columns update the rest of the front. L D is
   written to `times`, row by row. */
static bool eliminate_blocked(double *front, int64_t height, int64_t width, double *pivots,
                              double *times, const struct blas *blas) {
    for (int64_t start = 0; start < width; start += NARROW) {
        int64_t end = lesser(start + NARROW, width);
        if (!eliminate_triangle(front, height, width, pivots, times, start, end)) return false;
        /* The rows below the triangle. */
        for (int64_t i = end; i < height; i++)
            for (int64_t j = start; j < end; j++) times[i * width + j] = front[i * height + j];
        solve_triangle(blas, (int)(height - end), (int)(end - start),
                       front + start * height + start, (int)height, times + end * width + start,
                       (int)width);
        for (int64_t i = end; i < height; i++)
            for (int64_t j = start; j < end; j++)
                front[i * height + j] = times[i * width + j] / pivots[j];
        int64_t first = 0, last = height;
        if (end < width) {
            int64_t done = (end + NARROW - 1) / NARROW;
            int64_t span = (done & -done) * NARROW;
            first = greater(end - span, 0);
            last = lesser(end + span, width);
        }
        for (int64_t top = end; top < height; top += TALL) {
            int64_t bottom = lesser(top + TALL, height);
            int64_t columns = lesser(bottom, last) - end; /* on and below the diagonal */
            for (int64_t term = first; term < end; term += LONG)
                subtract_product(blas, (int)(bottom - top), (int)columns,
                                 (int)(lesser(term + LONG, end) - term), times + top * width + term,
                                 (int)width, front + end * height + term, (int)height,
                                 front + top * height + end, (int)height);
        }
    }
    return true;
}
