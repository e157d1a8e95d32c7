"""Numbers in files: lines of text, and what a file declares, read only if the file can hold it."""

import codecs
import contextlib
import lzma
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from certeig.kit.errors import FileFormatError
from certeig.kit.files import require_lines

Line = tuple[int, bytes]  # its number in the file, and its text
PLAIN = b"+-.0123456789eE \t\n"
PLAIN_WHOLE = b"+-0123456789 \t\n"
EXACT = 2**53  # whole numbers below it are exact in double precision
INT64 = 2**63  # whole numbers from -INT64 to below INT64 fit into 64 bits


def lines_of(data: bytes, first: int = 1) -> list[Line]:
    """Split text into lines without comments and blank lines; names and comments may be in any encoding."""
    require_lines(data)
    texts = data.removeprefix(codecs.BOM_UTF8).splitlines()
    bare = ((number, text.partition(b"#")[0].strip()) for number, text in enumerate(texts, first))
    return [line for line in bare if line[1]]


def number_table(lines: Sequence[Line], allowed: bytes = PLAIN) -> Float[np.ndarray, "n c"] | None:
    """Read a table of plain numbers at once; return None if the lines are no such table."""
    text = b"\n".join([text for _, text in lines])
    if not text.strip() or text.translate(None, allowed):
        return None
    try:
        values = np.loadtxt(text.decode().split("\n"), comments=None, ndmin=2)
    except ValueError:
        return None
    return values if len(values) == len(lines) else None  # loadtxt ignores empty lines


def whole_table(lines: Sequence[Line]) -> Int[np.ndarray, "n c"] | None:
    """Read a table of plain whole numbers at once; return None if the lines are no such table."""
    values = number_table(lines, PLAIN_WHOLE)
    return values.astype(np.int64) if values is not None and np.abs(values).max() < EXACT else None


def coordinates(lines: Sequence[Line], *, least: int = 3) -> Float[np.ndarray, "n d"]:
    """Read the first three numbers of each line, or two if all lines have two and that is enough."""
    values = number_table(lines)
    if values is not None and values.shape[1] >= least:
        return values[:, :3]
    rows = []
    for line in lines:
        words = line[1].split()[:3]
        if len(words) < 3:
            raise FileFormatError(
                f"A vertex must have three numbers; line {line[0]} is {quote_line(line)}."
            )
        rows.append([number(word, line) for word in words])
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def number(word: bytes, line: Line) -> float:
    """Read a number; an error names the line."""
    try:
        return float(word.replace(b"_", b"?"))  # Python would read 1_0 as ten
    except ValueError as err:
        raise FileFormatError(
            f"A coordinate must be a number; line {line[0]} has {quote_line((0, word))} in {quote_line(line)}."
        ) from err


def whole(word: bytes, line: Line, what: str) -> int:
    """Read a whole number; an error names the line."""
    try:
        value = int(word.replace(b"_", b"?"))
    except ValueError as err:
        raise FileFormatError(
            f"{what} must be a whole number; line {line[0]} has {quote_line((0, word))} in {quote_line(line)}."
        ) from err
    if not -INT64 <= value < INT64:
        raise FileFormatError(
            f"{what} must fit into 64 bits; line {line[0]} has {quote_line((0, word))}."
        )
    return value


def numbers_of(words: Sequence[bytes], kind: Any = np.float64) -> Shaped[np.ndarray, " k"]:
    """Read words as numbers: whole numbers of `kind` if all are, otherwise in double precision.

    Raise ValueError if a word is not a number.
    """
    if b"_" in b" ".join(words):  # Python would read 1_0 as ten
        raise ValueError("numbers have no underscores")
    if np.dtype(kind).kind in "iu":
        # Whole numbers of 64 bits would be rounded in double precision.
        with contextlib.suppress(ValueError, OverflowError):
            return np.fromiter(map(int, words), kind, len(words))
    return np.fromiter(map(float, words), np.float64, len(words))


def wholes(numbers: Shaped[np.ndarray, " k"], what: str) -> Int[np.ndarray, " k"]:
    """Convert numbers to whole numbers; raise an error for others."""
    odd = (numbers != np.floor(numbers)) | ~(np.abs(numbers.astype(np.float64)) < EXACT)
    bad = np.flatnonzero(odd)
    if bad.size:
        raise FileFormatError(
            f"{what} must be whole numbers; number {bad[0]} is {numbers[bad[0]]}."
        )
    return numbers.astype(np.int64)


def require_distinct(numbers: Int[np.ndarray, " k"], what: str) -> None:
    """Raise an error if a number occurs twice."""
    different, counts = np.unique(numbers, return_counts=True)
    if (counts > 1).any():
        raise FileFormatError(
            f"{what} must differ; {different[counts.argmax()]} occurs twice or more."
        )


def quote_line(line: Line) -> str:
    """Quote a line, shortened if it is long."""
    return repr(line[1].strip()[:60].decode("latin-1"))


def rows_text(prefix: str, rows: np.ndarray) -> list[str]:
    """Write rows so that each number reads back exactly."""
    return [prefix + " ".join(map(repr, row)) for row in rows.tolist()]


def end_lines(lines: Sequence[str]) -> bytes:
    """Return the content of a file of some lines."""
    return ("\n".join(lines) + "\n").encode()


# Compression ratios: a regular lattice of tetrahedra has 9 with zlib and 36 with LZMA, zeros 1,000.
MOST_TIMES = 40
ALWAYS = 2**25  # bytes that a file of any size may unpack to
# Bytes for a volume: labels of a head, 256 voxels a side in 32 bits, are 64 MiB, and pack 200 times.
VOLUME_SIZE = 2**28
LZMA_MEMORY = 2**27  # bytes; level 9, the most that compressors use, needs 65 MiB
ZLIB, LZMA, LZ4 = "vtkZLibDataCompressor", "vtkLZMADataCompressor", "vtkLZ4DataCompressor"
COMPRESSORS = (ZLIB, LZMA, LZ4)
USUAL_WORD = 16  # bytes of a number in a text file with the space after it


@dataclass
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

    data: bytes
    what: str
    is_text: bool = False
    place: int = 0

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
            return self._take_words(kind, count)
        found = np.frombuffer(self.data, kind, count, self.place) if count else np.empty(0, kind)
        self.place += count * size
        return found

    def wholes(self, kind: Any, count: int) -> Int[np.ndarray, " k"]:
        """Return the next numbers, all of them whole, such as counts or corners."""
        found = self.take(kind, count)
        if found.dtype.kind == "f":
            return wholes(found, f"Counts and corners of {self.what[0].lower()}{self.what[1:]}")
        return found.astype(np.int64)

    def one(self, kind: Any) -> int:
        """Return the next number, which must be whole, such as a count."""
        return int(self.wholes(kind, 1)[0])

    def _take_words(self, kind: Any, count: int) -> np.ndarray:
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
            found = numbers_of(words[:count], kind)
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


def require_reasonable(size: int, n_bytes: int, always: int = ALWAYS) -> None:
    """Raise an error for a declared size that no real file has, before memory is allocated."""
    most = always + MOST_TIMES * n_bytes
    if size > most:
        raise FileFormatError(
            f"Compressed data must unpack to at most {MOST_TIMES} times the size of its file and "
            f"{always >> 20} MiB; it declares "
            f"{size} bytes in a file of {n_bytes}. If it is good, save it uncompressed."
        )


def unpack_block(packed: bytes, size: int, compressor: str) -> bytes:
    """Unpack a block to its declared size, and not more.

    Raise FileFormatError if the block is damaged, or of another size.
    """
    try:
        if compressor == ZLIB:
            # A limit of 0 would mean no limit.
            found = zlib.decompressobj().decompress(packed, size + 1)
        elif compressor == LZMA:
            unpacker = lzma.LZMADecompressor(memlimit=LZMA_MEMORY)
            found = unpacker.decompress(packed, max_length=size + 1)
        else:
            found = _unpack_lz4(packed, size)
    except (zlib.error, lzma.LZMAError, IndexError) as err:
        raise FileFormatError(f"A compressed block must be whole; one is damaged: {err}.") from err
    if len(found) != size:
        more = "more" if len(found) > size else f"{len(found)}"
        raise FileFormatError(
            f"A compressed block must unpack to the size it declares, {size}; it unpacks to {more}."
        )
    return found


def _unpack_lz4(packed: bytes, size: int) -> bytes:
    """Unpack a block of LZ4, and stop beyond `size` bytes; raise IndexError if it is damaged.

    A block is a row of sequences: literal bytes, then a copy of bytes that were unpacked before
    (https://github.com/lz4/lz4/blob/dev/doc/lz4_Block_format.md).
    """
    out = bytearray()
    place = 0
    while len(out) <= size:
        token = packed[place]
        place += 1
        n_literals, place = _length(packed, place, token >> 4)
        out += packed[place : place + n_literals]
        place += n_literals
        if place >= len(packed):  # the last sequence has no copy
            break
        back = packed[place] + 256 * packed[place + 1]
        place += 2
        count, place = _length(packed, place, token & 15)
        count = min(count + 4, size + 1 - len(out))
        start = len(out) - back
        if start < 0 or not back:
            raise IndexError("a copy begins before the first byte")
        piece = out[start : start + count]
        if back < count:  # a copy that reaches its own bytes repeats itself
            piece = (piece * (count // back + 1))[:count]
        out += piece
    return bytes(out)


def _length(packed: bytes, place: int, length: int) -> tuple[int, int]:
    """Return a length, and its end: to 15, bytes are added up to one below 255."""
    more = 255 if length == 15 else 0
    while more == 255:
        more = packed[place]
        length += more
        place += 1
    return length, place
