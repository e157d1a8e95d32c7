"""Lines of numbers in text files, read all at once if they are plain, otherwise one by one."""

import codecs
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int, Shaped

from eigenshape._errors import FileFormatError

Line = tuple[int, bytes]  # its number in the file, and its text
PLAIN = b"+-.0123456789eE \t\n"
PLAIN_WHOLE = b"+-0123456789 \t\n"
EXACT = 2**53  # whole numbers below it are exact in double precision
INT64 = 2**63  # whole numbers from -INT64 to below INT64 fit into 64 bits


def lines_of(data: bytes, first: int = 1) -> list[Line]:
    """Split text into lines without comments and blank lines; names and comments may be in any encoding."""
    texts = data.removeprefix(codecs.BOM_UTF8).splitlines()
    bare = ((number, text.partition(b"#")[0].strip()) for number, text in enumerate(texts, first))
    return [line for line in bare if line[1]]


def number_table(lines: Sequence[Line]) -> Float[np.ndarray, "n c"] | None:
    """Read a table of plain numbers at once; return None if the lines are no such table."""
    return _table(lines, PLAIN)


def whole_table(lines: Sequence[Line]) -> Int[np.ndarray, "n c"] | None:
    """Read a table of plain whole numbers at once; return None if the lines are no such table."""
    values = _table(lines, PLAIN_WHOLE)
    return values.astype(np.int64) if values is not None and np.abs(values).max() < EXACT else None


def _table(lines: Sequence[Line], allowed: bytes) -> np.ndarray | None:
    text = b"\n".join([text for _, text in lines])
    if not text.strip() or text.translate(None, allowed):
        return None
    try:
        values = np.loadtxt(text.decode().split("\n"), comments=None, ndmin=2)
    except ValueError:
        return None
    return values if len(values) == len(lines) else None  # loadtxt ignores empty lines


def coordinates(lines: Sequence[Line], *, least: int = 3) -> Float[np.ndarray, "n d"]:
    """Read the first three numbers of each line, or two if all lines have two and that is enough."""
    values = number_table(lines)
    if values is not None and least == values.shape[1] == 2:
        return values
    if values is not None and values.shape[1] >= 3:
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


def numbers_of(words: Sequence[bytes]) -> Float[np.ndarray, " k"]:
    """Read words as numbers; raise ValueError if one is not a number."""
    if b"_" in b" ".join(words):  # Python would read 1_0 as ten
        raise ValueError("numbers have no underscores")
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


def quote_line(line: Line) -> str:
    """Quote a line, shortened if it is long."""
    return repr(line[1].strip()[:60].decode("latin-1"))


def rows_text(prefix: str, rows: np.ndarray) -> list[str]:
    """Write rows so that each number reads back exactly."""
    return [prefix + " ".join(map(repr, row)) for row in rows.tolist()]
