/* Loop of `pencil`: the sums in Rayleigh quotients and residuals. */
#include "kernels.h"

enum { SUMMED_ROWS = 256 }; /* rows whose sums are added up separately first, for accuracy */

struct matrix {
    const int64_t *starts;
    const int32_t *columns;
    const double *entries;
};

/* Row i of a matrix times the vectors. */
static void fill_image(const struct matrix *matrix, const double *vectors, int64_t k, int64_t i,
                       double *restrict image) {
    for (int64_t c = 0; c < k; c++) image[c] = 0;
    for (int64_t place = matrix->starts[i]; place < matrix->starts[i + 1]; place++) {
        double value = matrix->entries[place];
        const double *row = vectors + matrix->columns[place] * k;
        for (int64_t c = 0; c < k; c++) image[c] += value * row[c];
    }
}

KERNEL void add_sums(const struct matrix *stiffness, const struct matrix *mass,
                     const double *vectors, const double *values, const double *weights,
                     bool with_residuals, double *images, double *part, double *sums, int64_t n,
                     int64_t k) {
    double *stiff = images, *heavy = images + k;
    for (int64_t i = 0; i < n; i++) {
        const double *row = vectors + i * k;
        fill_image(stiffness, vectors, k, i, stiff);
        fill_image(mass, vectors, k, i, heavy);
        for (int64_t c = 0; c < k; c++) {
            part[c] += row[c] * stiff[c];
            part[k + c] += row[c] * heavy[c];
        }
        for (int64_t c = 0; with_residuals && c < k; c++) {
            double rest = stiff[c] - values[c] * heavy[c];
            part[2 * k + c] += rest * rest / weights[i];
        }
        if ((i + 1) % SUMMED_ROWS != 0 && i + 1 != n) continue;
        for (int64_t at = 0; at < 3 * k; at++) {
            sums[at] += part[at];
            part[at] = 0;
        }
    }
}
