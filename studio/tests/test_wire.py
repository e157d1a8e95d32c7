"""The wire: what is written comes back, and nothing else is accepted."""

import json
import struct

import numpy as np
import pytest

from eigenshape_studio.wire import DTYPES, WireError, decode, encode, encode_halves


@pytest.mark.parametrize("kind", [kind for kind in DTYPES if kind != "<f2"])
@pytest.mark.parametrize("shape", [(), (0,), (3,), (5, 3), (2, 3, 1), (0, 3)])
def test_arrays_come_back_as_they_were(kind, shape):
    array = np.arange(np.prod(shape, dtype=int)).astype(kind).reshape(shape)
    meta, arrays = decode(encode({"a": [1, None, "ü"]}, {"x": array, "y": array}))
    assert meta == {"a": [1, None, "ü"]}
    for name in ("x", "y"):
        assert arrays[name].dtype.str == kind
        assert arrays[name].shape == shape
        assert (arrays[name] == array).all()
        assert not arrays[name].flags.writeable


def test_data_and_arrays_begin_at_multiples_of_eight():
    message = encode({}, {"a": np.zeros(3, "|u1"), "b": np.ones(1, "<f8")})
    (length,) = struct.unpack("<I", message[:4])
    header = json.loads(message[4 : 4 + length])
    assert (4 + length) % 8 == 0
    assert [entry["offset"] for entry in header["arrays"].values()] == [0, 8]


def test_numbers_that_are_not_finite_become_null():
    meta, _ = decode(encode({"a": np.float64("nan"), "b": [np.inf, 1.5, np.int64(3)]}))
    assert meta == {"a": None, "b": [None, 1.5, 3]}


def test_rows_of_another_order_are_written_in_c_order():
    array = np.asfortranarray(np.arange(6.0).reshape(2, 3))
    assert (decode(encode({}, {"a": array}))[1]["a"] == array).all()


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e12])
def test_halves_keep_three_digits_at_every_size(size):
    values = size * np.random.default_rng(0).normal(size=(20, 30))
    _, arrays = decode(encode_halves({}, {"n": np.zeros(2, "<i4")}, {"modes": values}))
    assert arrays["modes"].dtype == np.float32
    assert np.abs(arrays["modes"] - values).max() < 5e-4 * np.abs(values).max()


def test_an_array_of_another_type_is_refused():
    with pytest.raises(WireError, match="must have a type of"):
        encode({}, {"a": np.zeros(2, "<i8")})


def framed(header, data=b"", pad=True):
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    text += b" " * (-(4 + len(text)) % 8 if pad else 0)
    return struct.pack("<I", len(text)) + text + data


def one(**changes):
    entry = {"dtype": "<f4", "shape": [2], "offset": 0} | changes
    return framed({"meta": {}, "arrays": {"a": entry}}, bytes(8))


MALFORMED = {
    "must begin with 4 bytes": b"\x01",
    "multiple of 8": framed(b"{}   ", pad=False),
    "must lie in the message": struct.pack("<I", 2**20 - 4) + b"{}",
    "must be JSON": framed(b"{nonsense"),
    "is not a number of JSON": framed(b'{"meta": NaN, "arrays": {}}'),
    "two entries": framed({"meta": {}}),
    "at most 4096": framed({"meta": {}, "arrays": []}),
    "must have dtype": framed({"meta": {}, "arrays": {"a": 3}}),
    "dtype of array 'a'": one(dtype="<c8"),
    "dtype of array": one(dtype="O"),
    "list of counts": one(shape=[-2]),
    "must be a list of counts": one(shape=[True]),
    "shape of array": one(shape=[1, 1, 1, 1, 1]),
    "must be a multiple of 8": one(offset=4),
    "offset of array": one(offset=-8),
    "must lie in the data": one(shape=[3]),
    "bytes 0 to": one(shape=[2**52, 2**52]),
    "scale of array": one(dtype="<f2", scale="2"),
}


@pytest.mark.parametrize("reason", MALFORMED)
def test_a_malformed_message_is_refused_with_its_reason(reason):
    with pytest.raises(WireError, match=reason):
        decode(MALFORMED[reason])


def test_deep_nesting_is_refused():
    with pytest.raises(WireError, match="must be JSON"):
        decode(framed(b"[" * 100_000 + b"]" * 100_000))


def test_every_truncation_is_refused():
    message = encode({"a": 1}, {"x": np.arange(4, dtype="<f8")})
    for length in range(len(message)):
        with pytest.raises(WireError):
            decode(message[:length])
