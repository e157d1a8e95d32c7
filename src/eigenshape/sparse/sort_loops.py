"""A compiled sort: NumPy's takes a second to compile inside a loop, this one a tenth."""

from typing import no_type_check

from eigenshape._compile import njit


@njit
@no_type_check
def sort_part(values, start, stop):
    """Sort a part of an array in place, by insertion at gaps that shrink to 1 (Shell 1959, gaps of Knuth 1973)."""
    gap = 1
    while 3 * gap < stop - start:
        gap = 3 * gap + 1
    while gap:
        for i in range(start + gap, stop):
            value = values[i]
            into = i
            while into >= start + gap and values[into - gap] > value:
                values[into] = values[into - gap]
                into -= gap
            values[into] = value
        gap //= 3
