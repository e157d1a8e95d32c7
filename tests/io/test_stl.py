import numpy as np
import pytest
from tetrahedra import FILES, TETRAHEDRON, read

from eigenshape import FileFormatError, InvalidShapeError, TriangleMesh
from eigenshape.io.formats.stl import format_binary, format_text, parse, single_precision

TEXT = FILES["stl text"][1].decode()
BINARY = FILES["stl binary"][1]


@pytest.mark.parametrize(
    "data",
    [
        TEXT.encode(),
        TEXT.upper().encode(),
        TEXT.replace("\n", "\r\n  ").encode(),
        TEXT.replace("solid mesh", "solid Ångström…").encode(),
        TEXT.replace("solid mesh", "solid").encode(),
        (TEXT + "\n" + TEXT.replace("0.0", "-0.0")).encode(),
        BINARY,
        b"solid but binary".ljust(80) + BINARY[80:],
    ],
)
def test_equal_corners_become_one_vertex(data):
    mesh = read(parse, data)
    assert mesh.n_vertices == 4
    # Vertices stand in the order in which the triangles (0, 2, 1), (0, 1, 3) first meet them.
    np.testing.assert_array_equal(mesh.vertices, TETRAHEDRON.vertices[[0, 2, 1, 3]])
    assert mesh.faces[:4].tolist() == [[0, 1, 2], [0, 2, 3], [2, 1, 3], [0, 3, 1]]


def test_normals_point_outwards():
    assert "facet normal 0.0 0.0 -1.0" in TEXT
    slope = np.frombuffer(BINARY[84 + 100 : 84 + 112], "<f4")
    np.testing.assert_allclose(slope, 3**-0.5, rtol=1e-6)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"solid empty\nendsolid empty\n", "must hold triangles; it holds none"),
        (BINARY[:80] + bytes(4), "must hold triangles; it holds none"),
        (BINARY[:80], "84 bytes of header; it has 80 in all"),
        (BINARY[:-1], "4 take 284 bytes and it has 283"),
        (BINARY + b"\0", "4 take 284 bytes and it has 285"),
        (
            BINARY[:80] + b"\0\0\0\x80" + BINARY[84:],
            "2147483648 take 107374182484 bytes and it has 284",
        ),
        (TEXT[:-14].encode(), "must close what it opens; it has 1 solid, 0 endsolid"),
        (
            TEXT.replace("endfacet\nendsolid", "endsolid").encode(),
            "must end with a whole facet; its last line is 'endloop'",
        ),
        (
            TEXT.replace("vertex 0.0 0.0 0.0\n", "", 1).encode(),
            "vertex endloop endfacet; line 6 is 'endloop'",
        ),
        (
            TEXT.replace("vertex 0.0 0.0 0.0\n", "vertex 0.0 0.0\n", 1).encode(),
            "three numbers; line 4 is '0.0 0.0'",
        ),
        (
            TEXT.replace("1.0\n", "one\n").encode(),
            "A coordinate must be a number; line [0-9]+ has 'one'",
        ),
        (b"garbage\n" * 20, "must hold the triangles it declares"),
    ],
)
def test_broken_files_are_refused(data, message):
    with pytest.raises(FileFormatError, match=message):
        parse(data)


def test_nan_is_refused():
    data = bytearray(BINARY)
    data[96:100] = np.float32(np.nan).tobytes()
    with pytest.raises(InvalidShapeError, match="must be finite; vertex 0"):
        parse(bytes(data))


def scaled(factor):
    return TriangleMesh(TETRAHEDRON.vertices * factor, TETRAHEDRON.faces)


def test_single_precision_refuses_what_it_cannot_hold():
    with pytest.raises(FileFormatError, match=r"up to 3.4e38; vertex 1 is \[1e\+100, 0.0, 0.0\]"):
        format_binary(scaled(1e100))
    with pytest.raises(
        FileFormatError, match=r"down to 1.2e-38; no coordinate is larger than 1e-100"
    ):
        format_binary(scaled(1e-100))
    largest = float(np.finfo(np.float32).max)
    assert np.isfinite(single_precision(scaled(largest), "STL")).all()


@pytest.mark.parametrize("factor", [1e-300, 1e-100, 1.0, 1e100, 1e300])
def test_text_keeps_full_precision_and_unit_normals(factor):
    data = format_text(scaled(factor / 3))
    np.testing.assert_array_equal(
        read(parse, data).vertices, TETRAHEDRON.vertices[[0, 2, 1, 3]] * (factor / 3)
    )
    assert b"facet normal 0.0 0.0 -1.0" in data
