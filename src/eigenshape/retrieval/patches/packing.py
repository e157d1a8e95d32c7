"""Turn codes and points of patches into bytes, and back without loss."""

import zlib

import numpy as np
from jaxtyping import Int8, UInt8

from eigenshape.retrieval.patches.code_loops import unpack
from eigenshape.retrieval.patches.matching import (
    LENGTHS,
    N_LANDMARKS,
    NUMBER_STEP,
    PatchPoints,
    distances_by_landmarks,
    nearest_lengths,
)

# How numbers of points, vertices, and weights are stored
LENGTH, VERTEX, HALF = np.dtype("<u4"), np.dtype("<u4"), np.dtype("<f2")


def pack_codes(codes: Int8[np.ndarray, "m v"]) -> UInt8[np.ndarray, "m h"]:
    """Return codes from -7 to 7, two to a byte.

    A byte has an entry of the first half of a code in its low half, and one of the second half in
    its high half, each raised by 8: so kernels read a row from end to end.
    """
    raised = (codes + 8).astype(np.uint8)
    half = codes.shape[-1] // 2
    return np.asarray(raised[:, :half] | raised[:, half:] << 4)


def unpack_codes(rows: UInt8[np.ndarray, "m h"]) -> Int8[np.ndarray, "m v"]:
    """Return the codes that `pack_codes` turned into bytes."""
    codes = np.empty((len(rows), 2 * rows.shape[1]), dtype=np.int8)
    unpack(np.ascontiguousarray(rows), codes)
    return codes


def pack_points(points: PatchPoints) -> bytes:
    """Return points as bytes: 16 KB for 150 points with 90 numbers each."""
    parts = (
        np.array([*points.numbers.shape], dtype=LENGTH),
        points.vertices.astype(VERTEX),
        points.weights.astype(HALF),
        np.rint(points.numbers / NUMBER_STEP).astype(np.int8),
        nearest_lengths(points.distances[:, :N_LANDMARKS]),
    )
    # Each part is coded apart, since their bytes are distributed differently.
    deflate = zlib.compressobj()
    pieces = [deflate.compress(part.tobytes()) + deflate.flush(zlib.Z_FULL_FLUSH) for part in parts]
    return b"".join([*pieces, deflate.flush()])


def unpack_points(data: bytes) -> PatchPoints:
    """Return the points that `pack_points` turned into bytes."""
    data, place = zlib.decompress(data), 0

    def take(kind: "np.dtype[np.generic]", count: int) -> np.ndarray:
        nonlocal place
        taken = np.frombuffer(data, kind, count, place)
        place += taken.nbytes
        return taken

    m, r, d = take(LENGTH, 3).tolist()
    vertices, weights = take(VERTEX, m).astype(np.int64), take(HALF, m).astype(np.float32)
    numbers = np.float32(NUMBER_STEP) * take(np.dtype("i1"), m * r * d).reshape(m, r, d)
    lengths = LENGTHS[take(np.dtype("u1"), m * min(m, N_LANDMARKS)).reshape(m, -1)]
    return PatchPoints(numbers, weights, distances_by_landmarks(lengths), vertices)
