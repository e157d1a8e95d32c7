"""Compressed data, unpacked only after its declared size is found to be reasonable."""

import lzma
import zlib

from eigenshape._errors import FileFormatError

# Compression ratios: a regular lattice of tetrahedra has 9 with zlib and 36 with LZMA, zeros 1,000.
MOST_TIMES = 40
ALWAYS = 2**25  # bytes that a file of any size may unpack to
LZMA_MEMORY = 2**27  # bytes; level 9, the most that compressors use, needs 65 MiB
ZLIB, LZMA = "vtkZLibDataCompressor", "vtkLZMADataCompressor"
COMPRESSORS = (ZLIB, LZMA)


def require_reasonable(size: int, n_bytes: int) -> None:
    """Raise an error for a declared size that no real file has, before memory is allocated.

    Raises
    ------
    FileFormatError
        If `size` bytes are more than a file of `n_bytes` may unpack to.
    """
    most = ALWAYS + MOST_TIMES * n_bytes
    if size > most:
        raise FileFormatError(
            f"Compressed data must unpack to at most {MOST_TIMES} times the size of its file and 32 MiB; it declares "
            f"{size} bytes in a file of {n_bytes}. If it is good, save it uncompressed."
        )


def unpack_block(packed: bytes, size: int, compressor: str) -> bytes:
    """Unpack a block to its declared size, and not more.

    Raises
    ------
    FileFormatError
        If the block is damaged, or of another size.
    """
    try:
        if compressor == ZLIB:
            found = zlib.decompressobj().decompress(
                packed, size + 1
            )  # a limit of 0 would mean no limit
        else:
            unpacker = lzma.LZMADecompressor(memlimit=LZMA_MEMORY)
            found = unpacker.decompress(packed, max_length=size + 1)
    except (zlib.error, lzma.LZMAError) as err:
        raise FileFormatError(f"A compressed block must be whole; one is damaged: {err}.") from err
    if len(found) != size:
        more = "more" if len(found) > size else f"{len(found)}"
        raise FileFormatError(
            f"A compressed block must unpack to the size it declares, {size}; it unpacks to {more}."
        )
    return found
