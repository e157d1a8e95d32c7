"""Rows of numbers in text files, with the line named when one is wrong."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError


class Line(NamedTuple):
    """The words of a line that has any, and where it stands."""

    number: int
    words: list[str]


def lines_of(data: bytes, comment: str = "#") -> list[Line]:
    """Split text into lines of words, without comments and blank lines; any byte is a letter (Latin-1)."""
    lines = []
    for number, text in enumerate(data.decode("latin-1").splitlines(), 1):
        words = text.partition(comment)[0].split() if comment else text.split()
        if words:
            lines.append(Line(number, words))
    return lines


def coordinates(lines: Sequence[Line], skip: int = 0, columns: Sequence[int] = (0, 1, 2)) -> Float[np.ndarray, "n 3"]:
    """Read three numbers from each line, at the given places after `skip` words."""
    places = [skip + column for column in columns]
    try:
        return np.array([[line.words[place] for place in places] for line in lines], dtype=np.float64).reshape(-1, 3)
    except (IndexError, ValueError):
        for line in lines:
            _three_numbers(line, places)
        raise


def _three_numbers(line: Line, places: Sequence[int]) -> None:
    try:
        _ = [float(line.words[place]) for place in places]
    except (IndexError, ValueError) as err:
        raise FileFormatError(f"A vertex must have three numbers; line {line.number} is {shown(line.words)}.") from err


def whole(word: str, line: int, what: str) -> int:
    """Read a whole number, naming the line where there is none."""
    try:
        return int(word)
    except ValueError as err:
        raise FileFormatError(f"{what} must be a whole number; line {line} has {shown([word])}.") from err


def shown(words: Sequence[str]) -> str:
    """Quote a line, cut short where it is long."""
    return repr(" ".join(words)[:60])


def fans(polygons: Sequence[Sequence[int]]) -> Int[np.ndarray, "f 3"]:
    """Split polygons into triangles around their first corner."""
    triangles = [
        (corners[0], corners[place], corners[place + 1]) for corners in polygons for place in range(1, len(corners) - 1)
    ]
    try:
        return np.array(triangles, dtype=np.int64).reshape(-1, 3)
    except OverflowError as err:
        huge = max((index for corners in polygons for index in corners), key=abs)
        raise FileFormatError(f"A face must index vertices; there is an index {huge}.") from err


def rows_text(prefix: str, rows: np.ndarray) -> list[str]:
    """Write rows so that each number reads back exactly."""
    return [prefix + " ".join(map(repr, row)) for row in rows.tolist()]
