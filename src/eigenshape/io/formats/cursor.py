"""Reading what a file declares, only after it is found that the file can hold it."""

import lzma
import zlib
from typing import Any

import numpy as np
from jaxtyping import Int

from eigenshape._errors import FileFormatError
from eigenshape.io.formats.text import numbers_of, wholes

# Compression ratios: a regular lattice of tetrahedra has 9 with zlib and 36 with LZMA, zeros 1,000.
MOST_TIMES = 40
ALWAYS = 2**25  # bytes that a file of any size may unpack to
LZMA_MEMORY = 2**27  # bytes; level 9, the most that compressors use, needs 65 MiB
ZLIB, LZMA = "vtkZLibDataCompressor", "vtkLZMADataCompressor"
COMPRESSORS = (ZLIB, LZMA)
USUAL_WORD = 16  # bytes of a number in a text file with the space after it


class Cursor:
    """A position in a file or a section of one, from which numbers and lines are taken in order.

    Attributes
    ----------
    data : bytes
    what : str
        The subject of errors, such as "A VTK file".
    is_text : bool
        Whether numbers are words of text, and not binary.
    place : int
        Number of bytes before the position.
    """

    def __init__(self, data: bytes, what: str, *, is_text: bool = False, place: int = 0) -> None:
        self.data, self.what, self.is_text, self.place = data, what, is_text, place

    def line(self) -> bytes:
        """Return the next line that is not blank, without spaces around it; an empty one at the end."""
        text = b""
        while not text and self.place < len(self.data):
            end = self.data.find(b"\n", self.place)
            end = len(self.data) if end < 0 else end
            text, self.place = self.data[self.place : end].strip(), end + 1
        return text

    def take(self, kind: Any, count: int) -> np.ndarray:
        """Return the next `count` numbers; `kind` is their numpy type in a binary file.

        Raise FileFormatError if there are fewer, or a word of a text file is not a number.
        """
        size = 2 if self.is_text else np.dtype(kind).itemsize  # a digit, and a space after it
        left = len(self.data) - self.place + self.is_text
        if not 0 <= count * size <= left:
            raise self.too_many(count)
        if self.is_text:
            return self._take_words(count)
        found = np.frombuffer(self.data, kind, count, self.place) if count else np.empty(0, kind)
        self.place += count * size
        return found

    def wholes(self, kind: Any, count: int) -> Int[np.ndarray, " k"]:
        """Return the next numbers, all of them whole, such as counts or corners."""
        found = self.take(kind, count)
        if found.dtype.kind == "f":
            return wholes(found, f"Counts and corners of {self.what[0].lower()}{self.what[1:]}")
        return found.astype(np.int64)

    def _take_words(self, count: int) -> np.ndarray:
        # A window is split that grows until it holds all words, so that many short lists in a long
        # file cost no more than one long list.
        width, words = USUAL_WORD * (count + 1), list[bytes]()
        while len(words) <= count and len(words) < len(self.data):
            window = self.data[self.place : self.place + width]
            words = window.split(None, count)
            if self.place + width >= len(self.data):
                break
            width *= 2
        try:
            found = numbers_of(words[:count])
        except ValueError as err:
            raise FileFormatError(
                f"{self.what} must hold {count} numbers at byte {self.place}; it does not: {err}."
            ) from err
        if len(found) < count:
            raise self.too_many(count)
        if len(words) > count:
            self.place += len(window) - len(words[count])
            return found
        if count and not self.data[-1:].isspace():
            raise FileFormatError(
                f"{self.what} must be whole; its last number has no line break after it."
            )
        self.place = len(self.data)
        return found

    def too_many(self, count: int) -> FileFormatError:
        """Return the error for a count of numbers that are not all there."""
        return FileFormatError(
            f"{self.what} must hold what it declares; {count} items at byte {self.place} do not fit into its "
            f"{len(self.data)} bytes."
        )

    def require_end(self) -> None:
        """Raise an error if anything but white space remains."""
        if self.data[self.place :].strip():
            raise FileFormatError(
                f"{self.what} must hold what it declares; more follows after the last that is declared."
            )


def require_reasonable(size: int, n_bytes: int) -> None:
    """Raise an error for a declared size that no real file has, before memory is allocated."""
    most = ALWAYS + MOST_TIMES * n_bytes
    if size > most:
        raise FileFormatError(
            f"Compressed data must unpack to at most {MOST_TIMES} times the size of its file and 32 MiB; it declares "
            f"{size} bytes in a file of {n_bytes}. If it is good, save it uncompressed."
        )


def unpack_block(packed: bytes, size: int, compressor: str) -> bytes:
    """Unpack a block to its declared size, and not more.

    Raise FileFormatError if the block is damaged, or of another size.
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
