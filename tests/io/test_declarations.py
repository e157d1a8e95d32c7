"""What meshio would believe, wait for or lose: refused before it sees the file."""

import struct

import meshio
import numpy as np
import pytest
from test_shape_files import CUBE, CURVE, POLYDATA

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io.pcd import parse as parse_pcd
from eigenshape.io.shape_files import read_shape

PLACES = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
GMSH_2 = (
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n9 0 0 1\n$EndNodes\n"
    "$Elements\n2\n1 4 2 0 0 1 2 3 9\n2 15 2 0 0 1\n$EndElements\n"
)
GMSH_4 = (
    '$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 "all"\n$EndPhysicalNames\n'
    f"$Nodes\n1 4 1 9\n3 1 0 4\n1\n2\n3\n9\n{PLACES}$EndNodes\n"
    "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 9\n$EndElements\n"
)
MEDIT = (
    f"MeshVersionFormatted 2\nDimension 3\nVertices\n4\n{PLACES.replace(chr(10), ' 0' + chr(10))}"
    "Tetrahedra\n1\n1 2 3 4 0\nRidges\n1\n7\nEnd\n"
)
PIECE = (
    '<Piece NumberOfPoints="4" NumberOfCells="1"><Points><DataArray type="Float64" NumberOfComponents="3" '
    f'format="ascii">{PLACES}</DataArray></Points><Cells>'
    '<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>'
    '<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>'
    '<DataArray type="Int64" Name="types" format="ascii">10</DataArray></Cells></Piece>'
)
XML = (
    '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">'
    f"<UnstructuredGrid>{PIECE}</UnstructuredGrid></VTKFile>\n"
)
LEGACY = (
    f"# vtk DataFile Version 4.2\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n{PLACES}"
    "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"
)
WHOLE = {"a.msh": GMSH_2, "b.msh": GMSH_4, "a.mesh": MEDIT, "a.vtu": XML, "a.vtk": LEGACY}


@pytest.mark.parametrize("name", WHOLE)
def test_whole_files_give_one_tetrahedron(tmp_path, name):
    (tmp_path / name).write_text(WHOLE[name])
    found = read_shape(tmp_path / name)
    assert found.simplices.tolist() == [[0, 1, 2, 3]]
    assert found.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


@pytest.mark.parametrize(
    ("name", "change", "match"),
    [
        # Tags that meshio takes for other nodes, tables as long as the largest tag, points from unused memory.
        (
            "a.msh",
            ("\n1 0 0 0", "\n0 0 0 0"),
            r"tags of a gmsh file must lie in 1\.\.10000000; they go from 0 to 9",
        ),
        ("a.msh", ("\n9 0 0 1", "\n3 0 0 1"), "must have tags of their own; 2 have the tag 3"),
        ("a.msh", ("9 ", "2000000000 "), "they go from 1 to 2000000000"),
        ("b.msh", ("9\n0 0 0", "4000000000\n0 0 0"), "they go from 1 to 4000000000"),
        ("b.msh", ("1 4 1 9", "1 7 1 9"), "it declares 7 nodes and holds 4"),
        ("b.msh", ("3 1 0 4\n1", "3 1 0 -4\n1"), "a block declares -4 nodes"),
        ("b.msh", ("3 1 0 4\n1", "3 1 0 3\n1"), "it declares 20 words of nodes and holds 24"),
        ("b.msh", ("3 1 0 4\n1", "3 1 0 x\n1"), "a number is missing, or not whole"),
        (
            "b.msh",
            ("$Elements\n1 1 1 1", "$Elements\n1 2 1 1"),
            "it declares 2 cells, of which meshio reads 1",
        ),
        ("a.msh", ("$Elements\n2", "$Elements\n1"), "it declares 1 elements and holds 2"),
        ("a.msh", ("$Nodes\n4", "$Nodes\n5"), "it declares 20 words of nodes and holds 16"),
        (
            "a.msh",
            ("2.2 0 8", "4.0 0 8"),
            r"must be of version 2\.2 or 4\.1; its format is '4\.0 0 8'",
        ),
        (
            "a.msh",
            ("$Elements", "$Nodes\n0\n$EndNodes\n$Elements"),
            "must have one section Nodes; it has 2",
        ),
        ("a.msh", ("$EndMeshFormat", "$EndFormat"), r"must be whole; it has no \$EndMeshFormat"),
        # A count that meshio passes over line by line, for days.
        (
            "a.mesh",
            ("Ridges\n1", "Ridges\n1000000000000"),
            "must hold the lines it declares; '1000000000000' do not",
        ),
        # Endless loops, and cells of which meshio keeps those of the last piece alone.
        (
            "a.vtu",
            (PIECE, PIECE + PIECE),
            "must hold one piece; it holds 2 that have cells. Merge them first",
        ),
        (
            "a.vtu",
            ('Name="types"', 'Name="faces"'),
            "must have connectivity, offsets and types; it has connectivity, offsets, faces",
        ),
        (
            "a.vtu",
            ('version="0.1"', 'version="0.1" header_type="Int32"'),
            "must be UInt32 or UInt64; it is 'Int32'",
        ),
        (
            "a.vtu",
            ('Cells="1"', 'Cells="x"'),
            r"pieces that count points and cells; the counts are \[\('4', 'x'\)\]",
        ),
        ("a.vtu", (">10<", ">13<"), "must be simplices, quads or polylines; it holds wedge"),
        # A grid of any size in a few bytes.
        (
            "a.vtk",
            ("UNSTRUCTURED_GRID", "STRUCTURED_POINTS"),
            "UNSTRUCTURED_GRID or POLYDATA; its line is 'DATASET STRUCTURED_POINTS'",
        ),
        ("a.vtk", ("DATASET UNSTRUCTURED_GRID\n", ""), "its line is 'POINTS 4 double'"),
        (
            "a.vtk",
            (f"POINTS 4 double\n{PLACES}", ""),
            "A VTK file must have a section POINTS; it has none",
        ),
    ],
)
def test_what_meshio_would_get_wrong_is_named(tmp_path, capfd, name, change, match):
    assert change[0] in WHOLE[name]
    (tmp_path / name).write_text(WHOLE[name].replace(*change))
    with pytest.raises(FileFormatError, match=rf"{name}:? .*{match}"):
        read_shape(tmp_path / name)
    assert capfd.readouterr() == ("", "")


def test_a_binary_gmsh_file_that_declares_more_nodes_than_it_holds(tmp_path):
    path = tmp_path / "a.msh"
    meshio.write_points_cells(path, CUBE.points, [("tetra", CUBE.simplices)], file_format="gmsh")
    whole = path.read_bytes()
    assert read_shape(path).n_points == CUBE.n_points
    start = whole.index(b"$Nodes\n") + 7
    counts = struct.unpack_from("<4Q", whole, start)
    assert counts[1] == CUBE.n_points
    path.write_bytes(whole[: start + 8] + struct.pack("<Q", 30) + whole[start + 16 :])
    with pytest.raises(FileFormatError, match=f"it declares 30 nodes and holds {CUBE.n_points}"):
        read_shape(path)
    path.write_bytes(whole[: start + 44] + struct.pack("<Q", 2**62) + whole[start + 52 :])
    with pytest.raises(FileFormatError, match=f"a block declares {2**62} nodes"):
        read_shape(path)


def test_a_binary_medit_file_reads_by_any_name_and_must_have_its_end(tmp_path):
    path = tmp_path / "a.meshb"
    meshio.write_points_cells(path, CUBE.points, [("tetra", CUBE.simplices)], file_format="medit")
    np.testing.assert_array_equal(read_shape(path).simplices, CUBE.simplices)
    whole = path.read_bytes()
    (tmp_path / "a.bin").write_bytes(whole)
    assert read_shape(tmp_path / "a.bin", file_format="meshb").n_simplices == CUBE.n_simplices
    path.write_bytes(whole[: whole.rindex(struct.pack("<i", 54))])
    with pytest.raises(
        FileFormatError, match=r"a\.meshb must be whole; meshio says '.*End-of-file"
    ):
        read_shape(path)


@pytest.mark.parametrize(
    ("kind", "change", "match"),
    [
        ("text", (b"2 0 1", b"2 0 1.7"), r"must be whole numbers; number 2 is 1\.7"),
        ("text", (b"2 0 1", b"2 0 1e300"), r"must be whole numbers; number 2 is 1e\+300"),
        ("text", (b"1 0 0\n", b"1_0 0 0\n"), "must hold 12 numbers at byte"),
        ("text", (b"LINES 2 7\n", b"LINES 1 7\n"), "must fill 7 numbers; 1 cells fill 3"),
        ("text", (b"LINES 2 7\n2 0 1\n3 1 2 3", b"POLYGONS 1 3\n2 0 1"), r"3 points or more; cell 0 has 2"),
        ("text", (b"POINT_DATA", b"LINES 1 3\n2 2 3\nPOINT_DATA"), "must have one section LINES; it has two"),
        ("version 5", (b"OFFSETS vtktypeint64", b"OFFSETS"), "they are b''"),
        ("version 5", (b"0 2 5", b"3 2 5"), r"must rise from 0 to 5; they are \[3, 2, 5\]"),
    ],
)  # fmt: skip
def test_polydata_that_would_lose_cells_is_named(tmp_path, kind, change, match):
    assert change[0] in POLYDATA[kind]
    (tmp_path / "a.vtk").write_bytes(POLYDATA[kind].replace(*change))
    with pytest.raises(FileFormatError, match=rf"a\.vtk: .*{match}"):
        read_shape(tmp_path / "a.vtk")


def test_fields_of_several_values_before_the_coordinates():
    head = "FIELDS fpfh x y z\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 3 1 1 1\nPOINTS 1\nDATA ascii\n"
    assert parse_pcd(f"{head}9 9 9 1 2 3\n".encode()).tolist() == [[1, 2, 3]]
    assert parse_pcd(f"{head}9 9 nan 1 2 3\n".encode()).tolist() == [[1, 2, 3]]
    with pytest.raises(
        FileFormatError, match="A point must have all fields and no more; line 7 is '9 9 9 1 2 3 4'"
    ):
        parse_pcd(f"{head}9 9 9 1 2 3 4\n".encode())


def test_polylines_of_obj_files(tmp_path):
    rows = "".join(f"v {x} {y} {z}\n" for x, y, z in CURVE)
    (tmp_path / "a.obj").write_text(f"{rows}l 1 2/7 -2\nl 3 4\n")
    found = read_shape(tmp_path / "a.obj")
    assert isinstance(found, SimplicialMesh)
    assert found.simplices.tolist() == [[0, 1], [1, 2], [2, 3]]
    (tmp_path / "a.obj").write_text(f"{rows}l 1 2\nf 1 2 3\n")
    assert isinstance(read_shape(tmp_path / "a.obj"), TriangleMesh)
    (tmp_path / "a.obj").write_text(f"{rows}l 1\n")
    with pytest.raises(
        FileFormatError, match="A polyline must have two points or more; line 5 is '1'"
    ):
        read_shape(tmp_path / "a.obj")
