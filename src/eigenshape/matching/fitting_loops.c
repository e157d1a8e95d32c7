/* The pull on frames, and their turns. Documented in fitting_loops.py. */
#include "kernels.h"

#include "matching/nearest.h"

enum {
    N_GIVEN = 2,     /* steps towards given targets; later ones are towards nearest points */
    N_FIRST = 12,    /* turns of the frames in the first step */
    N_NEXT = 2,      /* the same in each later one */
    MOST_TURNS = 30, /* of one frame in one round; it ends at the first small turn */
    LANES = 8,       /* frames that are turned side by side */
};
static const double SOFT = 0.03; /* units from the whole at which the pull on a point is halved */
static const double LEAST_SIZE = 0.8, MOST_SIZE = 1.25; /* stretch of a frame that costs nothing */
static const double LEAST_STIFFNESS =
    1e-9; /* of all frames, so that one that nothing pulls is held */
static const double SMALLEST = 0x1p-1022; /* a normal length, to divide by */
static const double SMALLEST_TURN = 1e-4; /* radians; the next round starts from there */

/* Vertices and normals of a part, its frames, and which of these carry each vertex how far. */
struct carried {
    const double (*vertices)[3];
    const double (*normals)[3];
    const int64_t *frames, *carriers;
    const double *portions;
};

/* Vertices of the part that are pulled, each by its share, and the arms from the frames that carry it. */
struct samples {
    const int64_t *vertices;
    const double *pull;
    const double (*arms)[3];
};

/* From frame to frame, both ways; the graph is their Laplacian. */
struct edges {
    const int64_t *one, *two;
    const double (*links)[3];
    const double *graph;
};

/* Vertices of the whole, and which of them draw samples. */
struct whole {
    const double (*vertices)[3];
    const double (*normals)[3];
    const bool *inner;
};

/* Their tree, with the vertex of each of its rows. */
struct tree {
    const int64_t *order;
    const double (*rows)[6];
    const double (*nodes)[2][6];
};

/* Of frames: the matrix of a step, forces on them, by axis, products of their edges before and after,
   and squares. Of samples: the pull on each, the normal and the row that it has now, the nearest row of
   the tree, and how far that is. */
struct scratch {
    double *matrix, *forces;
    double (*products)[3][3];
    double *squares, *pull;
    double (*normals)[3];
    double (*points)[6];
    int64_t *found;
    double *distances;
};

/* Functions of the C library, and two of LAPACK: a Cholesky factor, and solves with it. */
struct routines {
    double (*cosine)(double);
    double (*sine)(double);
    void (*dpotrf)(const char *, const int *, double *, const int *, int *);
    void (*dpotrs)(const char *, const int *, const int *, const double *, const int *, double *,
                   const int *, int *);
};

/* Fill the lower triangle of the matrix by which places of frames depend on the pulls on samples: the sum
   of the products of portions, times the pull on each, plus the stiffness times the graph. */
static void fill_matrix(const struct carried *part, const struct samples *samples,
                        const double *pull, const double *graph, double stiffness, double *matrix,
                        int64_t n_samples, int64_t n_carriers, int64_t n_frames) {
    for (int64_t i = 0; i < n_frames; i++)
        for (int64_t j = 0; j <= i; j++) matrix[i * n_frames + j] = 0;
    for (int64_t s = 0; s < n_samples; s++) {
        const int64_t *carrier = &part->carriers[samples->vertices[s] * n_carriers];
        const double *portion = &part->portions[samples->vertices[s] * n_carriers];
        for (int64_t c = 0; c < n_carriers; c++)
            for (int64_t d = 0; d < n_carriers; d++)
                if (carrier[c] <= carrier[d])
                    matrix[carrier[d] * n_frames + carrier[c]] += pull[s] * portion[c] * portion[d];
    }
    for (int64_t i = 0; i < n_frames; i++) {
        for (int64_t j = 0; j <= i; j++)
            matrix[i * n_frames + j] += stiffness * graph[i * n_frames + j];
        matrix[i * n_frames + i] += LEAST_STIFFNESS / (double)n_frames;
    }
}

/* Write a matrix times a vector. */
static void turn_arm(const double matrix[3][3], const double arm[3], double turned[3]) {
    for (int d = 0; d < 3; d++)
        turned[d] = matrix[d][0] * arm[0] + matrix[d][1] * arm[1] + matrix[d][2] * arm[2];
}

/* Fill what pulls on frames, in their turns: samples, which lie at arms from the frames that carry
   them, and edges, of which each demands minus its weight times its link in the mean turn of its frames. */
static void fill_forces(const struct carried *part, const struct samples *samples,
                        const double *pull, const double (*targets)[3], const struct edges *edges,
                        double weight, const double (*turns)[3][3], double *forces,
                        int64_t n_samples, int64_t n_carriers, int64_t n_frames, int64_t n_edges) {
    for (int64_t i = 0; i < 3 * n_frames; i++) forces[i] = 0;
    for (int64_t s = 0; s < n_samples; s++) {
        const int64_t *carrier = &part->carriers[samples->vertices[s] * n_carriers];
        const double *portion = &part->portions[samples->vertices[s] * n_carriers];
        double rest[3] = {targets[s][0], targets[s][1], targets[s][2]};
        for (int64_t c = 0; c < n_carriers; c++) {
            const double *arm = samples->arms[s * n_carriers + c];
            for (int d = 0; d < 3; d++)
                for (int e = 0; e < 3; e++)
                    rest[d] -= portion[c] * turns[carrier[c]][d][e] * arm[e];
        }
        for (int64_t c = 0; c < n_carriers; c++)
            for (int d = 0; d < 3; d++)
                forces[d * n_frames + carrier[c]] += pull[s] * portion[c] * rest[d];
    }
    for (int64_t edge = 0; edge < n_edges; edge++) {
        int64_t one = edges->one[edge], two = edges->two[edge];
        for (int d = 0; d < 3; d++) {
            double turned = 0;
            for (int e = 0; e < 3; e++)
                turned += 0.5 * (turns[one][d][e] + turns[two][d][e]) * edges->links[edge][e];
            forces[d * n_frames + one] -= weight * turned;
        }
    }
}

/* Write where frames, each a turn times a size at a place, carry a vertex, and the normal there. */
static void carry_vertex(const struct carried *part, const double (*turns)[3][3],
                         const double (*places)[3], int64_t v, int64_t n_carriers, double point[3],
                         double normal[3]) {
    double center[3] = {0}, away[3] = {0}, blend[3][3] = {{0}};
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
        point[d] = center[d] + away[d];
        normal[d] /= length;
    }
}

KERNEL void carry_vertices(const double (*turns)[3][3], const double (*places)[3],
                           const struct carried *part, const int64_t *vertices, double (*points)[3],
                           double (*normals)[3], int64_t n_vertices, int64_t n_carriers) {
    for (int64_t number = 0; number < n_vertices; number++)
        carry_vertex(part, turns, places, vertices[number], n_carriers, points[number],
                     normals[number]);
}

/* The nearest points of the whole that face the same way pull, the more the nearer: each sample towards
   the plane there, and a share `along` of the way along it. */
static void draw_samples(const struct carried *part, const struct samples *samples,
                         const struct whole *whole, const struct tree *tree, double normal_length,
                         double along, int64_t levels, const double (*turns)[3][3],
                         const double (*places)[3], double (*targets)[3], const struct scratch *now,
                         int64_t n_samples, int64_t n_carriers, int64_t n_rows) {
    for (int64_t s = 0; s < n_samples; s++) {
        double *point = now->points[s];
        carry_vertex(part, turns, places, samples->vertices[s], n_carriers, point, now->normals[s]);
        for (int d = 0; d < 3; d++) point[3 + d] = normal_length * now->normals[s][d];
    }
    find_nearest_rows((const double (*)[6])now->points, tree->rows, levels, tree->nodes, now->found,
                      now->distances, n_samples, n_rows);
    for (int64_t s = 0; s < n_samples; s++) {
        int64_t nearest = tree->order[now->found[s]];
        const double *place = whole->vertices[nearest], *plane = whole->normals[nearest];
        double step[3], upward = 0, square = 0, facing = 0;
        for (int d = 0; d < 3; d++) {
            step[d] = place[d] - now->points[s][d];
            upward += step[d] * plane[d];
            square += step[d] * step[d];
            facing += now->normals[s][d] * plane[d];
        }
        for (int d = 0; d < 3; d++) {
            double flat = upward * plane[d];
            targets[s][d] = now->points[s][d] + flat + along * (step[d] - flat);
        }
        facing = whole->inner[nearest] ? minimum(maximum(facing, 0), 1) : 0;
        now->pull[s] = samples->pull[s] * facing / (1 + square / (SOFT * SOFT));
    }
}

/* The axis of the next small turn of each rotation towards a matrix, and the inner products of both. */
static void fill_axes(const double products[3][3][LANES], const double turns[3][3][LANES],
                      const double *floors, double axes[3][LANES], double *inners) {
    for (int l = 0; l < LANES; l++) {
        double x = 0, y = 0, z = 0, inner = 0;
        for (int e = 0; e < 3; e++) {
            double a = turns[0][e][l], b = turns[1][e][l], c = turns[2][e][l];
            double u = products[0][e][l], v = products[1][e][l], w = products[2][e][l];
            x += b * w - c * v;
            y += c * u - a * w;
            z += a * v - b * u;
            inner += a * u + b * v + c * w;
        }
        double reach = absolute(inner) + floors[l];
        axes[0][l] = x / reach, axes[1][l] = y / reach, axes[2][l] = z / reach;
        inners[l] = inner;
    }
}

/* Turn each rotation about an axis of length 1, by the formula of Rodrigues. */
static void turn_about(double axes[3][LANES], const double *cosines, const double *sines,
                       double turns[3][3][LANES]) {
    for (int e = 0; e < 3; e++)
        for (int l = 0; l < LANES; l++) {
            double a = turns[0][e][l], b = turns[1][e][l], c = turns[2][e][l];
            double x = axes[0][l], y = axes[1][l], z = axes[2][l];
            double cosine = cosines[l], sine = sines[l];
            double along = (x * a + y * b + z * c) * (1 - cosine);
            turns[0][e][l] = a * cosine + (y * c - z * b) * sine + x * along;
            turns[1][e][l] = b * cosine + (z * a - x * c) * sine + y * along;
            turns[2][e][l] = c * cosine + (x * b - y * a) * sine + z * along;
        }
}

/* Turn each rotation to the one nearest to a matrix, and write their inner products. It is found by small
   turns from the last one (Müller, Bender, Chentanez and Macklin 2016). Those that have arrived stay. */
static void turn_nearest(const double products[3][3][LANES], double turns[3][3][LANES],
                         double *inners, const struct routines *routines) {
    double floors[LANES] = {0}, axes[3][LANES], angles[LANES], cosines[LANES], sines[LANES];
    bool moves[LANES];
    for (int l = 0; l < LANES; l++) {
        double norm = 0;
        for (int e = 0; e < 3; e++)
            norm += products[0][e][l] * products[0][e][l] + products[1][e][l] * products[1][e][l] +
                    products[2][e][l] * products[2][e][l];
        moves[l] = norm != 0;
        floors[l] = moves[l] ? 1e-9 * square_root(norm) : 1;
    }
    for (int round = 0; round < MOST_TURNS; round++) {
        bool any = false;
        fill_axes(products, turns, floors, axes, inners);
        for (int l = 0; l < LANES; l++)
            angles[l] = square_root(axes[0][l] * axes[0][l] + axes[1][l] * axes[1][l] +
                                    axes[2][l] * axes[2][l]);
        for (int l = 0; l < LANES; l++) {
            moves[l] &= !(angles[l] < SMALLEST_TURN);
            any |= moves[l];
            /* Where it has arrived, a turn by nothing. */
            double angle = moves[l] ? angles[l] : 1;
            for (int d = 0; d < 3; d++) axes[d][l] = moves[l] ? axes[d][l] / angle : 0;
            cosines[l] = moves[l] ? routines->cosine(angle) : 1;
            sines[l] = moves[l] ? routines->sine(angle) : 0;
        }
        if (!any) break;
        turn_about(axes, cosines, sines, turns);
    }
}

/* Turn each frame to follow its edges, and give it the size that fits them best. */
static void follow_edges(const double (*places)[3], const struct edges *edges,
                         const struct routines *routines, double (*turns)[3][3],
                         const struct scratch *now, int64_t n_frames, int64_t n_edges) {
    for (int64_t i = 0; i < n_frames; i++) {
        now->squares[i] = 0;
        for (int d = 0; d < 3; d++)
            for (int e = 0; e < 3; e++) now->products[i][d][e] = 0;
    }
    for (int64_t edge = 0; edge < n_edges; edge++) {
        int64_t i = edges->one[edge], j = edges->two[edge];
        const double *link = edges->links[edge];
        for (int d = 0; d < 3; d++) {
            double moved = places[j][d] - places[i][d];
            now->squares[i] += link[d] * link[d];
            for (int e = 0; e < 3; e++) now->products[i][d][e] += moved * link[e];
        }
    }
    for (int64_t first = 0; first < n_frames; first += LANES) {
        double products[3][3][LANES], turned[3][3][LANES], inners[LANES];
        for (int64_t l = 0; l < LANES; l++) {
            int64_t i = lesser(first + l, n_frames - 1);
            double square = 0;
            for (int d = 0; d < 3; d++) square += turns[i][d][0] * turns[i][d][0];
            double size = square_root(square);
            for (int d = 0; d < 3; d++)
                for (int e = 0; e < 3; e++) {
                    turned[d][e][l] = turns[i][d][e] / size;
                    products[d][e][l] = now->products[i][d][e];
                }
        }
        turn_nearest((const double (*)[3][LANES])products, turned, inners, routines);
        for (int64_t i = first; i < lesser(first + LANES, n_frames); i++) {
            double inner = inners[i - first], square = now->squares[i];
            double size = square > 0 ? minimum(maximum(inner / square, LEAST_SIZE), MOST_SIZE) : 1;
            for (int d = 0; d < 3; d++)
                for (int e = 0; e < 3; e++) turns[i][d][e] = size * turned[d][e][i - first];
        }
    }
}

KERNEL void settle_frames(const struct carried *part, const struct samples *samples,
                          const struct edges *edges, const struct whole *whole,
                          const struct tree *tree, int64_t levels, double normal_length,
                          const double *stiffnesses, double along, double (*targets)[3],
                          double (*turns)[3][3], double (*places)[3], const struct scratch *now,
                          const struct routines *routines, int64_t n_samples, int64_t n_carriers,
                          int64_t n_frames, int64_t n_edges, int64_t n_steps, int64_t n_rows) {
    const int size = (int)n_frames, axes = 3;
    int failed;
    for (int64_t s = 0; s < n_samples; s++) {
        now->pull[s] = samples->pull[s];
        now->found[s] = 0;
    }
    for (int64_t step = 0; step < n_steps; step++) {
        if (step >= N_GIVEN)
            draw_samples(part, samples, whole, tree, normal_length, along, levels, turns, places,
                         targets, now, n_samples, n_carriers, n_rows);
        /* Move frames so that samples come nearer to their targets, and turn frames to follow. */
        fill_matrix(part, samples, now->pull, edges->graph, stiffnesses[step], now->matrix,
                    n_samples, n_carriers, n_frames);
        /* In the order of LAPACK, the lower triangle is the upper one. */
        routines->dpotrf("U", &size, now->matrix, &size, &failed);
        double weight = stiffnesses[step] * 2 / (double)n_edges; /* as in the graph */
        for (int round = 0; round < (step ? N_NEXT : N_FIRST); round++) {
            fill_forces(part, samples, now->pull, targets, edges, weight, turns, now->forces,
                        n_samples, n_carriers, n_frames, n_edges);
            routines->dpotrs("U", &size, &axes, now->matrix, &size, now->forces, &size, &failed);
            for (int64_t i = 0; i < n_frames; i++)
                for (int d = 0; d < 3; d++) places[i][d] = now->forces[d * n_frames + i];
            follow_edges(places, edges, routines, turns, now, n_frames, n_edges);
        }
    }
}
