/* Loops of `matching`: matches that agree, and distances by landmarks. */
#include "kernels.h"

KERNEL void fill_agreement(const double *ours, const double *theirs, double ratio, double slack,
                           double least, double *agreeing, int64_t n) {
    for (int64_t one = 0; one < n; one++) {
        for (int64_t two = 0; two < one; two++) {
            double a = ratio * ours[one * n + two], b = theirs[one * n + two];
            if (absolute(a) == INFINITE || absolute(b) == INFINITE) continue;
            double longer = a > b ? a : b;
            double error = absolute(a - b) / (longer > least ? longer : least) / slack;
            if (error < 1) agreeing[one * n + two] = agreeing[two * n + one] = 1 - error * error;
        }
    }
}

KERNEL void between_landmarks(const float *lengths, float *found, int64_t n, int64_t a) {
    for (int64_t one = 0; one < n; one++) {
        found[one * n + one] = 0;
        for (int64_t two = 0; two < one; two++) {
            float most = INFINITE, least = 0;
            for (int64_t landmark = 0; landmark < a; landmark++) {
                float ours = lengths[one * a + landmark], theirs = lengths[two * a + landmark];
                if (ours + theirs < most) most = ours + theirs;
                if (ours == theirs) continue; /* two infinite distances have no difference */
                float difference = ours > theirs ? ours - theirs : theirs - ours;
                if (difference > least) least = difference;
            }
            double mean = ((double)most + least) / 2;
            found[one * n + two] = found[two * n + one] = (float)mean;
        }
    }
}
