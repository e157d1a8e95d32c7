/* The best rotation at each vertex, and the rotated edges. Documented in rigidity_loops.py. */
#include "kernels.h"

#include "space.h"

/* Most steps of a fit. Newton's method takes a few; the rest is for starts far from the maximum. */
enum { MOST_NEWTON_STEPS = 100 };
/* A step that turns by less, in radians, is the last: Newton's next one would be of its square. */
static const double SETTLED = 1e-4;
/* Added to the Hessian, as a share of the largest covariance, so that a rotation which the edges do
   not determine keeps its value. */
static const double LEAST = 1e-9;
/* Length of the gradient, relative to the largest covariance, that is rounding: the fit is done. */
static const double GRADIENT_ROUNDING = 1e-15;
/* Most that one step turns, in radians: the tangent of half the angle has a pole at π. */
static const double HALFWAY = 3;

typedef double matrix[3][3];

/* Functions of the C library. */
struct circle {
    double (*arctangent)(double, double);
    double (*tangent)(double);
};

/* A turn as a unit quaternion, real part first. */
struct turn {
    double w, x, y, z;
};

static struct turn read_turn(const double *turn) {
    return (struct turn){turn[0], turn[1], turn[2], turn[3]};
}

static void fill_rotation(struct turn turn, matrix m) {
    double w = turn.w, x = turn.x, y = turn.y, z = turn.z;
    m[0][0] = 1 - 2 * (y * y + z * z), m[0][1] = 2 * (x * y - w * z), m[0][2] = 2 * (x * z + w * y);
    m[1][0] = 2 * (x * y + w * z), m[1][1] = 1 - 2 * (x * x + z * z), m[1][2] = 2 * (y * z - w * x);
    m[2][0] = 2 * (x * z - w * y), m[2][1] = 2 * (y * z + w * x), m[2][2] = 1 - 2 * (x * x + y * y);
}

/* A turn after a further one by the quaternion (1, u), of length 1 again. */
static struct turn turn_further(struct turn turn, struct vector u) {
    double w = turn.w, x = turn.x, y = turn.y, z = turn.z;
    double new_w = w - u.x * x - u.y * y - u.z * z;
    double new_x = x + u.x * w + u.y * z - u.z * y;
    double new_y = y - u.x * z + u.y * w + u.z * x;
    double new_z = z + u.x * y - u.y * x + u.z * w;
    double shrink = 1 / square_root(new_w * new_w + new_x * new_x + new_y * new_y + new_z * new_z);
    return (struct turn){new_w * shrink, new_x * shrink, new_y * shrink, new_z * shrink};
}

/* The next step of a fit: half its axis times its angle, or times the tangent of half the angle where
   that is large; and the angle. p is the rotation times the covariance, and u the gradient.

   Where the energy is concave the step is Newton's, else it turns about the gradient as far as is
   best. */
static struct vector next_step(const matrix p, struct vector u, const struct circle *circle,
                               double *angle) {
    double size = square_root(dot(u, u));
    double a = p[1][1] + p[2][2] + LEAST, b = p[0][0] + p[2][2] + LEAST;
    double c = p[0][0] + p[1][1] + LEAST;
    double d = -(p[0][1] + p[1][0]) / 2, e = -(p[0][2] + p[2][0]) / 2, f = -(p[1][2] + p[2][1]) / 2;
    double second = a * b - d * d; /* the leading minors of minus the Hessian */
    double third = second * c - a * f * f + 2 * d * e * f - b * e * e;
    if (a > 0 && second > 0 && third > 0) {
        struct vector step = {
            (u.x * (b * c - f * f) + u.y * (e * f - d * c) + u.z * (d * f - b * e)) / third,
            (u.x * (e * f - d * c) + u.y * (a * c - e * e) + u.z * (d * e - a * f)) / third,
            (u.x * (d * f - b * e) + u.y * (d * e - a * f) + u.z * second) / third,
        };
        *angle = square_root(dot(step, step));
        return (struct vector){step.x / 2, step.y / 2, step.z / 2};
    }
    double mixed = d * u.x * u.y + e * u.x * u.z + f * u.y * u.z;
    double squares = p[0][0] * u.x * u.x + p[1][1] * u.y * u.y + p[2][2] * u.z * u.z;
    double along = (squares - 2 * mixed) / (size * size);
    *angle = circle->arctangent(size, p[0][0] + p[1][1] + p[2][2] - along);
    double half = circle->tangent(minimum(*angle, HALFWAY) / 2) / size;
    return (struct vector){u.x * half, u.y * half, u.z * half};
}

/* Maximize the inner product of a rotation and the covariance by Newton steps, or by safe steps where
   it is not concave; return the maximum. */
static double settle_turn(matrix covariance, double *place, const struct circle *circle) {
    struct turn turn = read_turn(place);
    double largest = 0;
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            largest = maximum(largest, absolute(covariance[row][column]));
    if (!(largest > 0)) return 0;
    for (int row = 0; row < 3; row++) /* its cube is used in a step */
        for (int column = 0; column < 3; column++) covariance[row][column] /= largest;
    matrix m, p;
    for (int round = 0; round < MOST_NEWTON_STEPS; round++) {
        fill_rotation(turn, m);
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                p[row][column] = m[row][0] * covariance[0][column] +
                                 m[row][1] * covariance[1][column] +
                                 m[row][2] * covariance[2][column];
        struct vector gradient = {p[1][2] - p[2][1], p[2][0] - p[0][2], p[0][1] - p[1][0]};
        if (square_root(dot(gradient, gradient)) <= GRADIENT_ROUNDING) break;
        double angle;
        turn = turn_further(turn, next_step(p, gradient, circle, &angle));
        if (angle < SETTLED) break;
    }
    fill_rotation(turn, m);
    double height = m[0][0] * covariance[0][0] + m[0][1] * covariance[1][0];
    height += m[0][2] * covariance[2][0] + m[1][0] * covariance[0][1];
    height += m[1][1] * covariance[1][1] + m[1][2] * covariance[2][1];
    height += m[2][0] * covariance[0][2] + m[2][1] * covariance[1][2];
    height += m[2][2] * covariance[2][2];
    place[0] = turn.w, place[1] = turn.x, place[2] = turn.y, place[3] = turn.z;
    return height * largest;
}

KERNEL double settle_rotations(const int64_t *vertices, const int64_t *starts,
                               const int64_t *others, const double *weights,
                               const double (*rest)[3], const double (*posed)[3],
                               double (*turns)[4], const struct circle *circle,
                               int64_t n_vertices) {
    double left = 0;
    for (int64_t place = 0; place < n_vertices; place++) {
        int64_t i = vertices[place];
        double lengths = 0;
        matrix covariance;
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++) covariance[row][column] = 0;
        for (int64_t k = starts[i]; k < starts[i + 1]; k++) {
            int64_t j = others[k];
            double weight = weights[k];
            struct vector after = difference(posed[j], posed[i]);
            lengths += weight * dot(after, after);
            for (int row = 0; row < 3; row++) {
                double before = rest[j][row] - rest[i][row];
                lengths += weight * before * before;
                before *= weight;
                covariance[row][0] += before * after.x;
                covariance[row][1] += before * after.y;
                covariance[row][2] += before * after.z;
            }
        }
        left += lengths - 2 * settle_turn(covariance, turns[i], circle);
    }
    return left / 2;
}

/* (R - 1)/2, of a rotation R. */
static void fill_spin(const double *turn, matrix spin) {
    struct turn q = read_turn(turn);
    spin[0][0] = -(q.y * q.y + q.z * q.z);
    spin[0][1] = q.x * q.y - q.w * q.z;
    spin[0][2] = q.x * q.z + q.w * q.y;
    spin[1][0] = q.x * q.y + q.w * q.z;
    spin[1][1] = -(q.x * q.x + q.z * q.z);
    spin[1][2] = q.y * q.z - q.w * q.x;
    spin[2][0] = q.x * q.z - q.w * q.y;
    spin[2][1] = q.y * q.z + q.w * q.x;
    spin[2][2] = -(q.x * q.x + q.y * q.y);
}

KERNEL void turn_edges(const int64_t *vertices, const int64_t *starts, const int64_t *others,
                       const double *weights, const double (*rest)[3], const double (*turns)[4],
                       double (*sums)[3], int64_t n_vertices) {
    for (int64_t place = 0; place < n_vertices; place++) {
        int64_t i = vertices[place];
        matrix one, two;
        fill_spin(turns[i], one);
        double sum[3] = {0, 0, 0};
        for (int64_t k = starts[i]; k < starts[i + 1]; k++) {
            struct vector edge = difference(rest[i], rest[others[k]]);
            fill_spin(turns[others[k]], two);
            for (int row = 0; row < 3; row++) {
                double turned =
                    (one[row][0] + two[row][0]) * edge.x + (one[row][1] + two[row][1]) * edge.y;
                turned += (one[row][2] + two[row][2]) * edge.z;
                sum[row] += weights[k] * turned;
            }
        }
        for (int row = 0; row < 3; row++) sums[place][row] = sum[row];
    }
}
