/* A maximum matching (Hopcroft and Karp 1973): documented in bipartite_loops.py. */
#include "kernels.h"

/* A bipartite graph: the columns of row i are columns[starts[i]] to columns[starts[i + 1] - 1]. */
struct graph {
    const int64_t *starts;
    const int32_t *columns;
    int64_t n_rows;
};

/* The column of each row and the row of each column, or -1; and the distance of each row from a
   free row along alternating paths, or -1. */
struct matching {
    int64_t *column_of, *row_of, *depth;
};

/* Fill the depths; return whether a free column is reached. */
static bool layer_rows(struct graph graph, struct matching found, int64_t *queue) {
    int64_t height = 0, last = -1;
    for (int64_t row = 0; row < graph.n_rows; row++) {
        bool is_free = found.column_of[row] < 0;
        found.depth[row] = is_free ? 0 : -1;
        if (is_free) queue[height++] = row;
    }
    for (int64_t place = 0; place < height; place++) {
        int64_t row = queue[place], next = found.depth[row] + 1;
        if (found.depth[row] == last) break;
        for (int64_t entry = graph.starts[row]; entry < graph.starts[row + 1]; entry++) {
            int64_t other = found.row_of[graph.columns[entry]];
            if (other < 0) {
                last = next;
            } else if (found.depth[other] < 0) {
                found.depth[other] = next;
                queue[height++] = other;
            }
        }
    }
    return last >= 0;
}

/* Find a path through the layers from a free row to a free column, and flip its edges. The entry
   of a row that is tried next is `following`. */
static bool augment(int64_t free, struct graph graph, struct matching found, int64_t *following,
                    int64_t *path) {
    int64_t height = 1;
    path[0] = free;
    while (height > 0) {
        int64_t row = path[height - 1];
        if (following[row] == graph.starts[row + 1]) {
            height--;
            if (height > 0) following[path[height - 1]]++;
            continue;
        }
        int64_t other = found.row_of[graph.columns[following[row]]];
        if (other < 0) {
            while (height > 0) {
                int64_t owner = path[--height], column = graph.columns[following[owner]++];
                found.row_of[column] = owner;
                found.column_of[owner] = column;
            }
            return true;
        }
        if (found.depth[other] == found.depth[row] + 1) {
            path[height++] = other;
        } else {
            following[row]++;
        }
    }
    return false;
}

KERNEL void improve_matching(const int64_t *starts, const int32_t *columns, int64_t *column_of,
                             int64_t *row_of, int64_t *depth, int64_t *following, int64_t *path,
                             int64_t n_rows) {
    struct graph graph = {starts, columns, n_rows};
    struct matching found = {column_of, row_of, depth};
    int64_t n_free = 0;
    for (int64_t row = 0; row < n_rows; row++) {
        depth[row] = -1;
        if (column_of[row] < 0) {
            n_free++;
        } else {
            row_of[column_of[row]] = row;
        }
    }
    /* Rows of the queue need no path, so both have one memory. */
    while (n_free > 0 && layer_rows(graph, found, path)) {
        for (int64_t row = 0; row < n_rows; row++) following[row] = starts[row];
        for (int64_t row = 0; row < n_rows; row++) {
            if (column_of[row] < 0 && augment(row, graph, found, following, path)) n_free--;
        }
    }
}
