/* Loops of `elimination`: symbolic analysis, which finds the entries of a factor. */
#include "kernels.h"

/* Supernodes are merged if the merged one stores few zeros that the factor does not need. The numbers
   are the columns of the merged supernode and the largest share of such zeros, the defaults of
   CHOLMOD (`nrelax`, `zrelax`). */
enum { ALWAYS = 4, OFTEN = 16, RARELY = 48 };
static const double OFTEN_ZEROS = 0.8, RARELY_ZEROS = 0.1, BEYOND_ZEROS = 0.05;

KERNEL void find_dominated(const int64_t *indptr, const int64_t *indices, const int64_t *order,
                           int64_t *leader, int64_t *mark, int64_t count) {
    for (int64_t place = 0; place < count; place++) {
        int64_t v = order[place];
        if (leader[v] >= 0) continue;
        mark[v] = v;
        for (int64_t at = indptr[v]; at < indptr[v + 1]; at++) mark[indices[at]] = v;
        for (int64_t at = indptr[v]; at < indptr[v + 1]; at++) {
            int64_t u = indices[at];
            if (u == v || leader[u] >= 0) continue;
            int64_t other = indptr[u], stop = indptr[u + 1];
            while (other < stop && mark[indices[other]] == v) other++;
            if (other == stop) leader[u] = place;
        }
    }
}

KERNEL void find_parents(const int64_t *indptr, const int64_t *indices, const int64_t *order,
                         const int64_t *place, int64_t *parent, int64_t *ancestor, int64_t n) {
    for (int64_t i = 0; i < n; i++) {
        for (int64_t at = indptr[order[i]]; at < indptr[order[i] + 1]; at++) {
            int64_t k = place[indices[at]];
            while (k != -1 && k < i) {
                int64_t following = ancestor[k];
                ancestor[k] = i;
                if (following == -1) parent[k] = i;
                k = following;
            }
        }
    }
}

KERNEL void postorder(const int64_t *parent, int64_t *first_child, int64_t *sibling, int64_t *stack,
                      int64_t *order, int64_t n) {
    for (int64_t i = n - 1; i >= 0; i--) {
        if (parent[i] < 0) continue;
        sibling[i] = first_child[parent[i]];
        first_child[parent[i]] = i;
    }
    int64_t size = 0;
    for (int64_t root = 0; root < n; root++) {
        if (parent[root] >= 0) continue;
        int64_t top = 0;
        stack[top++] = root;
        while (top) {
            int64_t node = stack[top - 1], child = first_child[node];
            if (child >= 0) {
                first_child[node] = sibling[child];
                stack[top++] = child;
            } else {
                order[size++] = node;
                top--;
            }
        }
    }
}

KERNEL void count_entries(const int64_t *indptr, const int64_t *indices, const int64_t *order,
                          const int64_t *place, const int64_t *parent, int64_t *mark,
                          int64_t *counts, int64_t n) {
    for (int64_t i = 0; i < n; i++) {
        mark[i] = i;
        for (int64_t at = indptr[order[i]]; at < indptr[order[i] + 1]; at++) {
            int64_t k = place[indices[at]];
            while (k < i && mark[k] != i) {
                counts[k]++;
                mark[k] = i;
                k = parent[k];
            }
        }
    }
}

KERNEL void join_runs(const int64_t *parent, const int64_t *first, int64_t *heights,
                      int64_t *widths, double *zeros, bool *keep, int64_t size) {
    for (int64_t s = size - 2; s >= 0; s--) { /* s + 1 has already absorbed those after it */
        int64_t up = parent[first[s + 1] - 1];
        if (up < first[s + 1] || up >= first[s + 1] + widths[s + 1]) continue;
        int64_t columns = widths[s] + widths[s + 1];
        /* Exact: all other rows of s are also rows of its parent. */
        int64_t rows = widths[s] + heights[s + 1];
        double lost = zeros[s + 1] + (double)(widths[s] * (rows - heights[s]));
        double entries =
            (double)(columns * (columns + 1)) / 2 + (double)(columns * (rows - columns));
        double share = lost / entries;
        bool joins = columns <= ALWAYS || lost == 0 || (columns <= OFTEN && share < OFTEN_ZEROS) ||
                     (columns <= RARELY && share < RARELY_ZEROS) || share < BEYOND_ZEROS;
        if (!joins) continue;
        keep[s + 1] = false;
        widths[s] = columns;
        heights[s] = rows;
        zeros[s] = lost;
    }
}

KERNEL void find_front_rows(const int64_t *indptr, const int64_t *indices, const int64_t *order,
                            const int64_t *place, const int64_t *first, const int64_t *begins,
                            const int64_t *above, int64_t *rows, int64_t *first_child,
                            int64_t *sibling, int64_t *mark, int64_t size) {
    for (int64_t s = 0; s < size; s++) {
        int64_t high = first[s + 1], stop = begins[s];
        for (int64_t j = first[s]; j < high; j++) rows[stop++] = j;
        for (int64_t j = first[s]; j < high; j++) {
            for (int64_t at = indptr[order[j]]; at < indptr[order[j] + 1]; at++) {
                int64_t i = place[indices[at]];
                if (i < high || mark[i] == s) continue;
                mark[i] = s;
                rows[stop++] = i;
            }
        }
        for (int64_t child = first_child[s]; child >= 0; child = sibling[child]) {
            for (int64_t at = begins[child]; at < begins[child + 1]; at++) {
                int64_t i = rows[at];
                if (i < high || mark[i] == s) continue;
                mark[i] = s;
                rows[stop++] = i;
            }
        }
        if (above[s] < 0) continue;
        sibling[s] = first_child[above[s]];
        first_child[above[s]] = s;
    }
}
