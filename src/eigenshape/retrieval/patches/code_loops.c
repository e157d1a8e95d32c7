/* Codes of four bits, and distances of descriptions by them: documented in code_loops.py. */
#include "kernels.h"

/* A description: `n_codes` codes of `width` entries, one for each base radius and size, and their
   lengths. */
struct description {
    const int8_t *codes;
    const double *lengths;
};

/* What descriptions that are compared have in common. */
struct form {
    int64_t n_codes, n_sizes, width;
    double price;
};

KERNEL void unpack(const uint8_t *rows, int8_t *codes, int64_t n_rows, int64_t half) {
    for (int64_t row = 0; row < n_rows; row++) {
        const uint8_t *packed = rows + row * half;
        int8_t *first = codes + 2 * row * half, *second = first + half;
        for (int64_t i = 0; i < half; i++) first[i] = (int8_t)((packed[i] & 15) - 8);
        for (int64_t i = 0; i < half; i++) second[i] = (int8_t)((packed[i] >> 4) - 8);
    }
}

/* Return the product of two codes; its sum fits 32 bits. */
static int32_t dot(const int8_t *one, const int8_t *two, int64_t width) {
    int32_t total = 0;
    for (int64_t i = 0; i < width; i++) total += one[i] * two[i];
    return total;
}

KERNEL void lengths(const int8_t *codes, double *found, int64_t n_rows, int64_t width) {
    for (int64_t row = 0; row < n_rows; row++) {
        const int8_t *code = codes + row * width;
        int32_t squares = dot(code, code, width);
        found[row] = squares > 0 ? square_root(squares) : 1;
    }
}

/* Return the description that begins some codes later. */
static struct description later(struct description of, int64_t n_codes, int64_t width) {
    return (struct description){of.codes + n_codes * width, of.lengths + n_codes};
}

/* Return 1 - the mean cosine of two descriptions at the best relative size. */
static double distance(struct description one, struct description two, struct form form) {
    int64_t n_bases = form.n_codes / form.n_sizes;
    double best = -INFINITE;
    for (int64_t step = 1 - form.n_sizes; step < form.n_sizes; step++) {
        int64_t ours = greater(-step, 0), theirs = greater(step, 0);
        double total = 0;
        for (int64_t base = 0; base < n_bases; base++) {
            int64_t a = base * form.n_sizes + ours, b = base * form.n_sizes + theirs;
            int32_t product =
                dot(one.codes + a * form.width, two.codes + b * form.width, form.width);
            total += product / (one.lengths[a] * two.lengths[b]);
        }
        best = maximum(best, total / n_bases - form.price * greater(step, -step));
    }
    return maximum(1 - best, 0); /* rounding may leave a cosine above 1 */
}

KERNEL void distances_to(const int8_t *query, const double *query_lengths, const int8_t *others,
                         const double *other_lengths, int64_t n_sizes, double price, double *found,
                         int64_t n_codes, int64_t width, int64_t n_others) {
    struct form form = {n_codes, n_sizes, width, price};
    struct description whole = {query, query_lengths}, other = {others, other_lengths};
    for (int64_t place = 0; place < n_others; place++) {
        found[place] = distance(whole, later(other, place * n_codes, width), form);
    }
}

/* Return the mean of two distances: to a whole, and to the nearest of it and its views. If it has
   none, the views of the query serve in their place. */
static double view_distance(struct description query, int64_t n_query_codes,
                            struct description other, int64_t n_other_codes, struct form form) {
    double own = distance(query, other, form), nearest = own;
    for (int64_t first = form.n_codes; first < n_other_codes; first += form.n_codes) {
        struct description view = later(other, first, form.width);
        nearest = minimum(nearest, distance(query, view, form));
    }
    if (n_other_codes > form.n_codes) return (own + nearest) / 2;
    for (int64_t first = form.n_codes; first < n_query_codes; first += form.n_codes) {
        struct description view = later(query, first, form.width);
        nearest = minimum(nearest, distance(view, other, form));
    }
    return (own + nearest) / 2;
}

KERNEL void packed_view_distances(const int8_t *query, const double *query_lengths,
                                  const uint8_t *const *others, const int64_t *n_rows,
                                  int8_t *codes, double *code_lengths, int64_t n_codes,
                                  int64_t n_sizes, double price, double *found,
                                  int64_t n_query_codes, int64_t width, int64_t n_others) {
    struct form form = {n_codes, n_sizes, width, price};
    struct description ours = {query, query_lengths}, theirs = {codes, code_lengths};
    for (int64_t i = 0; i < n_others; i++) {
        unpack(others[i], codes, n_rows[i], width / 2);
        lengths(codes, code_lengths, n_rows[i], width);
        found[i] = view_distance(ours, n_query_codes, theirs, n_rows[i], form);
    }
}

KERNEL void scan(const int16_t *query, const int8_t *rows, double unit, double price, float *found,
                 int64_t n_sizes, int64_t width, int64_t n_rows) {
    for (int64_t place = 0; place < n_rows; place++) {
        const int8_t *shape = rows + place * n_sizes * width;
        double best = -INFINITE;
        for (int64_t step = 1 - n_sizes; step < n_sizes; step++) {
            const int16_t *ours = query + greater(-step, 0) * width;
            const int8_t *theirs = shape + greater(step, 0) * width;
            int32_t total = 0;
            for (int64_t i = 0; i < width; i++) total += ours[i] * theirs[i];
            best = maximum(best, unit * total - price * greater(step, -step));
        }
        found[place] = (float)(1 - best);
    }
}
