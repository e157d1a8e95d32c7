"""Whatever a file holds, a reader gives a mesh or an error of ours, soon."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tetrahedra import FILES

from eigenshape import EigenshapeError, TriangleMesh
from eigenshape.io.formats.registry import format_of


def read_or_refuse(parse, data):
    try:
        with np.errstate(all="ignore"):
            mesh = TriangleMesh(*parse(data)[:2])
    except EigenshapeError:
        return None
    assert np.isfinite(mesh.vertices).all()
    assert mesh.n_faces <= len(data)
    return mesh


@pytest.mark.parametrize("name", FILES)
def test_every_truncation_is_refused_or_loses_only_the_end_of_line(name):
    parse, data = FILES[name]
    for length in range(len(data) - 1):
        mesh = read_or_refuse(parse, data[:length])
        # OBJ declares no counts: what is cut between two lines cannot be known.
        assert mesh is None or name == "obj" or mesh.n_faces == 4, length
    assert read_or_refuse(parse, data).n_faces == 4


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
@settings(max_examples=150, deadline=None)
@given(st.data())
def test_any_changed_bytes(name, data):
    parse, good = FILES[name]
    places = st.tuples(st.integers(0, len(good) - 1), st.integers(0, 255))
    bad = bytearray(good)
    for place, value in data.draw(st.lists(places, min_size=1, max_size=6)):
        bad[place] = value
    read_or_refuse(parse, bytes(bad))


@pytest.mark.long
@pytest.mark.parametrize("name", FILES)
def test_every_single_bit(name):
    parse, good = FILES[name]
    for place in range(min(len(good), 400)):
        for bit in (0, 3, 7):
            bad = bytearray(good)
            bad[place] ^= 1 << bit
            read_or_refuse(parse, bytes(bad))


@pytest.mark.parametrize("name", FILES)
@settings(max_examples=80, deadline=None)
@given(st.data())
def test_any_piece_cut_out_doubled_or_put_in(name, data):
    parse, good = FILES[name]
    start, stop = sorted(data.draw(st.tuples(*[st.integers(0, len(good))] * 2)))
    piece = data.draw(
        st.sampled_from(
            [b"", good[start:stop] * 2, b"\n", b"-", b"9" * 30, b"\0\xff", b"1e999 nan _ #\\"]
        )
    )
    read_or_refuse(parse, good[:start] + piece + good[stop:])


HEADS = {
    ".off": b"OFF ",
    ".obj": b"v ",
    ".ply": b"ply\n",
    ".stl": b"solid ",
    ".glb": b"glTF",
    ".npz": b"PK\x03\x04",
}


@pytest.mark.parametrize("suffix", HEADS)
@settings(max_examples=80, deadline=None)
@given(noise=st.binary(max_size=200))
def test_noise(suffix, noise):
    parse = format_of(suffix).load().parse
    read_or_refuse(parse, noise)
    read_or_refuse(parse, HEADS[suffix] + noise)
