"""Packed volumes: no flipped bit changes what is read, up to the checksum and length at the end."""

import gzip
import struct

import numpy as np
import pytest

import eigenshape as es

VOLUME = np.random.default_rng(0).integers(0, 9, (6, 5, 4))
N_ENDING = 96  # bits before the end: checksum, length and the last bytes of the data


def nifti():
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, 6, 5, 4, 1, 1, 1, 1)
    struct.pack_into("<hh", header, 70, 16, 32)
    struct.pack_into("<8f", header, 76, *[1.0] * 8)
    struct.pack_into("<f", header, 108, 352.0)
    header[344:348] = b"n+1\0"
    return bytes(header) + VOLUME.astype("<f4").tobytes(order="F")


def mgh():
    sizes = struct.pack(">7ih3f", 1, 6, 5, 4, 1, 3, 0, 1, 1, 1, 1)
    axes = np.eye(3).astype(">f4").tobytes() + bytes(12)
    return (sizes + axes).ljust(284, b"\0") + VOLUME.astype(">f4").tobytes(order="F")


@pytest.mark.parametrize(("name", "make"), [("a.nii.gz", nifti), ("a.mgz", mgh)])
def test_no_flipped_bit_is_silent(name, make, tmp_path):
    packed = gzip.compress(make(), mtime=0)
    n_bits = 8 * len(packed)
    drawn = np.random.default_rng(0).integers(0, n_bits, 200 - N_ENDING)
    n_refused = 0
    for bit in [*drawn, *range(n_bits - N_ENDING, n_bits)]:
        changed = bytearray(packed)
        changed[bit // 8] ^= 1 << (bit % 8)
        (tmp_path / name).write_bytes(changed)
        try:
            # Names and times of the header of gzip may change.
            np.testing.assert_array_equal(es.io.read_volume(tmp_path / name)[0], VOLUME)
        except es.FileFormatError:
            n_refused += 1
    assert n_refused > 180
