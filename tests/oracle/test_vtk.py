"""VTK's own writers, in each of their forms, against our readers."""

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter, vtkUnstructuredGridWriter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from eigenshape import SimplicialMesh, TriangleMesh, read_mesh, read_shape
from eigenshape.shapes.domains import box
from eigenshape.shapes.spheres import icosphere

CUBE = box(4, 3, 2)
GRID = pv.UnstructuredGrid({10: CUBE.simplices}, CUBE.points)
BALL = icosphere(3)
MODES = {"ascii": 0, "binary": 1, "appended": 2}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("compressor", ["none", "zlib", "lzma"])
@pytest.mark.parametrize("encoded", [True, False])
@pytest.mark.parametrize("header", [32, 64])
@pytest.mark.parametrize("order", ["little", "big"])
def test_every_form_of_vtu(tmp_path, mode, compressor, encoded, header, order):
    path = tmp_path / "a.vtu"
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(with_data(GRID))
    writer.SetDataMode(MODES[mode])
    writer.SetEncodeAppendedData(encoded)
    writer.SetCompressorType({"none": 0, "zlib": 1, "lzma": 3}[compressor])
    writer.SetBlockSize(4096)
    writer.SetHeaderType(header)
    (writer.SetByteOrderToLittleEndian if order == "little" else writer.SetByteOrderToBigEndian)()
    assert writer.Write()
    found = read_shape(path)
    assert isinstance(found, SimplicialMesh)
    np.testing.assert_array_equal(found.simplices, CUBE.simplices)
    np.testing.assert_allclose(found.points, CUBE.points, rtol=1e-6)


def with_data(dataset):
    """Add arrays that nobody reads."""
    copy = dataset.copy()
    copy.point_data["heat"] = np.arange(copy.n_points, dtype=float)
    copy.cell_data["label"] = np.arange(copy.n_cells)
    return copy


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("version", [42, 51])
def test_legacy_grids_surfaces_and_strips(tmp_path, binary, version):
    ball = pv.PolyData.from_regular_faces(BALL.vertices, BALL.faces)
    strips = ball.strip()
    assert strips.n_strips
    shapes = {"grid": GRID, "ball": ball, "strips": strips}
    for name, shape in shapes.items():
        writer = vtkPolyDataWriter() if name != "grid" else vtkUnstructuredGridWriter()
        writer.SetFileName(str(tmp_path / f"{name}.vtk"))
        writer.SetInputData(with_data(shape) if name != "strips" else shape)
        (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
        writer.SetFileVersion(version)
        assert writer.Write()
    found = read_shape(tmp_path / "grid.vtk")
    np.testing.assert_array_equal(found.simplices, CUBE.simplices)
    for name in ("ball", "strips"):
        surface = read_mesh(tmp_path / f"{name}.vtk")
        assert isinstance(surface, TriangleMesh)
        np.testing.assert_allclose(surface.vertices, BALL.vertices, atol=1e-6)
        assert turned(surface.faces) == turned(BALL.faces)


def turned(faces):
    """Return the faces as a set, each begun with its lowest corner."""
    return {tuple(np.roll(face, -int(np.argmin(face))).tolist()) for face in faces}


def test_quads_of_a_grid_become_triangles(tmp_path):
    sheet = pv.Plane(i_resolution=4, j_resolution=3)
    sheet.cast_to_unstructured_grid().save(tmp_path / "a.vtu")
    sheet.save(tmp_path / "a.vtk")
    for name in ("a.vtu", "a.vtk"):
        mesh = read_mesh(tmp_path / name)
        assert mesh.n_faces == 24
