/* Loops of a maximum matching (Hopcroft and Karp 1973). The columns of row i are
   columns[starts[i]:starts[i + 1]]; -1 stands for no partner, and no depth. */
#include "kernels.h"

struct graph {
    const int64_t *starts, *columns;
};

/* Fill the distance of each row from a free row; return whether a free column is reached. Distances
   are steps along alternating paths. */
static bool layer(const struct graph *graph, const int64_t *row_of, const int64_t *column_of,
                  int64_t *depth, int64_t *queue, int64_t n) {
    int64_t height = 0, last = -1;
    for (int64_t row = 0; row < n; row++) {
        depth[row] = -1;
        if (column_of[row] >= 0) continue;
        depth[row] = 0;
        queue[height++] = row;
    }
    for (int64_t place = 0; place < height; place++) {
        int64_t row = queue[place];
        if (depth[row] == last) break;
        for (int64_t entry = graph->starts[row]; entry < graph->starts[row + 1]; entry++) {
            int64_t other = row_of[graph->columns[entry]];
            if (other < 0) {
                last = depth[row] + 1;
            } else if (depth[other] < 0) {
                depth[other] = depth[row] + 1;
                queue[height++] = other;
            }
        }
    }
    return last >= 0;
}

/* Find a path through the layers from a free row to a free column, and flip its edges. */
static bool augment(const struct graph *graph, int64_t free, int64_t *row_of, int64_t *column_of,
                    const int64_t *depth, int64_t *following, int64_t *path) {
    int64_t height = 0;
    path[height++] = free;
    while (height) {
        int64_t row = path[height - 1];
        if (following[row] == graph->starts[row + 1]) {
            height--;
            if (height) following[path[height - 1]]++;
            continue;
        }
        int64_t other = row_of[graph->columns[following[row]]];
        if (other < 0) {
            for (int64_t step = height - 1; step >= 0; step--) {
                int64_t column = graph->columns[following[path[step]]++];
                row_of[column] = path[step];
                column_of[path[step]] = column;
            }
            return true;
        }
        if (depth[other] == depth[row] + 1)
            path[height++] = other;
        else
            following[row]++;
    }
    return false;
}

KERNEL void complete_matching(const int64_t *starts, const int64_t *columns, int64_t *row_of,
                              int64_t *column_of, int64_t *depth, int64_t *following,
                              int64_t *queue, int64_t *path, int64_t n) {
    const struct graph graph = {starts, columns};
    int64_t n_matched = 0;
    for (int64_t row = 0; row < n; row++) {
        if (column_of[row] < 0) continue;
        row_of[column_of[row]] = row;
        n_matched++;
    }
    while (n_matched < n && layer(&graph, row_of, column_of, depth, queue, n)) {
        for (int64_t row = 0; row < n; row++) following[row] = starts[row];
        for (int64_t row = 0; row < n; row++)
            if (column_of[row] < 0)
                n_matched += augment(&graph, row, row_of, column_of, depth, following, path);
    }
}
