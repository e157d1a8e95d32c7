/* The nearest of points with normals, and their tree. Documented in nearest_loops.py. */
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

/* Put the numbers of rows that are lower along an axis than the one that belongs to a place before it, and
   those that are higher behind (Hoare 1961, Algorithm 65: FIND). */
static void select_row(const double (*rows)[6], int axis, int64_t *order, int64_t n,
                       int64_t place) {
    for (int64_t first = 0, last = n - 1; first < last;) {
        double pivot = rows[order[place]][axis];
        int64_t low = first, high = last;
        while (low <= high) {
            while (rows[order[low]][axis] < pivot) low++;
            while (rows[order[high]][axis] > pivot) high--;
            if (low > high) break;
            int64_t row = order[low];
            order[low++] = order[high];
            order[high--] = row;
        }
        if (high < place) first = low;
        if (low > place) last = high;
    }
}

static int longest_axis(const double (*rows)[6], const int64_t *order, int64_t n) {
    int longest = 0;
    double most = -1;
    for (int axis = 0; axis < 6; axis++) {
        double low = INFINITE, high = -INFINITE;
        for (int64_t i = 0; i < n; i++) {
            low = minimum(low, rows[order[i]][axis]);
            high = maximum(high, rows[order[i]][axis]);
        }
        if (high - low > most) {
            most = high - low;
            longest = axis;
        }
    }
    return longest;
}

KERNEL void order_rows(const double (*rows)[6], int64_t levels, int64_t *order, int64_t n_rows) {
    int64_t leaves = (int64_t)1 << levels;
    for (int64_t row = 0; row < n_rows; row++) order[row] = row;
    for (int64_t width = leaves; width > 1; width /= 2) { /* of a node, in leaves */
        for (int64_t leaf = 0; leaf < leaves; leaf += width) {
            int64_t first = first_of_leaf(leaf, n_rows, leaves);
            int64_t middle = first_of_leaf(leaf + width / 2, n_rows, leaves);
            int64_t end = first_of_leaf(leaf + width, n_rows, leaves);
            int axis = longest_axis(rows, &order[first], end - first);
            select_row(rows, axis, &order[first], end - first, middle - first);
        }
    }
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
