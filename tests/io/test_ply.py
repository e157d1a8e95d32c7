import struct

import numpy as np
import pytest
from tetrahedra import FACES, FILES, TETRAHEDRON, VERTICES

from eigenshape import FileFormatError, InvalidShapeError, TriangleMesh, read_mesh
from eigenshape.io.formats.ply import format_binary, format_text, parse

HEADER = """ply
format {order} 1.0
comment with {remark}
obj_info nothing
element vertex 4
property float x
property list uchar short marks
property double y
property uchar red
property int z
element note 2
property list int float words
element nothing 2147483647
element face 3
property short kind
property list uint8 uint32 vertex_index
property list uchar float texcoord
end_header
"""
TEXT_ROWS = """0 0 0 255 0
1 2 7 8 0 255 0
0 1 9 1 255 0
0 0 0 255 1
0
2 .5 nan
7 3 0 2 1 0
7 3 0 1 3 2 0.5 0.5
7 4 1 2 3 0 1 .5
"""
WANTED = [[0, 2, 1], [0, 1, 3], [0, 1, 2], [0, 2, 3]]  # the fan of the last would fold


def binary_rows(order):
    def pack(code, *values):
        return struct.pack(order + code, *values)

    rows = pack("fBdBi", 0, 0, 0, 255, 0) + pack("fBhhdBi", 1, 2, 7, 8, 0, 255, 0)
    rows += pack("fBhdBi", 0, 1, 9, 1, 255, 0) + pack("fBdBi", 0, 0, 0, 255, 1)
    rows += pack("i", 0) + pack("iff", 2, 0.5, 0.5)
    rows += pack("hBIIIB", 7, 3, 0, 2, 1, 0) + pack("hBIIIBff", 7, 3, 0, 1, 3, 2, 0.5, 0.5)
    return rows + pack("hBIIIIBf", 7, 4, 1, 2, 3, 0, 1, 0.5)


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("remark", ["end_header", "Ålesund…"])
@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_what_is_not_asked_for_is_passed_over(order, remark, newline):
    rows = {"ascii": TEXT_ROWS.replace("\n", newline).encode()} | {
        "binary_little_endian": binary_rows("<"),
        "binary_big_endian": binary_rows(">"),
    }
    head = HEADER.format(order=order, remark=remark).replace("\n", newline).encode()
    vertices, faces = parse(head + rows[order])
    np.testing.assert_array_equal(vertices, VERTICES)
    assert faces.tolist() == WANTED


def test_whole_numbers_of_64_bits_as_meshio_writes_them(tmp_path):
    text = simple(corners="list uint8 int64 vertex_indices").replace(
        "element face", "property int64 lab\nproperty uint64 big\nelement face"
    )
    text = text.replace("0 0 0\n1 0 0\n0 1 0\n", f"0 0 0 1 5\n1 0 0 2 6\n0 1 0 {2**40} 7\n")
    (tmp_path / "a.ply").write_text(text)
    mesh, attributes = read_mesh(tmp_path / "a.ply", attributes=True)
    assert mesh.faces.tolist() == [[0, 1, 2]]
    assert attributes.fields["lab"].tolist() == [1, 2, 2**40]
    assert attributes.fields["big"].tolist() == [5, 6, 7]
    body = struct.pack("<9dB3q", 0, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, 2)
    head = simple("", "list uint8 uint64 vertex_indices").replace("float", "double")
    head = head.replace("ascii", "binary_little_endian").split("0 0 0\n")[0]
    assert parse(head.encode() + body)[1].tolist() == [[0, 1, 2]]


def test_faces_under_another_name_are_named():
    text = simple().replace("element face", "element polygon")
    _, faces, note = parse(text.encode())
    assert faces.shape == (0, 3)
    assert note == "the element polygon, which has vertex_indices, is not read"


def test_rows_that_begin_with_a_line_feed_belong_to_the_rows():
    head = b"ply\rformat binary_little_endian 1.0\relement vertex 3\r"
    head += b"property uchar x\rproperty uchar y\rproperty uchar z\r"
    head += b"element face 1\rproperty list uchar uchar vertex_indices\rend_header\r"
    vertices, _ = parse(head + bytes([10, 0, 0, 1, 0, 0, 0, 1, 0]) + bytes([3, 0, 1, 2]))
    assert vertices.tolist() == [[10, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_plain_text_with_colors_of_faces():
    text = FILES["ply text"][1].decode().replace("end_header", "property uchar red\nend_header")
    text = "\n".join(line + (" 255" if line.startswith("3 ") else "") for line in text.splitlines())
    assert parse(text.encode())[1].tolist() == FACES


def simple(rows="3 0 1 2\n", corners="list uchar int vertex_indices", axes="xyz", count=1):
    properties = "".join(f"property float {axis}\n" for axis in axes)
    vertices = f"element vertex 3\n{properties}"
    head = (
        f"ply\nformat ascii 1.0\n{vertices}element face {count}\nproperty {corners}\nend_header\n"
    )
    return head + "0 0 0\n1 0 0\n0 1 0\n" + rows


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "A PLY file must begin with ply; it begins with ''"),
        ("plyx\n", "A PLY file must begin with ply; it begins with 'plyx'"),
        (
            "ply\nformat ascii 1.0\n",
            "must end with end_header; there is no such line in its first [0-9]+ bytes",
        ),
        ("ply\nelement vertex 3\nend_header\n", "must name its format; it has no such line"),
        (
            "ply\nformat morse 1.0\nend_header\n",
            "format, elements and properties; line 2 is 'format morse 1.0'",
        ),
        (
            "ply\nformat ascii 1.0\nend_header\n",
            "must declare an element vertex with the numbers x, y and z",
        ),
        (simple(axes="xyw"), "must declare an element vertex with the numbers x, y and z"),
        (
            simple().replace("float x", "list uchar float x"),
            "must declare an element vertex with the numbers x, y",
        ),
        (simple(axes="xyzx"), "format, elements and properties; line 7 is 'property float x'"),
        (simple().replace("face 1", "vertex 1"), "line 7 is 'element vertex 1'"),
        (simple().replace("face 1", "face -1"), "line 7 is 'element face -1'"),
        (simple().replace("face 1", "face"), "line 7 is 'element face'"),
        (simple().replace("element vertex 3\n", ""), "line 3 is 'property float x'"),
        (
            simple(corners="list float int vertex_indices"),
            "line 8 is 'property list float int vertex_indices'",
        ),
        (
            simple().replace("property float y", "propriety float y"),
            "line 5 is 'propriety float y'",
        ),
        (
            simple(corners="list uchar float vertex_indices"),
            "must declare a list of whole vertex_indices",
        ),
        (simple(corners="int vertex_indices"), "must declare a list of whole vertex_indices"),
        (simple(corners="list uchar int corners"), "must declare a list of whole vertex_indices"),
        (
            simple(corners="int vertex_indices").replace("face 1", "tristrips 1"),
            "element tristrips of a PLY file must",
        ),
        (simple(rows=""), "it declares 4 in all and holds 3"),
        (simple(rows="3 0 1 2\n3 0 1 2\n"), "it declares 4 in all and holds 5"),
        (
            simple(count=2**31),
            "2147483648 rows of face take 4294967296 bytes or more and 2[0-9] follow",
        ),
        (simple(count=10**4299), "line 7 is 'element face 10"),
        (simple(rows="2 0 1\n"), r"A face must have three corners or more; face 0 is \[0, 1\]"),
        (
            simple(rows="3 0 1 2\n2 0 1\n", count=2),
            r"A face must have three corners or more; face 1 is \[0, 1\]",
        ),
        (
            simple(rows="3 0 1\n"),
            "A row must hold all its columns; line 13 lacks vertex_indices: '3 0 1'",
        ),
        (
            simple(rows="-3 0 1 2\n"),
            "A row must hold all its columns; line 13 lacks vertex_indices",
        ),
        (
            simple(rows="3 0 1 2 4\n"),
            "A row of face must end with its columns; line 13 goes on with '4'",
        ),
        (simple(rows="3 0 1 2.0\n"), r"A corner must be a whole number; line 13 has '2\.0'"),
        (
            simple(rows="3. 0 1 2\n"),
            r"The length of a list must be a whole number; line 13 has '3\.'",
        ),
        (
            simple().replace("1 0 0", "1 0 zero"),
            "A coordinate must be a number; line 11 has 'zero'",
        ),
        (
            simple().replace("1 0 0", "1 0"),
            "A row must hold all its columns; line 11 lacks z: '1 0'",
        ),
    ],
)
def test_broken_text_is_refused(text, message):
    with pytest.raises(FileFormatError, match=message):
        parse(text.encode())


def swapped(old, new):
    return FILES["ply little"][1].replace(old, new)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            FILES["ply little"][1][:-1],
            "4 rows of face take 4 bytes|vertex_indices of face 3 does not fit",
        ),
        (FILES["ply big"][1][:-20], "vertex_indices of face 2 does not fit"),
        (
            FILES["ply little"][1] + b"\x03\x00\x00",
            "must end with its last row; 3 more bytes follow",
        ),
        (swapped(b"face 4", b"face 5"), "vertex_indices of face 4 does not fit"),
        (
            swapped(b"face 4", b"face 2147483648"),
            "2147483648 rows of face take 2147483648 bytes or more",
        ),
        (
            swapped(b"vertex 4", b"vertex 99"),
            "99 rows of vertex take 2376 bytes or more and 148 follow",
        ),
        (
            swapped(b"list uchar int", b"list char int").replace(b"\x03\0\0\0\0", b"\xfd\0\0\0\0"),
            "face 0 does not fit",
        ),
        (
            swapped(b"list uchar int", b"list uchar float"),
            "must declare a list of whole vertex_indices",
        ),
    ],
)
def test_broken_binary_is_refused(data, message):
    with pytest.raises(FileFormatError, match=message):
        parse(data)


def test_wrong_values_are_refused():
    with pytest.raises(InvalidShapeError, match=r"index vertices 0\.\.3; face 3 is \[0, 3, -1\]"):
        TriangleMesh(*parse(FILES["ply little"][1][:-4] + b"\xff\xff\xff\xff"))
    with pytest.raises(InvalidShapeError, match=r"index vertices 0\.\.2; face 0 is \[0, 1, 9\]"):
        TriangleMesh(*parse(simple(rows="3 0 1 9\n").encode()))
    with pytest.raises(InvalidShapeError, match="must be finite; vertex 1"):
        TriangleMesh(*parse(simple().replace("1 0 0", "1 0 inf").encode()))


@pytest.mark.parametrize("write", [format_text, format_binary])
def test_colors_stand_with_the_vertices(write):
    colors = np.arange(12, dtype=np.uint8).reshape(4, 3)
    data = write(TETRAHEDRON, dict(zip(("red", "green", "blue"), colors.T, strict=True)))
    assert b"property uchar red\nproperty uchar green\nproperty uchar blue\nelement face" in data
    assert (b"0.0 0.0 1.0 9 10 11\n" in data) or (
        struct.pack("<dddBBB", 0, 0, 1, 9, 10, 11) in data
    )
    np.testing.assert_array_equal(parse(data)[0], VERTICES)
    np.testing.assert_array_equal(parse(data)[1], FACES)


@pytest.mark.parametrize(
    ("strips", "faces"),
    [
        ("4 0 1 2 3", [[0, 1, 2], [2, 1, 3]]),
        ("8 0 1 2 3 -1 3 1 0", [[0, 1, 2], [2, 1, 3], [3, 1, 0]]),
        ("7 0 1 2 2 1 3 -1", [[0, 1, 2], [1, 2, 3]]),  # turned by naming points twice
        ("3 0 1 -1", []),
    ],
)
def test_strips_of_triangles(strips, faces):
    text = (
        simple(rows=f"{strips}\n").replace("face 1", "tristrips 1").replace("uchar int", "int int")
    )
    text = text.replace("vertex 3", "vertex 4").replace("0 0 0\n", "0 0 0\n0 0 1\n")
    assert turned(parse(text.encode())[1]) == turned(faces)


def turned(faces):
    """Begin each face with its lowest corner."""
    return [np.roll(face, -int(np.argmin(face))).tolist() for face in faces]


def test_a_strip_makes_the_tetrahedron():
    assert sorted(turned(parse(FILES["ply strip"][1])[1])) == sorted(turned(FACES))
