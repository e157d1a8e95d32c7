"""Whole numbers as bytes, packed by LZMA2, and unpacked without surprises."""

import lzma

import numpy as np
from jaxtyping import Int

from eigenshape._errors import FileFormatError

# LZMA2 without a container: our file has its own lengths and its own checksum. Bytes are coded
# whatever their place (pb) and the byte before (lc), which say nothing of a coefficient: what comes
# out is within 1 % of the entropy of each band. The dictionary bounds the memory.
FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 9, "lc": 0, "lp": 0, "pb": 0, "dict_size": 1 << 22}]
# A number of this size or more is this byte, and the rest follows in a second stream.
ESCAPE = 255
# Most bytes of a number in the second stream, seven bits each.
MOST_BYTES = 9


def pack(data: bytes) -> bytes:
    """Compress bytes."""
    return lzma.compress(data, format=lzma.FORMAT_RAW, filters=FILTERS)


def unpack(data: bytes, most: int, what: str) -> bytes:
    """Decompress bytes; never more than `most` are unpacked.

    Raise FileFormatError if there are more, or the stream is damaged.
    """
    reader = lzma.LZMADecompressor(format=lzma.FORMAT_RAW, filters=FILTERS)
    try:
        found = reader.decompress(data, max_length=most + 1)
        # a stream of exactly `most` bytes still has its end mark to read
        ended = reader.eof or (not reader.needs_input and not reader.decompress(b"", max_length=1))
    except (lzma.LZMAError, EOFError) as err:
        raise FileFormatError(f"The {what} of a compressed mesh are damaged: {err}.") from err
    if len(found) > most or not (ended or reader.eof):
        raise FileFormatError(
            f"The {what} of a compressed mesh must unpack to at most {most} bytes; they are more, "
            "or end early. The file is damaged."
        )
    return found


def to_bytes(numbers: Int[np.ndarray, " n"]) -> tuple[bytes, bytes]:
    """Return a byte for each number of any sign, and what is left of those that need more."""
    folded = np.where(numbers < 0, -2 * numbers - 1, 2 * numbers)
    large = folded[folded >= ESCAPE] - ESCAPE
    return np.minimum(folded, ESCAPE).astype(np.uint8).tobytes(), to_varints(large.tolist())


def from_bytes(first: bytes, rest: bytes) -> Int[np.ndarray, " n"]:
    """Return the numbers of `to_bytes`.

    Raise FileFormatError if the second stream does not fit the first.
    """
    folded = np.frombuffer(first, dtype=np.uint8).astype(np.int64)
    large = np.flatnonzero(folded == ESCAPE)
    folded[large] += np.array(from_varints(rest, len(large)), dtype=np.int64)
    return np.where(folded % 2, -(folded + 1) // 2, folded // 2)


def to_varints(numbers: list[int]) -> bytes:
    """Return numbers as bytes of seven bits each, the lowest first (LEB128)."""
    written = bytearray()
    for number in numbers:
        left = number
        while left > 127:
            written.append(left & 127 | 128)
            left >>= 7
        written.append(left)
    return bytes(written)


def from_varints(data: bytes, count: int) -> list[int]:
    """Return the numbers of `to_varints`.

    Raise FileFormatError if there are not `count` of them, or one has more than nine bytes.
    """
    numbers, number, shift = [], 0, 0
    for byte in data:
        number |= (byte & 127) << shift
        shift += 7
        if shift > 7 * MOST_BYTES:
            break
        if byte < 128:
            numbers.append(number)
            number = shift = 0
    if len(numbers) != count or shift:
        raise FileFormatError(
            f"A compressed mesh must have {count} large numbers; {len(numbers)} could be read. "
            "The file is damaged."
        )
    return numbers
