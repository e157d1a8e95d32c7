"""Memory that is free again goes back to the system (glibc alone would keep it)."""

import ctypes
from contextlib import suppress

M_ARENA_MAX = -8  # number of this option in <malloc.h>


def share_one_arena() -> None:
    """Let all threads take memory from one place; call this before there are threads.

    Otherwise each thread has a place of its own, and keeps up to 64 MB of free memory at its end,
    which not even `trim_memory` gives back. A fixed threshold above which arrays are mapped
    (M_MMAP_THRESHOLD) would do, too, but makes a solve 17 % slower.
    """
    with suppress(AttributeError, OSError, TypeError):  # another system than Linux with glibc
        ctypes.CDLL(None).mallopt(M_ARENA_MAX, 1)


def trim_memory() -> None:
    """Give all free memory back to the system."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
