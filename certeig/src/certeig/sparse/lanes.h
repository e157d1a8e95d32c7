/* Rows of eight numbers and sums of them, the innermost loop of solves and projections. The compiler
   splits these vectors into the sizes of the processor. */
#pragma once
#include "kernels.h"

enum {
    LANES =
        8, /* doubles of 512 bits; processors without such vectors take two or four instructions */
    AHEAD =
        32, /* rows after the present one that memory is asked for, since it takes long to answer
                   (measured) */
    MOST_SUMS = 8, /* that fit into registers */
};

typedef double eight __attribute__((vector_size(8 * LANES), aligned(8)));

#define INLINED static inline __attribute__((always_inline))

/* a b + c, rounded once where the processor can: the one place where this is allowed. */
INLINED eight multiply_add(double a, eight b, eight c) {
#pragma clang fp contract(fast)
    return a * b + c;
}

/* Ask memory for what may be needed soon; it may lie beyond the end of an array. */
INLINED void fetch(const void *address) { __builtin_prefetch(address, 0, 3); }

/* Fill sums q < n of Σ_t shares[t stride + q apart] given[t]. Several sums use the multipliers better,
   as long as all fit into registers. If `ahead` is not 0, memory is asked for the shares of the term
   so many later. */
INLINED void fill_sums(int n, eight *sums, const double *shares, int64_t stride, int64_t apart,
                       const eight *given, int64_t count, int64_t ahead) {
    for (int q = 0; q < n; q++) sums[q] = (eight){0};
    for (int64_t t = 0; t < count; t++) {
        if (ahead) fetch(shares + (t + ahead) * stride);
        for (int q = 0; q < n; q++)
            sums[q] = multiply_add(shares[t * stride + q * apart], given[t], sums[q]);
    }
}

/* Subtract such sums from the rows of `taken`. */
INLINED void subtract_sums(int n, const double *shares, int64_t stride, int64_t apart,
                           const eight *given, int64_t count, eight *taken) {
    eight sums[MOST_SUMS];
    fill_sums(n, sums, shares, stride, apart, given, count, 0);
    for (int q = 0; q < n; q++) taken[q] -= sums[q];
}

/* Write such sums, with the other sign, to the rows of `taken`. */
INLINED void write_negative_sums(int n, const double *shares, int64_t stride, int64_t apart,
                                 const eight *given, int64_t count, eight *taken) {
    eight sums[MOST_SUMS];
    fill_sums(n, sums, shares, stride, apart, given, count, 0);
    for (int q = 0; q < n; q++) taken[q] = (eight){0} - sums[q];
}
