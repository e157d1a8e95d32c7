/* Aggregates, sparse products, and smoothing. Documented in multilevel_loops.py. */
#include "kernels.h"

/* Share of a row's strongest coupling below which points do not count as neighbors. */
static const double STRONG = 0.25;
/* Share of the target size below which an aggregate is split among its neighbors. */
static const double FRAGMENT = 0.25;

/* Matrices by rows. */
struct matrix {
    const int32_t *starts, *columns;
    const double *values;
};

struct single_matrix {
    const int32_t *starts, *columns;
    const float *values;
};

/* Move each point of a fragment to its most strongly coupled aggregate, and number the others anew;
   return how many are left. */
static int64_t join_fragments(const int32_t *starts, const int32_t *columns, const double *values,
                              int32_t *labels, int64_t *counts, int64_t n, int64_t n_aggregates,
                              double least) {
    for (int64_t i = 0; i < n; i++) {
        if (counts[labels[i]] >= least) continue;
        double best = 0;
        int32_t chosen = -1;
        for (int64_t entry = starts[i]; entry < starts[i + 1]; entry++) {
            int32_t other = labels[columns[entry]];
            if (counts[other] < least || !(-values[entry] > best)) continue;
            best = -values[entry];
            chosen = other;
        }
        if (chosen >= 0) labels[i] = chosen;
    }
    int64_t *numbers = counts, n_left = 0; /* the counts are not needed any more */
    for (int64_t label = 0; label < n_aggregates; label++) numbers[label] = -1;
    for (int64_t i = 0; i < n; i++) {
        if (numbers[labels[i]] < 0) numbers[labels[i]] = n_left++;
        labels[i] = (int32_t)numbers[labels[i]];
    }
    return n_left;
}

KERNEL int64_t fill_aggregates(const int32_t *starts, const int32_t *columns, const double *values,
                               int32_t *labels, double *strongest, int64_t *counts,
                               int64_t *members, int64_t n_starts, int64_t size) {
    int64_t n = n_starts - 1, n_aggregates = 0;
    for (int64_t i = 0; i < n; i++) {
        labels[i] = -1;
        strongest[i] = 0;
        for (int64_t entry = starts[i]; entry < starts[i + 1]; entry++)
            if (columns[entry] != i && -values[entry] > strongest[i]) strongest[i] = -values[entry];
    }
    for (int64_t first = 0; first < n; first++) {
        if (labels[first] >= 0) continue;
        labels[first] = (int32_t)n_aggregates;
        members[0] = first;
        int64_t height = 1, at = 0;
        while (at < height && height < size) {
            int64_t i = members[at];
            double best = STRONG * strongest[i];
            int32_t chosen = -1;
            for (int64_t entry = starts[i]; entry < starts[i + 1]; entry++) {
                if (labels[columns[entry]] >= 0 || !(-values[entry] > best)) continue;
                best = -values[entry];
                chosen = columns[entry];
            }
            if (chosen < 0) {
                at++;
                continue;
            }
            labels[chosen] = (int32_t)n_aggregates;
            members[height++] = chosen;
        }
        counts[n_aggregates++] = height;
    }
    return join_fragments(starts, columns, values, labels, counts, n, n_aggregates,
                          FRAGMENT * (double)size);
}

/* The entries of a row of a product, if none of them coincide. */
static int64_t most_entries(const struct matrix *left, const struct matrix *right, int64_t i) {
    int64_t sum = 0;
    for (int64_t entry = left->starts[i]; entry < left->starts[i + 1]; entry++)
        sum += right->starts[left->columns[entry] + 1] - right->starts[left->columns[entry]];
    return sum;
}

/* `places` holds where the entry of each column of the product was written last. */
KERNEL int64_t fill_products(const struct matrix *left, const struct matrix *right, int64_t begin,
                             int64_t end, int32_t *lengths, int32_t *columns, double *values,
                             int64_t *places, int64_t room, int64_t n_columns) {
    int64_t height = 0;
    for (int64_t i = begin; i < end; i++) {
        int64_t first = height;
        if (room - height < n_columns && room - height < most_entries(left, right, i))
            return i - begin;
        for (int64_t entry = left->starts[i]; entry < left->starts[i + 1]; entry++) {
            int64_t j = left->columns[entry];
            double share = left->values[entry];
            for (int64_t other = right->starts[j]; other < right->starts[j + 1]; other++) {
                int32_t c = right->columns[other];
                if (places[c] < first) {
                    places[c] = height;
                    columns[height] = c;
                    values[height++] = 0;
                }
                values[places[c]] += share * right->values[other];
            }
        }
        lengths[i - begin] = (int32_t)(height - first);
    }
    return end - begin;
}

/* Functions that fill a row of a product with columns, in the order of the entries. Four entries at a
   time: the compiler then keeps more in registers, which takes 0.8 of the time. A macro, since three
   pairs of types are multiplied, each in its own precision. */
#define DEFINE_ROW_PRODUCT(name, value_type, block_type, sum_type)                                 \
    static inline void name(const int32_t *columns, const value_type *values, int64_t entry,       \
                            int64_t end, const block_type *block, int64_t width,                   \
                            sum_type *restrict sums) {                                             \
        for (int64_t c = 0; c < width; c++) sums[c] = 0;                                           \
        for (; entry + 4 <= end; entry += 4) {                                                     \
            const block_type *j = block + columns[entry] * width;                                  \
            const block_type *k = block + columns[entry + 1] * width;                              \
            const block_type *m = block + columns[entry + 2] * width;                              \
            const block_type *n = block + columns[entry + 3] * width;                              \
            value_type v = values[entry], w = values[entry + 1];                                   \
            value_type x = values[entry + 2], y = values[entry + 3];                               \
            for (int64_t c = 0; c < width; c++)                                                    \
                sums[c] = (((sums[c] + v * j[c]) + w * k[c]) + x * m[c]) + y * n[c];               \
        }                                                                                          \
        for (; entry < end; entry++) {                                                             \
            const block_type *j = block + columns[entry] * width;                                  \
            for (int64_t c = 0; c < width; c++) sums[c] += values[entry] * j[c];                   \
        }                                                                                          \
    }

DEFINE_ROW_PRODUCT(fill_single_row, float, float, float)
DEFINE_ROW_PRODUCT(fill_mixed_row, double, float, double)
DEFINE_ROW_PRODUCT(fill_double_row, double, double, double)

KERNEL void multiply_single(const int32_t *starts, const int32_t *columns, const float *values,
                            const float *block, float *product, int64_t begin, int64_t end,
                            int64_t first, int64_t width) {
    for (int64_t i = begin; i < end; i++)
        fill_single_row(columns, values, starts[i], starts[i + 1], block, width,
                        product + (first + i - begin) * width);
}

KERNEL void multiply_mixed(const int32_t *starts, const int32_t *columns, const double *values,
                           const float *block, double *product, int64_t begin, int64_t end,
                           int64_t first, int64_t width) {
    for (int64_t i = begin; i < end; i++)
        fill_mixed_row(columns, values, starts[i], starts[i + 1], block, width,
                       product + (first + i - begin) * width);
}

KERNEL void multiply_double(const int32_t *starts, const int32_t *columns, const double *values,
                            const double *block, double *product, int64_t begin, int64_t end,
                            int64_t first, int64_t width) {
    for (int64_t i = begin; i < end; i++)
        fill_double_row(columns, values, starts[i], starts[i + 1], block, width,
                        product + (first + i - begin) * width);
}

struct scales {
    const float *weights, *inverse;
};

struct terms {
    const float *right, *shifts;
};

/* A row of `moved` holds that of the product until the step is known. */
KERNEL void smoothing_step(const struct single_matrix *matrix, const struct scales *scales,
                           const struct terms *terms, const float *block, float *step, float *moved,
                           double old, double new, int64_t begin, int64_t end, int64_t width) {
    float keep = (float)old;
    for (int64_t i = begin; i < end; i++) {
        const float *from = block + i * width, *right = terms->right + i * width;
        float *restrict to = moved + i * width, *restrict change = step + i * width;
        fill_single_row(matrix->columns, matrix->values, matrix->starts[i], matrix->starts[i + 1],
                        block, width, to);
        float weight = scales->weights[i], factor = scales->inverse[i] * (float)new;
        for (int64_t c = 0; c < width; c++) {
            float rest = (right[c] - to[c]) + (weight * terms->shifts[c]) * from[c];
            change[c] = keep * change[c] + factor * rest;
            to[c] = from[c] + change[c];
        }
    }
}
