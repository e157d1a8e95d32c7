/* Vectors in space, and the leaves of a `box_tree`. */
#pragma once
#include "kernels.h"

enum { MOST_LEVELS = 60, MOST_WAITING = MOST_LEVELS + 2 }; /* of a tree, and nodes of one search */

struct vector {
    double x, y, z;
};

static inline struct vector difference(const double *a, const double *b) {
    return (struct vector){a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

static inline struct vector minus(struct vector a, struct vector b) {
    return (struct vector){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline double dot(struct vector a, struct vector b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline struct vector cross(struct vector a, struct vector b) {
    return (struct vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* The first of n faces in a leaf of a tree. */
static inline int64_t first_of_leaf(int64_t leaf, int64_t n, int64_t leaves) {
    return leaf * n / leaves;
}
