/* Loops of `elimination`: L D Lᵀ front by front, and solves with it. */
#include "sparse/dense.h"

enum {
    SMALL = 40,   /* rows of a front up to which plain loops are faster (measured) */
    NEAR = 32,    /* rows of a panel that fit into the first-level cache */
    AFTER = 1024, /* numbers of L beyond those in use that memory is asked for (measured) */
    SOON = 64,    /* cache lines of the next panel that are asked for ahead (measured) */
};

/* Numbers in the lower triangle of a matrix. */
static inline int64_t triangle(int64_t rows) { return rows * (rows + 1) / 2; }

struct fronts {
    const int64_t *first, *begins, *rows, *last_child, *older, *panel_places;
};
struct lower {
    const int64_t *columns, *rows;
    const double *entries;
};
struct updates {
    double *stack;
    int64_t *places;
};
struct room {
    double *front, *times;
    int64_t *local, *ends;
};

/* Add the entries of the matrix in the columns of front s. */
static void gather_entries(const struct fronts *tree, const struct lower *lower,
                           const struct room *room, int64_t s, int64_t height) {
    for (int64_t j = tree->first[s]; j < tree->first[s + 1]; j++) {
        double *column = room->front + (j - tree->first[s]);
        for (int64_t at = lower->columns[j]; at < lower->columns[j + 1]; at++)
            column[room->local[lower->rows[at]] * height] += lower->entries[at];
    }
}

/* Add an update, a lower triangle row by row, to the entries of a front in these rows. Most of them
   are next to each other in the front, too, in a few runs. */
static void add_update(const double *update, const int64_t *rows, int64_t count,
                       const struct room *room, int64_t height) {
    const int64_t *local = room->local;
    int64_t *ends = room->ends;
    for (int64_t j = count - 1; j >= 0; j--) {
        bool continues = j + 1 < count && local[rows[j + 1]] == local[rows[j]] + 1;
        ends[j] = continues ? ends[j + 1] : j + 1;
    }
    for (int64_t i = 0; i < count; i++) {
        double *target = room->front + local[rows[i]] * height;
        for (int64_t j = 0; j <= i; j = ends[j]) {
            double *run = target + local[rows[j]] - j;
            int64_t stop = lesser(ends[j], i + 1);
            for (int64_t k = j; k < stop; k++) run[k] += update[k];
        }
        update += i + 1;
    }
}

/* Copy the eliminated columns to panels, each row by row. */
static void store_panels(const double *front, int64_t height, int64_t width, double *panel) {
    for (int64_t block = 0; block < width; block += WIDE) {
        int64_t stop = lesser(block + WIDE, width);
        for (int64_t i = block; i < height; i++)
            for (int64_t j = block; j < stop; j++) *panel++ = front[i * height + j];
    }
}

KERNEL bool factor_fronts(const struct fronts *tree, const struct lower *lower, double *panels,
                          double *pivots, const struct updates *updates, const struct room *room,
                          int64_t begin, int64_t end, int64_t top, const struct blas *blas) {
    const int64_t *first = tree->first, *begins = tree->begins, *rows = tree->rows;
    double *front = room->front;
    for (int64_t s = begin; s < end; s++) {
        int64_t height = begins[s + 1] - begins[s], width = first[s + 1] - first[s];
        for (int64_t i = 0; i < height; i++)
            for (int64_t j = 0; j < lesser(i + SHORT, height); j++) front[i * height + j] = 0;
        for (int64_t i = 0; i < height; i++) room->local[rows[begins[s] + i]] = i;
        gather_entries(tree, lower, room, s, height);
        for (int64_t child = tree->last_child[s]; child >= 0; child = tree->older[child]) {
            int64_t skip = begins[child] + first[child + 1] - first[child];
            int64_t count = begins[child + 1] - skip;
            add_update(updates->stack + updates->places[child], rows + skip, count, room, height);
            if (child >= begin) top -= triangle(count);
        }
        double *own = pivots + first[s];
        bool sound = height <= SMALL
                         ? eliminate_plain(front, height, width, own)
                         : eliminate_blocked(front, height, width, own, room->times, blas);
        if (!sound) return false;
        store_panels(front, height, width, panels + tree->panel_places[s]);
        updates->places[s] = top;
        for (int64_t i = width; i < height; i++)
            for (int64_t j = width; j <= i; j++) updates->stack[top++] = front[i * height + j];
    }
    return true;
}

struct tree {
    const int64_t *order, *first, *begins, *places;
};
struct tasks {
    const int64_t *fronts, *rows, *own_rows, *fetches, *fetched, *to;
};

/* Ask memory for so many numbers. Solves wait for it: they use each number of L eight times. */
static inline void fetch_numbers(const double *begin, int64_t count) {
    for (int64_t at = 0; at < count; at += LANES) fetch(begin + at);
}

/* Solve with the panels of one front: its own columns, then what these add to the rows below. */
static void solve_front(const struct tree *tree, const int64_t *rows, const double *panel,
                        eight *lanes, eight *gathered, int64_t s) {
    int64_t first = tree->first[s], stop = tree->first[s + 1];
    for (int64_t mine = first; mine < stop; mine += WIDE) {
        /* A panel is a triangle in the rows of its own columns, and a rectangle below. */
        int64_t columns = lesser(WIDE, stop - mine);
        int64_t below = tree->begins[s] + mine - first + columns;
        int64_t rest = tree->begins[s + 1] - below, four = rest / 4 * 4;
        for (int64_t i = 1; i < columns; i++)
            subtract_sums(1, panel + i * columns, 1, 0, lanes + mine, i, lanes + mine + i);
        panel += columns * columns;
        for (int64_t i = 0; i < four; i += 4) {
            fetch_numbers(panel + i * columns + AFTER, 4 * columns);
            write_negative_sums(4, panel + i * columns, 1, columns, lanes + mine, columns,
                                gathered + i);
        }
        for (int64_t i = four; i < rest; i++)
            write_negative_sums(1, panel + i * columns, 1, 0, lanes + mine, columns, gathered + i);
        for (int64_t i = 0; i < rest; i++) lanes[rows[below + i]] += gathered[i];
        panel += rest * columns;
    }
}

KERNEL void solve_lower(const struct tree *tree, const struct tasks *tasks, const double *panels,
                        const eight *right, eight *lanes, eight *gathered, int64_t begin,
                        int64_t end) {
    const int64_t *fronts = tasks->fronts;
    for (int64_t task = begin; task < end; task++) {
        for (int64_t i = tree->first[fronts[task]]; i < tree->first[fronts[task + 1]]; i++)
            lanes[i] = right[tree->order[i]];
        for (int64_t row = tasks->own_rows[task]; row < tasks->own_rows[task + 1]; row++)
            lanes[row] = (eight){0};
        for (int64_t i = tasks->fetches[task]; i < tasks->fetches[task + 1]; i++)
            lanes[tasks->to[i]] += lanes[tasks->fetched[i]];
        for (int64_t s = fronts[task]; s < fronts[task + 1]; s++)
            solve_front(tree, tasks->rows, panels + tree->places[s], lanes, gathered, s);
    }
}

/* Subtract from the rows of a panel's columns what the rows below give: gathered, rest of them. */
static void subtract_below(const double *panel, int64_t columns, const eight *gathered,
                           int64_t rest, eight *own) {
    int64_t four = columns / 4 * 4;
    for (int64_t low = 0; low < rest; low += NEAR) {
        int64_t count = lesser(NEAR, rest - low);
        const double *corner = panel + low * columns;
        const double *next = corner + NEAR * columns;
        for (int64_t j = 0; j < four; j += 4) {
            fetch_numbers(next + j * NEAR, 4 * NEAR);
            subtract_sums(4, corner + j, columns, 1, gathered + low, count, own + j);
        }
        for (int64_t j = four; j < columns; j++)
            subtract_sums(1, corner + j, columns, 0, gathered + low, count, own + j);
    }
}

/* Solve with the triangle of a panel, row by row, so that rows above do not wait for one another. */
static void solve_triangle_upward(const double *panel, int64_t columns, eight *own) {
    for (int64_t i = columns - 1; i > 0; i--) {
        const double *row = panel + i * columns;
        int64_t four = i / 4 * 4;
        for (int64_t j = 0; j < four; j += 4) subtract_sums(4, row + j, 0, 1, own + i, 1, own + j);
        for (int64_t j = four; j < i; j++) subtract_sums(1, row + j, 0, 0, own + i, 1, own + j);
    }
}

KERNEL void solve_upper(const struct tree *tree, const int64_t *rows, const int64_t *fronts,
                        const double *panels, const double *pivots, eight *lanes, eight *solution,
                        eight *gathered, int64_t begin, int64_t end) {
    const int64_t *first = tree->first, *begins = tree->begins, *places = tree->places;
    for (int64_t task = end - 1; task >= begin; task--) {
        for (int64_t i = first[fronts[task]]; i < first[fronts[task + 1]]; i++)
            lanes[i] /= pivots[i];
        for (int64_t s = fronts[task + 1] - 1; s >= fronts[task]; s--) {
            int64_t height = begins[s + 1] - begins[s], width = first[s + 1] - first[s];
            int64_t stop = places[s + 1];
            /* Memory is read backward, which processors do not foresee. */
            int64_t line = places[greater(s - 1, 0)] / LANES;
            int64_t last = lesser(line + SOON, stop / LANES);
            for (; line < last; line++) fetch(panels + line * LANES);
            for (int64_t block = (width - 1) / WIDE * WIDE; block >= 0; block -= WIDE) {
                int64_t columns = lesser(WIDE, width - block), rest = height - block - columns;
                int64_t below = stop - rest * columns;
                eight *own = lanes + first[s] + block;
                for (int64_t i = 0; i < rest; i++)
                    gathered[i] = lanes[rows[begins[s + 1] - rest + i]];
                subtract_below(panels + below, columns, gathered, rest, own);
                stop = below - columns * columns;
                solve_triangle_upward(panels + stop, columns, own);
            }
        }
        for (int64_t i = first[fronts[task]]; i < first[fronts[task + 1]]; i++)
            solution[tree->order[i]] = lanes[i];
    }
}

KERNEL void add_sizes(const int64_t *first, const int64_t *begins, const int64_t *rows,
                      const int64_t *places, const double *panels, const double *pivots,
                      double *weights, double *sizes, int64_t *terms, int64_t size) {
    for (int64_t s = 0; s < size; s++) {
        const double *panel = panels + places[s];
        for (int64_t mine = first[s]; mine < first[s + 1]; mine += WIDE) {
            int64_t columns = lesser(WIDE, first[s + 1] - mine);
            int64_t top = begins[s] + mine - first[s], height = begins[s + 1] - top;
            /* Above the diagonal, panels of large fronts keep numbers that are not of L. */
            for (int64_t i = 0; i < height; i++)
                for (int64_t j = 0; j < lesser(columns, i + 1); j++)
                    weights[mine + j] += absolute(panel[i * columns + j]);
            for (int64_t j = 0; j < columns; j++) weights[mine + j] *= absolute(pivots[mine + j]);
            for (int64_t i = 0; i < height; i++) {
                double total = 0;
                for (int64_t j = 0; j < lesser(columns, i + 1); j++)
                    total += absolute(panel[i * columns + j]) * weights[mine + j];
                sizes[rows[top + i]] += total;
                terms[rows[top + i]] += lesser(columns, i + 1);
            }
            panel += height * columns;
        }
    }
}
