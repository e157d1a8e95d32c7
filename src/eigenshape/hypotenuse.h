/* The length of a vector in the plane, to the last digit that of glibc since version 2.35. */
#pragma once
#include "kernels.h"

/* The root of a² + b² for a >= b >= 0, corrected for the rounding of its steps: algorithm 10 of
   Borges, "An improved algorithm for hypot(a, b)" (2019). */
static inline double corrected_root(double a, double b) {
    double root = square_root(a * a + b * b), error;
    if (root <= 2 * b) {
        double above = root - b;
        error = a * (2 * above - a) + (above - 2 * (a - b)) * above;
    } else {
        double above = root - a;
        error = 2 * above * (a - 2 * b) + ((4 * above - b) * b + above * above);
    }
    return root - error / (2 * root);
}

/* Squares of very large and very small numbers would overflow and underflow, so both are scaled. */
static inline double hypotenuse(double x, double y) {
    double one = absolute(x), two = absolute(y);
    double a = one < two ? two : one, b = one < two ? one : two;
    if (b <= a * 0x1p-54) return a + b;
    if (a > 0x1p511) return corrected_root(a * 0x1p-600, b * 0x1p-600) * 0x1p600;
    if (b < 0x1p-459) return corrected_root(a * 0x1p600, b * 0x1p600) * 0x1p-600;
    return corrected_root(a, b);
}
