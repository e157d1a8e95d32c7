/* The nearest of points with normals, and the boxes of their tree. Documented in nearest_loops.py. */
#include "matching/nearest.h"

#include "space.h"

static double square_to_box(const double (*box)[6], const double *point) {
    double sum = 0;
    for (int axis = 0; axis < 6; axis++) {
        double low = box[0][axis] - point[axis], high = point[axis] - box[1][axis];
        double away = maximum(maximum(low, 0), high);
        sum += away * away;
    }
    return sum;
}

static double square_between(const double *a, const double *b) {
    double sum = 0;
    for (int axis = 0; axis < 6; axis++) sum += (a[axis] - b[axis]) * (a[axis] - b[axis]);
    return sum;
}

/* From the leaves up: the least and the largest coordinates of each node. */
KERNEL void fill_row_boxes(const double (*rows)[6], int64_t levels, double (*nodes)[2][6],
                           int64_t n_rows) {
    int64_t leaves = (int64_t)1 << levels;
    for (int64_t node = 2 * leaves - 2; node >= 0; node--) {
        bool is_leaf = node >= leaves - 1;
        int64_t first = first_of_leaf(node - leaves + 1, n_rows, leaves);
        int64_t end = first_of_leaf(node - leaves + 2, n_rows, leaves);
        for (int axis = 0; axis < 6; axis++) {
            double low = INFINITE, high = -INFINITE;
            for (int64_t row = first; is_leaf && row < end; row++) {
                low = minimum(low, rows[row][axis]);
                high = maximum(high, rows[row][axis]);
            }
            for (int64_t child = 2 * node + 1; !is_leaf && child < 2 * node + 3; child++) {
                low = minimum(low, nodes[child][0][axis]);
                high = maximum(high, nodes[child][1][axis]);
            }
            nodes[node][0][axis] = low;
            nodes[node][1][axis] = high;
        }
    }
}

/* The row that comes as `found` bounds the search: boxes that are farther away are skipped. Of two
   children the nearer one is opened first. */
KERNEL void find_nearest_rows(const double (*points)[6], const double (*rows)[6], int64_t levels,
                              const double (*nodes)[2][6], int64_t *found, double *squares,
                              int64_t n_points, int64_t n_rows) {
    int64_t leaves = (int64_t)1 << levels, waiting[MOST_WAITING];
    double away[MOST_WAITING];
    for (int64_t p = 0; p < n_points; p++) {
        double least = square_between(points[p], rows[found[p]]);
        int64_t height = 1;
        waiting[0] = 0;
        away[0] = 0;
        while (height) {
            int64_t node = waiting[--height];
            if (away[height] >= least) continue;
            while (node < leaves - 1) {
                int64_t left = 2 * node + 1;
                double to_left = square_to_box(nodes[left], points[p]);
                double to_right = square_to_box(nodes[left + 1], points[p]);
                bool is_left_nearer = to_left <= to_right;
                double farther = is_left_nearer ? to_right : to_left;
                node = is_left_nearer ? left : left + 1;
                if (farther < least) {
                    waiting[height] = is_left_nearer ? left + 1 : left;
                    away[height++] = farther;
                }
                if ((is_left_nearer ? to_left : to_right) >= least) break;
            }
            if (node < leaves - 1) continue;
            int64_t leaf = node - leaves + 1, end = first_of_leaf(leaf + 1, n_rows, leaves);
            for (int64_t row = first_of_leaf(leaf, n_rows, leaves); row < end; row++) {
                double square = square_between(points[p], rows[row]);
                if (!(square < least)) continue;
                least = square;
                found[p] = row;
            }
        }
        squares[p] = least;
    }
}
