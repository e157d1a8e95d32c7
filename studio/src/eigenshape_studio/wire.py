"""One message format for every call, every host and both directions.

A message is a little-endian uint32 H, a JSON header of H bytes, and the data of the arrays. The
header is padded by spaces so that the data begins at a multiple of 8 bytes. Every array begins
at a multiple of 8 bytes of the data, so that a browser can use it where it lies.
"""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

# The types of numbers that arrays may have. "<f2" is for reports: `decode` returns it in single
# precision, times the "scale" of its entry, which keeps small and large numbers in its range.
DTYPES = ("<f2", "<f4", "<f8", "<u4", "<i4", "|u1")
ALIGNMENT = 8  # bytes
LONGEST_HEADER = 1 << 24  # bytes; edits of many vertices travel in the header
# How deep and how wide the header may be: far beyond any call, far below what exhausts memory.
MOST_ARRAYS = 4096
MOST_AXES = 4
LARGEST_HALF = 60000.0  # below the largest number in half precision, 65504


class WireError(ValueError):
    """A message does not follow the format; the text says where."""


def encode(meta: Any, arrays: Mapping[str, np.ndarray] | None = None) -> bytes:
    """Return a message.

    Parameters
    ----------
    meta : any JSON
        Numbers that are not finite become null, because JSON has none.
    arrays : {name: array}, optional
        Of a type in `DTYPES`. Arrays in half precision are written with a scale.

    Raises
    ------
    WireError
        If an array has another type.
    """
    entries: dict[str, dict[str, Any]] = {}
    parts: list[bytes] = []
    offset = 0
    for name, array in (arrays or {}).items():
        if array.dtype.str not in DTYPES:
            raise WireError(
                f"Array {name!r} must have a type of {DTYPES}; it has {array.dtype.str}."
            )
        data = np.ascontiguousarray(array).tobytes()
        entries[name] = {"dtype": array.dtype.str, "shape": list(array.shape), "offset": offset}
        padding = -len(data) % ALIGNMENT
        parts.append(data + bytes(padding))
        offset += len(data) + padding
    return _join({"meta": _finite(meta), "arrays": entries}, parts)


def encode_halves(
    meta: Any, arrays: Mapping[str, np.ndarray], halves: Mapping[str, np.ndarray]
) -> bytes:
    """Return a message in which some arrays are in half precision, each with a scale.

    Parameters
    ----------
    meta : any JSON
    arrays : {name: array}
    halves : {name: float array}
        The last three digits of their largest number survive.
    """
    scales = {name: float(np.abs(values).max(initial=0.0)) for name, values in halves.items()}
    scales = {name: scale / LARGEST_HALF or 1.0 for name, scale in scales.items()}
    rounded = {name: (values / scales[name]).astype("<f2") for name, values in halves.items()}
    header, data = _split(encode(meta, {**arrays, **rounded}))
    for name, scale in scales.items():
        header["arrays"][name]["scale"] = scale
    return _join(header, [bytes(data)])


def decode(message: bytes | bytearray | memoryview) -> tuple[Any, dict[str, np.ndarray]]:
    """Return the meta and the arrays of a message; the arrays are read-only.

    Raises
    ------
    WireError
        If the message does not follow the format in any way.
    """
    header, data = _split(message)
    if not isinstance(header, dict) or set(header) != {"meta", "arrays"}:
        raise WireError("The header of a message must have the two entries meta and arrays.")
    entries = header["arrays"]
    if not isinstance(entries, dict) or len(entries) > MOST_ARRAYS:
        raise WireError(f"arrays must be an object of at most {MOST_ARRAYS} entries.")
    return header["meta"], {name: _array(name, entry, data) for name, entry in entries.items()}


def _join(header: dict[str, Any], parts: list[bytes]) -> bytes:
    text = json.dumps(header, allow_nan=False, separators=(",", ":")).encode()
    text += b" " * (-(4 + len(text)) % ALIGNMENT)
    return b"".join([len(text).to_bytes(4, "little"), text, *parts])


def _split(message: bytes | bytearray | memoryview) -> tuple[Any, memoryview]:
    """Return the header and the data of a message."""
    view = memoryview(message).cast("B")
    if len(view) < 4:
        raise WireError(f"A message must begin with 4 bytes of length; it has {len(view)} bytes.")
    length = int.from_bytes(view[:4], "little")
    if (4 + length) % ALIGNMENT:
        raise WireError(
            f"4 + the length of the header must be a multiple of 8; it is {4 + length}."
        )
    if length > min(len(view) - 4, LONGEST_HEADER):
        raise WireError(
            f"The header must lie in the message and have at most {LONGEST_HEADER} bytes; "
            f"{length} are declared, and {len(view) - 4} follow."
        )
    try:
        header = json.loads(bytes(view[4 : 4 + length]), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as err:
        raise WireError(f"The header of a message must be JSON; it is not: {err}.") from err
    return header, view[4 + length :]


def _refuse_constant(text: str) -> None:
    raise ValueError(f"{text} is not a number of JSON")


def _array(name: str, entry: Any, data: memoryview) -> np.ndarray:
    """Return one array of a message, after checking every number of its entry."""
    keys = {"dtype", "shape", "offset"}
    if not isinstance(entry, dict) or not keys <= set(entry) <= keys | {"scale"}:
        raise WireError(f"The entry of array {name!r} must have dtype, shape and offset.")
    kind, shape, offset = entry["dtype"], entry["shape"], entry["offset"]
    if kind not in DTYPES:
        raise WireError(f"The dtype of array {name!r} must be one of {DTYPES}; it is {kind!r}.")
    if not isinstance(shape, list) or len(shape) > MOST_AXES or not all(map(_is_count, shape)):
        raise WireError(f"The shape of array {name!r} must be a list of counts; it is {shape!r}.")
    if not _is_count(offset) or offset % ALIGNMENT:
        raise WireError(f"The offset of array {name!r} must be a multiple of 8; it is {offset!r}.")
    count = math.prod(shape)
    size = count * np.dtype(kind).itemsize
    if offset + size > len(data):
        raise WireError(
            f"Array {name!r} must lie in the data; bytes {offset} to {offset + size} are declared, "
            f"and there are {len(data)}."
        )
    array = (
        np.frombuffer(data, kind, count, offset).reshape(shape) if count else np.empty(shape, kind)
    )
    if kind == "<f2":
        factor = entry.get("scale", 1.0)
        if (
            isinstance(factor, bool)
            or not isinstance(factor, int | float)
            or not math.isfinite(factor)
        ):
            raise WireError(f"The scale of array {name!r} must be a number; it is {factor!r}.")
        array = (array.astype(np.float64) * factor).astype(np.float32)
    array.flags.writeable = False
    return array


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**53


def _finite(value: Any) -> Any:
    """Return JSON with null in place of numbers that are not finite."""
    if isinstance(value, Mapping):
        return {str(name): _finite(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
