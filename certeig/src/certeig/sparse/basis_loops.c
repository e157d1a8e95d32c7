/* Loops of products with tall blocks whose columns are packed by eight. */
#include "sparse/lanes.h"

enum { CHUNK = 4096 }; /* rows of a block that take a quarter of the second-level cache */

KERNEL void add_products(const eight *space, const eight *columns, eight *parts, int64_t begin,
                         int64_t end, int64_t slots, int64_t groups, int64_t n) {
    for (int64_t start = 0; start < n; start += CHUNK) {
        int64_t count = lesser(CHUNK, n - start);
        for (int64_t slot = begin; slot < end; slot++) {
            const double *shares = (const double *)(space + slot * n + start);
            for (int64_t group = 0; group < groups; group++) {
                eight sums[LANES], *to = parts + (group * slots + slot) * LANES;
                const eight *given = columns + group * n + start;
                fill_sums(LANES, sums, shares, LANES, 1, given, count, AHEAD);
                for (int q = 0; q < LANES; q++) to[q] += sums[q];
            }
        }
    }
}

KERNEL void subtract_combination(const eight *space, const eight *parts, eight *columns,
                                 int64_t begin, int64_t end, int64_t slots, int64_t groups,
                                 int64_t n) {
    for (int64_t start = begin; start < end; start += CHUNK) {
        int64_t stop = lesser(start + CHUNK, end), four = start + (stop - start) / 4 * 4;
        for (int64_t slot = 0; slot < slots; slot++) {
            for (int64_t row = start; row < stop; row += row < four ? 4 : 1) {
                const eight *place = space + slot * n + row;
                const double *shares = (const double *)place;
                if (row < four)
                    for (int ahead = AHEAD; ahead < AHEAD + 4; ahead++) fetch(place + ahead);
                for (int64_t group = 0; group < groups; group++) {
                    const eight *given = parts + (group * slots + slot) * LANES;
                    eight *to = columns + group * n + row;
                    if (row < four)
                        subtract_sums(4, shares, 1, LANES, given, LANES, to);
                    else
                        subtract_sums(1, shares, 1, 0, given, LANES, to);
                }
            }
        }
    }
}

struct matrix {
    const int64_t *pointers;
    const int32_t *indices;
    const double *entries;
};

/* Σ entries[p] given[indices[p]] of one row. Even and odd terms are summed separately, so that an
   addition need not wait for the one before. */
INLINED eight row_product(const struct matrix *matrix, int64_t row, const eight *given) {
    const int32_t *indices = matrix->indices;
    const double *entries = matrix->entries;
    int64_t at = matrix->pointers[row], stop = matrix->pointers[row + 1];
    eight even = {0}, odd = {0};
    for (; at + 1 < stop; at += 2) {
        even = multiply_add(entries[at], given[indices[at]], even);
        odd = multiply_add(entries[at + 1], given[indices[at + 1]], odd);
    }
    if (at < stop) even = multiply_add(entries[at], given[indices[at]], even);
    return even + odd;
}

KERNEL void multiply_lanes(const struct matrix *matrix, const eight *given, const eight *before,
                           double factor, double share, int64_t begin, int64_t end, eight *out) {
    for (int64_t i = begin; i < end; i++)
        out[i] = factor * row_product(matrix, i, given) - share * before[i];
}
