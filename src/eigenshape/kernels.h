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
