/* The search in a tree of rows, which other kernels call, too. Documented in nearest_loops.py. */
#pragma once
#include "kernels.h"

KERNEL void find_nearest_rows(const double (*points)[6], const double (*rows)[6], int64_t levels,
                              const double (*nodes)[2][6], int64_t *found, double *squares,
                              int64_t n_points, int64_t n_rows);
