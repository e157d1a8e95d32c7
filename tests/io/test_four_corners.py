"""Polygons of four corners in legacy VTK files: quads or tetrahedra, told from how they join, or asked for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lapy import TetMesh

from eigenshape import (
    FileFormatError,
    InvalidParameterError,
    SimplicialMesh,
    TriangleMesh,
    read_mesh,
    read_shape,
)
from eigenshape.io.formats.cells import four_cornered, require_kind
from eigenshape.io.formats.obj import parse as parse_obj
from eigenshape.shapes.domains import box

CUBE = box(3, 2, 2)


def grid(n, height):
    """Return a sheet of n by n quads, bent by `height`."""
    x, y = (
        part.ravel() for part in np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    )
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    points = np.column_stack([x, y, height * np.sin(x + 0.3 * y * y)])
    return points, np.column_stack([first, first + 1, first + n + 2, first + n + 1])


def write_polygons(path, points, polygons):
    rows = [" ".join(map(repr, row)) for row in points.tolist()]
    cells = [f"{len(row)} {' '.join(map(str, row))}" for row in polygons.tolist()]
    text = [
        "# vtk DataFile Version 3.0",
        "any",
        "ASCII",
        "DATASET POLYDATA",
        f"POINTS {len(points)} double",
        *rows,
    ]
    path.write_text("\n".join([*text, f"POLYGONS {len(cells)} {5 * len(cells)}", *cells]) + "\n")
    return path


def test_tetrahedra_that_lapy_writes_come_back_as_tetrahedra(tmp_path):
    TetMesh(CUBE.points, CUBE.simplices).write_vtk(str(tmp_path / "a.vtk"))
    found = read_shape(tmp_path / "a.vtk")
    assert isinstance(found, SimplicialMesh)
    np.testing.assert_array_equal(found.simplices, CUBE.simplices)
    np.testing.assert_allclose(found.points, CUBE.points, rtol=1e-7)
    with pytest.raises(
        FileFormatError,
        match=r"must hold triangles in R\^3; it holds .* tetrahedra in R\^3, which read",
    ):
        read_mesh(tmp_path / "a.vtk")


@pytest.mark.parametrize("height", [0.0, 0.4])
def test_quads_come_back_as_triangles(tmp_path, height):
    points, quads = grid(4, height)
    found = read_shape(write_polygons(tmp_path / "a.vtk", points, quads))
    assert isinstance(found, TriangleMesh)
    assert found.n_faces == 2 * len(quads)
    assert found.faces[:2].tolist() == [quads[0, :3].tolist(), quads[0, [0, 2, 3]].tolist()]


def test_where_it_could_be_either_the_caller_says_it(tmp_path):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    path = write_polygons(tmp_path / "a.vtk", corners, np.array([[0, 1, 2, 3]]))
    message = r"a\.vtk: Polygons of four corners .* these 1 could be either; .* cells=\"quads\" or cells=\"tetrahedra\""
    with pytest.raises(FileFormatError, match=message):
        read_shape(path)
    assert read_shape(path, cells="tetrahedra").simplices.tolist() == [[0, 1, 2, 3]]
    assert read_shape(path, cells="quads").faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert read_mesh(path, cells="quads").n_faces == 2
    with pytest.raises(
        InvalidParameterError,
        match="cells must be triangles, quads, tetrahedra or None; it is 'hexes'",
    ):
        require_kind("hexes")
    with pytest.raises(
        FileFormatError, match="read with cells='triangles' must hold triangles; it holds quads"
    ):
        read_shape(path, cells="triangles")


def test_the_ring_of_three_that_is_a_sphere_of_quads_and_three_tetrahedra_is_asked_about():
    points = np.array([[0.0, 0, 1], [0, 0, -1], [1, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0]])
    assert four_cornered(points, np.array([[0, 2, 1, 3], [0, 3, 1, 4], [0, 4, 1, 2]])) is None


@settings(max_examples=60, deadline=None)
@given(n=st.tuples(*[st.integers(1, 4)] * 3), seed=st.integers(0, 2**32 - 1))
def test_no_tetrahedra_in_any_order_of_corners_are_taken_for_quads(n, seed):
    rng = np.random.default_rng(seed)
    shape = box(*n)
    cells = rng.permuted(shape.simplices, axis=1)
    points = shape.points + rng.uniform(-0.02, 0.02, size=shape.points.shape)
    assert four_cornered(points, cells) in ("tetrahedra", None)
    assert four_cornered(points, cells) == "tetrahedra" or min(n) == 1


@settings(max_examples=60, deadline=None)
@given(n=st.integers(2, 7), seed=st.integers(0, 2**32 - 1), rolled=st.integers(0, 3))
def test_no_quads_are_taken_for_tetrahedra(n, seed, rolled):
    rng = np.random.default_rng(seed)
    points, quads = grid(n, 0.5)
    keep = rng.random(len(quads)) < 0.8  # with holes
    assert four_cornered(points, np.roll(quads[keep], rolled, axis=1)) in ("quads", None)
    assert four_cornered(points, quads) == "quads"


def test_no_cells_and_cells_beyond_the_points_are_left_to_who_makes_the_mesh():
    assert four_cornered(np.zeros((1, 3)), np.empty((0, 4), dtype=int)) == "quads"
    assert four_cornered(np.zeros((1, 3)), np.array([[0, 1, 2, 3]])) == "quads"


@pytest.mark.data
def test_quads_of_a_real_surface(data, tmp_path):
    text = (data / "nasty" / "geometrycentral" / "moebius.obj").read_bytes()
    lines = [line.split()[1:] for line in text.decode().splitlines() if line.startswith("f ")]
    quads = np.array(
        [[int(word.split("/")[0]) - 1 for word in line] for line in lines if len(line) == 4]
    )
    assert len(quads) == len(lines) == 224
    assert four_cornered(parse_obj(text)[0], quads) == "quads"
