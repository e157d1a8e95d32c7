import numpy as np
import pytest
from tetrahedra import FACES, FILES, TETRAHEDRON, VERTICES

from eigenshape import FileFormatError, InvalidShapeError, TriangleMesh, read_mesh
from eigenshape.io.formats.off import parse

ROWS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
COLUMNS = "0 0 0 9 9 9\n1 0 0 9 9 9\n0 1 0 9 9 9\n0 0 1 9 9 9\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 4 6\n{ROWS}",
        f"off\n4 4\n{ROWS}",
        f"OFF 4 4 6\n{ROWS}",
        f"OFF4 4 6\n{ROWS}",
        f"# before\n\nOFF # here\n\n# between\n4 4 6 # counts\n\n{ROWS}\n\n# after",
        f"OFF\r\n4 4 6\r\n{ROWS}".replace("\n", "\r\n").replace("\r\r", "\r"),
        f"OFF\r4 4 6\r{ROWS}".replace("\n", "\r"),
        f"NOFF\n4 4 6\n{COLUMNS}",
        f"COFF\n4 4 6\n{COLUMNS}",
        f"STCNOFF\n4 4 6\n{COLUMNS}",
        f"NCOFF\n4 4 6\n{COLUMNS}",
        f"CNOFF\n4 4 6\n{COLUMNS}",
        f"noff\n4 4 6\n{COLUMNS}",
        f"OFF\n4 4 6\n{ROWS}".replace("3 0 2 1\n", "3 0 2 1 255 0 0\n").replace(
            "3 0 1 3\n", "3 0 1 3 .5 .5 .5 1\n"
        ),
        f"OFF\n4 4 6\n{ROWS}".replace("1 0 0", "\t1. +0 -0e-5"),
    ],
)
def test_variants_give_the_tetrahedron(text):
    vertices, faces, *_ = parse(text.encode())
    np.testing.assert_array_equal(vertices, VERTICES)
    np.testing.assert_array_equal(faces, FACES)


def test_columns_and_colors_that_are_not_read_are_named(tmp_path):
    text = "NCOFF\n3 1 0\n0 0 0 255 0 0 255 0 0 1\n1 0 0 255 0 0 255 0 0 1\n"
    text += "0 1 0 255 0 0 255 0 0 1\n3 0 1 2 .5 .5 .5\n"  # as MeshLab writes it
    message = r"a\.off: colors, normals and texture coordinates are not read"
    for each in (
        text,
        text.replace(" .5 .5 .5", ""),
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 9\n",
    ):
        (tmp_path / "a.off").write_text(each)
        with pytest.warns(UserWarning, match=message):
            assert read_mesh(tmp_path / "a.off").faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    "remark",
    ["Ångström…".encode(), "é".encode("latin-1"), bytes(range(128, 256)) + b"\x0b\x0c\x1c"],
)
def test_comments_in_any_encoding_do_no_harm(remark):
    data = (
        b"OFF # " + remark + b"\n# " + remark + b"\n4 4 6\n" + ROWS.replace("\n", "\n#\n").encode()
    )
    np.testing.assert_array_equal(parse(data)[1], FACES)
    np.testing.assert_array_equal(parse(b"\xef\xbb\xbf" + data)[1], FACES)


def test_polygons_become_triangles_in_order():
    text = b"OFF\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n-1 1 0\n5 0 1 2 3 4\n4 4 0 1 2\n"
    assert parse(text)[1].tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [4, 0, 1], [4, 1, 2]]
    squares = b"OFF\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n-1 1 0\n4 0 1 2 3\n4 4 0 1 3\n"
    assert parse(squares)[1].tolist() == [[0, 1, 2], [0, 2, 3], [4, 0, 1], [4, 1, 3]]


def test_no_triangle_of_a_polygon_lies_outside_or_on_a_line():
    dart = b"OFF\n5 2 0\n0 0 0\n1 0 0\n.2 .2 0\n0 1 0\n.5 0 0\n4 0 1 2 3\n4 0 4 1 2\n"
    assert parse(dart)[1].tolist() == [[0, 1, 2], [0, 2, 3], [2, 0, 4], [2, 4, 1]]
    with pytest.raises(InvalidShapeError, match=r"cross themselves.*face 1 .*\[0, 1, 3, 2\]"):
        parse(dart.replace(b"4 0 4 1 2", b"4 0 1 3 2").replace(b".2 .2", b"1 1"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must begin with OFF, COFF, NOFF"),
        ("PLY\n4 4 6\n", "it begins with 'PLY'"),
        ("4OFF\n4 4 6\n", "it begins with '4OFF'"),
        ("OFF BINARY\n", "must hold 32-bit counts, x, y and z of each vertex"),
        ("OFF\n", "must declare vertices and faces; line 2 is ''"),
        ("OFF\n\n4\n", "must declare vertices and faces; line 3 is '4'"),
        ("nOFF\n3\n4 4 6\n", "three coordinates a vertex; it begins with 'nOFF'. Save it as OFF"),
        ("4nOFF\n3\n4 4 6\n", "three coordinates a vertex; it begins with '4nOFF'"),
        ("4OFF\n3\n4 4 6\n", "three coordinates a vertex; it begins with '4OFF'"),
        ("OFF\n-4 12 6\n" + ROWS, "A count must not be negative; line 2"),
        ("OFF\n4.0 4 6\n" + ROWS, r"A count must be a whole number; line 2 has '4\.0'"),
        ("OFF\n4 4_0 6\n" + ROWS, "A count must be a whole number; line 2 has '4_0'"),
        ("OFF\n4 4 6\n" + ROWS + "3 0 1 2\n", "declares 4 vertices and 4 faces and holds 9 rows"),
        ("OFF\n4 4 6\n" + ROWS[:-9], "declares 4 vertices and 4 faces and holds 7 rows"),
        (
            "OFF\n2147483648 2147483648 6\n" + ROWS,
            "declares 2147483648 vertices and 2147483648 faces",
        ),
        ("OFF\n5 3 6\n" + ROWS, "equally many columns; the first has 3 and line 7 is '3 0 2 1'"),
        ("OFF\n3 5 6\n" + ROWS, "three corners or more, as many as it says; line 6 is '0 0 1'"),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "2 0 2 1"),
            "three corners or more, as many as it says; line 7",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "4 0 2 1"),
            "three corners or more, as many as it says; line 7",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "3. 0 2 1"),
            r"A number of corners must be a whole number; line 7",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "3 0 2 1.5"),
            r"A corner must be a whole number; line 7 has '1\.5'",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "3 0 2 1e0"),
            "A corner must be a whole number; line 7 has '1e0'",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", f"3 0 2 {10**30}"),
            "A corner must fit into 64 bits; line 7 has '10",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("1 0 0", "1 0 zero"),
            "A coordinate must be a number; line 4 has 'zero'",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("1 0 0", "1 0 1_0"),
            "A coordinate must be a number; line 4 has '1_0'",
        ),
        ("OFF\n1 1 0\n0 0\n3 0 0 0\n", "A vertex must have three numbers; line 3 is '0 0'"),
    ],
)
def test_broken_files_are_refused(text, message):
    with pytest.raises(FileFormatError, match=message):
        parse(text.encode())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "OFF\n4 4 6\n" + ROWS.replace("1 0 0", "1 nan 0"),
            r"must be finite; vertex 1 is \[1\.0, nan, 0\.0\]",
        ),
        ("OFF\n4 4 6\n" + ROWS.replace("1 0 0", "1 0 1e999"), "must be finite; vertex 1"),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "3 0 2 4"),
            r"index vertices 0\.\.3; face 0 is \[0, 2, 4\]",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "3 0 2 -1"),
            r"index vertices 0\.\.3; face 0 is \[0, 2, -1\]",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", "3 0 2 4294967296"),
            r"face 0 is \[0, 2, 4294967296\]",
        ),
        (
            "OFF\n4 4 6\n" + ROWS.replace("3 0 2 1", f"3 0 2 {2**62}"),
            rf"face 0 is \[0, 2, {2**62}\]",
        ),
        ("OFF\n0 0 0\n", "must have vertices; it has none"),
        ("OFF\n1 0 0\n1 2 3\n", "it has 1 vertices and no face"),
    ],
)
def test_wrong_values_are_refused(text, message):
    with pytest.raises(InvalidShapeError, match=message):
        TriangleMesh(*parse(text.encode()))


def test_written_text_is_plain():
    assert FILES["off"][1].decode().splitlines()[:3] == ["OFF", "4 4 0", "0.0 0.0 0.0"]
    np.testing.assert_array_equal(parse(FILES["off"][1])[0], TETRAHEDRON.vertices)


@pytest.mark.parametrize(
    "body",
    [
        ROWS.replace("3 0 2 1\n", "3\n0 2\n1\n"),
        ROWS.replace("1 0 0\n", "1\n0 0\n"),
        ROWS.replace("\n", " "),
    ],
)
def test_lines_may_break_anywhere(body):
    vertices, faces = parse(f"OFF\n4 4 6\n{body}".encode())
    np.testing.assert_array_equal(vertices, VERTICES)
    np.testing.assert_array_equal(faces, FACES)


@pytest.mark.parametrize(
    "body",
    [
        ROWS.replace("3 0 2 1\n", "3\n0 2\n1 9\n"),  # a color, which ends where its line ends
        ROWS.replace("3 0 2 1\n", "2\n0 2\n1\n"),
        ROWS.replace("3 0 3 2\n", "9\n0 3 2\n"),
        ROWS.replace("3 0 3 2\n", ""),
    ],
)
def test_broken_lines_that_do_not_fill_the_file_are_refused(body):
    with pytest.raises(FileFormatError, match="declares 4 vertices and 4 faces and holds"):
        parse(f"OFF\n4 4 6\n{body}".encode())
    with pytest.raises(FileFormatError, match="declares 4 vertices and 4 faces and holds"):
        parse(f"COFF\n4 4 6\n{ROWS}".replace("3 0 2 1", "3\n0 2\n1").encode())


@pytest.mark.parametrize("order", [">", "<"])
@pytest.mark.parametrize("colors", [None, 0, 3])
def test_binary_files_of_both_orders_with_and_without_counts_of_colors(order, colors):
    body = np.array([4, 4, 6], f"{order}i4").tobytes() + np.array(VERTICES, f"{order}f4").tobytes()
    for face in FACES:
        body += np.array([3, *face], f"{order}i4").tobytes()
        if colors is not None:
            body += (
                np.array([colors], f"{order}i4").tobytes() + np.ones(colors, f"{order}f4").tobytes()
            )
    vertices, faces = parse(b"OFF BINARY\n" + body)
    np.testing.assert_array_equal(vertices, VERTICES)
    np.testing.assert_array_equal(faces, FACES)
    for broken in (body[:-4], body[:-1], body + b"\0\0\0\0", body[:8]):
        with pytest.raises(FileFormatError, match=f"it does not, in {len(broken)} bytes"):
            parse(b"OFF BINARY\n" + broken)
