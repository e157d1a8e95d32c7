import numpy as np
import pytest

from certeig.kit.errors import CerteigError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh

CORNERS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACE = [[0, 1, 2]]


def refused(match, vertices=CORNERS, faces=FACE):
    with pytest.raises(InvalidShapeError, match=match) as caught:
        TriangleMesh(vertices, faces)
    assert isinstance(caught.value, CerteigError)
    assert isinstance(caught.value, ValueError)


def test_lists_become_read_only_arrays():
    mesh = TriangleMesh(CORNERS, FACE)
    assert (mesh.n_vertices, mesh.n_faces) == (4, 1)
    assert mesh.vertices.dtype == np.float64
    assert mesh.faces.dtype == np.int64
    assert repr(mesh) == "TriangleMesh(4 vertices, 1 faces)"
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_later_writes_to_the_arguments_change_nothing():
    vertices, faces = np.array(CORNERS), np.array(FACE)
    mesh = TriangleMesh(vertices, faces)
    vertices[0], faces[0] = 7, 3
    assert mesh.vertices[0].tolist() == [0, 0, 0]
    assert mesh.faces.tolist() == FACE


@pytest.mark.parametrize("kind", [np.uint8, np.int32, np.uint64, np.float32, np.float64, object])
def test_whole_numbers_of_any_type_index(kind):
    assert TriangleMesh(CORNERS, np.array([[0, 1, 3]], dtype=kind)).faces.tolist() == [[0, 1, 3]]


@pytest.mark.parametrize(("bad", "shown"), [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf")])
@pytest.mark.parametrize("row", [1, 3])  # no face uses vertex 3
def test_coordinates_that_are_not_finite_are_refused(bad, shown, row):
    vertices = np.array(CORNERS)
    vertices[row, 1] = bad
    refused(
        rf"vertices must be finite; vertex {row} is \[{vertices[row, 0]}, {shown}, .* \(1 such\)",
        vertices,
    )


def test_all_rows_that_are_not_finite_are_counted():
    refused(r"vertex 0 is \[nan, nan, nan\] \(4 such\)", np.full((4, 3), np.nan))


@pytest.mark.parametrize(
    ("index", "shown"),
    [
        (4, "4"),
        (-1, "-1"),
        (2**31, "2147483648"),
        (-(2**31) - 1, "-2147483649"),
        (2**32, "4294967296"),
        (2**63, r"9\.223372036854776e\+18"),
        (2**64 + 1, "18446744073709551617"),
        (-(2**63) - 1, "-9223372036854775809"),
        (float("inf"), "inf"),
    ],
)
def test_an_index_out_of_range_is_refused(index, shown):
    refused(
        rf"faces must index vertices 0\.\.3; face 1 is .*, {shown}\]",
        faces=[[0, 1, 2], [0, 1, index]],
    )


@pytest.mark.parametrize(("entry", "shown"), [(1.5, r"1\.5"), (float("nan"), "nan")])
def test_a_fraction_is_no_index(entry, shown):
    refused(
        rf"faces must be whole numbers; face 1 is \[0\.0, 1\.0, {shown}\]",
        faces=[[0, 1, 2], [0, 1, entry]],
    )


@pytest.mark.parametrize("empty", [[], np.empty((0, 3)), np.empty((3, 0))])
def test_emptiness_is_refused(empty):
    refused("A mesh must have vertices; it has none", vertices=empty)
    refused("A mesh must have faces; it has 4 vertices and no face", faces=empty)


@pytest.mark.parametrize("name", ["vertices", "faces"])
@pytest.mark.parametrize(
    ("value", "fact"),
    [
        ([[0, 1, 2], [0, 1]], "the rows differ in length"),
        (np.zeros((3, 5), dtype=int), r"the shape is \(3, 5\)\. Transpose it\."),
        (np.zeros((5, 2), dtype=int), r"the shape is \(5, 2\)\.$"),
        (np.zeros((5, 4), dtype=int), r"the shape is \(5, 4\)\.$"),
        (np.zeros(3, dtype=int), r"the shape is \(3,\)"),
        (np.zeros((2, 3, 3), dtype=int), r"the shape is \(2, 3, 3\)"),
        (np.array(None), r"the shape is \(\)"),
    ],
)
def test_other_shapes_are_refused(name, value, fact):
    refused(rf"{name} must have shape \(n, 3\); {fact}", **{name: value})


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (np.zeros((3, 3), dtype=complex), "complex128"),
        (np.zeros((3, 3), dtype=bool), "bool"),
        ([["0", "1", "2"]], "<U1"),
        ([[0, 1, None]], "object"),
    ],
)
def test_other_types_are_refused(value, kind):
    refused(rf"vertices must be real numbers; the type is {kind}", vertices=value)
    refused(rf"faces must be integers; the type is {kind}", faces=value)


def test_coordinates_beyond_floats_are_refused():
    vertices = np.array(CORNERS, dtype=np.longdouble)
    vertices[2, 0] = np.longdouble("1e400")
    refused(r"vertices must be finite; vertex 2 is \[inf, 1\.0, 0\.0\] \(1 such\)", vertices)


def test_whole_numbers_of_mixed_types_are_refused_by_value():
    huge = np.array([[np.int64(0), 1, 2**70]], dtype=object)
    refused(rf"faces must index vertices 0\.\.3; face 0 is \[.*, {2**70}\]", faces=huge)


@pytest.mark.parametrize("size", [1e300, 1e-300, 5e-324])
def test_any_finite_size_is_a_mesh(size):
    np.testing.assert_array_equal(
        TriangleMesh(np.array(CORNERS) * size, FACE).vertices, np.array(CORNERS) * size
    )
