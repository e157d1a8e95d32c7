import struct
import warnings

import meshio
import numpy as np
import pytest

from certeig.kit.errors import CerteigError, FileFormatError, InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io.formats.pcd import decompress
from eigenshape.io.mesh_files import parse_file, read_mesh
from eigenshape.io.opening import SourceFile
from eigenshape.io.shape_files import read_points, read_shape, write_points
from eigenshape.shapes.domains import box, disc

CUBE = box(2, 1, 1)
DISC = disc(2)
CURVE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 5]])


def written(path, points, cells, **options):
    kinds = {".msh": "gmsh", ".mesh": "medit"}
    meshio.write_points_cells(path, points, cells, file_format=kinds.get(path.suffix), **options)
    return path


@pytest.mark.parametrize("suffix", [".mesh", ".msh", ".vtk", ".vtu"])
def test_tetrahedra(tmp_path, suffix):
    path = written(tmp_path / f"a{suffix}", CUBE.points, [("tetra", CUBE.simplices)])
    found = read_shape(path)
    assert isinstance(found, SimplicialMesh)
    np.testing.assert_allclose(found.points, CUBE.points, rtol=1e-15)
    np.testing.assert_array_equal(found.simplices, CUBE.simplices)


@pytest.mark.parametrize("suffix", [".mesh", ".msh", ".vtk", ".vtu"])
def test_a_surface_is_a_triangle_mesh(tmp_path, suffix):
    found = read_shape(written(tmp_path / f"a{suffix}", DISC.vertices, [("triangle", DISC.faces)]))
    assert isinstance(found, TriangleMesh)
    np.testing.assert_array_equal(found.faces, DISC.faces)


def test_of_several_dimensions_the_highest_counts(tmp_path):
    cells = [("triangle", CUBE.simplices[:4, :3]), ("tetra", CUBE.simplices), ("vertex", [[0]])]
    assert (
        read_shape(written(tmp_path / "a.vtu", CUBE.points, cells)).n_simplices == CUBE.n_simplices
    )


BESIDE = (
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
    "$Elements\n2\n1 4 2 0 0 1 2 3 4\n2 2 2 0 0 1 3 2\n$EndElements\n"
)


@pytest.mark.parametrize("suffix", [".mesh", ".msh", ".vtk", ".vtu"])
def test_the_triangles_beside_tetrahedra_are_read_where_they_are_asked_for(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    if suffix == ".msh":
        path.write_text(BESIDE)
    else:
        cells = [("triangle", [[0, 2, 1]]), ("tetra", [[0, 1, 2, 3]])]
        written(path, np.vstack([np.zeros(3), np.eye(3)]), cells)
    with pytest.raises(
        FileFormatError,
        match=r"it holds 1 tetrahedra in R\^3, .* cells=\"triangles\" reads the triangles",
    ):
        read_mesh(path)
    assert read_shape(path).simplices.tolist() == [[0, 1, 2, 3]]
    for read in (read_mesh, read_shape):
        found = read(path, cells="triangles")
        assert isinstance(found, TriangleMesh)
        assert found.faces.tolist() == [[0, 2, 1]]


def test_a_flat_mesh_is_no_triangle_mesh(tmp_path):
    path = written(tmp_path / "a.mesh", DISC.vertices[:, :2], [("triangle", DISC.faces)])
    assert read_shape(path).points.shape[1] == 2
    with pytest.raises(
        FileFormatError, match=r"must hold triangles in R\^3; it holds \d+ triangles in R\^2"
    ):
        read_mesh(path)


def test_a_curve_and_bare_points(tmp_path):
    found = read_shape(written(tmp_path / "a.vtu", CURVE, [("line", [[0, 1], [1, 2], [2, 3]])]))
    assert (found.dim, found.n_simplices) == (1, 3)
    cloud = read_shape(
        written(tmp_path / "b.vtk", CURVE, [("vertex", [[0], [1], [2], [3]])]), dim=1
    )
    assert isinstance(cloud, PointCloud)
    assert cloud.dim == 1


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".msh", ".mesh"])
def test_solids_are_split_into_tetrahedra(tmp_path, suffix):
    corners = [[x, y, z] for z in (0.0, 1.0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    path = written(tmp_path / f"a{suffix}", corners, [("hexahedron", [list(range(8))])])
    with pytest.warns(UserWarning, match="1 hexahedra were split into 6 tetrahedra"):
        solid = read_shape(path)
    assert solid.n_simplices == 6
    assert simplex_volumes(solid).sum() == pytest.approx(1)
    inverted = written(
        tmp_path / f"b{suffix}", corners, [("hexahedron", [[0, 1, 2, 3, 4, 6, 5, 7]])]
    )
    with pytest.raises(
        InvalidShapeError, match=r"b\..* hexahedron 0 with the corners \[0, 1, 2, 3, 4, 6"
    ):
        read_shape(inverted)


POLYDATA = {
    "text": b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0\n1 1 0 2 1 5\n"
    b"LINES 2 7\n2 0 1\n3 1 2 3\nPOINT_DATA 4\nSCALARS a float\n",
    "binary": b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 4 double\n"
    + CURVE.astype(">f8").tobytes()
    + b"\nLINES 2 7\n"
    + np.array([2, 0, 1, 3, 1, 2, 3], ">i4").tobytes()
    + b"\n",
    "version 5": b"# vtk DataFile Version 5.1\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 2 1 5\n"
    b"LINES 3 5\nOFFSETS vtktypeint64\n0 2 5\nCONNECTIVITY vtktypeint64\n0 1 1 2 3\n",
}


@pytest.mark.parametrize("kind", POLYDATA)
def test_polylines(tmp_path, kind):
    (tmp_path / "a.vtk").write_bytes(POLYDATA[kind])
    found = read_shape(tmp_path / "a.vtk")
    assert found.simplices.tolist() == [[0, 1], [1, 2], [2, 3]]
    np.testing.assert_array_equal(found.points, CURVE)


def test_polygons_become_triangles(tmp_path):
    flat = (
        POLYDATA["text"]
        .replace(b"LINES 2 7\n2 0 1\n3 1 2 3", b"POLYGONS 1 5\n4 0 1 3 2")
        .replace(b" 5\nP", b" 0\nP")
    )
    (tmp_path / "a.vtk").write_bytes(flat)
    assert read_shape(tmp_path / "a.vtk").faces.tolist() == [[0, 1, 3], [0, 3, 2]]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (
            (b"LINES 2 7\n2 0 1", b"LINES 2 7\n9 0 1"),
            "A VTK file must hold 2 cells in 7 numbers; 1 cells take 10",
        ),
        ((b"POINTS 4 float", b"POINTS 4000 float"), "12000 items at byte .* do not fit into its"),
        ((b"POINTS 4 float", b"POINTS 8 float"), "A VTK file must hold 24 numbers at byte"),
        (
            (b"POINTS 4 float", b"POINTS 4 half"),
            r"Numbers of a VTK file must be float, .* they are b'half'",
        ),
        (
            (b"LINES 2 7", b"LINES two 7"),
            "A VTK file must count what it holds by whole numbers; it says b'two'",
        ),
        (
            (b"LINES 2 7\n2 0 1\n3 1 2 3\nPOINT_DATA 4\nSCALARS a float\n", b"LINES 2 9\n2 0"),
            "9 items at byte .* do not fit into its",
        ),
        (
            (b"LINES", b"TRIANGLE_STRIPS"),
            "A VTK cell of type 6 must have 3 points or more; cell 0 has 2",
        ),
        ((b"3 1 2 3", b"3 1 2 9"), "must join its 4 points, counted from 0; cell 1 joins point 9"),
    ],
)
def test_broken_polydata_is_named(tmp_path, change, match):
    assert change[0] in POLYDATA["text"]
    (tmp_path / "a.vtk").write_bytes(POLYDATA["text"].replace(*change))
    with pytest.raises(CerteigError, match=match):
        read_shape(tmp_path / "a.vtk")


def test_binary_polydata_that_ends_early(tmp_path):
    (tmp_path / "a.vtk").write_bytes(POLYDATA["binary"][:120])
    with pytest.raises(FileFormatError, match=r"12 items at byte .* do not fit into its"):
        read_shape(tmp_path / "a.vtk")


def test_files_that_lack_cells_or_their_end_are_named(tmp_path):
    path = written(tmp_path / "a.vtk", CUBE.points, [("tetra", CUBE.simplices)])
    path.write_bytes(path.read_bytes().replace(b"CELLS 13", b"CELLS 23"))
    with pytest.raises(
        FileFormatError,
        match=r"a\.vtk: Numbers of a VTK file must be float, .*; they are b''",
    ):
        read_shape(path)
    path = written(tmp_path / "a.msh", CUBE.points, [("tetra", CUBE.simplices)])
    path.write_bytes(path.read_bytes().replace(b"$EndElements", b"$EndElement"))
    with pytest.raises(
        FileFormatError, match=r"a\.msh: A gmsh file must be whole; it has no \$EndElements"
    ):
        read_shape(path)
    path = written(tmp_path / "a.mesh", DISC.vertices, [("triangle", DISC.faces)])
    path.write_bytes(path.read_bytes().replace(b"End", b""))
    with pytest.raises(
        FileFormatError, match=r"a\.mesh: A Medit file must be whole; it has no End"
    ):
        read_shape(path)
    path = written(tmp_path / "b.vtk", CUBE.points, [("tetra", CUBE.simplices)], binary=False)
    path.write_bytes(path.read_bytes().rstrip())
    with pytest.raises(
        FileFormatError,
        match=r"b\.vtk: A VTK file must be whole; its last number has no line break",
    ):
        read_shape(path)


@pytest.mark.parametrize("suffix", [".mesh", ".meshb", ".msh", ".vtk", ".vtu"])
@pytest.mark.parametrize("content", [b"nonsense", b"\x00\xff\xfe" * 50, b"5\n1 2 3\n", b"\n"])
def test_what_is_no_mesh_is_named_and_nothing_is_printed(tmp_path, capfd, suffix, content):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(CerteigError, match=rf"a{suffix}"):
        read_shape(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.long
@pytest.mark.parametrize(
    "kind", ["medit", "gmsh", "gmsh22", "gmsh text", "vtk", "vtk text", "vtu", "vtu text"]
)
def test_truncated_files_are_refused_or_whole(tmp_path, capfd, kind):
    name, _, text = kind.partition(" ")
    suffix = {"medit": ".mesh", "gmsh": ".msh", "gmsh22": ".msh"}.get(name, f".{name}")
    path = tmp_path / f"whole{suffix}"
    options = {"binary": False} if text else {}
    points, cells = CUBE.points[CUBE.simplices[0]], np.array([[0, 1, 2, 3]])
    meshio.write_points_cells(path, points, [("tetra", cells)], file_format=name, **options)
    capfd.readouterr()
    whole, n_refused = path.read_bytes(), 0
    for end in range(1, len(whole)):
        try:
            _, found = parse_file(SourceFile(path, suffix, whole[:end]), None)
        except CerteigError:
            n_refused += 1
            continue
        np.testing.assert_array_equal(found, cells)
    assert n_refused > len(whole) / 2
    assert capfd.readouterr() == ("", "")


TABLES = {
    "a.xyz": b"0 0 0\n1 0 0 9 9 9\n# nothing\n0 1.5e0 0\n",
    "a.pts": b"3\n0 0 0 7\n1 0 0 7\n0 1.5 0 7\n",
    "a.ply": b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    b"end_header\n0 0 0\n1 0 0\n0 1.5 0\n",
    "a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1.5 0\n",
}
EXPECTED = [[0, 0, 0], [1, 0, 0], [0, 1.5, 0]]


@pytest.mark.parametrize("name", TABLES)
def test_tables_of_points(tmp_path, name):
    (tmp_path / name).write_bytes(TABLES[name])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert read_shape(tmp_path / name).points.tolist() == EXPECTED
        assert read_points(tmp_path / name, dim=1).dim == 1
    more = b" 7" in TABLES[name]
    assert [
        str(each.message).endswith("1 columns after x, y and z are not read") for each in said
    ] == [True, True] * more


def test_a_binary_point_set(tmp_path):
    rows = b"".join(struct.pack("<ffff", *row, 9.0) for row in EXPECTED)
    head = (
        b"[Expe/PointSet/Binary/0.1]\nproperty position 12\nproperty radius 4\nnofpoints 3\ndata\n"
    )
    (tmp_path / "a.pts").write_bytes(head + rows)
    assert read_points(tmp_path / "a.pts").points.tolist() == EXPECTED
    for change, match in (
        ((b"nofpoints 3", b"nofpoints 4"), "declares 4 of 16 bytes each and holds 48 bytes"),
        ((b"position 12", b"position 24"), "must have a position of 12 bytes"),
        ((b"\ndata\n", b"\n"), "must have a line 'data'; it has none"),
        ((b"property radius 4", b"radius"), "must declare properties; line 3 is 'radius'"),
    ):
        (tmp_path / "b.pts").write_bytes((head + rows).replace(*change))
        with pytest.raises(FileFormatError, match=match):
            read_points(tmp_path / "b.pts")


PCD = (
    b"# .PCD v.7\nVERSION .7\nFIELDS rgb x y z\nSIZE 4 4 4 4\nTYPE U F F F\nCOUNT 1 1 1 1\n"
    b"WIDTH 3\nHEIGHT 1\nPOINTS 3\n"
)
FIELDS = np.column_stack([np.array([7, 8, 9], np.float32), np.array(EXPECTED, np.float32)])


def pcd(kind):
    if kind == "ascii":
        return (
            PCD
            + b"DATA ascii\n"
            + "\n".join(" ".join(map(str, row)) for row in FIELDS.tolist()).encode()
        )
    if kind == "binary":
        return PCD + b"DATA binary\n" + FIELDS.astype("<f4").tobytes()
    plain = FIELDS.T.astype("<f4").tobytes()
    packed = b"".join(
        bytes([len(plain[i : i + 32]) - 1]) + plain[i : i + 32] for i in range(0, len(plain), 32)
    )
    return PCD + b"DATA binary_compressed\n" + struct.pack("<II", len(packed), len(plain)) + packed


@pytest.mark.filterwarnings("ignore:.*the fields .* are not read")
@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_point_cloud_data(tmp_path, kind):
    (tmp_path / "a.pcd").write_bytes(pcd(kind))
    assert read_points(tmp_path / "a.pcd").points.tolist() == EXPECTED


def test_lzf_repeats_what_it_points_back_to():
    packed = bytes(
        [2, 1, 2, 3, (3 << 5), 2, (7 << 5), 1, 0]
    )  # three plain bytes, five from three back, ten from one back
    found = list(decompress(packed, 18))
    assert found == [1, 2, 3, 1, 2, 3, 1, 2, *[2] * 10]
    assert decompress(bytes([32, 9]), 5) == b""  # points before the beginning
    for damaged in (packed[:-1], packed[:6], b"\x05abc"):  # what ends early is left out
        assert len(decompress(damaged, 18)) < 18
    assert len(decompress(packed, 17)) == 8  # nor does it ever unpack to more


@pytest.mark.parametrize(
    ("kind", "change", "match"),
    [
        ("ascii", (b"POINTS 3", b"POINTS 4"), "declares 4 and holds 3"),
        ("binary", (b"POINTS 3", b"POINTS 4"), "declares 4 of 16 bytes and holds 48 bytes"),
        ("binary_compressed", (b"POINTS 3", b"POINTS 4"), "4 points take 64"),
        (
            "binary",
            (b"DATA binary", b"DATA octal"),
            "must be ascii, binary or binary_compressed; it is 'octal'",
        ),
        ("binary", (b"DATA binary", b"DATUM"), "A PCD file must have a line DATA; it has none"),
        ("binary", (b"SIZE 4 4 4 4", b"SIZE 4 4 4"), "must be of one length; they are not"),
        (
            "binary",
            (b"FIELDS rgb x y z", b"FIELDS rgb x y w"),
            "must have the fields x, y and z; z is missing",
        ),
        ("binary", (b"TYPE U F F F", b"TYPE U F F U"), "must be floats of 4 or 8 bytes; z is not"),
        ("binary", (b"POINTS 3", b"POINTS 0"), "A PCD file must hold points; it declares 0"),
        ("binary", (b"TYPE U F F F\n", b""), "A PCD file must have a line TYPE; it has none"),
        (
            "ascii",
            (b"7.0 0.0 0.0 0.0", b"7.0 0.0 0.0"),
            "A point must have all fields and no more; line 11 is '7.0 0.0 0.0'",
        ),
    ],
)
def test_broken_point_cloud_data_is_named(tmp_path, kind, change, match):
    data = pcd(kind)
    assert change[0] in data
    (tmp_path / "a.pcd").write_bytes(data.replace(*change))
    with pytest.raises(FileFormatError, match=match):
        read_points(tmp_path / "a.pcd")


def test_compressed_points_that_end_early(tmp_path):
    data = pcd("binary_compressed")
    (tmp_path / "a.pcd").write_bytes(data[: data.index(b"compressed\n") + 15])
    with pytest.raises(
        FileFormatError, match="must begin with two sizes; the file ends after 4 bytes"
    ):
        read_points(tmp_path / "a.pcd")


def test_missing_returns_are_refused_or_dropped_when_asked(tmp_path):
    (tmp_path / "a.xyz").write_text("0 0 0\nnan nan nan\n1 1 1\n")
    with pytest.raises(
        InvalidShapeError, match=r"a\.xyz: points must be finite; point 1 is \[nan, .* \(1 such\)"
    ):
        read_points(tmp_path / "a.xyz")
    assert read_points(tmp_path / "a.xyz", drop_missing=True).points.tolist() == [
        [0, 0, 0],
        [1, 1, 1],
    ]


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"3\n0 0 0\n", "it declares 3 and holds 1"),
        (b"# nothing\n", "A file of points must hold points; it holds none"),
        (b"0 0\n", "A vertex must have three numbers; line 1 is '0 0'"),
        (
            b"0,0,0\n",
            "three numbers; line 1 is '0,0,0'. Put # before lines of text, spaces between",
        ),
        (
            b"//X Y Z\n0 0 0\n",
            "a number; line 1 has '//X' in '//X Y Z'. Put # before lines of text",
        ),
        (b"0,5 0 1\n", "a number; line 1 has '0,5' in '0,5 0 1'. .* and a point before decimals"),
        (
            b"Version 1.0\nS001 1 2 3\n",
            "landmarks of Landmark Editor. es.morphometrics.read_landmarks",
        ),
    ],
)
def test_broken_tables_are_named(tmp_path, content, match):
    (tmp_path / "a.pts").write_bytes(content)
    with pytest.raises(FileFormatError, match=match):
        read_points(tmp_path / "a.pts")


@pytest.mark.parametrize("name", ["a.xyz", "a.ply"])
def test_heights_that_were_not_measured_are_noticed(tmp_path, name):
    points = np.random.default_rng(0).normal(size=(20, 3))
    path = tmp_path / name
    write_points(PointCloud(points), path)
    assert read_points(path).n_points == 20  # warnings are errors in tests
    points[3, 2] = -9999
    write_points(PointCloud(points), path)
    with pytest.warns(UserWarning, match=r"measured nothing \(-9999, -32768\); if so, leave out"):
        assert read_points(path).n_points == 20
    # It is no height that is missing if there are lower ones.
    points[4, 2] = -10_001
    write_points(PointCloud(points), path)
    assert read_points(path).n_points == 20


def test_a_table_is_read_as_its_messages_say(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z\n0,0.5,1\n1,0,1\n")
    with pytest.raises(FileFormatError, match=r"Points, x y z on each line, .* ends in \.xyz\.$"):
        read_shape(tmp_path / "a.csv")
    with pytest.raises(FileFormatError, match=r"it is '\.csv'\.$"):  # no points are read there
        read_mesh(tmp_path / "a.csv")
    table = (tmp_path / "a.csv").read_text().replace(",", " ")
    (tmp_path / "a.xyz").write_text(f"# {table}")
    assert read_shape(tmp_path / "a.xyz").points.tolist() == [[0, 0.5, 1], [1, 0, 1]]


def test_points_are_written_exactly(tmp_path):
    cloud = PointCloud(np.random.default_rng(0).normal(size=(20, 3)) * 1e-7)
    for name in ("a.xyz", "a.pts", "a.ply"):
        write_points(cloud, tmp_path / name)
        np.testing.assert_array_equal(read_points(tmp_path / name).points, cloud.points)
    with pytest.raises(
        FileFormatError,
        match=r"a\.csv must be of a known format, \.ply, \.xyz, \.pts; it is '\.csv'",
    ):
        write_points(cloud, tmp_path / "a.csv")
    with pytest.raises(
        InvalidShapeError, match="Files of points hold three coordinates; these points have 2"
    ):
        write_points(PointCloud(np.eye(2)), tmp_path / "a.xyz")


def test_unknown_formats_and_dimensions(tmp_path):
    (tmp_path / "a.abc").write_text("0 0 0\n")
    with pytest.raises(
        FileFormatError, match=r"a\.abc must be of a known format, \.off, .*; it is '\.abc'"
    ):
        read_shape(tmp_path / "a.abc")
    with pytest.raises(FileFormatError, match=r"must be of a known format, .*; it has no suffix"):
        read_shape(tmp_path / "abc")
    with pytest.raises(FileFormatError, match="must be a file; it is a folder"):
        read_shape(tmp_path)
    assert read_shape(tmp_path / "a.abc", file_format="xyz").n_points == 1
    with pytest.raises(InvalidParameterError, match=r"dim must lie in 1\.\.3; it is 5"):
        read_shape(tmp_path / "a.abc", file_format="xyz", dim=5)
