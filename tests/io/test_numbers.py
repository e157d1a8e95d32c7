"""The cursor: numbers and lines in order, and nothing that is declared and not there."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from eigenshape import FileFormatError
from eigenshape.io.formats.numbers import Cursor


@given(
    numbers=st.lists(st.integers(-(10**15), 10**15), min_size=1, max_size=30),
    gaps=st.lists(st.sampled_from([" ", "\n", "\t  ", " " * 300]), min_size=30, max_size=30),
    cuts=st.lists(st.integers(0, 30), max_size=5),
)
def test_words_are_taken_in_order_whatever_is_between_them(numbers, gaps, cuts):
    text = "".join(f"{number}{gap}" for number, gap in zip(numbers, gaps, strict=False)) + "\n"
    cursor = Cursor(text.encode(), "A file", is_text=True)
    ends = [*sorted(min(cut, len(numbers)) for cut in cuts), len(numbers)]
    taken = [
        cursor.wholes("<i8", end - start).tolist()
        for start, end in zip([0, *ends], ends, strict=False)
    ]
    assert [number for piece in taken for number in piece] == numbers
    cursor.require_end()


def test_binary_numbers_lines_and_what_is_left():
    data = b"\n head \n" + np.array([1, -2], ">i4").tobytes() + np.array([0.5], "<f8").tobytes()
    cursor = Cursor(data, "A file")
    assert cursor.line() == b"head"
    assert cursor.wholes(">i4", 2).tolist() == [1, -2]
    with pytest.raises(FileFormatError, match="A file must hold what it declares; more follows"):
        cursor.require_end()
    assert cursor.take("<f8", 1).tolist() == [0.5]
    cursor.require_end()
    assert cursor.take("<f8", 0).size == 0
    assert cursor.line() == b""


@pytest.mark.parametrize("count", [-1, 3, 2**62])
@pytest.mark.parametrize("is_text", [False, True])
def test_a_count_that_does_not_fit_is_named_with_its_place(count, is_text):
    cursor = Cursor(b"1 2 \n", "A file", is_text=is_text)
    with pytest.raises(
        FileFormatError, match=f"declares; {count} items at byte 0 do not fit into its 5 bytes"
    ):
        cursor.take("<i4", count)


def test_words_that_are_no_numbers_and_a_last_word_that_may_be_cut_off():
    with pytest.raises(
        FileFormatError, match=r"must hold 2 numbers at byte 0; it does not: .*b'x'"
    ):
        Cursor(b"1 x \n", "A file", is_text=True).take("<f8", 2)
    with pytest.raises(FileFormatError, match="must be whole; its last number has no line break"):
        Cursor(b"1 2", "A file", is_text=True).take("<f8", 2)
    with pytest.raises(
        FileFormatError,
        match=r"Counts and corners of a file must be whole numbers; number 1 is 0\.5",
    ):
        Cursor(b"1 0.5 \n", "A file", is_text=True).wholes("<i8", 2)
