"""Compiled loop that decompresses LZF data, which point cloud files use."""

from typing import no_type_check

import numpy as np

from eigenshape._compile import njit


@njit
@no_type_check
def decompress(data, size):
    """Return `size` bytes, or fewer if the data ends early or refers to bytes before its start."""
    out = np.empty(size, dtype=np.uint8)
    place, end = 0, 0
    while place < len(data):
        control = int(data[place])
        place += 1
        if control < 32:  # a run of control + 1 literal bytes
            count = control + 1
            if place + count > len(data) or end + count > size:
                return out[:end]
            out[end : end + count] = data[place : place + count]
            place += count
            end += count
            continue
        count = control >> 5
        if count == 7:
            if place >= len(data):
                return out[:end]
            count += int(data[place])
            place += 1
        if place >= len(data):
            return out[:end]
        start = end - ((control & 31) << 8) - int(data[place]) - 1
        place += 1
        count += 2
        if start < 0 or end + count > size:
            return out[:end]
        for step in range(count):
            out[end + step] = out[start + step]
        end += count
    return out[:end]
