/* The pull on frames, and their turns. Documented in fitting_loops.py. */
#include "kernels.h"

#include "space.h"

enum { MOST_TURNS = 30 }; /* of one frame in one round; it ends at the first small turn */
static const double SMALLEST = 0x1p-1022; /* a normal length, to divide by */
static const double SMALLEST_TURN = 1e-4; /* radians; the next round starts from there */

typedef double matrix[3][3];

/* Vertices and normals of a part, its frames, and which of these carry each vertex how far. */
struct carried {
    const double (*vertices)[3], (*normals)[3];
    const int64_t *frames, *carriers;
    const double *portions;
};

/* Functions of the C library. */
struct circle {
    double (*cosine)(double);
    double (*sine)(double);
};

KERNEL void fill_stiffness(const int64_t *carriers, const double *portions, const double *pull,
                           const double *graph, double stiffness, double least, double *matrix,
                           int64_t n_samples, int64_t n_carriers, int64_t n_frames) {
    for (int64_t i = 0; i < n_frames; i++)
        for (int64_t j = 0; j <= i; j++) matrix[i * n_frames + j] = 0;
    for (int64_t s = 0; s < n_samples; s++) {
        const int64_t *carrier = &carriers[s * n_carriers];
        const double *portion = &portions[s * n_carriers];
        for (int64_t c = 0; c < n_carriers; c++)
            for (int64_t d = 0; d < n_carriers; d++)
                if (carrier[c] <= carrier[d])
                    matrix[carrier[d] * n_frames + carrier[c]] += pull[s] * portion[c] * portion[d];
    }
    for (int64_t i = 0; i < n_frames; i++) {
        for (int64_t j = 0; j <= i; j++)
            matrix[i * n_frames + j] += stiffness * graph[i * n_frames + j];
        matrix[i * n_frames + i] += least;
    }
}

KERNEL void add_forces(const double (*turns)[3][3], const int64_t *carriers, const double *portions,
                       const double (*arms)[3], const double *pull, const double (*targets)[3],
                       const int64_t *one, const int64_t *two, const double (*links)[3],
                       double weight, double (*right)[3], int64_t n_samples, int64_t n_carriers,
                       int64_t n_edges) {
    for (int64_t s = 0; s < n_samples; s++) {
        double rest[3] = {targets[s][0], targets[s][1], targets[s][2]};
        int64_t first = s * n_carriers, end = first + n_carriers;
        for (int64_t c = first; c < end; c++)
            for (int d = 0; d < 3; d++)
                for (int e = 0; e < 3; e++)
                    rest[d] -= portions[c] * turns[carriers[c]][d][e] * arms[c][e];
        for (int64_t c = first; c < end; c++)
            for (int d = 0; d < 3; d++) right[carriers[c]][d] += pull[s] * portions[c] * rest[d];
    }
    for (int64_t edge = 0; edge < n_edges; edge++) {
        const double (*first)[3] = turns[one[edge]], (*second)[3] = turns[two[edge]];
        for (int d = 0; d < 3; d++) {
            double turned = 0;
            for (int e = 0; e < 3; e++)
                turned += 0.5 * (first[d][e] + second[d][e]) * links[edge][e];
            right[one[edge]][d] -= weight * turned;
        }
    }
}

/* Write a matrix times a vector. */
static void turn_arm(const double matrix[3][3], const double arm[3], double turned[3]) {
    for (int d = 0; d < 3; d++)
        turned[d] = matrix[d][0] * arm[0] + matrix[d][1] * arm[1] + matrix[d][2] * arm[2];
}

KERNEL void carry_vertices(const double (*turns)[3][3], const double (*places)[3],
                           const struct carried *part, const int64_t *vertices, double (*points)[3],
                           double (*normals)[3], int64_t n_vertices, int64_t n_carriers) {
    for (int64_t number = 0; number < n_vertices; number++) {
        int64_t v = vertices[number];
        double center[3] = {0}, away[3] = {0}, blend[3][3] = {{0}}, normal[3];
        for (int64_t c = v * n_carriers; c < (v + 1) * n_carriers; c++) {
            int64_t frame = part->carriers[c];
            double share = part->portions[c], arm[3], turned[3];
            for (int d = 0; d < 3; d++)
                arm[d] = part->vertices[v][d] - part->vertices[part->frames[frame]][d];
            turn_arm(turns[frame], arm, turned);
            for (int d = 0; d < 3; d++) {
                center[d] += share * places[frame][d];
                away[d] += share * turned[d];
                for (int e = 0; e < 3; e++) blend[d][e] += share * turns[frame][d][e];
            }
        }
        turn_arm(blend, part->normals[v], normal);
        double square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        double length = maximum(square_root(square), SMALLEST);
        for (int d = 0; d < 3; d++) {
            points[number][d] = center[d] + away[d];
            normals[number][d] = normal[d] / length;
        }
    }
}

/* Turn a rotation to the one nearest to a matrix, and return their inner product. It is found by
   small turns from the last one (Müller, Bender, Chentanez and Macklin 2016), each by the formula of
   Rodrigues. */
static double turn_nearest(const matrix product, matrix turn, const struct circle *circle) {
    double inner = 0;
    for (int round = 0; round < MOST_TURNS; round++) {
        double x = 0, y = 0, z = 0, norm = 0;
        inner = 0;
        for (int e = 0; e < 3; e++) {
            double a = turn[0][e], b = turn[1][e], c = turn[2][e];
            double u = product[0][e], v = product[1][e], w = product[2][e];
            x += b * w - c * v;
            y += c * u - a * w;
            z += a * v - b * u;
            inner += a * u + b * v + c * w;
            norm += u * u + v * v + w * w;
        }
        if (norm == 0) return inner;
        double reach = absolute(inner) + 1e-9 * square_root(norm);
        x /= reach, y /= reach, z /= reach;
        double angle = square_root(x * x + y * y + z * z);
        if (angle < SMALLEST_TURN) return inner;
        x /= angle, y /= angle, z /= angle;
        double cosine = circle->cosine(angle), sine = circle->sine(angle);
        for (int e = 0; e < 3; e++) {
            double a = turn[0][e], b = turn[1][e], c = turn[2][e];
            double along = (x * a + y * b + z * c) * (1 - cosine);
            turn[0][e] = a * cosine + (y * c - z * b) * sine + x * along;
            turn[1][e] = b * cosine + (z * a - x * c) * sine + y * along;
            turn[2][e] = c * cosine + (x * b - y * a) * sine + z * along;
        }
    }
    return inner;
}

KERNEL void follow_edges(const double (*places)[3], const int64_t *one, const int64_t *two,
                         const double (*arms)[3], double least, double most,
                         const struct circle *circle, double (*turns)[3][3],
                         double (*products)[3][3], double *squares, int64_t n_frames,
                         int64_t n_edges) {
    for (int64_t edge = 0; edge < n_edges; edge++) {
        int64_t i = one[edge], j = two[edge];
        for (int d = 0; d < 3; d++) {
            double moved = places[j][d] - places[i][d];
            squares[i] += arms[edge][d] * arms[edge][d];
            for (int e = 0; e < 3; e++) products[i][d][e] += moved * arms[edge][e];
        }
    }
    for (int64_t i = 0; i < n_frames; i++) {
        double square = 0;
        for (int d = 0; d < 3; d++) square += turns[i][d][0] * turns[i][d][0];
        double size = square_root(square);
        for (int d = 0; d < 3; d++)
            for (int e = 0; e < 3; e++) turns[i][d][e] /= size;
        double inner = turn_nearest(products[i], turns[i], circle);
        size = squares[i] > 0 ? minimum(maximum(inner / squares[i], least), most) : 1;
        for (int d = 0; d < 3; d++)
            for (int e = 0; e < 3; e++) turns[i][d][e] *= size;
    }
}
