import numpy as np
import pytest
from tetrahedra import FACES, VERTICES

from eigenshape import FileFormatError, InvalidShapeError, TriangleMesh
from eigenshape.io.formats.obj import parse

POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
TRIANGLES = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.mark.parametrize(
    "text",
    [
        POINTS + TRIANGLES,
        TRIANGLES + POINTS,
        "mtllib none.mtl\no f 1 2 3\ng v\ns off\n"
        + POINTS
        + "vt 0 0\nvn 0 0 1\nvp 1\nl 1 2\np 1\n"
        + TRIANGLES,
        POINTS + "vt 0 0\nvt 1 1\nf 1/1 3/2 2/1\nf 1/2 2/2 4/1\nf 2/1 3/1 4/2\nf 1/1 4/1 3/1\n",
        POINTS + "f 1/1/1 3/2/1 2/1/1\nf 1//1 2//2 4//1\nf 2// 3// 4//\nf 1/1/ 4/1/ 3/1/\n",
        POINTS + "f -4 -2 -3\nf -4 -3 -1\nf -3/1 -2/-1 -1/-1\nf 1 -1 -2\n",
        POINTS.replace("v ", "v\t ").replace(" 0\n", " 0  # end\n")
        + "\n"
        + TRIANGLES.replace("f ", "  f   "),
        POINTS.replace("1\n", "1 0.5\n") + TRIANGLES,
        POINTS.replace("v 1 0 0", "v 1 0 0 0.5 nan 0") + TRIANGLES,
        POINTS + "f 1 \\\n3 \\\r\n2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
        "# drawn in C:\\shapes\\\nmtllib C:\\\n" + POINTS + "usemtl C:\\\n" + TRIANGLES,
        "v 0 0 0 # C:\\\n" + POINTS[8:] + TRIANGLES,
        (POINTS + TRIANGLES).replace("\n", "\r\n"),
        "\ufeff" + POINTS + TRIANGLES,
        "g Ålesund\n# Ålesund…\n" + POINTS + "usemtl \u2028\u0085\n" + TRIANGLES,
    ],
)
def test_variants_give_the_tetrahedron(text):
    vertices, faces = parse(text.encode())
    np.testing.assert_array_equal(vertices, VERTICES)
    np.testing.assert_array_equal(faces, FACES)


def test_relative_corners_count_back_from_where_they_stand():
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n"
    assert parse(text.encode())[1].tolist() == [[0, 1, 2], [3, 4, 5]]


def test_polygons_become_fans_in_order():
    text = POINTS + "f 1 2 3 4\nf 4 3 2\nf 1 2 3 4 1\n"
    fan = [[0, 1, 2], [0, 2, 3], [3, 2, 1], [0, 1, 2], [0, 2, 3], [0, 3, 0]]
    assert parse(text.encode())[1].tolist() == fan


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (POINTS + "v 0 0\n" + TRIANGLES, "A vertex must have three numbers; line 5 is '0 0'"),
        ("v\n" + POINTS + TRIANGLES, "A vertex must have three numbers; line 1 is ''"),
        (POINTS + "f 1 2\n", "A face must have three corners or more; line 5 is '1 2'"),
        (POINTS + "f\n", "A face must have three corners or more; line 5 is ''"),
        (POINTS + "f\n" + TRIANGLES, "A face must have three corners or more; line 5 is ''"),
        (
            POINTS + "f 1 2 3\nf 0 1 2\n",
            "A corner must count vertices from 1, or back from -1; line 6 is '0 1 2'",
        ),
        (POINTS + "f -5 1 2\n", "back from -1; line 5 is '-5 1 2' after 4 vertices"),
        (POINTS + "f 1 2 3.0\n", r"A corner must be a whole number; line 5 has '3\.0'"),
        (POINTS + "f 1 2 /3\n", "A corner must be a whole number; line 5 has '/3'"),
        (POINTS + "f 1 2 3 \\", "A corner must be a whole number; line 5"),
        (POINTS + "f 1 2 x/3\n", "A corner must be a whole number; line 5 has 'x/3'"),
        (
            POINTS.replace("v 1 0 0", "v 1 0,5 0") + TRIANGLES,
            "A coordinate must be a number; line 2 has '0,5'",
        ),
    ],
)
def test_broken_files_are_refused(text, message):
    with pytest.raises(FileFormatError, match=message):
        parse(text.encode())


def test_corner_beyond_the_vertices_is_refused():
    with pytest.raises(InvalidShapeError, match=r"index vertices 0\.\.3; face 0 is \[0, 1, 4\]"):
        TriangleMesh(*parse((POINTS + "f 1 2 5\n").encode()))


def test_many_joined_lines_stay_quick():
    text = b"f \\\n" + b"\\\n" * 300_000 + b"1 2 3\n" + POINTS.encode()
    assert parse(text)[1].tolist() == [[0, 1, 2]]


def test_vertices_of_two_numbers_are_in_the_plane():
    vertices, faces = parse(b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n")
    assert vertices.tolist() == [[0, 0], [1, 0], [0, 1]]
    assert faces.tolist() == [[0, 1, 2]]
