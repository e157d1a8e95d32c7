"""Legacy VTK files: arrays of every type, names with spaces, masks, and values of cells."""

import numpy as np
import pytest
import pyvista as pv
import vtk

import eigenshape as es
from eigenshape import FileFormatError
from eigenshape.io import read_fields, write_fields

HEAD = (
    "# vtk DataFile Version 5.1\nany\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0 1 0 0 0 2 0 0 0 3\n"
    "POLYGONS 5 12\nOFFSETS vtktypeint64\n0 3 6 9 12\nCONNECTIVITY vtktypeint64\n0 2 1 0 1 3 1 2 3 0 3 2\n"
)
ARRAYS = [
    vtk.vtkCharArray, vtk.vtkSignedCharArray, vtk.vtkUnsignedCharArray, vtk.vtkShortArray,
    vtk.vtkUnsignedShortArray, vtk.vtkIntArray, vtk.vtkUnsignedIntArray, vtk.vtkLongArray,
    vtk.vtkUnsignedLongArray, vtk.vtkLongLongArray, vtk.vtkUnsignedLongLongArray, vtk.vtkFloatArray,
    vtk.vtkDoubleArray, vtk.vtkIdTypeArray, vtk.vtkBitArray,
]  # fmt: skip


def read(tmp_path, text):
    (tmp_path / "a.vtk").write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_fields(tmp_path / "a.vtk")


def ball():
    """Return a surface of PyVista with an array of every type, one with names and one of text."""
    surface = pv.Icosphere(nsub=1)
    numbers = np.arange(surface.n_points) % 2
    for kind in ARRAYS:
        array = kind()
        array.SetName(kind.__name__)
        for number in numbers.tolist():
            array.InsertNextTuple1(number)
        surface.GetPointData().AddArray(array)
    texts = vtk.vtkStringArray()
    texts.SetName("texts")
    for number in range(surface.n_points):
        texts.InsertNextValue("" if number == 3 else f"a b {number}\n" * (1 + 9 * (number == 5)))
    surface.GetPointData().AddArray(texts)
    named = vtk.vtkFloatArray()
    named.SetName("named parts")
    named.SetNumberOfComponents(2)
    named.SetNumberOfTuples(surface.n_points)
    named.Fill(0.5)
    for place, name in enumerate(("a b", "POINTS 3 float")):
        named.SetComponentName(place, name)
    surface.GetPointData().AddArray(named)
    surface.field_data["time"] = [0.25]
    surface.field_data["who"] = ["x y", "z"]
    surface.cell_data["é 100%"] = np.arange(surface.n_cells)
    return surface, numbers


@pytest.mark.parametrize("suffix", [".vtk", ".vtp", ".vtu"])
@pytest.mark.parametrize("binary", [True, False])
def test_arrays_of_every_type_are_read(tmp_path, suffix, binary):
    surface, numbers = ball()
    path = tmp_path / f"a{suffix}"
    (surface.cast_to_unstructured_grid() if suffix == ".vtu" else surface).save(path, binary=binary)
    with pytest.warns(UserWarning, match=r"the array 'texts' "):
        fields = read_fields(path)
    for kind in ARRAYS:
        np.testing.assert_array_equal(fields[kind.__name__], numbers, err_msg=kind.__name__)
    np.testing.assert_array_equal(fields["named parts"], np.full((surface.n_points, 2), 0.5))
    np.testing.assert_array_equal(fields["é 100%"], np.arange(surface.n_cells))
    assert es.read_mesh(path).n_faces == surface.n_cells


@pytest.mark.parametrize("suffix", [".vtk", ".vtp"])
@pytest.mark.parametrize("binary", [True, False])
def test_masks_that_are_active_stay(tmp_path, suffix, binary):
    surface = pv.Icosphere(nsub=1)
    label = (np.arange(surface.n_points) % 256).astype(np.uint8)
    mask = surface.points[:, 0] > 0
    surface.point_data["label"] = label
    surface.cell_data["mask"] = np.arange(surface.n_cells) > 9
    surface.point_data["mask"] = mask
    for active in ("label", "mask"):
        surface.point_data.active_scalars_name = active
        surface.cell_data.active_scalars_name = "mask"
        surface.save(tmp_path / f"a{suffix}", binary=binary)
        fields = read_fields(tmp_path / f"a{suffix}")
        np.testing.assert_array_equal(fields["label"], label)
        np.testing.assert_array_equal(fields["mask"], mask)
        np.testing.assert_array_equal(fields["face_mask"], np.arange(surface.n_cells) > 9)


def test_whole_numbers_of_64_bits_are_exact_in_text(tmp_path):
    data = f"POINT_DATA 4\nSCALARS id vtktypeint64\nLOOKUP_TABLE default\n0 1 {2**62 + 1} -{2**62 + 1}\n"
    found = read(tmp_path, HEAD + data)["id"]
    assert found.tolist() == [0, 1, 2**62 + 1, -(2**62) - 1]


def test_every_section_of_data_is_a_field(tmp_path):
    four = "0 1 2 3\n"
    data = (
        f"POINT_DATA 4\nSCALARS plain short\nLOOKUP_TABLE default\n{four}"
        f"SCALARS heat float 1\nLOOKUP_TABLE colors\n{four}LOOKUP_TABLE colors 2\n0 0 0 1 1 1 1 1\n"
        f"NORMALS n float\n{4 * '0 0 1 '}\nVECTORS v float\n{4 * '1 2 3 '}\n"
        f"TEXTURE_COORDINATES uv 2 float\n{4 * '0 1 '}\nTENSORS t float\n{4 * '1 2 3 4 5 6 7 8 9 '}\n"
        f"GLOBAL_IDS ids vtkIdType\n{four}COLOR_SCALARS rgb 3\n{4 * '0 0.5 1 '}\n"
        f"METADATA\nINFORMATION 0\n\nCELL_DATA 4\nFIELD FieldData 1\nmy area 1 4 double\n{four}"
    )
    found = read(tmp_path, HEAD + data)
    shapes = {name: values.shape for name, values in found.items()}
    assert shapes == {
        "plain": (4,), "heat": (4,), "n": (4, 3), "v": (4, 3), "uv": (4, 2), "t": (4, 9), "ids": (4,),
        "rgb": (4, 3), "my area": (4,),
    }  # fmt: skip
    assert found["rgb"][0].tolist() == [0, 128, 255]
    assert found["my area"].tolist() == [0, 1, 2, 3]
    assert found["plain"].dtype == np.int16


def test_what_is_not_known_is_named(tmp_path):
    data = (
        "POINT_DATA 4\nSCALARS h float\nLOOKUP_TABLE default\n0 1 2 3\nMATRICES m float\n1 2 3 4\n"
    )
    with pytest.warns(UserWarning, match=r"a\.vtk: what follows 'MATRICES m float' is not read"):
        assert list(read(tmp_path, HEAD + data)) == ["h"]
    with pytest.raises(
        FileFormatError,
        match=r"must be POINTS, VERTICES, .* or CELL_DATA; one begins with 'POLYGON 4",
    ):
        read(tmp_path, HEAD.replace("POLYGONS 5 12", "POLYGON 4 4"))
    with pytest.raises(FileFormatError, match=r"8 items at byte \d+ do not fit into its"):
        read(tmp_path, f"{HEAD}POINT_DATA 4\nFIELD FieldData 1\ntexts 2 4 string\na\nb\n")
    with pytest.raises(FileFormatError, match=r"must be float, .*; they are b'half'"):
        read(tmp_path, f"{HEAD}POINT_DATA 4\nFIELD FieldData 1\na 1 4 half\n0 0 0 0\n")
    with pytest.raises(FileFormatError, match="by whole numbers; it says b'-3'"):
        read(tmp_path, f"{HEAD}POINT_DATA 4\nFIELD FieldData 1\na -2 -3 float\n0 0 0 0 0 0\n")


def test_names_go_and_come_back_as_they_are(tmp_path):
    mesh = es.icosphere(0)
    names = ["two words", "100%", "%20", "é", 'a "quote"', "under_score", "a/b:c"]
    fields = {name: np.full(12, float(place)) for place, name in enumerate(names)}
    for suffix in (".vtk", ".vtp", ".vtu"):
        write_fields(mesh, tmp_path / f"a{suffix}", fields)
        found = read_fields(tmp_path / f"a{suffix}")
        theirs = pv.read(tmp_path / f"a{suffix}")
        for place, name in enumerate(names):
            assert found[name][0] == place
            assert theirs.point_data[name][0] == place


def test_values_of_curved_and_of_solid_cells(tmp_path):
    """A second-order triangle with points 3 to 5 between corners, and a voxel of six tetrahedra."""
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    grid = pv.UnstructuredGrid({22: np.arange(6)[None]}, points)
    grid.point_data["number"], grid.cell_data["value"] = np.arange(6), [7.0]
    for suffix in (".vtk", ".vtu"):
        grid.save(tmp_path / f"a{suffix}")
        with pytest.warns(UserWarning, match=r"by their corners \(1\), .* left out \(3\)"):
            mesh, attributes = es.read_mesh(tmp_path / f"a{suffix}", attributes=True)
        assert mesh.vertices.tolist() == points[:3].tolist()
        assert attributes.fields["number"].tolist() == [0, 1, 2]
        assert attributes.fields["value"].tolist() == [7]
    voxels = pv.ImageData(dimensions=(3, 2, 2)).cast_to_unstructured_grid()
    voxels.cell_data["value"] = [3, 4]
    voxels.save(tmp_path / "b.vtu")
    with pytest.warns(UserWarning, match="2 hexahedra were split into 12 tetrahedra"):
        assert es.read_shape(tmp_path / "b.vtu").n_simplices == 12
    assert read_fields(tmp_path / "b.vtu")["value"].tolist() == [3] * 6 + [4] * 6


def test_a_curved_cell_that_joins_no_point_is_named(tmp_path):
    text = HEAD.replace("POLYDATA", "UNSTRUCTURED_GRID").split("POLYGONS")[0]
    text += "CELLS 1 7\n6 0 1 2 3 3 9\nCELL_TYPES 1\n22\n"
    with pytest.raises(
        FileFormatError, match="must join its 4 points, counted from 0; cell 0 joins point 9"
    ):
        read(tmp_path, text)
    with pytest.raises(FileFormatError, match="type 22 must have 3 points; cell 0 has 2"):
        read(tmp_path, text.replace("1 7\n6 0 1 2 3 3 9", "1 3\n2 0 1"))
    with pytest.raises(FileFormatError, match="type 7 must have 3 points or more; cell 0 has 2"):
        read(tmp_path, text.replace("1 7\n6 0 1 2 3 3 9", "1 3\n2 0 1").replace("\n22", "\n7"))


def test_values_of_cells_that_could_be_either_stay(tmp_path):
    text = (
        HEAD.partition("POLYGONS")[0] + "POLYGONS 1 5\n4 0 1 2 3\nCELL_DATA 1\nSCALARS part int\n"
    )
    assert read(tmp_path, text + "LOOKUP_TABLE default\n5\n")["part"].tolist() == [5]
