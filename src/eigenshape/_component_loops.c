/* Groups of linked things: documented in _component_loops.py. */
#include "kernels.h"

/* The root of a tree, with path halving (Tarjan and van Leeuwen 1984). */
static int64_t root_of(int64_t *above, int64_t thing) {
    while (above[thing] != thing) thing = above[thing] = above[above[thing]];
    return thing;
}

KERNEL int64_t number_groups(const int64_t *one, const int64_t *two, int64_t *group, int64_t k,
                             int64_t n) {
    for (int64_t i = 0; i < n; i++) group[i] = i;
    for (int64_t link = 0; link < k; link++) {
        int64_t first = root_of(group, one[link]), second = root_of(group, two[link]);
        group[greater(first, second)] = lesser(first, second);
    }
    /* What is above a thing has a lower number, and its group by now. */
    int64_t count = 0;
    for (int64_t i = 0; i < n; i++) group[i] = group[i] == i ? count++ : group[group[i]];
    return count;
}
