"""Surfaces of brains as CIVET and FreeSurfer have written them over the years, and what stands behind the triangles."""

import base64
import warnings
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
from nibabel import freesurfer
from tetrahedra import FACES, TETRAHEDRON, VERTICES
from typer.testing import CliRunner

import eigenshape as es
from eigenshape import FileFormatError
from eigenshape.cli import app
from eigenshape.io.formats.neuro import freesurfer as fs
from eigenshape.io.formats.neuro import gifti, mni_obj

OF_NIBABEL = Path(nib.__file__).parent / "gifti" / "tests" / "data"
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def threes(*numbers):
    """Return whole numbers of three bytes each."""
    return b"".join(int(number).to_bytes(3, "big") for number in numbers)


def quadrangles(points, quads, *, new=False):
    numbers = np.array(points, ">f4") if new else np.rint(100 * np.array(points)).astype(">i2")
    first = b"\xff\xff\xfd" if new else b"\xff\xff\xff"
    counts = threes(len(points), len(quads))
    return first + counts + numbers.tobytes() + threes(*np.ravel(quads))


@pytest.mark.parametrize("new", [False, True])
@pytest.mark.parametrize("name", ["lh.orig", "a.surf"])
def test_a_surface_of_quadrangles_is_what_nibabel_reads(tmp_path, name, new):
    (tmp_path / name).write_bytes(quadrangles(SQUARE, [[0, 1, 2, 3]], new=new))
    mesh = es.read_mesh(tmp_path / name)
    points, faces = freesurfer.read_geometry(tmp_path / name)
    assert mesh.vertices.tolist() == points.tolist() == SQUARE
    assert es.geometry.face_areas(mesh).sum() == 1
    assert es.geometry.face_areas(es.TriangleMesh(points, faces)).sum() == 1
    assert es.read_mesh(tmp_path / name, cells="quads").n_faces == 2


def test_quadrangles_and_functions_of_one_signature_are_told_apart(tmp_path):
    for n in (1, 2, 100, 300, 70_000):
        es.io.write_fields(es.icosphere(0), tmp_path / "lh.sulc", {"a": np.arange(12.0)})
        freesurfer.write_morph_data(tmp_path / "lh.curv", np.arange(n, dtype=float))
        assert len(es.io.read_fields(tmp_path / "lh.curv")["values"]) == n
    points = np.zeros((300, 3))
    points[:, 0] = np.arange(300)
    quads = np.arange(300).reshape(-1, 4)
    (tmp_path / "lh.orig").write_bytes(quadrangles(points, quads))
    assert es.io.read_points(tmp_path / "lh.orig").points.tolist() == points.tolist()
    with pytest.raises(FileFormatError, match="must hold what it declares"):
        fs.parse(quadrangles(points, quads)[:-1])
    with pytest.raises(FileFormatError, match=r"it is '.surf'"):
        es.io.read_fields(tmp_path / "lh.orig")


def test_old_functions_have_no_signature(tmp_path):
    data = threes(4, 4) + np.array([0, 100, -250, 32767], ">i2").tobytes()
    (tmp_path / "lh.curv").write_bytes(data)
    values = es.io.read_fields(tmp_path / "lh.curv")["values"]
    assert values.tolist() == np.float32([0, 1, -2.5, 327.67]).tolist()
    assert np.array_equal(
        values, freesurfer.read_morph_data(tmp_path / "lh.curv").astype(np.float32)
    )
    (tmp_path / "lh.old").write_bytes(data)
    assert np.array_equal(es.io.read_fields(tmp_path / "lh.old")["values"], values)
    (tmp_path / "lh.old").write_bytes(data[:-1])
    with pytest.raises(FileFormatError, match="of a known format"):
        es.io.read_fields(tmp_path / "lh.old")


def text_surface(mark=0):
    rows = [
        "#!ascii version of lh.white",
        "4 4",
        *(f"{x:f}  {y:f}  {z:f}  {mark}" for x, y, z in VERTICES),
        *(f"{a} {b} {c} 0" for a, b, c in FACES),
    ]
    return "\n".join([*rows, ""]).encode()


def test_a_surface_in_text(tmp_path):
    for name in ("lh.white.asc", "lh.white", "a.surf"):
        (tmp_path / name).write_bytes(text_surface())
        mesh = es.read_mesh(tmp_path / name)
        assert mesh.vertices.tolist() == VERTICES
        assert mesh.faces.tolist() == FACES
    (tmp_path / "lh.white.asc").write_bytes(text_surface(mark=1))
    with pytest.warns(UserWarning, match=r"asc: the marks behind 4 of its vertices and faces"):
        assert es.read_mesh(tmp_path / "lh.white.asc").n_faces == 4
    with pytest.raises(FileFormatError, match="more follows"):
        fs.parse(text_surface() + b"1 2 3 0\n")
    with pytest.raises(FileFormatError, match="must hold what it declares"):
        fs.parse(text_surface()[:-20])
    with pytest.raises(FileFormatError, match="must hold what it declares"):
        fs.parse(b"#!ascii version of")


def mni_text(points, polygons, colors="0\n1 1 1 1"):
    ends = np.cumsum([len(polygon) for polygon in polygons])
    lines = [
        f"P 0.3 0.3 0.4 10 1 {len(points)}",
        *(" ".join(map(str, point)) for point in points),
        "",
        *(["0 0 1"] * len(points)),
        "",
        str(len(polygons)),
        colors,
        "",
        " ".join(map(str, ends)),
        "",
        " ".join(str(corner) for polygon in polygons for corner in polygon),
    ]
    return ("\n".join(lines) + "\n").encode()


def mni_binary(points, polygons, order, coloring=0):
    n_colors = {0: 1, 1: len(polygons), 2: len(points)}[coloring]
    ends = np.cumsum([len(polygon) for polygon in polygons])
    parts = [
        np.array([0.3, 0.3, 0.4, 10, 1], f"{order}f4"),
        np.array([len(points)], f"{order}i4"),
        np.array(points, f"{order}f4"),
        np.zeros((len(points), 3), f"{order}f4"),
        np.array([len(polygons), coloring], f"{order}i4"),
        np.zeros((n_colors, 4), "u1"),
        ends.astype(f"{order}i4"),
        np.concatenate(polygons).astype(f"{order}i4"),
    ]
    return b"p" + b"".join(part.tobytes() for part in parts)


@pytest.mark.parametrize(
    "data",
    [
        mni_text(VERTICES, FACES),
        mni_binary(VERTICES, FACES, ">"),
        mni_binary(VERTICES, FACES, "<"),
    ],
    ids=["text", "big", "little"],
)
def test_an_mni_object_is_recognized_and_read(tmp_path, data):
    for name in ("white_surface.obj", "a.mniobj"):
        (tmp_path / name).write_bytes(data)
        mesh, attributes = es.read_mesh(tmp_path / name, attributes=True)
        assert mesh.vertices.tolist() == VERTICES
        assert mesh.faces.tolist() == FACES
        assert attributes.source is None
        assert es.io.read_surface(tmp_path / name).mesh.n_faces == 4


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (mni_text(VERTICES, FACES, "1\n" + "1 0 0 1\n" * 4), "polygons"),
        (mni_text(VERTICES, FACES, "2\n" + "1 0 0 1\n" * 4), "vertices"),
        (mni_binary(VERTICES, FACES, ">", 1), "polygons"),
        (mni_binary(VERTICES, FACES, "<", 2), "vertices"),
    ],
)
def test_colors_of_an_mni_object_are_named(tmp_path, data, what):
    (tmp_path / "a.obj").write_bytes(data)
    with pytest.warns(UserWarning, match=f"a.obj: the colors of its {what} are not read"):
        assert es.read_mesh(tmp_path / "a.obj").faces.tolist() == FACES


def test_an_mni_object_of_polygons():
    _, cells = mni_obj.parse(mni_text(SQUARE, [[0, 1, 2, 3]]))
    assert cells["polygons"].corners.tolist() == [0, 1, 2, 3]
    with pytest.raises(FileFormatError, match="three corners or more; polygon 1 has 2"):
        mni_obj.parse(mni_text(SQUARE, [[0, 1, 2], [0, 3]]))


def test_damaged_mni_objects_are_refused(tmp_path):
    for good in (mni_text(VERTICES, FACES), mni_binary(VERTICES, FACES, "<")):
        for end in (1, 20, 100, len(good) - 2):
            with pytest.raises(FileFormatError, match=r"must hold|must be"):
                mni_obj.parse(good[:end])
        with pytest.raises(FileFormatError, match="more follows"):
            mni_obj.parse(good + good)
    (tmp_path / "a.obj").write_bytes(mni_text(VERTICES, [[0, 1, 9]]))
    with pytest.raises(es.InvalidShapeError, match="face 0 is"):
        es.read_mesh(tmp_path / "a.obj")
    # An object of points in a Wavefront file begins with p as well.
    (tmp_path / "a.obj").write_bytes(b"p 1\nv 0 0 0\n")
    assert es.read_shape(tmp_path / "a.obj").n_points == 1


# What stands behind the triangles


def write_white(path, mesh):
    info = {"head": [2, 0, 20], "valid": "1", "filename": "orig.mgz", "volume": [256] * 3}
    axes = {"voxelsize": [1, 1, 1], "xras": [-1, 0, 0], "yras": [0, 0, -1], "zras": [0, 1, 0]}
    info |= axes | {"cras": [-1.5, 24.1, -5.5]}
    freesurfer.write_geometry(path, mesh.vertices, mesh.faces, "someone", info)


def test_the_place_of_the_volume_is_kept_or_named(tmp_path):
    path, copy = tmp_path / "lh.white", tmp_path / "lh.copy"
    write_white(path, es.icosphere(1))
    mesh, attributes = es.read_mesh(path, attributes=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        es.write_mesh(mesh, copy, attributes=attributes)
    *_, before = freesurfer.read_geometry(path, read_metadata=True)
    *_, after = freesurfer.read_geometry(copy, read_metadata=True)
    assert after["cras"].tolist() == [-1.5, 24.1, -5.5]
    assert {key: str(value) for key, value in after.items()} == {
        key: str(value) for key, value in before.items()
    }
    for name in ("a.ply", "a.stl", "a.vtu", "a.gii"):
        with pytest.warns(UserWarning, match=r"does not keep: the place of the volume .*c_ras"):
            es.write_mesh(mesh, tmp_path / name, attributes=attributes)
    # A surface that has none loses none.
    es.write_mesh(mesh, copy)
    mesh, attributes = es.read_mesh(copy, attributes=True)
    assert attributes.others == ()


def test_the_command_line_keeps_it_after_a_repair_or_names_it(tmp_path):
    path = tmp_path / "lh.white"
    write_white(path, es.icosphere(1))
    for name in ("lh.repaired", "a.off"):
        arguments = ["repair", str(path), "--repair", "auto", "-o", str(tmp_path / name)]
        done = CliRunner().invoke(app, arguments)
        assert done.exit_code == 0, done.output
        assert ("c_ras" in done.output) == (name == "a.off")
    *_, after = freesurfer.read_geometry(tmp_path / "lh.repaired", read_metadata=True)
    assert after["cras"].tolist() == [-1.5, 24.1, -5.5]


def placed_gifti(*, matrix, space="NIFTI_XFORM_SCANNER_ANAT"):
    systems = [nib.gifti.GiftiCoordSystem(0, space, matrix)]
    points = nib.gifti.GiftiDataArray(np.float32(VERTICES), "NIFTI_INTENT_POINTSET")
    points.coordsys = systems[0]
    points.meta = nib.gifti.GiftiMetaData({"AnatomicalStructurePrimary": "CortexLeft"})
    faces = nib.gifti.GiftiDataArray(np.int32(FACES), "NIFTI_INTENT_TRIANGLE")
    image = nib.gifti.GiftiImage(
        meta=nib.gifti.GiftiMetaData({"Made by": "é <&>"}), darrays=[points, faces]
    )
    return image.to_bytes()


def test_the_transformation_of_a_gifti_file_is_kept_or_named(tmp_path):
    matrix = np.eye(4)
    matrix[:3, 3] = [-1.5, 24.1, -5.5]
    path, copy = tmp_path / "a.surf.gii", tmp_path / "b.surf.gii"
    data = placed_gifti(matrix=matrix)
    # A second one, to another space, as the standard allows
    end = b"</CoordinateSystemTransformMatrix>"
    start = data.index(b"<CoordinateSystemTransformMatrix>")
    system = data[start : data.index(end) + len(end)]
    second = system.replace(b"SCANNER_ANAT", b"MNI_152")
    path.write_bytes(data.replace(system, system + second))
    mesh, attributes = es.read_mesh(path, attributes=True)
    assert mesh.vertices.tolist() == VERTICES  # as nibabel and Connectome Workbench read them
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        moved = es.TriangleMesh(mesh.vertices + 1, mesh.faces)
        es.write_mesh(moved, copy, attributes=attributes)
    image = nib.load(copy)
    points = image.darrays[0]
    assert points.data.tolist() == moved.vertices.tolist()
    assert np.allclose(points.coordsys.xform, matrix)
    assert points.meta["AnatomicalStructurePrimary"] == "CortexLeft"
    assert image.meta["Made by"] == "é <&>"
    spaces = gifti.parse_tags(copy.read_bytes()).findall("DataArray[1]//TransformedSpace")
    assert [each.text for each in spaces] == ["NIFTI_XFORM_SCANNER_ANAT", "NIFTI_XFORM_MNI_152"]
    for name in ("a.ply", "lh.a"):
        with pytest.warns(UserWarning, match="not keep: metadata, and the transformation"):
            es.write_mesh(mesh, tmp_path / name, attributes=attributes)
    # A file without metadata whose transformation changes nothing loses nothing.
    es.write_mesh(mesh, path)
    assert es.read_mesh(path, attributes=True)[1].others == ()


def test_numbers_of_a_gifti_file_may_lie_beside_it(tmp_path):
    expected = [array.data for array in nib.load(OF_NIBABEL / "external.gii").darrays]
    mesh = es.read_mesh(OF_NIBABEL / "external.gii")
    assert np.array_equal(mesh.vertices, expected[0])
    assert np.array_equal(mesh.faces, expected[1])
    values = np.array([0.5, 1.5, 2.5, 3.5], "<f4")
    (tmp_path / "a.dat").write_bytes(b"12345678" + values.tobytes())

    def write(name, start, kind="FLOAT32", intent="NONE", suffix="func"):
        (tmp_path / f"a.{suffix}.gii").write_text(
            '<GIFTI Version="1.0" NumberOfDataArrays="1"><LabelTable><Label Key="1">x</Label>'
            f'</LabelTable><DataArray Intent="NIFTI_INTENT_{intent}" DataType="NIFTI_TYPE_{kind}" '
            'Dimensionality="1" Dim0="4" ArrayIndexingOrder="RowMajorOrder" Endian="LittleEndian" '
            f'Encoding="ExternalFileBinary" ExternalFileName="{name}" ExternalFileOffset="{start}">'
            "<Data></Data></DataArray></GIFTI>"
        )
        return tmp_path / f"a.{suffix}.gii"

    assert es.io.read_fields(write("a.dat", 8))["values"].tolist() == values.tolist()
    (tmp_path / "a.dat").write_bytes(b"12345678" + np.array([0, 1, 1, 0], "<i4").tobytes())
    path = write("a.dat", 8, "INT32", "LABEL", "label")
    assert es.io.read_parcellation(path, TETRAHEDRON).labels.tolist() == [-1, 0, 0, -1]
    with pytest.raises(FileFormatError, match="takes 16 bytes, not 8"):
        es.io.read_fields(write("a.dat", 16))
    outside = tmp_path.parent / "outside.dat"
    outside.write_bytes(values.tobytes())
    for name, start in (
        ("../outside.dat", 0), (outside, 0), ("b.dat", 0), ("", 0), ("a.dat", -8), ("a.dat", "x")
    ):  # fmt: skip
        with pytest.raises(
            FileFormatError, match=r"in a file in its folder; .* which is not there"
        ):
            es.io.read_fields(write(name, start))


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"])
def test_numbers_of_any_type_of_nifti_are_read(kind):
    values = np.arange(4).astype(f"<{kind}")
    text = base64.b64encode(values.tobytes()).decode()
    data = (
        '<GIFTI Version="1.0" NumberOfDataArrays="1"><DataArray Intent="NIFTI_INTENT_SHAPE" '
        f'DataType="NIFTI_TYPE_{values.dtype.name.upper()}" Dimensionality="1" Dim0="4" '
        'Encoding="Base64Binary" Endian="LittleEndian" ArrayIndexingOrder="RowMajorOrder">'
        f"<Data>{text}</Data></DataArray></GIFTI>"
    )
    found = gifti.parse_fields(data.encode())[0]["values"]
    assert found.dtype == np.dtype(kind)
    assert found.tolist() == [0, 1, 2, 3]
