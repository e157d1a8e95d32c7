/* Loops of `distance` and `coarse`: codes of four bits, and distances of two descriptions or of short
   rows. */
#include "kernels.h"

static void unpack_row(const uint8_t *packed, int8_t *code, int64_t half) {
    for (int64_t place = 0; place < half; place++) {
        code[place] = (int8_t)((packed[place] & 15) - 8);
        code[half + place] = (int8_t)((packed[place] >> 4) - 8);
    }
}

KERNEL void unpack(const uint8_t *rows, int8_t *codes, int64_t n, int64_t half) {
    for (int64_t row = 0; row < n; row++)
        unpack_row(rows + row * half, codes + row * 2 * half, half);
}

/* The product of two codes; the sum fits 32 bits. */
static int32_t dot(const int8_t *one, const int8_t *two, int64_t v) {
    int32_t total = 0;
    for (int64_t place = 0; place < v; place++) total += (int32_t)one[place] * two[place];
    return total;
}

/* Codes one below the other, and the length of each. */
struct codes {
    const int8_t *rows;
    const double *lengths;
};

static struct codes from_row(struct codes codes, int64_t row, int64_t v) {
    return (struct codes){codes.rows + row * v, codes.lengths + row};
}

KERNEL void lengths(const int8_t *codes, double *found, int64_t m, int64_t v) {
    for (int64_t row = 0; row < m; row++) {
        int32_t squares = dot(codes + row * v, codes + row * v, v);
        found[row] = squares > 0 ? square_root((double)squares) : 1; /* cosines of zeros are 0 */
    }
}

/* 1 - the mean cosine of two descriptions at the best relative size. */
static double distance(struct codes one, struct codes two, int64_t n_bases, int64_t n_sizes,
                       double price, int64_t v) {
    double best = -INFINITE;
    for (int64_t step = 1 - n_sizes; step < n_sizes; step++) {
        int64_t ours = greater(-step, 0), theirs = greater(step, 0);
        double total = 0;
        for (int64_t base = 0; base < n_bases; base++) {
            int64_t a = base * n_sizes + ours, b = base * n_sizes + theirs;
            double size = one.lengths[a] * two.lengths[b];
            total += dot(one.rows + a * v, two.rows + b * v, v) / size;
        }
        double score = total / (double)n_bases - price * (double)(ours + theirs);
        if (score > best) best = score;
    }
    return best < 1 ? 1 - best : 0; /* rounding may leave a cosine above 1 */
}

KERNEL void distances_to(const int8_t *query, const double *query_lengths, const int8_t *others,
                         const double *other_lengths, int64_t n_sizes, double price, double *found,
                         int64_t m, int64_t k, int64_t v) {
    const struct codes one = {query, query_lengths}, all = {others, other_lengths};
    for (int64_t place = 0; place < k; place++)
        found[place] = distance(one, from_row(all, place * m, v), m / n_sizes, n_sizes, price, v);
}

KERNEL double packed_view_distance(const int8_t *query, const double *query_lengths,
                                   const uint8_t *packed, int8_t *codes, double *code_lengths,
                                   int64_t m, int64_t n_sizes, double price, int64_t n_query,
                                   int64_t n_rows, int64_t half) {
    int64_t v = 2 * half, n_bases = m / n_sizes;
    unpack(packed, codes, n_rows, half);
    lengths(codes, code_lengths, n_rows, v);
    const struct codes one = {query, query_lengths}, other = {codes, code_lengths};
    double own = distance(one, other, n_bases, n_sizes, price, v), nearest = own;
    for (int64_t first = m; first < n_rows; first += m) {
        double view = distance(one, from_row(other, first, v), n_bases, n_sizes, price, v);
        if (view < nearest) nearest = view;
    }
    for (int64_t first = m; n_rows == m && first < n_query; first += m) {
        double view = distance(from_row(one, first, v), other, n_bases, n_sizes, price, v);
        if (view < nearest) nearest = view;
    }
    return (own + nearest) / 2;
}

static int32_t dot_of_query(const int16_t *query, const int8_t *row, int64_t d) {
    int32_t total = 0;
    for (int64_t number = 0; number < d; number++) total += (int32_t)query[number] * row[number];
    return total;
}

KERNEL void scan(const int16_t *query, const int8_t *rows, double unit, double price, float *found,
                 int64_t n, int64_t s, int64_t d) {
    for (int64_t place = 0; place < n; place++) {
        double best = -INFINITE;
        for (int64_t step = 1 - s; step < s; step++) {
            int64_t ours = greater(-step, 0), theirs = greater(step, 0);
            int32_t total = dot_of_query(query + ours * d, rows + (place * s + theirs) * d, d);
            double score = unit * total - price * (double)(ours + theirs);
            if (score > best) best = score;
        }
        found[place] = (float)(1 - best);
    }
}
