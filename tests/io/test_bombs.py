"""Small files that unpack to much, or declare it: refused with little memory, measured in a process of their own."""

import base64
import json
import lzma
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
from test_declarations import LEGACY, MEDIT
from tetrahedra import TETRAHEDRON

from eigenshape import FileFormatError, read_shape
from eigenshape.io.formats import off
from eigenshape.io.formats.numbers import LZ4, LZMA, ZLIB, unpack_block
from eigenshape.io.mesh_files import read_mesh, write_mesh

GIGABYTES = 2**32 - 2**24
BLOCK = 2**24
POINTS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
PACK = {ZLIB: lambda data: zlib.compress(data, 9), LZMA: lzma.compress}
# Peak memory only rises: what a file adds to the peak is what it took beyond those before it.
MEASURE = """
import resource, sys
from eigenshape import EigenshapeError, read_shape
import eigenshape.io.shape_files
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for path in sys.argv[1:]:
    try:
        said = repr(read_shape(path))
    except EigenshapeError as error:
        said = str(error)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak
    print(grown / 1024, said.replace("\\n", " "))
"""


def zeros(size, compressor=ZLIB):
    """Return an array of zeros as a VTU file packs it."""
    block = PACK[compressor](bytes(BLOCK))
    count = size // BLOCK
    head = struct.pack(f"<{3 + count}Q", count, BLOCK, BLOCK, *[len(block)] * count)
    return base64.b64encode(head).decode() + base64.b64encode(block * count).decode()


def array(data, compressor=ZLIB, declared=None):
    block = PACK[compressor](data)
    head = struct.pack("<4Q", 1, declared or len(data), declared or len(data), len(block))
    return base64.b64encode(head).decode() + base64.b64encode(block).decode()


def vtu(points=None, connectivity=None, extra="", n_points=4, compressor=ZLIB):
    def tag(kind, name, text):
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="3" format="binary">{text}</DataArray>'

    points = tag("Float64", "Points", points or array(POINTS.tobytes(), compressor))
    cells = tag("Int64", "connectivity", connectivity or array(np.arange(4).tobytes(), compressor))
    cells += tag("Int64", "offsets", array(np.array([4]).tobytes(), compressor))
    cells += tag("UInt8", "types", array(bytes([10]), compressor))
    unread = tag("Float64", "unread", extra) if extra else ""
    return (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
        f'compressor="{compressor}"><UnstructuredGrid><Piece NumberOfPoints="{n_points}" NumberOfCells="1">'
        f"<Points>{points}</Points><Cells>{cells}</Cells><PointData>{unread}</PointData></Piece>"
        "</UnstructuredGrid></VTKFile>\n"
    ).encode()


def pcd_of_zeros(size):
    times = size // 264
    packed = b"\0\0" + bytes([7 << 5, 255, 0]) * times
    size = 1 + 264 * times
    head = f"FIELDS x y z w\nSIZE 4 4 4 4\nTYPE F F F F\nPOINTS {size // 16}\nDATA binary_compressed\n".encode()
    return head + struct.pack("<II", len(packed), size) + packed


def gltf_of_copies(count):
    """Place a tetrahedron so many times."""
    nodes = [{"mesh": 0}] * count
    positions, corners = POINTS.astype("<f4").tobytes(), TETRAHEDRON.faces.astype("<u4").tobytes()
    views = [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48}]
    uri = "data:application/octet-stream;base64," + base64.b64encode(positions + corners).decode()
    tree = {
        "scenes": [{"nodes": list(range(count))}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * 2000}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": 96, "uri": uri}],
    }
    return json.dumps(tree, separators=(",", ":")).encode()


def medit_binary(count):
    """Declare so many vertices in a binary Medit file."""
    return struct.pack("<iiiiii", 1, 2, 3, 24, 3, 4) + struct.pack("<ii", 0, count) + bytes(64)


BOMBS = {
    "points.vtu": (lambda: vtu(zeros(GIGABYTES)), "'Points' takes 96 bytes, not 4278190080"),
    "many.vtu": (
        lambda: vtu(zeros(24 * BLOCK * 8), n_points=BLOCK * 8),
        "must unpack to at most 40 times the size of its file and 32 MiB; it declares 3221225472 bytes",
    ),
    "lzma.vtu": (
        lambda: vtu(zeros(24 * BLOCK * 8, LZMA), n_points=BLOCK * 8, compressor=LZMA),
        "must unpack to at most 40 times the size of its file and 32 MiB; it declares 3221225472 bytes",
    ),
    "liar.vtu": (
        lambda: vtu(array(bytes(GIGABYTES // 8), declared=96)),
        "the size it declares, 96; it unpacks to more",
    ),
    "lzf.pcd": (
        lambda: pcd_of_zeros(GIGABYTES),
        "must unpack to at most 40 times the size of its file",
    ),
    "header.pcd": (
        lambda: (
            b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 4000000000\nDATA binary\n" + bytes(500)
        ),
        "it declares 4000000000 of 12 bytes and holds 500 bytes",
    ),
    "copies.gltf": (
        lambda: gltf_of_copies(1000),
        "must stay within 4194304 vertices and faces; its copies make more",
    ),
    "points.vtk": (
        lambda: LEGACY.replace("POINTS 4", "POINTS 400000000").encode(),
        "1200000000 items at byte",
    ),
    "types.vtk": (
        lambda: LEGACY.replace("TYPES 1", "TYPES 400000000").encode(),
        "400000000 items at byte",
    ),
    "vertices.mesh": (
        lambda: MEDIT.replace("Vertices\n4", "Vertices\n400000000").encode(),
        "Vertices declares 400000000 rows",
    ),
    "cells.mesh": (
        lambda: MEDIT.replace("Tetrahedra\n1", "Tetrahedra\n40000000").encode(),
        "Tetrahedra declares 40000000 rows",
    ),
    "vertices.meshb": (
        lambda: medit_binary(100_000_000),
        "100000000 items at byte 32 do not fit",
    ),
}


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """Read all bombs in one process; for each, the MiB by which the process has grown, and what it said."""
    folder = tmp_path_factory.mktemp("bombs")
    files = {name: make() for name, (make, _) in BOMBS.items()} | {
        "unread.vtu": vtu(extra=zeros(GIGABYTES))
    }
    for name, data in files.items():
        (folder / name).write_bytes(data)
    command = [sys.executable, "-c", MEASURE, *(str(folder / name) for name in files)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = [line.split(" ", 1) for line in done.stdout.splitlines()]
    return {name: (float(grown), said) for name, (grown, said) in zip(files, lines, strict=True)}


@pytest.mark.long
@pytest.mark.parametrize("name", BOMBS)
def test_bombs_are_refused_with_less_than_200_megabytes(outcomes, name):
    grown, said = outcomes[name]
    assert name in said
    assert BOMBS[name][1] in said
    assert grown < 200


@pytest.mark.long
def test_what_nobody_reads_is_not_unpacked(outcomes):
    grown, said = outcomes["unread.vtu"]
    assert said == "SimplicialMesh(4 points in R^3, 1 simplices of dimension 3)"
    assert grown < 200


@pytest.mark.parametrize("compressor", [ZLIB, LZMA])
def test_blocks_unpack_to_what_they_declare_or_not_at_all(compressor):
    block = PACK[compressor](bytes(1000))
    assert unpack_block(block, 1000, compressor) == bytes(1000)
    with pytest.raises(
        FileFormatError, match="unpack to the size it declares, 999; it unpacks to more"
    ):
        unpack_block(block, 999, compressor)
    with pytest.raises(
        FileFormatError, match="unpack to the size it declares, 1001; it unpacks to 1000"
    ):
        unpack_block(block, 1001, compressor)
    with pytest.raises(FileFormatError, match="A compressed block must be whole; one is damaged"):
        unpack_block(b"nonsense", 1000, compressor)


# Token, literal bytes, distance of a copy: abcabcabca, with four more bytes of lengths where they are full
LZ4_BLOCKS = {
    bytes([0x33, *b"abc", 3, 0, 0x10, ord("x")]): b"abcabcabcax",
    bytes([0x1F, ord("a"), 1, 0, 255, 2, 0]): b"a" * (1 + 4 + 15 + 255 + 2),
    bytes([0xF0, 5, *b"abcdefghijklmnopqrst"]): b"abcdefghijklmnopqrst",
    bytes([0x00]): b"",
}


@pytest.mark.parametrize("block", LZ4_BLOCKS)
def test_lz4_copies_what_was_unpacked_before(block):
    whole = LZ4_BLOCKS[block]
    assert unpack_block(block, len(whole), LZ4) == whole
    with pytest.raises(FileFormatError, match=f"declares, {len(whole) + 1}; it unpacks to"):
        unpack_block(block, len(whole) + 1, LZ4)
    for end in range(len(block)):
        with pytest.raises(FileFormatError, match="A compressed block must "):
            unpack_block(block[:end], len(whole) + 1, LZ4)
    if whole:
        with pytest.raises(
            FileFormatError, match=f"declares, {len(whole) - 1}; it unpacks to more"
        ):
            unpack_block(block, len(whole) - 1, LZ4)


def test_lz4_does_not_copy_from_before_the_beginning_or_beyond_its_size():
    for distance in (0, 2):
        with pytest.raises(FileFormatError, match="damaged: a copy begins before the first byte"):
            unpack_block(bytes([0x10, ord("a"), distance, 0, 0]), 9, LZ4)
    # A length of 255 million, of which 101 bytes are made.
    with pytest.raises(FileFormatError, match="declares, 100; it unpacks to more"):
        unpack_block(bytes([0x1F, ord("a"), 1, 0]) + b"\xff" * 10**6 + b"\0\0", 100, LZ4)


def test_too_little_memory_has_a_name(tmp_path, monkeypatch):
    def fail(data):
        raise MemoryError

    write_mesh(TETRAHEDRON, tmp_path / "a.off")
    monkeypatch.setattr(off, "parse", fail)
    for read in (read_shape, read_mesh):
        with pytest.raises(
            FileFormatError, match=r"a\.off must fit into memory; there is too little to read it"
        ):
            read(tmp_path / "a.off")
