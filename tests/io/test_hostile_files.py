"""Files made to hurt: declarations larger than the file, places outside it, and values where none are thought of."""

import builtins
import copy
import io
import json
import os
import struct
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_glb import GOOD, changed, packed, primitive, unpacked
from test_glb_places import moving_file
from test_ply import HEADER, TEXT_ROWS, binary_rows, simple
from tetrahedra import FILES

from eigenshape import EigenshapeError, FileFormatError, TriangleMesh, read_mesh
from eigenshape.io.formats import gltf, obj, ply
from eigenshape.io.formats.registry import format_of

MANY = 2**31
PADDING = b"0 0 0\n" * 150
BIG_PLY = (
    "ply\nformat {order} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    f"element face {MANY}\nproperty list uchar int vertex_indices\nend_header\n"
)
LIES = {
    "a.off": f"OFF\n3 {MANY} 0\n".encode() + PADDING,
    "b.off": f"OFF\n{MANY} 1 0\n".encode() + PADDING,
    "a.ply": BIG_PLY.format(order="ascii").encode() + PADDING,
    "b.ply": BIG_PLY.format(order="binary_little_endian").encode() + PADDING,
    "c.ply": BIG_PLY.format(order="binary_big_endian").encode() + PADDING,
    "a.stl": bytes(80) + struct.pack("<I", MANY) + bytes(900),
    "a.glb": changed("accessors", 1, "count", to=MANY),
    "b.glb": changed("bufferViews", 0, "byteLength", to=MANY, binary=bytes(40)),
}


def read_or_refuse(parse, data):
    try:
        with np.errstate(all="ignore"):
            mesh = TriangleMesh(*parse(data)[:2])
    except EigenshapeError:
        return None
    assert np.isfinite(mesh.vertices).all()
    assert 0 <= mesh.faces.min() <= mesh.faces.max() < mesh.n_vertices
    return mesh


@pytest.mark.parametrize("name", LIES)
def test_a_small_file_that_declares_much_costs_neither_time_nor_memory(tmp_path, name):
    (tmp_path / name).write_bytes(LIES[name])
    assert len(LIES[name]) < 1200
    tracemalloc.start()
    began = time.perf_counter()
    try:
        with pytest.raises(FileFormatError, match=rf"{name}: .*(declares|{MANY}|do not fit)"):
            read_mesh(tmp_path / name)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert time.perf_counter() - began < 0.5
    assert peak < 5e6


def many_declarations(line, count):
    rows = "".join(line.format(number) for number in range(count))
    return f"ply\nformat ascii 1.0\nelement vertex 0\n{rows}end_header\n".encode()


@pytest.mark.long
@pytest.mark.parametrize("line", ["property float a{}\n", "element a{} 0\n"])
def test_a_header_of_many_lines_is_read_in_proportion(line):
    spent = []
    for count in (5_000, 40_000):
        data = many_declarations(line, count)
        tries = []
        for _ in range(3):  # the least, since other work slows some of them down
            began = time.process_time()
            with pytest.raises(
                FileFormatError, match="must declare an element vertex with the numbers x, y and z"
            ):
                ply.parse(data)
            tries.append(time.process_time() - began)
        spent.append(min(tries))
    assert (
        spent[1] < 24 * spent[0]
    )  # eight times the lines; 64 times the work when each looked at all before it


@pytest.mark.parametrize("place", ["buffers", "images"])
def test_nothing_outside_a_glb_file_is_opened(tmp_path, monkeypatch, place):
    tree, binary = unpacked()
    outside = tmp_path / "outside.bin"
    outside.write_bytes(binary)
    tree[place] = [{"byteLength": len(binary), "uri": outside.name}]
    path = tmp_path / "a.glb"
    path.write_bytes(packed(tree, binary))
    opened = []

    def spy(original):
        def opening(file, *arguments, **options):
            opened.append(str(file))
            return original(file, *arguments, **options)

        return opening

    for module, name in ((io, "open"), (builtins, "open"), (os, "open")):
        monkeypatch.setattr(module, name, spy(getattr(module, name)))
    if place == "buffers":
        with pytest.raises(
            FileFormatError, match=r"a\.glb: .* buffers\[0\] points outside, to 'outside\.bin'"
        ):
            read_mesh(path)
    else:
        assert read_mesh(path).n_faces == 4  # how a surface is painted is passed over
    assert set(opened) == {str(path)}


@pytest.mark.parametrize("count", [0, 1])
def test_a_stride_between_fewer_than_two_rows_is_never_taken(count):
    tree, binary = primitive(4, 6)
    for stride in (10**30, 2**62, 1000):
        tree["bufferViews"][0]["byteStride"] = stride
        tree["accessors"][0]["count"] = count
        tree["accessors"][1] = {**tree["accessors"][0], "componentType": 5121, "type": "SCALAR"}
        with pytest.raises(
            FileFormatError, match=r"must have three corners each|must hold triangles"
        ):
            gltf.parse(packed(tree, binary))
    tree["accessors"][0]["byteOffset"] = 500
    with pytest.raises(
        FileFormatError, match=rf"accessors\[0\] must lie in its buffer; {count} rows do not fit"
    ):
        gltf.parse(packed(tree, binary))


@pytest.mark.parametrize("value", [0.5, -1.0, 4.0, float("nan"), float("inf")])
def test_indices_that_are_no_whole_numbers_are_refused(value):
    tree, binary = unpacked()
    corners = np.zeros(12, "<f4")
    corners[7] = value
    tree["accessors"][1]["componentType"] = 5126
    tree["bufferViews"][1]["byteLength"] = corners.nbytes
    message = rf"must be whole and within 0\.\.3; index 7 is {value:g}"
    with pytest.raises(FileFormatError, match=message):
        gltf.parse(packed(tree, binary[:48] + corners.tobytes()))


def test_names_of_odd_things_are_cut_short_and_plain():
    with pytest.raises(
        FileFormatError, match=r"it names meshes\['\\ud800x+\] and holds none\."
    ) as caught:
        gltf.parse(changed("nodes", 0, "mesh", to="\ud800" + "x" * 5000))
    assert str(caught.value).isascii()
    assert len(str(caught.value)) < 150


def test_list_of_a_plain_row_that_goes_beyond_its_end():
    text = simple(rows="100 0 1 2 7\n").replace("end_header", "property int kind\nend_header")
    with pytest.raises(
        FileFormatError, match="A row must hold all its columns; line 14 lacks vertex_indices"
    ):
        ply.parse(text.encode())
    text = text.replace("100 0 1 2 7", "3 0 1 2 7")
    assert ply.parse(text.encode())[1].tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_lines_after_joined_lines_keep_their_numbers(newline):
    text = "v 0 0 0\nv 1 \\\n0 \\\n0\nv 0 1 0\nf 1 \\\n2 3\nf 1 2 x\n".replace("\n", newline)
    with pytest.raises(
        FileFormatError, match="A corner must be a whole number; line 8 has 'x' in '1 2 x'"
    ):
        obj.parse(text.encode())


RICH = {
    **FILES,
    "ply rich text": (
        ply.parse,
        HEADER.format(order="ascii", remark="x").encode() + TEXT_ROWS.encode(),
    ),
    "ply rich big": (
        ply.parse,
        HEADER.format(order="binary_big_endian", remark="x").encode() + binary_rows(">"),
    ),
    "obj rich": (
        obj.parse,
        b"v 0 0 0 1\nv 1 0 \\\n0\nvt 0 0\nv 0 1 0\nf 1/1 2//2 -1/1/1\nf 1 2 3 1\n",
    ),
}
WORDS = [
    b"-1",
    b"0",
    b"100",
    b"255",
    b"256",
    b"2147483648",
    b"9" * 20,
    b"1e999",
    b"nan",
    b"1.5",
    b"",
    b"#",
    b"\\\n",
]


@pytest.mark.long
@pytest.mark.parametrize("name", RICH)
@settings(max_examples=100, deadline=None)
@given(st.data())
def test_any_word_put_in_place_of_another(name, data):
    parse, good = RICH[name]
    words = good.split(b" ")
    for place in data.draw(st.lists(st.integers(0, len(words) - 1), min_size=1, max_size=3)):
        kept = words[place].partition(b"\n")[1:] if data.draw(st.booleans()) else ()
        words[place] = data.draw(st.sampled_from(WORDS)) + b"".join(kept)
    read_or_refuse(parse, b" ".join(words))


def places(tree, path=()):
    """List the paths of all values of a JSON tree."""
    entries = (
        tree.items()
        if isinstance(tree, dict)
        else enumerate(tree)
        if isinstance(tree, list)
        else ()
    )
    return [
        found for key, value in entries for found in [(*path, key), *places(value, (*path, key))]
    ]


ODD = st.one_of(
    st.none(), st.booleans(), st.integers(-2, 70), st.sampled_from([5120, 5121, 5123, 5126, 2**31, 2**63, 10**400]),
    st.floats(), st.text(max_size=3), st.lists(st.integers(-1, 4), max_size=4), st.just({}), st.just([[[]]]),
)  # fmt: skip
PLACES = places(unpacked()[0])
MOVING = moving_file()
PLACES_OF_MOVING = places(MOVING.tree)


@pytest.mark.long
@settings(max_examples=300, deadline=None)
@given(where=st.sampled_from(PLACES), to=ODD)
@example(where=("bufferViews", 0, "byteStride"), to=10**30)
def test_any_value_anywhere_in_the_tree_of_a_glb_file(where, to):
    read_or_refuse(gltf.parse, changed(*where, to=to))


@pytest.mark.long
@settings(max_examples=600, deadline=None)
@given(where=st.sampled_from(PLACES_OF_MOVING), to=ODD)
def test_any_value_anywhere_in_what_moves_geometry(where, to):
    tree = copy.deepcopy(MOVING.tree)
    *path, last = where
    place = tree
    for key in path:
        place = place[key]
    place[last] = to
    read_or_refuse(gltf.parse, packed(tree, MOVING.binary))


@pytest.mark.long
@settings(max_examples=200, deadline=None)
@given(
    st.dictionaries(
        st.sampled_from(["count", "byteOffset", "componentType", "normalized", "sparse"]), ODD
    ),
    st.dictionaries(st.sampled_from(["buffer", "byteOffset", "byteLength", "byteStride"]), ODD),
    st.dictionaries(
        st.sampled_from(["matrix", "rotation", "scale", "translation", "children", "mesh"]), ODD
    ),
)
def test_any_accessor_view_and_node(accessor, view, node):
    tree, binary = unpacked()
    tree["accessors"][0] |= accessor
    tree["bufferViews"][0] |= view
    tree["nodes"][0] |= node
    read_or_refuse(gltf.parse, packed(json.loads(json.dumps(tree)), binary))


@pytest.mark.long
@pytest.mark.data
@pytest.mark.parametrize("suffix", [".off", ".obj", ".ply", ".stl"])
def test_real_files_with_a_piece_lost_or_doubled(data, suffix):
    files = [path for path in sorted((data / "nasty").rglob("*")) if path.suffix.lower() == suffix]
    small = [path.read_bytes() for path in files if 0 < path.stat().st_size < 1500]
    rng = np.random.default_rng(0)
    parse = format_of(suffix).load().parse
    n_refused = 0
    for good in small:
        for _ in range(40 if suffix != ".off" else 300):
            start, stop = np.sort(rng.integers(0, len(good) + 1, size=2))
            piece = good[start:stop] * int(rng.choice([0, 2]))
            n_refused += read_or_refuse(parse, good[:start] + piece + good[stop:]) is None
    assert len(small) >= 3
    assert n_refused > 10 * len(small)


def test_good_file_of_these_tests_is_good():
    assert all(read_or_refuse(parse, good) is not None for parse, good in RICH.values())
    assert read_or_refuse(gltf.parse, GOOD).n_faces == 4
