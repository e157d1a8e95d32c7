/* The piece of a limb that is nearest to each point. Documented in limb_loops.py. */
#include "kernels.h"

/* A point, or the center and the radius at one end of a piece. */
struct place {
    double x, y, z;
};
struct end {
    struct place center;
    double radius;
};

static struct place difference(struct place a, struct place b) {
    return (struct place){a.x - b.x, a.y - b.y, a.z - b.z};
}

/* Products of points by pieces add x and z first, and those of one point or piece x and y: creatures
   have the digits that they had when NumPy computed them. */
static double product(struct place a, struct place b) { return a.x * b.x + a.z * b.z + a.y * b.y; }
static double own_product(struct place a, struct place b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

/* Copy the points that are near the box, and note which they are; the others are apart from the limb
   by the distance to the box. Return how many are near. */
static int64_t gather_close(const struct place *points, const struct place box[2], double reach,
                            struct place *arms, int64_t *close, double *apart, int64_t n) {
    int64_t n_close = 0;
    for (int64_t i = 0; i < n; i++) {
        struct place below = difference(box[0], points[i]), above = difference(points[i], box[1]);
        struct place outside = {maximum(maximum(below.x, above.x), 0),
                                maximum(maximum(below.y, above.y), 0),
                                maximum(maximum(below.z, above.z), 0)};
        apart[i] = square_root(own_product(outside, outside));
        arms[n_close] = points[i];
        close[n_close] = i;
        n_close += apart[i] < reach;
    }
    return n_close;
}

KERNEL int64_t nearest_pieces(const double (*points)[3], const double (*ends)[4],
                              const double (*box)[3], double reach, double *apart, int64_t *close,
                              double (*arms)[3], double *radii, double *pieces, double *shares,
                              int64_t n_points, int64_t n_ends) {
    const struct end *joints = (const struct end *)ends;
    struct place *from_axis = (struct place *)arms;
    int64_t n = gather_close((const struct place *)points, (const struct place *)box, reach,
                             from_axis, close, apart, n_points);
    for (int64_t i = 0; i < n; i++) {
        radii[i] = INFINITE; /* the distance to the nearest skin, until the end */
        pieces[i] = shares[i] = 0;
    }
    /* One piece is compared with all points after the other: so several points are computed at once. */
    for (int64_t piece = 0; piece + 1 < n_ends; piece++) {
        struct end begin = joints[piece];
        struct place along = difference(joints[piece + 1].center, begin.center);
        double length2 = own_product(along, along), from = own_product(begin.center, along);
        double begin2 = own_product(begin.center, begin.center);
        double widening = joints[piece + 1].radius - begin.radius;
        for (int64_t i = 0; i < n; i++) {
            /* |p - b - s a|² is expanded: fewer steps for each piece. */
            double dot = product(from_axis[i], along) - from;
            double share = minimum(maximum(dot / length2, 0), 1);
            double apart2 = own_product(from_axis[i], from_axis[i]);
            apart2 = apart2 - 2 * product(from_axis[i], begin.center) + begin2;
            apart2 += share * (share * length2 - 2 * dot);
            double skin = square_root(maximum(apart2, 0)) - begin.radius - share * widening;
            bool is_nearer = skin < radii[i]; /* false if the piece has no length: 0 / 0 */
            radii[i] = is_nearer ? skin : radii[i];
            pieces[i] = is_nearer ? (double)piece : pieces[i];
            shares[i] = is_nearer ? share : shares[i];
        }
    }
    for (int64_t i = 0; i < n; i++) {
        const struct end *at = &joints[(int64_t)pieces[i]];
        struct place along = difference(at[1].center, at->center);
        struct place center = {at->center.x + shares[i] * along.x,
                               at->center.y + shares[i] * along.y,
                               at->center.z + shares[i] * along.z};
        from_axis[i] = difference(from_axis[i], center);
        radii[i] = at->radius + shares[i] * (at[1].radius - at->radius);
    }
    return n;
}
