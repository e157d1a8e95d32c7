/* A z-buffer: documented in raster_loops.py. Every number is rounded after each step in the order
   that is written here, so that the picture does not depend on how faces are grouped. */
#include "kernels.h"

/* Return a number of pixels, from 0 to a size. */
static int64_t clamp(double pixels, int64_t size) {
    return (int64_t)minimum(maximum(pixels, 0), size);
}

static double least_of(double a, double b, double c) { return minimum(minimum(a, b), c); }
static double most_of(double a, double b, double c) { return maximum(maximum(a, b), c); }

/* A picture: at each pixel the height of the nearest face, and the face with its weights, if there is
   room for these. */
struct picture {
    double *depth;
    int64_t *face_at;
    double (*weights)[3];
    int64_t height, width;
};

static inline void draw_faces(const double (*points)[3], const int64_t (*faces)[3],
                              double least_doubled_area, double slack, struct picture picture,
                              int64_t n_faces) {
    for (int64_t face = 0; face < n_faces; face++) {
        const double *a = points[faces[face][0]], *b = points[faces[face][1]];
        const double *c = points[faces[face][2]];
        double x = a[0], y = a[1];
        double one_x = b[0] - x, one_y = b[1] - y, two_x = c[0] - x, two_y = c[1] - y;
        double doubled_area = one_x * two_y - one_y * two_x;
        if (!(absolute(doubled_area) > least_doubled_area)) continue;

        /* The box of pixels whose middles may lie in the face. */
        int64_t left = clamp(__builtin_ceil(least_of(x, b[0], c[0]) - 0.5), picture.width);
        int64_t right = clamp(__builtin_floor(most_of(x, b[0], c[0]) - 0.5) + 1, picture.width);
        int64_t top = clamp(__builtin_ceil(least_of(y, b[1], c[1]) - 0.5), picture.height);
        int64_t bottom = clamp(__builtin_floor(most_of(y, b[1], c[1]) - 0.5) + 1, picture.height);

        /* The weights of corners 1 and 2 are linear in the place: here at the first pixel of the
           box, and their change per column and per row. */
        double scale = 1 / doubled_area;
        double across_one = two_y * scale, across_two = -one_y * scale;
        double down_one = -two_x * scale, down_two = one_x * scale;
        double here_x = left + 0.5 - x, here_y = top + 0.5 - y;
        double first_one = across_one * here_x + down_one * here_y;
        double first_two = across_two * here_x + down_two * here_y;
        for (int64_t row = top; row < bottom; row++) {
            double below = row - top;
/* Most boxes are a few pixels wide, where wide instructions take a quarter longer. */
#pragma clang loop vectorize(disable)
            for (int64_t column = left; column < right; column++) {
                int64_t pixel = row * picture.width + column;
                if (picture.depth[pixel] == INFINITE) continue;
                double beside = column - left;
                double weight_one = first_one + across_one * beside + down_one * below;
                double weight_two = first_two + across_two * beside + down_two * below;
                double weight = 1 - (weight_one + weight_two);
                if (!(weight >= -slack && weight_one >= -slack && weight_two >= -slack)) continue;
                double found = weight * a[2] + weight_two * c[2] + weight_one * b[2];
                if (!(found > picture.depth[pixel])) continue;
                picture.depth[pixel] = found;
                if (!picture.face_at) continue;
                picture.face_at[pixel] = face;
                picture.weights[pixel][0] = weight;
                picture.weights[pixel][1] = weight_one;
                picture.weights[pixel][2] = weight_two;
            }
        }
    }
}

KERNEL void fill_buffer(const double (*points)[3], const int64_t (*faces)[3],
                        double least_doubled_area, double slack, int64_t *face_at,
                        double (*weights)[3], double *depth, int64_t n_faces, int64_t height,
                        int64_t width) {
    struct picture picture = {depth, face_at, weights, height, width};
    draw_faces(points, faces, least_doubled_area, slack, picture, n_faces);
}

KERNEL void fill_depth(const double (*points)[3], const int64_t (*faces)[3],
                       double least_doubled_area, double slack, double *depth, int64_t n_faces,
                       int64_t height, int64_t width) {
    struct picture picture = {depth, NULL, NULL, height, width};
    draw_faces(points, faces, least_doubled_area, slack, picture, n_faces);
}
