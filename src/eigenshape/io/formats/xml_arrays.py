"""Files in XML with arrays of numbers, as those of VTK and GIFTI."""

import base64
import binascii
import re
from typing import Any
from xml.etree import ElementTree

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.io.formats.numbers import numbers_of

# A surface of a brain has a tag for each parcel, and a note of its program of some kilobytes.
MOST_TAGS, LONGEST_TAG = 200_000, 2**18
LONG_TAG = re.compile(rb"<[^>]{%d}" % LONGEST_TAG)


def parse_xml(data: bytes, kind: str) -> ElementTree.Element:
    """Return the root of a file; raise FileFormatError if it is not XML, or declares entities."""
    if b"<!ENTITY" in data:
        raise FileFormatError(
            f"A {kind} file must be plain XML; it declares entities, which could be of any size."
        )
    long = LONG_TAG.search(data)
    if long or data.count(b"<") > MOST_TAGS:
        fact = f"that at byte {long.start()} is longer" if long else f"there are {data.count(b'<')}"
        raise FileFormatError(
            f"A {kind} file must have at most {MOST_TAGS} tags, each of less than {LONGEST_TAG} bytes; "
            f"{fact}. Save it again from the program that made it."
        )
    try:
        return ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as err:
        raise FileFormatError(f"A {kind} file must be whole XML; {err}.") from err


def text_numbers(text: bytes, dtype: Any, kind: str, name: str) -> np.ndarray:
    """Return the numbers of an array in text, as `numbers_of` does."""
    try:
        return numbers_of(text.split(), dtype)
    except ValueError as err:
        raise FileFormatError(
            f"Arrays of a {kind} file must be of numbers; {name!r} is not: {err}."
        ) from err


def decode_base64(text: bytes, kind: str, name: str) -> bytes:
    """Return the bytes of an array."""
    try:
        return base64.b64decode(text, validate=True)
    except binascii.Error as err:
        raise FileFormatError(
            f"Arrays of a {kind} file must be in base64; {name!r} is not: {err}."
        ) from err
