/* A tree of boxes, and which faces cross. Documented in crossing_loops.py. */
#include "kernels.h"

#include "geometry/distances/predicates.h"

enum { CURVE_BITS = 20 }; /* of a cell, along each axis */

static void widen(double *box, const double *other) {
    for (int axis = 0; axis < 3; axis++) {
        box[axis] = minimum(box[axis], other[axis]);
        box[3 + axis] = maximum(box[3 + axis], other[3 + axis]);
    }
}

static bool boxes_meet(const double *one, const double *other) {
    for (int axis = 0; axis < 3; axis++)
        if (!(one[axis] <= other[3 + axis] && other[axis] <= one[3 + axis])) return false;
    return true;
}

KERNEL void fill_face_boxes(const double (*corners)[3][3], double (*boxes)[6], int64_t n_faces) {
    for (int64_t face = 0; face < n_faces; face++) {
        for (int axis = 0; axis < 3; axis++) {
            double x = corners[face][0][axis], y = corners[face][1][axis];
            double z = corners[face][2][axis];
            boxes[face][axis] = minimum(minimum(x, y), z);
            boxes[face][3 + axis] = maximum(maximum(x, y), z);
        }
    }
}

/* Bit b of the cell along an axis is bit 3 b + axis of the place (Morton 1966). */
KERNEL void fill_curve_places(const double (*boxes)[6], int64_t *places, int64_t n_faces) {
    double low[3], extent = 0;
    for (int axis = 0; axis < 3; axis++) {
        double high = n_faces ? boxes[0][3 + axis] : 0;
        low[axis] = n_faces ? boxes[0][axis] : 0;
        for (int64_t face = 1; face < n_faces; face++) {
            low[axis] = minimum(low[axis], boxes[face][axis]);
            high = maximum(high, boxes[face][3 + axis]);
        }
        extent = maximum(extent, high - low[axis]);
    }
    double cells_per_length = extent > 0 ? ((1 << CURVE_BITS) - 1) / extent : 0;
    for (int64_t face = 0; face < n_faces; face++) {
        places[face] = 0;
        for (int axis = 0; axis < 3; axis++) {
            double middle = boxes[face][axis] / 2 + boxes[face][3 + axis] / 2;
            int64_t cell = (int64_t)((middle - low[axis]) * cells_per_length);
            for (int bit = 0; bit < CURVE_BITS; bit++)
                places[face] |= ((cell >> bit) & 1) << (3 * bit + axis);
        }
    }
}

KERNEL void fill_box_tree(const double (*boxes)[6], int64_t levels, double (*nodes)[6],
                          int64_t n_faces) {
    int64_t leaves = (int64_t)1 << levels;
    for (int64_t leaf = 0; leaf < leaves && n_faces; leaf++) {
        double *node = nodes[leaves - 1 + leaf];
        int64_t first = first_of_leaf(leaf, n_faces, leaves);
        for (int side = 0; side < 6; side++) node[side] = boxes[first][side];
        for (int64_t face = first + 1; face < first_of_leaf(leaf + 1, n_faces, leaves); face++)
            widen(node, boxes[face]);
    }
    for (int64_t place = leaves - 2; place >= 0; place--) {
        for (int side = 0; side < 6; side++) nodes[place][side] = nodes[2 * place + 1][side];
        widen(nodes[place], nodes[2 * place + 2]);
    }
}

/* An axis along which the projection of face a has area; -1 if the face has none. */
static int axis_of_face(rows points, int64_t a) {
    for (int axis = 0; axis < 3; axis++)
        if (side_of_line(points, (axis + 1) % 3, (axis + 2) % 3, a, a + 1, a + 2) != 0) return axis;
    return -1;
}

/* The corner of face b opposite to a side that it shares with face a, or -1. */
static int64_t corner_beyond_shared_side(rows points, int64_t a, int64_t b) {
    int n_shared = 0;
    int64_t apex = -1;
    for (int64_t q = b; q < b + 3; q++) {
        if (same_place(points, a, q) || same_place(points, a + 1, q) ||
            same_place(points, a + 2, q))
            n_shared++;
        else
            apex = q;
    }
    return n_shared == 2 ? apex : -1;
}

/* On which sides of the plane of one face another one has corners: the least and the largest sign,
   and the corner that is alone on its side. */
struct sides {
    int low, high, alone;
};

static struct sides sides_of_plane(rows points, int64_t a, int64_t b) {
    int x = side_of_plane(points, a, a + 1, a + 2, b);
    int y = side_of_plane(points, a, a + 1, a + 2, b + 1);
    int z = side_of_plane(points, a, a + 1, a + 2, b + 2);
    int low = x < y ? x : y, high = x > y ? x : y, alone;
    if (x != 0 && x * y <= 0 && x * z <= 0)
        alone = 0;
    else if (y != 0 && y * x <= 0 && y * z <= 0)
        alone = 1;
    else if (z != 0 && z * x <= 0 && z * y <= 0)
        alone = 2;
    else /* one side has no corner: take the corner in the plane, if any */
        alone = x == 0 ? 0 : y == 0 ? 1 : 2;
    return (struct sides){z < low ? z : low, z > high ? z : high, alone};
}

/* Whether a side of face a separates it from p, q, r, projected to axes u and v. Points on the side
   count as separated. */
static bool is_apart(rows points, int u, int v, int64_t a, int64_t p, int64_t q, int64_t r) {
    int turn = side_of_line(points, u, v, a, a + 1, a + 2);
    for (int k = 0; k < 3; k++) {
        int64_t s = a + k, t = a + (k + 1) % 3;
        if (turn * side_of_line(points, u, v, s, t, p) <= 0 &&
            turn * side_of_line(points, u, v, s, t, q) <= 0 &&
            turn * side_of_line(points, u, v, s, t, r) <= 0)
            return true;
    }
    return false;
}

static bool is_before(rows points, int64_t p, int64_t q) {
    for (int axis = 0; axis < 3; axis++)
        if (points[p][axis] != points[q][axis]) return points[p][axis] < points[q][axis];
    return false;
}

/* Whether face a, a segment or a point, has a point inside face b, whose projection along `axis` has
   area. */
static bool segment_enters(rows points, int axis, int64_t a, int64_t b) {
    /* The ends: the first and the last of three corners on a line, by x, then y, then z. */
    int64_t p = a, q = a;
    for (int64_t corner = a + 1; corner < a + 3; corner++) {
        if (is_before(points, corner, p)) p = corner;
        if (is_before(points, q, corner)) q = corner;
    }
    int from_p = side_of_plane(points, b, b + 1, b + 2, p);
    int from_q = side_of_plane(points, b, b + 1, b + 2, q);
    if (from_p * from_q > 0) return false;
    if (from_p != 0 || from_q != 0) {
        int x = side_of_plane(points, p, q, b, b + 1),
            y = side_of_plane(points, p, q, b + 1, b + 2);
        return x != 0 && x == y && x == side_of_plane(points, p, q, b + 2, b);
    }
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (is_apart(points, u, v, b, p, q, q)) return false;
    if (same_place(points, p, q)) return true;
    bool has_left = false, has_right = false;
    for (int64_t corner = b; corner < b + 3; corner++) {
        int side = side_of_line(points, u, v, p, q, corner);
        has_left |= side > 0;
        has_right |= side < 0;
    }
    return has_left && has_right;
}

/* Whether the interior of one of two faces meets the other; at least one has area.

   The planes meet in a line, and each face cuts this line in an interval. An end of the interval is
   the point where a side of the face meets the line. This side starts at `alone`, the corner that is
   alone on its side of the other plane. The sign of the volume spanned by two such sides, one of each
   face, gives the order of their ends on the line, up to one common sign (Guigue and Devillers 2003,
   section 3). */
static bool faces_cross(rows points, const int64_t *axes, int64_t i, int64_t j) {
    int64_t a = 3 * i, b = 3 * j;
    if (axes[i] < 0) return segment_enters(points, (int)axes[j], a, b);
    if (axes[j] < 0) return segment_enters(points, (int)axes[i], b, a);
    int64_t apex = corner_beyond_shared_side(points, a, b);
    if (apex >= 0 && side_of_plane(points, a, a + 1, a + 2, apex) != 0) return false;
    struct sides of_b = sides_of_plane(points, a, b);
    if (of_b.low == of_b.high) {
        int u = (int)(axes[i] + 1) % 3, v = (int)(axes[i] + 2) % 3;
        return of_b.low == 0 && !is_apart(points, u, v, a, b, b + 1, b + 2) &&
               !is_apart(points, u, v, b, a, a + 1, a + 2);
    }
    struct sides of_a = sides_of_plane(points, b, a);
    if (of_a.low == of_a.high) return false; /* it misses the line */
    if (of_a.low * of_a.high == 0 && of_b.low * of_b.high == 0)
        return false; /* only borders touch */
    bool is_before_end = false, is_after_start = false;
    for (int k = 1; k < 3; k++) {
        for (int l = 1; l < 3; l++) {
            int64_t p = a + (of_a.alone + k) % 3, q = b + (of_b.alone + l) % 3;
            int side = side_of_plane(points, a + of_a.alone, p, b + of_b.alone, q);
            is_before_end |= side < 0;
            is_after_start |= side > 0;
        }
    }
    return is_before_end && is_after_start;
}

/* Nodes are compared with nodes of the same level, from the root down to the leaves. Pairs beyond the
   room are counted, but not written. */
KERNEL int64_t find_crossings(const double (*corners)[3][3], const double (*boxes)[6],
                              int64_t levels, const double (*nodes)[6], int64_t *axes,
                              int64_t (*pairs)[2], int64_t n_faces, int64_t room) {
    rows points = corners[0];
    for (int64_t face = 0; face < n_faces; face++) axes[face] = axis_of_face(points, 3 * face);
    int64_t leaves = (int64_t)1 << levels, found = 0, height = 1;
    int64_t waiting[3 * MOST_LEVELS + 4][2];
    waiting[0][0] = waiting[0][1] = 0; /* the root with itself */
    while (height) {
        int64_t a = waiting[--height][0], b = waiting[height][1];
        if (a < leaves - 1) {
            for (int64_t one = 2 * a + 1; one < 2 * a + 3; one++) {
                for (int64_t other = 2 * b + 1; other < 2 * b + 3; other++) {
                    if (a == b && one > other) continue;
                    if (one != other && !boxes_meet(nodes[one], nodes[other])) continue;
                    waiting[height][0] = one;
                    waiting[height++][1] = other;
                }
            }
            continue;
        }
        a -= leaves - 1;
        b -= leaves - 1;
        int64_t end_a = first_of_leaf(a + 1, n_faces, leaves),
                end_b = first_of_leaf(b + 1, n_faces, leaves);
        for (int64_t i = first_of_leaf(a, n_faces, leaves); i < end_a; i++) {
            for (int64_t j = a == b ? i + 1 : first_of_leaf(b, n_faces, leaves); j < end_b; j++) {
                if (axes[i] < 0 && axes[j] < 0) continue;
                if (!boxes_meet(boxes[i], boxes[j]) || !faces_cross(points, axes, i, j)) continue;
                if (found < room) {
                    pairs[found][0] = i;
                    pairs[found][1] = j;
                }
                found++;
            }
        }
    }
    return found;
}
