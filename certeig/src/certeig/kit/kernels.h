/* What all kernels share.

   A kernel takes addresses of contiguous arrays, numbers, and lengths last. It allocates nothing,
   calls no library and keeps no state, so that threads may call it at once. It tells a failure only
   by what it returns. Its declaration, in the file of the same name in Python, says what it does. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define KERNEL __declspec(dllexport)
#else
#define KERNEL __attribute__((visibility("default")))
#endif

/* Instructions of the processor, for which other compilers would call a library. */
#define absolute __builtin_fabs
#define square_root __builtin_sqrt
#define INFINITE __builtin_inf()

static inline int64_t lesser(int64_t a, int64_t b) { return a < b ? a : b; }
static inline int64_t greater(int64_t a, int64_t b) { return a > b ? a : b; }

/* The first, if the two are equal or one is not a number, as min and max in Python. */
static inline double minimum(double a, double b) { return b < a ? b : a; }
static inline double maximum(double a, double b) { return b > a ? b : a; }

/* Division that rounds down, as in Python, by a positive number; that of C rounds to zero. */
static inline int64_t floor_divide(int64_t a, int64_t b) { return a / b - (a % b < 0); }

/* sqrt(x² + y²) for x >= y >= 0 that neither overflows nor vanishes, by the corrected method of Borges
   (2020, An improved algorithm for hypot(a, b)), as glibc has it from 2.35 on. */
static inline double corrected_root(double x, double y) {
    double root = square_root(x * x + y * y), first, second;
    if (root <= 2 * y) {
        double delta = root - y;
        first = x * (2 * delta - x);
        second = (delta - 2 * (x - y)) * delta;
    } else {
        double delta = root - x;
        first = 2 * delta * (x - 2 * y);
        second = (4 * delta - y) * y + delta * delta;
    }
    return root - (first + second) / (2 * root);
}

/* The length of a vector, to the last digit nearly always, whatever the scale of its coordinates. */
static inline double hypotenuse(double x, double y) {
    double longer = absolute(x) > absolute(y) ? absolute(x) : absolute(y);
    double shorter = absolute(x) > absolute(y) ? absolute(y) : absolute(x);
    if (shorter <= longer * 0x1p-54) return longer + shorter;
    if (longer > 0x1p511) return corrected_root(longer * 0x1p-600, shorter * 0x1p-600) * 0x1p600;
    if (shorter < 0x1p-459) return corrected_root(longer * 0x1p600, shorter * 0x1p600) * 0x1p-600;
    return corrected_root(longer, shorter);
}
