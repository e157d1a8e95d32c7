/* Join faces over edges, and points over links, in the order of a function: documented in
   merge_loops.py. Corners, ranks and faces have 32 bits, which halves the memory traffic. */
#include "kernels.h"

/* The ranks of a face's corners, highest first. */
typedef int32_t corners_of[3];

static void put_higher_first(int32_t *one, int32_t *two) {
    if (*one >= *two) return;
    int32_t lower = *one;
    *one = *two;
    *two = lower;
}

KERNEL void find_corners(const int64_t (*faces)[3], const int32_t *rank, corners_of *corners,
                         int64_t n_faces) {
    for (int64_t face = 0; face < n_faces; face++) {
        int32_t *sorted = corners[face];
        for (int i = 0; i < 3; i++) sorted[i] = rank[faces[face][i]];
        put_higher_first(&sorted[0], &sorted[1]);
        put_higher_first(&sorted[1], &sorted[2]);
        put_higher_first(&sorted[0], &sorted[1]);
    }
}

KERNEL void file_sides(const corners_of *corners, int64_t *place, int32_t *lower, int32_t *owner,
                       int64_t n_faces) {
    /* The sides join the highest corner to the middle one, the highest to the lowest, and the
       middle one to the lowest. */
    static const int high[3] = {0, 0, 1}, low[3] = {1, 2, 2};
    for (int64_t face = 0; face < n_faces; face++) {
        for (int side = 0; side < 3; side++) {
            int64_t free = place[corners[face][high[side]]]++;
            lower[free] = corners[face][low[side]];
            owner[free] = (int32_t)face;
        }
    }
}

/* Return whether a face precedes another by highest, middle and lowest vertex, then number. */
static bool is_lower(const corners_of *corners, int32_t one, int32_t two) {
    for (int i = 0; i < 3; i++) {
        if (corners[one][i] != corners[two][i]) return corners[one][i] < corners[two][i];
    }
    return one < two;
}

/* Return whether a side comes after another: by falling lower vertex, then by rising face. */
static bool comes_after(const corners_of *corners, int32_t one_low, int32_t one_face,
                        int32_t two_low, int32_t two_face) {
    if (one_low != two_low) return one_low < two_low;
    return is_lower(corners, two_face, one_face);
}

/* Sort the sides of a vertex, by Shell sort with Knuth's gaps (1973): most vertices have six
   sides, but the apex of a fan may have a million. */
static void sort_sides(const corners_of *corners, int32_t *lower, int32_t *owner, int64_t first,
                       int64_t end) {
    int64_t gap = 1;
    while (9 * gap < end - first) gap = 3 * gap + 1; /* plain insertion is as fast up to nine */
    for (; gap > 0; gap /= 3) {
        for (int64_t side = first + gap; side < end; side++) {
            int32_t low = lower[side], face = owner[side];
            int64_t into = side;
            while (into - gap >= first &&
                   comes_after(corners, lower[into - gap], owner[into - gap], low, face)) {
                lower[into] = lower[into - gap];
                owner[into] = owner[into - gap];
                into -= gap;
            }
            lower[into] = low;
            owner[into] = face;
        }
    }
}

/* Return the root of a face's tree, with path halving (Tarjan and van Leeuwen 1984). */
static int32_t root_of_face(int32_t *root, int32_t face) {
    while (root[face] != face) {
        root[face] = root[root[face]];
        face = root[face];
    }
    return face;
}

KERNEL int64_t join_faces(const corners_of *corners, const int64_t *starts, int32_t *lower,
                          int32_t *owner, int32_t *climbs_to, int32_t *highest, int32_t (*ended)[4],
                          int64_t n_vertices) {
    int64_t n_ended = 0;
    for (int64_t high = n_vertices - 1; high >= 0; high--) {
        int64_t first = starts[high], end = starts[high + 1];
        sort_sides(corners, lower, owner, first, end);
        while (first < end) {
            int32_t low = lower[first];
            int64_t last = first;
            while (last + 1 < end && lower[last + 1] == low) last++;
            /* The higher face first: it may itself climb over this edge. */
            for (int64_t side = last - 1; side >= first; side--) {
                int32_t face = owner[side], above = owner[side + 1];
                bool is_highest_edge = corners[face][0] == high && corners[face][1] == low;
                if (is_highest_edge && above != face) climbs_to[face] = climbs_to[above];
            }
            for (int64_t side = first; side < last; side++) {
                int32_t one = climbs_to[owner[side]], two = climbs_to[owner[side + 1]];
                int32_t root_one = root_of_face(highest, one);
                int32_t root_two = root_of_face(highest, two);
                if (root_one == root_two) continue;
                /* The basin of the lower maximum ends. */
                bool second_ends = is_lower(corners, root_two, root_one);
                int32_t ending = second_ends ? root_two : root_one;
                highest[ending] = second_ends ? root_one : root_two;
                int32_t *row = ended[n_ended++];
                row[0] = ending;
                row[1] = (int32_t)high;
                row[2] = low;
                row[3] = second_ends ? one : two;
            }
            first = last + 1;
        }
    }
    return n_ended;
}

/* Return the root of a point's tree, as `root_of_face` does. */
static int64_t root_of_point(int64_t *root, int64_t point) {
    while (root[point] != point) {
        root[point] = root[root[point]];
        point = root[point];
    }
    return point;
}

KERNEL int64_t add_points(const int64_t *starts, const int32_t *neighbors, const int64_t *order,
                          const int64_t *place, int64_t *root, int64_t (*ended)[2], int64_t n) {
    int64_t n_ended = 0;
    for (int64_t step = 0; step < n; step++) {
        int64_t point = order[step];
        for (int64_t entry = starts[point]; entry < starts[point + 1]; entry++) {
            if (place[neighbors[entry]] >= step) continue;
            int64_t one = root_of_point(root, point);
            int64_t two = root_of_point(root, neighbors[entry]);
            if (one == two) continue;
            /* The component with the later first point ends. */
            int64_t ending = place[one] < place[two] ? two : one;
            root[ending] = ending == one ? two : one;
            if (ending == point) continue;
            ended[n_ended][0] = ending;
            ended[n_ended][1] = point;
            n_ended++;
        }
    }
    for (int64_t step = 0; step < n; step++) root[order[step]] = root[root[order[step]]];
    return n_ended;
}

KERNEL void add_edges(const int64_t (*ends)[2], const int64_t *order, int64_t *root, bool *joins,
                      int64_t n_edges) {
    for (int64_t step = 0; step < n_edges; step++) {
        int64_t edge = order[step];
        int64_t one = root_of_point(root, ends[edge][0]);
        int64_t two = root_of_point(root, ends[edge][1]);
        joins[edge] = one != two;
        root[greater(one, two)] = lesser(one, two);
    }
}
