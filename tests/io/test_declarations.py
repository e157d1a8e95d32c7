"""What other readers would believe, wait for or lose, and what is not as a file declares it."""

import struct

import meshio
import numpy as np
import pytest
from test_shape_files import CUBE, CURVE, POLYDATA

from certeig.kit.errors import FileFormatError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io.formats.pcd import parse as parse_pcd
from eigenshape.io.shape_files import read_shape

PLACES = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
GMSH_2 = (
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n9 0 0 1\n$EndNodes\n"
    "$Elements\n2\n1 4 2 0 0 1 2 3 9\n2 15 2 0 0 1\n$EndElements\n"
)
GMSH_4 = (
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
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
        # Tags that meshio takes for other nodes, and points that it takes from unused memory.
        (
            "a.msh",
            ("\n1 0 0 0", "\n0 0 0 0"),
            "Node tags of a gmsh file must be 1 or more; the least is 0",
        ),
        (
            "a.msh",
            ("\n1 0 0 0", "\n1.5 0 0 0"),
            r"Node tags of a gmsh file must be whole numbers; number 0 is 1\.5",
        ),
        (
            "a.msh",
            ("\n9 0 0 1", "\n3 0 0 1"),
            "Node tags of a gmsh file must differ; 3 occurs twice",
        ),
        ("a.msh", ("9 0 0 1", "2000000000 0 0 1"), "must join its nodes; no node has the tag 9"),
        ("a.msh", ("0 0 1 2 3 9", "0 0 1 2 3 7"), "must join its nodes; no node has the tag 7"),
        ("a.msh", ("0 0 1 2 3 9", "0 0 1 2 3 0"), "must join its nodes; no node has the tag 0"),
        ("b.msh", ("1 4 1 9", "1 7 1 9"), "it declares 7 nodes and holds 4"),
        ("b.msh", ("3 1 0 4\n1", "3 1 0 -4\n1"), "-4 items at byte .* do not fit into its"),
        ("b.msh", ("3 1 0 4\n1", "3 1 0 3\n1"), "more follows after the last that is declared"),
        (
            "b.msh",
            ("3 1 0 4\n1", "3 1 0 x\n1"),
            "A gmsh file must hold .* numbers at byte .*; it does not: .*b'x'",
        ),
        (
            "b.msh",
            ("3 1 0 4\n1", "3 1 0 4_\n1"),
            "A gmsh file must hold .* numbers at byte .*; it does not: numbers have no underscores",
        ),
        (
            "b.msh",
            ("$Elements\n1 1 1 1", "$Elements\n1 2 1 1"),
            "it declares 2 elements and holds 1",
        ),
        (
            "b.msh",
            ("3 1 4 1\n", "3 1 34 1\n"),
            r"it holds elements of gmsh's type 34\. Save it with simplices, or with straight sides",
        ),
        ("a.msh", ("1 4 2 0 0", "1 34 2 0 0"), r"it holds elements of gmsh's type 34\. Save it"),
        ("a.msh", ("$Elements\n2", "$Elements\n1"), "more follows after the last of 1 elements"),
        ("a.msh", ("$Elements\n2", "$Elements\n3"), "element 2 of 3 is not whole"),
        ("a.msh", ("2 15 2 0 0 1", "2 15 9 0 0 1"), "element 1 of 2 is not whole"),
        ("a.msh", ("$Nodes\n4", "$Nodes\n5"), "20 items at byte .* do not fit into its"),
        (
            "a.msh",
            ("2.2 0 8", "5.0 0 8"),
            r"must be of version 2 or 4; its format is '5\.0 0 8'\. Save it anew, as gmsh a\.msh -save",
        ),
        (
            "a.msh",
            ("2.2 0 8", "2.2 1 8"),
            r"must have the order of bytes of this machine\. Save it anew as text",
        ),
        (
            "a.msh",
            ("$Elements", "$Nodes\n0\n$EndNodes\n$Elements"),
            "must have one section Nodes; it has 2",
        ),
        ("a.msh", ("$EndMeshFormat", "$EndFormat"), r"must be whole; it has no \$EndMeshFormat"),
        (
            "a.mesh",
            ("Tetrahedra", "Tetrahedrons"),
            r"Keywords .* must be known; 'Tetrahedrons' is not\. Leave that sec",
        ),
        (
            "a.mesh",
            ("MeshVersion", "1\nMeshVersion"),
            "A Medit file must begin with a keyword; it begins with '1'",
        ),
        (
            "a.mesh",
            ("Ridges", "Dimension 3\nRidges"),
            "A Medit file must have one section Dimension; it has two",
        ),
        (
            "a.mesh",
            ("Dimension 3", "Dimension 4"),
            r"must have one Dimension of 1 to 3; it has \[4\.0\]",
        ),
        (
            "a.mesh",
            ("MeshVersionFormatted 2\n", ""),
            r"must have one MeshVersionFormatted of 0 to 4; it has \[\]",
        ),
        ("a.mesh", ("Vertices", "Corners"), "A Medit file must have Vertices; it has none"),
        (
            "a.mesh",
            ("Vertices\n4", "Vertices\n5"),
            "Vertices declares 5 rows of 4 numbers and holds 16 numbers",
        ),
        (
            "a.mesh",
            ("Tetrahedra\n1\n1 2 3 4 0", "Tetrahedra"),
            "Tetrahedra declares -1 rows of 5 numbers and holds 0",
        ),
        (
            "a.mesh",
            ("1 2 3 4 0", "1 2 3 4.5 0"),
            r"Tetrahedra must be whole numbers; number 3 is 4\.5",
        ),
        (
            "a.mesh",
            ("1 2 3 4 0", "1 2 3 x 0"),
            "Tetrahedra of a Medit file must be numbers; could not convert .*b'x'",
        ),
        (
            "a.mesh",
            ("Ridges\n1\n7", "Prisms\n1\n1 1 1 1 1 1 0"),
            r"must not be inverted or flat where they are split; wedge 0 with the corners \[0, 0",
        ),
        # Endless loops.
        (
            "a.vtu",
            ('Name="types"', 'Name="faces"'),
            "must have types; they have connectivity, offsets, faces",
        ),
        (
            "a.vtu",
            ('version="0.1"', 'version="0.1" header_type="Int32"'),
            "must be UInt32 or UInt64; it is 'Int32'",
        ),
        (
            "a.vtu",
            ('Cells="1"', 'Cells="x"'),
            "Pieces of a VTK file must count what they hold; NumberOfCells is 'x'",
        ),
        ("a.vtu", (">10<", ">11<"), "A VTK cell of type 11 must have 8 points; cell 0 has 4"),
        # A grid of any size in a few bytes.
        (
            "a.vtk",
            ("UNSTRUCTURED_GRID", "STRUCTURED_POINTS"),
            "must hold an unstructured grid or PolyData; it holds 'STRUCTURED_POINTS'",
        ),
        (
            "a.vtk",
            ("DATASET UNSTRUCTURED_GRID\n", ""),
            "must hold an unstructured grid or PolyData; it holds 'POINTS 4 DOUBLE'",
        ),
        (
            "a.vtk",
            (f"POINTS 4 double\n{PLACES}", ""),
            "A VTK file must have a section POINTS; it has none",
        ),
    ],
)
def test_what_is_not_as_declared_is_named(tmp_path, capfd, name, change, match):
    assert change[0] in WHOLE[name]
    (tmp_path / name).write_text(WHOLE[name].replace(*change))
    with pytest.raises((FileFormatError, InvalidShapeError), match=rf"{name}:? .*{match}"):
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
    with pytest.raises(FileFormatError, match=f"{2**62} items at byte .* do not fit into its"):
        read_shape(path)


def test_a_binary_gmsh_file_of_version_2_whose_blocks_are_not_as_declared(tmp_path):
    path = tmp_path / "a.msh"
    meshio.write_points_cells(path, CUBE.points, [("tetra", CUBE.simplices)], file_format="gmsh22")
    whole = path.read_bytes()
    head = struct.pack("<3i", 4, CUBE.n_simplices, 2)
    assert head in whole
    path.write_bytes(whole.replace(head, struct.pack("<3i", 4, CUBE.n_simplices + 1, 2)))
    with pytest.raises(
        FileFormatError, match=f"a block declares {CUBE.n_simplices + 1} elements with 2 tags each"
    ):
        read_shape(path)


def test_tags_of_gmsh_may_be_of_any_size_and_order(tmp_path):
    for name, change in (("a.msh", ("9", "2000000000")), ("b.msh", ("9", "4000000000"))):
        text = WHOLE[name].replace(*change)
        (tmp_path / name).write_text(
            text.replace("\n1 0 0 0", "\n77 0 0 0").replace("0 0 1 2 3", "0 0 77 2 3")
        )
        assert read_shape(tmp_path / name).simplices.tolist() == [[0, 1, 2, 3]]


def test_medit_passes_over_what_a_shape_does_not_need(tmp_path):
    text = MEDIT.replace("Ridges\n1", "Ridges\n1000000000000").replace(
        "Vertices", "# a comment\nGeometry\nTetrahedra 9 # a name\nVertices", 1
    )
    (tmp_path / "a.mesh").write_text(text.replace("\n", "\r\n"))
    assert read_shape(tmp_path / "a.mesh").simplices.tolist() == [[0, 1, 2, 3]]
    (tmp_path / "a.mesh").write_text(
        MEDIT.replace("Formatted 2", "Formatted 1").replace("1 0 0 0", "0.1 0 0 0")
    )
    assert read_shape(tmp_path / "a.mesh").points[1, 0] == np.float32(0.1)


def medit_binary(version, order="<", *, extra=b""):
    """Write a tetrahedron; `extra` stands before its vertices."""
    whole, position = ("q" if version == 4 else "i"), ("q" if version >= 3 else "i")
    real = "f" if version == 1 else "d"
    pack = lambda layout, *numbers: struct.pack(order + layout, *numbers)  # noqa: E731
    data = pack("iii" + position + "i", 1, version, 3, 0, 3)
    data += extra + pack("i" + position + whole, 4, 0, 4)
    data += b"".join(
        pack(3 * real + whole, *row, 7) for row in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    )
    data += pack("i" + position + whole, 8, 0, 1) + pack(5 * whole, 1, 2, 3, 4, 7)
    return data + pack("i" + position, 54, 0)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_binary_medit_files_of_all_versions(tmp_path, version, order):
    (tmp_path / "a.meshb").write_bytes(medit_binary(version, order))
    found = read_shape(tmp_path / "a.meshb")
    assert found.simplices.tolist() == [[0, 1, 2, 3]]
    assert found.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def test_binary_medit_sections_are_passed_over_by_their_place_or_named(tmp_path):
    path = tmp_path / "a.meshb"
    path.write_bytes(medit_binary(2, extra=struct.pack("<iiii", 13, 36, 1, 5)))  # corners
    assert read_shape(path).n_simplices == 1
    for section, match in (
        (
            (13, 12, 1, 5),
            r"keyword of 1 to 198 and the place of the next section; one has keyword 13 and place 12 of",
        ),
        ((999, 36, 1, 5), "one has keyword 999 and place 36 of"),
        ((24, 36, 1, 5), r"it holds curved cells\. Save it with simplices"),
        ((46, 36, 1, 5), r"it holds polytopes\. Save it with simplices"),
    ):
        path.write_bytes(medit_binary(2, extra=struct.pack("<iiii", *section)))
        with pytest.raises(FileFormatError, match=match):
            read_shape(path)
    path.write_bytes(medit_binary(5))
    with pytest.raises(
        FileFormatError,
        match="A binary Medit file must begin with 1 and a version of 1 to 4; it has",
    ):
        read_shape(path)
    whole = medit_binary(2)
    path.write_bytes(whole[:16] + struct.pack("<i", 4) + whole[20:])
    with pytest.raises(FileFormatError, match="Dimension of a Medit file must be 2 or 3; it is 4"):
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
        FileFormatError, match=r"a\.meshb: .* hold what it declares; 1 items at byte"
    ):
        read_shape(path)


@pytest.mark.parametrize(
    ("kind", "change", "match"),
    [
        ("text", (b"2 0 1", b"2 0 1.7"), r"must be whole numbers; number 2 is 1\.7"),
        ("text", (b"2 0 1", b"2 0 1e300"), r"must be whole numbers; number 2 is 1e\+300"),
        ("text", (b"1 0 0\n", b"1_0 0 0\n"), "must hold 12 numbers at byte"),
        ("text", (b"LINES 2 7\n", b"LINES 1 7\n"), "must hold 1 cells in 7 numbers; 2 cells take 7"),
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
    assert parse_pcd(f"{head}9 9 9 1 2 3\n".encode())[0].tolist() == [[1, 2, 3]]
    assert parse_pcd(f"{head}9 9 nan 1 2 3\n".encode())[0].tolist() == [[1, 2, 3]]
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
