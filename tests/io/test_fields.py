"""Functions on vertices and faces, written and read back, also by other libraries and from their files."""

import meshio
import numpy as np
import pytest
import pyvista
import vtk

import eigenshape as es
from eigenshape import FileFormatError, InvalidParameterError, InvalidShapeError
from eigenshape.io import read_fields, write_fields

BALL = es.icosphere(1)
FIELDS = {
    "height": BALL.vertices[:, 2],
    "move": BALL.vertices.astype(np.float32),
    "part": np.arange(BALL.n_faces, dtype=np.int32),
    "flag": BALL.vertices[:, 0] > 0,
    "a <b> & 'c'": np.arange(BALL.n_vertices, dtype=np.uint8),
    "half": np.ones(BALL.n_faces, np.float16),
}


@pytest.mark.parametrize("suffix", [".vtu", ".vtk", ".npz"])
def test_fields_read_back(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write_fields(BALL, path, FIELDS)
    mesh, found = es.read_mesh(path), read_fields(path)
    np.testing.assert_array_equal(mesh.vertices, BALL.vertices)
    np.testing.assert_array_equal(mesh.faces, BALL.faces)
    assert len(found) == len(FIELDS)
    for (name, values), read in zip(
        sorted(FIELDS.items()), [found[k] for k in sorted(found)], strict=True
    ):
        np.testing.assert_array_equal(read, values, err_msg=name)
        assert not read.flags.writeable
    es.write_mesh(BALL, path)
    assert read_fields(path) == {}
    np.testing.assert_array_equal(es.read_mesh(path).faces, BALL.faces)


@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_pyvista_and_meshio_read_them(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    fields = {name: FIELDS[name] for name in ("height", "move", "part")}
    write_fields(BALL, path, fields)
    grid = pyvista.read(path)
    np.testing.assert_array_equal(grid.points, BALL.vertices)
    np.testing.assert_array_equal(grid.point_data["height"], FIELDS["height"])
    np.testing.assert_array_equal(grid.point_data["move"], FIELDS["move"])
    np.testing.assert_array_equal(grid.cell_data["part"], FIELDS["part"])
    if suffix == ".vtu":
        other = meshio.read(path)
        np.testing.assert_array_equal(other.point_data["height"], FIELDS["height"])


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("suffix", [".vtu", ".vtk"])
def test_we_read_those_of_pyvista(tmp_path, suffix, binary):
    surface = es.io.to_pyvista(BALL)
    surface.point_data["height"] = FIELDS["height"]
    surface.point_data.active_scalars_name = "height"
    surface.point_data["move"] = FIELDS["move"]
    surface.cell_data["part"] = FIELDS["part"]
    surface.compute_normals(inplace=True)
    path = tmp_path / f"a{suffix}"
    (surface.cast_to_unstructured_grid() if suffix == ".vtu" else surface).save(path, binary=binary)
    found = read_fields(path)
    for name in ("height", "move", "part"):
        np.testing.assert_allclose(found[name], FIELDS[name], rtol=1e-6)
    # PyVista gives normals to points and cells under one name.
    assert found["Normals"].shape == (BALL.n_vertices, 3)
    assert found["face_Normals"].shape == (BALL.n_faces, 3)


@pytest.mark.parametrize("binary", [True, False])
def test_numbers_of_points_of_vtk_are_read(tmp_path, binary):
    surface = es.io.to_pyvista(BALL)
    numbers = vtk.vtkIdTypeArray()
    numbers.SetName("origin")
    for number in range(BALL.n_vertices):
        numbers.InsertNextValue(7 * number)
    surface.GetPointData().AddArray(numbers)
    surface.save(tmp_path / "a.vtk", binary=binary)
    assert b"vtkIdType" in (tmp_path / "a.vtk").read_bytes()
    found = read_fields(tmp_path / "a.vtk")["origin"]
    np.testing.assert_array_equal(found, 7 * np.arange(BALL.n_vertices))


def test_legacy_sections_of_other_writers(tmp_path):
    head = "# vtk DataFile Version 2.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n"
    data = "POLYGONS 1 4\n3 0 1 2\nPOINT_DATA 3\nSCALARS heat double\nLOOKUP_TABLE default\n1 2 3\n"
    data += "VECTORS flow float\n1 0 0 0 1 0 0 0 1\nCELL_DATA 1\nSCALARS part int 1\nLOOKUP_TABLE default\n7\n"
    (tmp_path / "a.vtk").write_text(head + data)
    found = read_fields(tmp_path / "a.vtk")
    assert found["heat"].tolist() == [1, 2, 3]
    assert found["flow"].tolist() == np.eye(3).tolist()
    assert found["part"].tolist() == [7]


def test_polygons_in_npz_files(tmp_path):
    x, y = [0, 3, 3, 1, 1, 0], [0, 0, 1, 1, 3, 3]
    points = np.column_stack([x, y, np.zeros(6)])
    faces = [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0]]
    fields = {"face_part": [4, 5], "vertex_heat": x}
    np.savez(tmp_path / "a.npz", vertices=points, faces=faces, **fields)
    mesh, attributes = es.read_mesh(tmp_path / "a.npz", attributes=True)
    assert mesh.n_faces == 2 * 4
    assert es.geometry.surface_area(mesh) == 2 * 5.0
    assert attributes.fields["part"].tolist() == [4, 4, 4, 4, 5, 5, 5, 5]
    assert attributes.fields["heat"].tolist() == x
    np.savez(tmp_path / "a.npz", vertices=points, faces=[[0, 1, 2, 3], [0, 1, 2, -1]])
    with pytest.raises(InvalidShapeError, match=r"must index vertices 0\.\.5; face \d is .*-1"):
        es.read_mesh(tmp_path / "a.npz")


def test_what_is_no_field_is_refused(tmp_path):
    with pytest.raises(InvalidParameterError, match="42 vertices or 80 faces; 'heat' has 3"):
        write_fields(BALL, tmp_path / "a.vtu", {"heat": [1, 2, 3]})
    with pytest.raises(
        InvalidParameterError, match="must be lists or tables of numbers; 'name' is <U1"
    ):
        write_fields(BALL, tmp_path / "a.vtu", {"name": ["x"] * 42})
    with pytest.raises(FileFormatError, match=r"known format, \.vtu, .*\.mgz; it is '\.ply'"):
        write_fields(BALL, tmp_path / "a.ply", {})
    for arrays, message in (
        ({"vertices": BALL.vertices}, "it lacks faces"),
        (
            {"vertices": BALL.vertices, "faces": BALL.vertices},
            r"and faces \(f, 3\), or \(f, k\) of polygons, of whole numbers",
        ),
        ({"vertices": np.array([None])}, "must hold arrays of numbers; Object arrays"),
    ):
        np.savez(tmp_path / "a.npz", **arrays)
        with pytest.raises(FileFormatError, match=message):
            es.read_mesh(tmp_path / "a.npz")
    (tmp_path / "a.npz").write_bytes(b"PK\x03\x04")
    with pytest.raises(FileFormatError, match=r"a\.npz: A \.npz file must hold arrays of numbers"):
        es.read_mesh(tmp_path / "a.npz")
    np.savez_compressed(tmp_path / "a.npz", vertices=np.zeros(2**23), faces=np.zeros(3))
    with pytest.raises(
        FileFormatError, match="must unpack to at most 40 times the size of its file"
    ):
        es.read_mesh(tmp_path / "a.npz")


@pytest.mark.parametrize(
    "mesh",
    [
        es.SimplicialMesh(BALL.vertices, np.arange(40).reshape(10, 4)),
        es.SimplicialMesh(BALL.vertices, np.arange(42).reshape(21, 2)),
    ],
    ids=["tetrahedra", "segments"],
)
def test_other_cells_than_triangles_go_to_vtu(tmp_path, mesh):
    path = tmp_path / "a.vtu"
    values = np.arange(float(mesh.n_simplices))
    write_fields(mesh, path, {"volume": values})
    found = es.read_shape(path)
    np.testing.assert_array_equal(found.points, mesh.points)
    np.testing.assert_array_equal(found.simplices, mesh.simplices)
    np.testing.assert_array_equal(read_fields(path)["volume"], values)
    (block,) = meshio.read(path).cells
    assert block.type == {4: "tetra", 2: "line"}[mesh.simplices.shape[1]]
    for suffix in (".vtk", ".npz"):
        with pytest.raises(FileFormatError, match=r"hold triangles in R\^3.*Write it to \.vtu"):
            write_fields(mesh, tmp_path / f"a{suffix}", {})
