/* Matches that agree, and distances by landmarks: documented in matching_loops.py. */
#include "kernels.h"

enum { ROUNDS = 20 }; /* of the power method */

/* dgemv of BLAS: y = a A x + b y, with the sizes and steps of A, x and y. */
struct blas {
    void (*dgemv)(const char *transposed, const int *rows, const int *columns, const double *a,
                  const double *matrix, const int *wide, const double *x, const int *x_step,
                  const double *b, double *y, const int *y_step);
};

static void multiply_square(const struct blas *blas, int64_t n, const double *matrix,
                            const double *x, double *y) {
    int size = (int)n, step = 1;
    double one = 1, zero = 0;
    blas->dgemv("T", &size, &size, &one, matrix, &size, x, &step, &zero, y, &step);
}

/* Return the share by which two matches agree, given the distances between their points. */
static double agreement_of(double ours, double theirs, double slack, double shortest) {
    if (absolute(ours) == INFINITE || absolute(theirs) == INFINITE) return 0;
    double longest = maximum(maximum(ours, theirs), shortest);
    double error = absolute(ours - theirs) / longest / slack;
    return error < 1 ? 1 - error * error : 0;
}

static void fill_agreeing(const float *ours, const float *theirs, double ratio, double slack,
                          double shortest, double *agreeing, int64_t n) {
    for (int64_t one = 0; one < n; one++) {
        agreeing[one * n + one] = 0;
        for (int64_t two = 0; two < one; two++) {
            double between = ratio * ours[one * n + two];
            double agreement = agreement_of(between, theirs[one * n + two], slack, shortest);
            agreeing[one * n + two] = agreeing[two * n + one] = agreement;
        }
    }
}

KERNEL double find_leading(const float *ours, const float *theirs, const double *shares,
                           double ratio, double slack, double shortest, double *agreeing,
                           double *vector, double *scaled, double *support, const struct blas *blas,
                           int64_t n) {
    fill_agreeing(ours, theirs, ratio, slack, shortest, agreeing, n);
    for (int64_t i = 0; i < n; i++) {
        vector[i] = 1;
        support[i] = 0;
    }
    double value = 0;
    for (int round = 0; round < ROUNDS; round++) {
        for (int64_t i = 0; i < n; i++) scaled[i] = square_root(shares[i]) * vector[i];
        multiply_square(blas, n, agreeing, scaled, support);
        double squares = 0;
        for (int64_t i = 0; i < n; i++) {
            vector[i] = square_root(shares[i]) * support[i];
            squares += vector[i] * vector[i];
        }
        value = square_root(squares);
        if (value == 0) break;
        for (int64_t i = 0; i < n; i++) {
            vector[i] /= value;
            support[i] /= value;
        }
    }
    return value;
}

KERNEL void between_landmarks(const float *lengths, float *found, int64_t n_points,
                              int64_t n_landmarks) {
    for (int64_t one = 0; one < n_points; one++) {
        const float *ours = lengths + one * n_landmarks;
        found[one * n_points + one] = 0;
        for (int64_t two = 0; two < one; two++) {
            const float *theirs = lengths + two * n_landmarks;
            float most = INFINITE, least = 0;
            for (int64_t landmark = 0; landmark < n_landmarks; landmark++) {
                float a = ours[landmark], b = theirs[landmark];
                /* Two infinite distances have no difference. */
                float apart = a < b ? b - a : a > b ? a - b : 0;
                most = a + b < most ? a + b : most;
                least = apart > least ? apart : least;
            }
            float middle = (float)(((double)most + least) / 2);
            found[one * n_points + two] = found[two * n_points + one] = middle;
        }
    }
}
