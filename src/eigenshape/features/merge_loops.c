/* Loops of `merge_tree`: sort the sides of faces by edge, and join faces across them. Here the number
   of a vertex is its rank; the lowest vertex is 0. */
#include "kernels.h"

static inline void swap(int32_t *one, int32_t *two) {
    int32_t kept = *one;
    *one = *two;
    *two = kept;
}

static inline void put_higher_first(int32_t *one, int32_t *two) {
    if (*one < *two) swap(one, two);
}

KERNEL void find_corners(const int64_t (*faces)[3], const int32_t *rank, int32_t (*corners)[3],
                         int64_t f) {
    for (int64_t face = 0; face < f; face++) {
        int32_t *ranks = corners[face];
        for (int corner = 0; corner < 3; corner++) ranks[corner] = rank[faces[face][corner]];
        put_higher_first(&ranks[0], &ranks[1]);
        put_higher_first(&ranks[1], &ranks[2]);
        put_higher_first(&ranks[0], &ranks[1]);
    }
}

KERNEL void file_sides(const int32_t (*corners)[3], int64_t *place, int32_t *lower, int32_t *owner,
                       int64_t f) {
    for (int64_t face = 0; face < f; face++) {
        for (int side = 0; side < 3; side++) {
            int high = side == 2 ? 1 : 0, low = side == 0 ? 1 : 2;
            int64_t to = place[corners[face][high]]++;
            lower[to] = corners[face][low];
            owner[to] = (int32_t)face;
        }
    }
}

/* Return whether a face precedes another by highest, middle and lowest vertex, then number. */
static bool is_lower(const int32_t (*corners)[3], int32_t one, int32_t two) {
    for (int corner = 0; corner < 3; corner++)
        if (corners[one][corner] != corners[two][corner])
            return corners[one][corner] < corners[two][corner];
    return one < two;
}

/* Sort the sides of a vertex by falling lower vertex; equal ones by rising face. This is Shell sort
   with Knuth's gaps (1973): most vertices have six sides, but the apex of a fan may have a million. */
static void sort_sides(const int32_t (*corners)[3], int32_t *lower, int32_t *owner, int64_t count) {
    int64_t gap = 1;
    while (9 * gap < count) gap = 3 * gap + 1; /* up to nine sides plain insertion is as fast */
    for (; gap; gap /= 3) {
        for (int64_t place = gap; place < count; place++) {
            int32_t low = lower[place], face = owner[place];
            int64_t into = place;
            for (; into >= gap; into -= gap) {
                int32_t before = lower[into - gap];
                bool moves =
                    before < low || (before == low && is_lower(corners, face, owner[into - gap]));
                if (!moves) break;
                lower[into] = before;
                owner[into] = owner[into - gap];
            }
            lower[into] = low;
            owner[into] = face;
        }
    }
}

/* Return the root of a face's tree, with path halving (Tarjan and van Leeuwen 1984). */
static int32_t root_of_face(int32_t *root, int32_t face) {
    while (root[face] != face) face = root[face] = root[root[face]];
    return face;
}

KERNEL int64_t join_faces(const int32_t (*corners)[3], const int64_t *starts, int32_t *lower,
                          int32_t *owner, int32_t *climbs_to, int32_t *highest, int32_t (*ended)[4],
                          int64_t n) {
    int64_t n_ended = 0;
    for (int32_t high = (int32_t)n - 1; high >= 0; high--) {
        int64_t first = starts[high], end = starts[high + 1];
        sort_sides(corners, lower + first, owner + first, end - first);
        while (first < end) {
            int32_t low = lower[first];
            int64_t last = first;
            while (last + 1 < end && lower[last + 1] == low) last++;
            /* The higher face first: this may be its own way up. */
            for (int64_t side = last - 1; side >= first; side--) {
                int32_t face = owner[side], above = owner[side + 1];
                bool is_highest = corners[face][0] == high && corners[face][1] == low;
                if (is_highest && above != face) climbs_to[face] = climbs_to[above];
            }
            for (int64_t side = first; side < last; side++) {
                int32_t one = climbs_to[owner[side]], two = climbs_to[owner[side + 1]];
                int32_t root_one = root_of_face(highest, one);
                int32_t root_two = root_of_face(highest, two);
                if (root_one == root_two) continue;
                if (is_lower(corners, root_two, root_one)) {
                    swap(&root_one, &root_two);
                    swap(&one, &two);
                }
                highest[root_one] = root_two;
                int32_t *row = ended[n_ended++];
                row[0] = root_one, row[1] = high, row[2] = low, row[3] = two;
            }
            first = last + 1;
        }
    }
    return n_ended;
}

static int64_t root_of_point(int64_t *root, int64_t point) {
    while (root[point] != point) point = root[point] = root[root[point]];
    return point;
}

KERNEL int64_t add_points(const int64_t *starts, const int64_t *neighbors, const int64_t *order,
                          const int64_t *place, int64_t *root, int64_t (*ended)[2], int64_t n) {
    int64_t n_ended = 0;
    for (int64_t i = 0; i < n; i++) {
        int64_t point = order[i];
        for (int64_t entry = starts[point]; entry < starts[point + 1]; entry++) {
            int64_t neighbor = neighbors[entry];
            if (place[neighbor] >= place[point]) continue;
            int64_t one = root_of_point(root, point), two = root_of_point(root, neighbor);
            if (one == two) continue;
            int64_t first = place[one] < place[two] ? one : two, later = first == one ? two : one;
            root[later] = first;
            if (later == point) continue;
            ended[n_ended][0] = later;
            ended[n_ended++][1] = point;
        }
    }
    for (int64_t i = 0; i < n; i++) root[order[i]] = root[root[order[i]]];
    return n_ended;
}

KERNEL void add_edges(const int64_t (*ends)[2], const int64_t *order, int64_t *root, bool *joins,
                      int64_t m) {
    for (int64_t i = 0; i < m; i++) {
        int64_t edge = order[i];
        int64_t one = root_of_point(root, ends[edge][0]), two = root_of_point(root, ends[edge][1]);
        if (one == two) continue;
        root[greater(one, two)] = lesser(one, two);
        joins[edge] = true;
    }
}
