/* A routine of SciPy's BLAS, whose address Python hands in, on parts of matrices in C order. A part
   is given by its first entry, and by the number of entries from one row to the next. */
#pragma once
#include "kernels.h"

struct blas {
    void (*dgemm)(const char *, const char *, const int *, const int *, const int *, const double *,
                  const double *, const int *, const double *, const int *, const double *,
                  double *, const int *);
};

/* Subtract A Bᵀ from C. In Fortran's order every matrix is transposed: Cᵀ = Cᵀ - B Aᵀ. */
static inline void subtract_product(const struct blas *blas, int rows, int columns, int terms,
                                    const double *a, int a_wide, const double *b, int b_wide,
                                    double *c, int c_wide) {
    const double minus = -1, one = 1;
    blas->dgemm("T", "N", &columns, &rows, &terms, &minus, b, &b_wide, a, &a_wide, &one, c,
                &c_wide);
}
