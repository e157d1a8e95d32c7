"""Turn codes of patches into bytes, and back without loss."""

import numpy as np
from jaxtyping import Int8, UInt8

from eigenshape.retrieval.patches.code_loops import unpack


def pack_codes(codes: Int8[np.ndarray, "... v"]) -> UInt8[np.ndarray, "m h"]:
    """Return codes from -7 to 7, two entries to a byte and one code to a row.

    A byte has an entry of the first half of a code in its low half, and one of the second half in
    its high half, each raised by 8: so kernels read a row from end to end.
    """
    raised = (codes.reshape(-1, codes.shape[-1]) + 8).astype(np.uint8)
    half = raised.shape[1] // 2
    return np.asarray(raised[:, :half] | raised[:, half:] << 4)


def unpack_codes(rows: UInt8[np.ndarray, "m h"]) -> Int8[np.ndarray, "m v"]:
    """Return the codes that `pack_codes` turned into bytes."""
    codes = np.empty((len(rows), 2 * rows.shape[1]), dtype=np.int8)
    unpack(np.ascontiguousarray(rows), codes)
    return codes
