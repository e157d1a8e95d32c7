/* Eliminate the first columns of one dense front, which is flat, row by row. Only entries on and below
   the diagonal are used. Both functions return whether all pivots are finite and not zero. */
#pragma once
#include "sparse/blas.h"
#include "sparse/lanes.h"

enum {
    WIDE = 64,  /* columns of a panel: 32 rows are 16 KiB, half of the first-level cache */
    LONG = 256, /* terms of a sum in one product: shorter sums have less rounding error */
    TALL = 384, /* rows that are updated at once, */
    SHORT = 96, /* and across the diagonal */
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

/* The triangle on the diagonal of columns start to end - 1, column by column. */
static bool eliminate_triangle(double *front, int64_t height, double *pivots, int64_t start,
                               int64_t end) {
    double column[WIDE];
    for (int64_t j = start; j < end; j++) {
        double *corner = front + j * height + j, pivot = *corner;
        if (!is_usable(pivot)) return false;
        pivots[j] = pivot;
        *corner = 1;
        for (int64_t i = j + 1; i < end; i++) {
            double *row = front + i * height, share = row[j];
            row[j] = column[i - start] = share / pivot;
            for (int64_t k = j + 1; k <= i; k++) row[k] -= share * column[k - start];
        }
    }
    return true;
}

/* Replace X by X L^-T for the unit triangle L of some columns, where X has eight rows, and the numbers
   of a column are adjacent. */
static void solve_eight_rows(const double *triangle, int64_t height, int64_t columns, eight *x) {
    for (int64_t low = 0; low < columns; low += MOST_SUMS) {
        const double *rows = triangle + low * height;
        int64_t high = lesser(low + MOST_SUMS, columns);
        if (high - low == MOST_SUMS)
            subtract_sums(MOST_SUMS, rows, 1, height, x, low, x + low);
        else
            for (int64_t j = low; j < high; j++)
                subtract_sums(1, triangle + j * height, 1, 0, x, low, x + j);
        for (int64_t j = low + 1; j < high; j++)
            subtract_sums(1, triangle + j * height + low, 1, 0, x + low, j - low, x + j);
    }
}

/* The rows below that triangle, which become rows of L. L D is written to `times`, row by row; `x` is
   scratch for WIDE columns. */
static void eliminate_rows(double *front, int64_t height, const double *pivots, double *times,
                           eight *x, int64_t start, int64_t end) {
    const double *triangle = front + start * height + start, *turned = (const double *)x;
    int64_t columns = end - start;
    for (int64_t i = end; i < height; i += LANES) {
        int64_t count = lesser(LANES, height - i);
        for (int64_t q = 0; q < count; q++)
            for (int64_t j = 0; j < columns; j++)
                ((double *)x)[j * LANES + q] = front[(i + q) * height + start + j];
        solve_eight_rows(triangle, height, columns, x);
        for (int64_t q = 0; q < count; q++) {
            double *restrict row = front + (i + q) * height + start;
            double *restrict unscaled = times + (i + q) * LONG;
            for (int64_t j = 0; j < columns; j++) unscaled[j] = turned[j * LANES + q];
            for (int64_t j = 0; j < columns; j++) row[j] = unscaled[j] / pivots[start + j];
        }
    }
}

/* Subtract from columns `from` to `to` - 1 of a front, on and below the diagonal, what columns first to
   end - 1 give: L D in `times` times L. */
static void update_columns(double *front, int64_t height, const double *times, int64_t first,
                           int64_t end, int64_t from, int64_t to, const struct blas *blas) {
    int terms = (int)(end - first);
    for (int64_t top = from; top < height; top += TALL) {
        int64_t bottom = lesser(top + TALL, height), diagonal = lesser(top, to);
        if (diagonal > from)
            subtract_product(blas, (int)(bottom - top), (int)(diagonal - from), terms,
                             times + top * LONG, LONG, front + from * height + first, (int)height,
                             front + top * height + from, (int)height);
        /* The block on the diagonal, in lower strips, so that little is computed above it. */
        for (int64_t high = top; diagonal < to && high < bottom; high += SHORT) {
            int64_t low = lesser(high + SHORT, bottom), columns = lesser(low, to) - diagonal;
            subtract_product(blas, (int)(low - high), (int)columns, terms, times + high * LONG,
                             LONG, front + diagonal * height + first, (int)height,
                             front + high * height + diagonal, (int)height);
        }
    }
}

/* Blocks of LONG columns in panels of WIDE: a panel updates the rest of its block, and a block all
   columns after it. `times` has LONG numbers a row, and more for a panel of eight rows. */
static bool eliminate_blocked(double *front, int64_t height, int64_t width, double *pivots,
                              double *times, const struct blas *blas) {
    eight *turned = (eight *)(times + height * LONG);
    for (int64_t block = 0; block < width; block += LONG) {
        int64_t stop = lesser(block + LONG, width);
        for (int64_t start = block; start < stop; start += WIDE) {
            int64_t end = lesser(start + WIDE, stop);
            double *own = times + start - block;
            if (!eliminate_triangle(front, height, pivots, start, end)) return false;
            eliminate_rows(front, height, pivots, own, turned, start, end);
            if (end < stop) update_columns(front, height, own, start, end, end, stop, blas);
        }
        update_columns(front, height, times, block, stop, stop, height, blas);
    }
    return true;
}
