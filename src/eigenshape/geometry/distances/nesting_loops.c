/* Which points lie inside a closed piece. Documented in nesting_loops.py. */
#include "kernels.h"

#include "geometry/distances/predicates.h"

/* On which side of the line from s to t the ray up from p lies, seen from above; never 0.

   A ray that meets an edge or a corner is moved by an infinitely small step along the first axis, and
   by one smaller still along the second (Edelsbrunner and Mücke 1990). So it passes on the same side
   of an edge for both faces there. */
static int side_of_ray(rows points, int64_t s, int64_t t, int64_t p) {
    int side = side_of_line(points, 0, 1, s, t, p);
    if (side == 0) side = sign(points[s][1] - points[t][1]);
    if (side == 0) side = sign(points[t][0] - points[s][0]);
    return side;
}

/* Whether the ray up from point p crosses face a, by exact signs. */
static bool ray_crosses(rows points, int64_t a, int64_t p) {
    int turn = side_of_line(points, 0, 1, a, a + 1, a + 2);
    if (turn == 0) return false; /* upright: the ray, moved as above, passes it by */
    for (int k = 0; k < 3; k++)
        if (side_of_ray(points, a + k, a + (k + 1) % 3, p) != turn) return false;
    return side_of_plane(points, a, a + 1, a + 2, p) == turn;
}

static bool ray_misses(const double *box, const double *p) {
    return p[0] < box[0] || p[1] < box[1] || p[0] > box[3] || p[1] > box[4] || p[2] > box[5];
}

KERNEL void fill_inside(int64_t n_faces, int64_t levels, const double (*nodes)[6], bool *inside,
                        const double (*points)[3], int64_t n_points) {
    int64_t leaves = (int64_t)1 << levels, waiting[MOST_WAITING];
    for (int64_t number = 0; number < n_points; number++) {
        int64_t p = 3 * n_faces + number, height = 1;
        inside[number] = false;
        waiting[0] = 0;
        while (height) {
            int64_t node = waiting[--height];
            if (ray_misses(nodes[node], points[p])) continue;
            if (node < leaves - 1) {
                waiting[height++] = 2 * node + 1;
                waiting[height++] = 2 * node + 2;
                continue;
            }
            int64_t leaf = node - leaves + 1;
            for (int64_t face = first_of_leaf(leaf, n_faces, leaves);
                 face < first_of_leaf(leaf + 1, n_faces, leaves); face++)
                if (ray_crosses(points, 3 * face, p)) inside[number] = !inside[number];
        }
    }
}
