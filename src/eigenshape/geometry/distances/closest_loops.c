/* Nearest faces of points, and how faces wind around them. Documented in closest_loops.py. */
#include "kernels.h"

#include "space.h"

/* A product of many complex numbers is brought back to size 1 beyond these sizes. One factor changes
   it by up to 1e±160, and floats end at 1e±308. */
static const double SMALL = 1e-100, LARGE = 1e100;

/* The squared distance of a point to something, and the weights of corners 1 and 2 at the nearest
   place there. */
struct place {
    double square, second, third;
};

static double distance_to_box(const double *box, const double *point) {
    double sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        double low = box[axis] - point[axis], high = point[axis] - box[3 + axis];
        double away = maximum(maximum(low, 0), high);
        sum += away * away;
    }
    return sum;
}

/* The squared distance of w to the segment from 0 to u, and the share of u there. */
static struct place to_segment(struct vector u, struct vector w) {
    double square = dot(u, u);
    double share = square > 0 ? minimum(maximum(dot(u, w) / square, 0), 1) : 0;
    struct vector rest = {w.x - share * u.x, w.y - share * u.y, w.z - share * u.z};
    return (struct place){dot(rest, rest), share, 0};
}

/* The nearest point of a face is the foot of the perpendicular if that lies inside, else on a side.
   This also holds for faces without area, which have no inside. */
static struct place to_face(const double (*corners)[3], const double *point) {
    struct vector u = difference(corners[1], corners[0]), v = difference(corners[2], corners[0]);
    struct vector w = difference(point, corners[0]), n = cross(u, v);
    double square = dot(n, n);
    if (square > 0) {
        /* Weights of the foot: n · (w × v) / n² of corner 1, n · (u × w) / n² of corner 2. */
        double b = dot(n, cross(w, v)), c = dot(n, cross(u, w));
        if (b > 0 && c > 0 && b + c < square) {
            double height = dot(n, w);
            return (struct place){height * height / square, b / square, c / square};
        }
    }
    struct place best = to_segment(u, w), other = to_segment(v, w);
    if (other.square < best.square) best = (struct place){other.square, 0, other.second};
    other = to_segment(minus(v, u), minus(w, u));
    if (other.square < best.square)
        best = (struct place){other.square, 1 - other.second, other.second};
    return best;
}

static void write_weights(struct place place, double *weights) {
    weights[0] = maximum(1 - place.second - place.third, 0);
    weights[1] = place.second;
    weights[2] = place.third;
}

/* Boxes that are farther than the nearest point known so far are skipped; of two children the
   nearer one is opened first. */
KERNEL void fill_nearest_faces(const double (*points)[3], const double (*corners)[3][3],
                               int64_t levels, const double (*nodes)[6], int64_t *faces,
                               double (*weights)[3], double *squares, int64_t n_points,
                               int64_t n_faces) {
    int64_t leaves = (int64_t)1 << levels, waiting[MOST_WAITING];
    double away[MOST_WAITING];
    for (int64_t p = 0; p < n_points; p++) {
        double least = INFINITE;
        int64_t height = 1;
        waiting[0] = 0;
        away[0] = 0;
        while (height) {
            int64_t node = waiting[--height];
            if (away[height] >= least) continue;
            if (node < leaves - 1) {
                int64_t left = 2 * node + 1;
                double to_left = distance_to_box(nodes[left], points[p]);
                double to_right = distance_to_box(nodes[left + 1], points[p]);
                bool is_left_first = to_left < to_right;
                waiting[height] = is_left_first ? left + 1 : left;
                away[height++] = is_left_first ? to_right : to_left;
                waiting[height] = is_left_first ? left : left + 1;
                away[height++] = is_left_first ? to_left : to_right;
                continue;
            }
            int64_t leaf = node - leaves + 1;
            for (int64_t face = first_of_leaf(leaf, n_faces, leaves);
                 face < first_of_leaf(leaf + 1, n_faces, leaves); face++) {
                struct place found = to_face(corners[face], points[p]);
                if (!(found.square < least)) continue;
                least = found.square;
                faces[p] = face;
                write_weights(found, weights[p]);
            }
        }
        squares[p] = least;
    }
}

/* Faces are visited from neighbor to neighbor. `visits` holds the last point that visited each. */
KERNEL void fill_nearest_around(const double (*points)[3][3], const double (*middles)[3],
                                const int64_t *starts, const double *reach,
                                const double (*corners)[3][3], const int64_t (*neighbors)[3],
                                int64_t *visits, int64_t *waiting, int64_t (*faces)[3],
                                double (*weights)[3][3], int64_t n_points) {
    for (int64_t p = 0; p < n_points; p++) {
        double least[3] = {INFINITE, INFINITE, INFINITE};
        int64_t first = 0, last = 1;
        waiting[0] = starts[p];
        visits[starts[p]] = p;
        while (first < last && maximum(maximum(least[0], least[1]), least[2]) > 0) {
            int64_t face = waiting[first++];
            for (int k = 0; k < 3; k++) {
                struct place found = to_face(corners[face], points[p][k]);
                if (!(found.square < least[k])) continue;
                least[k] = found.square;
                faces[p][k] = face;
                write_weights(found, weights[p][k]);
            }
            for (int k = 0; k < 3; k++) {
                int64_t other = neighbors[face][k];
                if (visits[other] == p || to_face(corners[other], middles[p]).square > reach[p])
                    continue;
                visits[other] = p;
                waiting[last++] = other;
            }
        }
    }
}

/* Half the solid angle of a face is the argument of a complex number (Van Oosterom and Strackee
   1983). Arguments are summed by multiplying the numbers, and full turns are counted where the
   product crosses the negative real axis; so only one arctangent is needed, which the caller takes. */
KERNEL void multiply_angles(const double (*points)[3], const double (*corners)[3][3],
                            double (*products)[2], int64_t *turns, int64_t n_points,
                            int64_t n_faces) {
    for (int64_t p = 0; p < n_points; p++) {
        double real = 1, imaginary = 0;
        int64_t turn = 0;
        for (int64_t face = 0; face < n_faces; face++) {
            struct vector one = difference(corners[face][0], points[p]);
            struct vector two = difference(corners[face][1], points[p]);
            struct vector three = difference(corners[face][2], points[p]);
            double a = square_root(dot(one, one)), b = square_root(dot(two, two));
            double c = square_root(dot(three, three));
            double volume = dot(one, cross(two, three));
            double below =
                a * b * c + dot(one, two) * c + dot(two, three) * a + dot(three, one) * b;
            if (volume == 0 && below == 0) continue; /* the point is a corner, or lies on a side */
            bool is_upper = imaginary >= 0;
            double kept = real;
            real = kept * below - imaginary * volume;
            imaginary = kept * volume + imaginary * below;
            if (is_upper && volume > 0 && imaginary < 0) turn++;
            if (!is_upper && volume < 0 && imaginary >= 0) turn--;
            double size = absolute(real) + absolute(imaginary);
            if (__builtin_expect(size < SMALL || size > LARGE, false)) {
                real /= size;
                imaginary /= size;
            }
        }
        turns[p] = turn;
        products[p][0] = real;
        products[p][1] = imaginary;
    }
}
