/* The piece of a limb that is nearest to each point. Documented in limb_loops.py. */
#include "kernels.h"
#include "space.h"

/* The center and the radius at one end of a piece. */
struct end {
    struct vector center;
    double radius;
};

/* Products of points by pieces add x and z first, and those of one point or piece x and y: creatures
   have the digits that they had when NumPy computed them. */
static double product(struct vector a, struct vector b) {
    return a.x * b.x + a.z * b.z + a.y * b.y;
}

/* Copy the points that are near the box, and note which they are; the others are apart from the limb
   by the distance to the box. Return how many are near. */
static int64_t gather_close(const struct vector *points, const struct vector box[2], double reach,
                            struct vector *arms, int64_t *close, double *apart, int64_t n) {
    int64_t n_close = 0;
    for (int64_t i = 0; i < n; i++) {
        struct vector below = minus(box[0], points[i]), above = minus(points[i], box[1]);
        struct vector outside = {maximum(maximum(below.x, above.x), 0),
                                 maximum(maximum(below.y, above.y), 0),
                                 maximum(maximum(below.z, above.z), 0)};
        apart[i] = square_root(dot(outside, outside));
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
    struct vector *from_axis = (struct vector *)arms;
    int64_t n = gather_close((const struct vector *)points, (const struct vector *)box, reach,
                             from_axis, close, apart, n_points);
    for (int64_t i = 0; i < n; i++) {
        radii[i] = INFINITE; /* the distance to the nearest skin, until the end */
        pieces[i] = shares[i] = 0;
    }
    /* One piece is compared with all points after the other: so several points are computed at once. */
    for (int64_t piece = 0; piece + 1 < n_ends; piece++) {
        struct end begin = joints[piece];
        struct vector along = minus(joints[piece + 1].center, begin.center);
        double length2 = dot(along, along), from = dot(begin.center, along);
        double begin2 = dot(begin.center, begin.center);
        double widening = joints[piece + 1].radius - begin.radius;
        for (int64_t i = 0; i < n; i++) {
            /* |p - b - s a|² is expanded: fewer steps for each piece. */
            double reach_along = product(from_axis[i], along) - from;
            double share = minimum(maximum(reach_along / length2, 0), 1);
            double apart2 = dot(from_axis[i], from_axis[i]);
            apart2 = apart2 - 2 * product(from_axis[i], begin.center) + begin2;
            apart2 += share * (share * length2 - 2 * reach_along);
            double skin = square_root(maximum(apart2, 0)) - begin.radius - share * widening;
            bool is_nearer = skin < radii[i]; /* false if the piece has no length: 0 / 0 */
            radii[i] = is_nearer ? skin : radii[i];
            pieces[i] = is_nearer ? (double)piece : pieces[i];
            shares[i] = is_nearer ? share : shares[i];
        }
    }
    for (int64_t i = 0; i < n; i++) {
        const struct end *at = &joints[(int64_t)pieces[i]];
        struct vector along = minus(at[1].center, at->center);
        struct vector center = {at->center.x + shares[i] * along.x,
                                at->center.y + shares[i] * along.y,
                                at->center.z + shares[i] * along.z};
        from_axis[i] = minus(from_axis[i], center);
        radii[i] = at->radius + shares[i] * (at[1].radius - at->radius);
    }
    return n;
}
