/* Edges that collapse into one of their ends: documented in thinning_loops.py. */
#include "kernels.h"

/* The height of a face above its longest side, as a share of that; less is a sliver. */
static const double LEAST_HEIGHT = 0.03;
enum { FREE = 0, RIM = 1, FIXED = 2 }; /* kinds of vertices */

struct surface {
    const double (*points)[3];
    int64_t (*faces)[3];
    bool *alive;
    int64_t *heads, *links;
};

struct vector {
    double x, y, z;
};

static struct vector between(const double from[3], const double to[3]) {
    return (struct vector){to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

static double dot(struct vector u, struct vector v) { return u.x * v.x + u.y * v.y + u.z * v.z; }

static double square_between(struct surface of, int64_t one, int64_t two) {
    struct vector step = between(of.points[two], of.points[one]);
    return dot(step, step);
}

/* Return a normal of the face: its length is twice the area. */
static struct vector normal_of(struct surface of, int64_t a, int64_t b, int64_t c) {
    struct vector u = between(of.points[a], of.points[b]), v = between(of.points[a], of.points[c]);
    return (struct vector){u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
}

/* Return whether a face is no sliver, and faces nearly the same way, when its corner has moved. */
static bool keeps_normal(struct surface of, int64_t gone, int64_t kept, int64_t one, int64_t two,
                         double least_cosine) {
    struct vector before = normal_of(of, gone, one, two), after = normal_of(of, kept, one, two);
    double longest = maximum(square_between(of, kept, one), square_between(of, kept, two));
    longest = maximum(longest, square_between(of, one, two));
    /* The length of a normal is the longest side times the height above it. */
    if (square_root(dot(after, after)) < LEAST_HEIGHT * longest) return false;
    double sizes = square_root(dot(before, before) * dot(after, after));
    return dot(before, after) >= least_cosine * sizes;
}

/* Mark the neighbors of a vertex; return their number. */
static int64_t mark_neighbors(struct surface of, int64_t vertex, int64_t (*marks)[2],
                              int64_t mark) {
    int64_t n_neighbors = 0;
    for (int64_t corner = of.heads[vertex]; corner >= 0; corner = of.links[corner]) {
        if (!of.alive[corner / 3]) continue;
        for (int turn = 1; turn < 3; turn++) {
            int64_t other = of.faces[corner / 3][(corner + turn) % 3];
            n_neighbors += marks[other][0] != mark;
            marks[other][0] = mark;
        }
    }
    return n_neighbors;
}

/* Return whether a vertex may move into a neighbor: the surface must keep its topology.

   The link condition (Dey, Edelsbrunner, Guha and Nekhayev 1999): both have exactly the vertices
   opposite to their edge as common neighbors, and no face would occur twice. */
static bool may_collapse(struct surface of, const int64_t *kinds, int64_t (*marks)[2], int64_t gone,
                         int64_t kept, int64_t most_neighbors, double least_cosine, int64_t mark) {
    int64_t n_kept = mark_neighbors(of, kept, marks, mark);
    int64_t n_shared = 0, n_common = 0, n_gone = 0;
    for (int64_t corner = of.heads[gone]; corner >= 0; corner = of.links[corner]) {
        if (!of.alive[corner / 3]) continue;
        const int64_t *face = of.faces[corner / 3];
        int64_t ends[2] = {face[(corner + 1) % 3], face[(corner + 2) % 3]};
        if (ends[0] == kept || ends[1] == kept) {
            n_shared++;
        } else {
            bool would_occur_twice = marks[ends[0]][0] == mark && marks[ends[1]][0] == mark;
            if (would_occur_twice) return false;
            if (!keeps_normal(of, gone, kept, ends[0], ends[1], least_cosine)) return false;
        }
        for (int i = 0; i < 2; i++) {
            if (ends[i] == kept || marks[ends[i]][1] == mark) continue;
            marks[ends[i]][1] = mark;
            n_gone++;
            n_common += marks[ends[i]][0] == mark;
        }
    }
    if (n_common != n_shared || n_kept + n_gone - 1 - n_common > most_neighbors) return false;
    return kinds[gone] == RIM ? n_shared == 1 && kinds[kept] != FREE : n_shared == 2;
}

/* Link the corners of faces that are alive, of one list, before those of another. */
static int64_t link_before(struct surface of, int64_t corner, int64_t first) {
    while (corner >= 0) {
        int64_t after = of.links[corner];
        if (of.alive[corner / 3]) {
            of.links[corner] = first;
            first = corner;
        }
        corner = after;
    }
    return first;
}

/* Give the corners of one vertex to another, and remove the faces that have both. */
static void join_vertices(struct surface of, int64_t gone, int64_t kept) {
    for (int64_t corner = of.heads[gone]; corner >= 0; corner = of.links[corner]) {
        int64_t *face = of.faces[corner / 3];
        if (face[0] == kept || face[1] == kept || face[2] == kept) {
            of.alive[corner / 3] = false;
        } else if (of.alive[corner / 3]) {
            face[corner % 3] = kept;
        }
    }
    int64_t first = link_before(of, of.heads[gone], -1);
    of.heads[kept] = link_before(of, of.heads[kept], first);
    of.heads[gone] = -1;
}

/* Return the nearest neighbor of a vertex that is farther than one that was tried, and nearer than
   a limit, in squares; -1 if there is none. */
static int64_t nearest_beyond(struct surface of, int64_t vertex, double tried, double *limit) {
    int64_t nearest = -1;
    for (int64_t corner = of.heads[vertex]; corner >= 0; corner = of.links[corner]) {
        if (!of.alive[corner / 3]) continue;
        for (int turn = 1; turn < 3; turn++) {
            int64_t other = of.faces[corner / 3][(corner + turn) % 3];
            double square = square_between(of, vertex, other);
            if (tried < square && square < *limit) {
                nearest = other;
                *limit = square;
            }
        }
    }
    return nearest;
}

KERNEL int64_t collapse_short_edges(const double (*points)[3], int64_t (*faces)[3], bool *alive,
                                    int64_t *heads, int64_t *links, const int64_t *kinds,
                                    int64_t (*marks)[2], double length, int64_t most_neighbors,
                                    double least_cosine, int64_t n_vertices) {
    struct surface of = {points, faces, alive, heads, links};
    int64_t n_collapsed = 0, *last_mark = &marks[n_vertices][0];
    for (int64_t vertex = 0; vertex < n_vertices; vertex++) {
        if (heads[vertex] < 0 || kinds[vertex] == FIXED) continue;
        double tried = -1;
        while (true) {
            double square = length * length;
            int64_t nearest = nearest_beyond(of, vertex, tried, &square);
            if (nearest < 0) break;
            (*last_mark)++;
            if (may_collapse(of, kinds, marks, vertex, nearest, most_neighbors, least_cosine,
                             *last_mark)) {
                join_vertices(of, vertex, nearest);
                n_collapsed++;
                break;
            }
            tried = square;
        }
    }
    return n_collapsed;
}

KERNEL void link_corners(const int64_t (*faces)[3], int64_t *heads, int64_t *links,
                         int64_t n_faces) {
    for (int64_t corner = 3 * n_faces - 1; corner >= 0; corner--) {
        int64_t vertex = faces[corner / 3][corner % 3];
        links[corner] = heads[vertex];
        heads[vertex] = corner;
    }
}
