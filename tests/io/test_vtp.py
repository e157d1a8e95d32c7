"""PolyData in XML: what is read and written, by hand; every encoding is tested against VTK."""

import numpy as np
import pytest
import pyvista as pv

import eigenshape as es
from eigenshape import FileFormatError
from eigenshape.io import read_fields, write_fields


def array(name, kind, text, width=1):
    return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii">{text}</DataArray>'


def piece(sections, *, points="0 0 0 1 0 0 1 1 0 0 1 0", data=""):
    """Write a piece; each section is its corners and ends."""
    counts = " ".join(
        f'NumberOf{name}="{len(ends.split())}"' for name, (_, ends) in sections.items()
    )
    cells = "".join(
        f"<{name}>{array('connectivity', 'Int64', corners)}{array('offsets', 'Int64', ends)}</{name}>"
        for name, (corners, ends) in sections.items()
    )
    return (
        f'<Piece NumberOfPoints="{len(points.split()) // 3}" {counts}>'
        f"<Points>{array('Points', 'Float64', points, 3)}</Points>{cells}{data}</Piece>"
    )


def xml(*pieces):
    return (
        '<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData>'
        f"{''.join(pieces)}</PolyData></VTKFile>"
    )


ALL = {
    "Verts": ("0", "1"),
    "Lines": ("0 1 2", "3"),
    "Strips": ("0 1 3 2", "4"),
    "Polys": ("0 1 2 0 1 2 3", "3 7"),
}


def test_strips_polygons_and_their_values(tmp_path):
    # VTK counts polygons before strips, whatever their order in the file.
    data = f"<CellData>{array('value', 'Int16', '10 20 30 40 50')}</CellData>"
    (tmp_path / "a.vtp").write_text(xml(piece(ALL, data=data)))
    mesh, attributes = es.read_mesh(tmp_path / "a.vtp", attributes=True)
    theirs = pv.read(tmp_path / "a.vtp")
    assert theirs.n_cells == 5
    by_value = {value: [] for value in (30, 40, 50)}
    for face, value in zip(mesh.faces.tolist(), attributes.fields["value"].tolist(), strict=True):
        by_value[value].append(face)
    assert by_value[30] == [[0, 1, 2]]
    assert by_value[40] == [[0, 1, 2], [0, 2, 3]]
    assert by_value[50] == [[0, 1, 3], [3, 1, 2]]
    for number, value in enumerate(theirs.cell_data["value"].tolist()):
        if value >= 30:
            assert set(np.ravel(by_value[value]).tolist()) == set(theirs.get_cell(number).point_ids)


def test_lines_and_points_alone(tmp_path):
    (tmp_path / "a.vtp").write_text(xml(piece({name: ALL[name] for name in ("Verts", "Lines")})))
    assert es.read_shape(tmp_path / "a.vtp").simplices.tolist() == [[0, 1], [1, 2]]
    (tmp_path / "a.vtp").write_text(xml(piece({"Verts": ALL["Verts"]})))
    assert es.io.read_points(tmp_path / "a.vtp").points.shape == (4, 3)


def test_a_mesh_and_its_fields_go_and_come_back(tmp_path):
    mesh = es.icosphere(1)
    fields = {
        "height": mesh.vertices[:, 2],
        "move": mesh.vertices.astype(np.float32),
        "part <&>": np.arange(mesh.n_faces, dtype=np.int32),
    }
    write_fields(mesh, tmp_path / "a.vtp", fields)
    again, found = es.read_mesh(tmp_path / "a.vtp"), read_fields(tmp_path / "a.vtp")
    theirs = pv.read(tmp_path / "a.vtp")
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.faces, mesh.faces)
    np.testing.assert_array_equal(theirs.points, mesh.vertices)
    np.testing.assert_array_equal(theirs.regular_faces, mesh.faces)
    for name, values in fields.items():
        np.testing.assert_array_equal(found[name], values)
        of_cells = len(values) == mesh.n_faces
        np.testing.assert_array_equal(
            (theirs.cell_data if of_cells else theirs.point_data)[name], values
        )
    es.write_mesh(mesh, tmp_path / "b.vtp")
    assert read_fields(tmp_path / "b.vtp") == {}
    with pytest.raises(
        FileFormatError, match=r"Files in \.vtp hold triangles .* Write it to \.vtu"
    ):
        write_fields(es.SimplicialMesh(mesh.vertices, mesh.faces[:, :2]), tmp_path / "c.vtp", {})


def test_pieces_and_the_arrays_that_only_some_have(tmp_path):
    triangle = {"Polys": ("0 1 2", "3")}
    of_both, of_one = array("a", "Float64", "{}"), array("b", "Float64", "7")
    pieces = [
        piece(triangle, data=f"<CellData>{of_both.format(1)}{of_one}</CellData>"),
        piece(
            triangle, data=f"<CellData>{of_both.format(2)}</CellData>", points="0 0 5 1 0 5 0 1 5"
        ),
    ]
    (tmp_path / "a.vtp").write_text(xml(*pieces))
    with pytest.warns(UserWarning, match=r"a\.vtp: 2 pieces were joined"):
        mesh = es.read_mesh(tmp_path / "a.vtp")
    assert mesh.faces.tolist() == [[0, 1, 2], [4, 5, 6]]
    assert mesh.vertices[4].tolist() == [0, 0, 5]
    with pytest.warns(UserWarning, match="the array 'b' is not read: it is of text, or not in all"):
        assert {
            name: values.tolist() for name, values in read_fields(tmp_path / "a.vtp").items()
        } == {"a": [1, 2]}


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("0 1 2<", "0 1 9<"), "must join its 4 points, counted from 0; cell 0 joins point 9"),
        (("0 1 2<", "0 1 -1<"), "must join its 4 points, counted from 0; cell 0 joins point -1"),
        (('NumberOfPolys="1"', 'NumberOfPolys="x"'), "count what they hold; NumberOfPolys is 'x'"),
        (
            ('Name="offsets"', 'Name="ends"'),
            "Polys of a VTK file must have offsets; they have connectivity, ends",
        ),
        ((">3<", ">2<"), "'connectivity' must have 2 numbers and has 3"),
        (
            ('"Points" NumberOfComponents="3"', '"Points" NumberOfComponents="2"'),
            "must have three coordinates each; they have '2'",
        ),
    ],
)
def test_what_is_not_as_declared_is_named(tmp_path, change, match):
    text = xml(piece({"Polys": ("0 1 2", "3")}))
    assert change[0] in text
    (tmp_path / "a.vtp").write_text(text.replace(*change))
    with pytest.raises(FileFormatError, match=rf"a\.vtp: .*{match}"):
        es.read_mesh(tmp_path / "a.vtp")


@pytest.mark.data
def test_bones_of_opensim(data):
    paths = sorted((data / "bones").glob("*.vtp"))
    assert len(paths) == 22
    for path in paths:
        mesh, theirs = es.read_mesh(path), pv.read(path)
        np.testing.assert_allclose(mesh.vertices, theirs.points, atol=1e-7)
        area = es.geometry.face_areas(mesh).sum()
        assert area == pytest.approx(theirs.area, rel=1e-3)  # some polygons are not flat
