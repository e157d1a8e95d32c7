"""Files of brains and neurons, beside nibabel: what we read and write is what it writes and reads, to the last bit."""

import base64
import contextlib
import gzip
import re
from importlib import resources
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
from nibabel import freesurfer
from nibabel.cifti2 import cifti2_axes
from tetrahedra import FACES, TETRAHEDRON, VERTICES
from typer.testing import CliRunner

import eigenshape as es
from eigenshape import FileFormatError, InvalidShapeError
from eigenshape.cli import app
from eigenshape.features import Parcellation
from eigenshape.io import (
    read_fields,
    read_parcellation,
    read_volume,
    write_fields,
    write_parcellation,
)
from eigenshape.io.formats.neuro import annotations, cifti, gifti, mni_obj, nifti, swc
from eigenshape.io.formats.neuro import freesurfer as fs
from eigenshape.io.opening import unpack_gzip

CORTICES = Path(str(resources.files("neuromodes") / "data"))
OF_NIBABEL = Path(nib.__file__).parent / "gifti" / "tests" / "data"
LEFT = "sp-human_tpl-fsLR_den-4k_hemi-L_"
BALL = es.icosphere(2)
HEIGHT = BALL.vertices[:, 2].astype(np.float32)
PARCELS = Parcellation(
    np.searchsorted([-0.5, 0.1, 0.7], BALL.vertices[:, 2]) - 1,
    ("low", "middle", "hoch <&> é"),
    [[1, 0, 0, 1], [0, 0.2, 1, 0.4], [0, 1, 0, 1]],
)
FOUR = np.array([0.5, -1.0, np.nan, 3.0], np.float32)


def packed(data):
    """Pack bytes without the time, which would stand in the names of tests: workers of one run compare these."""
    return gzip.compress(data, mtime=0)


def both(path):
    """Return the content of a GIFTI file by nibabel."""
    return [array.data for array in nib.load(path).darrays]


# Surfaces.


@pytest.mark.parametrize("path", sorted(CORTICES.glob("*den-4k*.surf.gii")), ids=lambda p: p.name)
def test_a_cortex_is_what_nibabel_reads_and_goes_back_as_it_was(path, tmp_path):
    points, faces = both(path)
    mesh = es.read_mesh(path)
    assert mesh.vertices.astype(np.float32).tobytes() == points.tobytes()
    assert np.array_equal(mesh.faces, faces)
    for name in ("again.surf.gii", "lh.pial"):
        es.write_mesh(mesh, tmp_path / name)
        again = es.read_mesh(tmp_path / name)
        assert again.vertices.tobytes() == mesh.vertices.tobytes()
        assert again.faces.tobytes() == mesh.faces.tobytes()
    assert both(tmp_path / "again.surf.gii")[0].tobytes() == points.tobytes()
    found, corners = freesurfer.read_geometry(tmp_path / "lh.pial")
    assert found.tobytes() == mesh.vertices.tobytes()
    assert np.array_equal(corners, mesh.faces)


def test_a_surface_of_freesurfer_is_known_by_its_first_bytes(tmp_path):
    stamp, info = (
        "created by someone",
        {"head": [2, 0, 20], "valid": "1", "filename": "a", "volume": [9] * 3},
    )
    info |= {key: [1.0, 0, 0] for key in ("voxelsize", "xras", "yras", "zras", "cras")}
    freesurfer.write_geometry(tmp_path / "fs.white", BALL.vertices, BALL.faces, stamp, info)
    mesh = es.read_mesh(tmp_path / "fs.white")
    assert np.array_equal(mesh.vertices, BALL.vertices.astype(np.float32))
    assert np.array_equal(mesh.faces, BALL.faces)
    assert es.read_shape(tmp_path / "fs.white").n_faces == BALL.n_faces
    data = (tmp_path / "fs.white").read_bytes().replace(b"\n\n", b"\nof a scanner\n", 1)
    assert np.array_equal(fs.parse(data)[1], BALL.faces)
    (tmp_path / "other.white").write_bytes(b"abcdef")
    with pytest.raises(FileFormatError, match="of a known format"):
        es.read_mesh(tmp_path / "other.white")


@pytest.mark.parametrize("name", ["ascii.gii", "ascii_flat_data.gii", "base64bin.gii"])
def test_every_encoding_of_gifti_is_read(name):
    points, faces = both(OF_NIBABEL / name)
    found, corners = gifti.parse((OF_NIBABEL / name).read_bytes())
    assert np.array_equal(found, points)
    assert np.array_equal(corners, faces)


def test_arrays_by_columns_and_of_the_other_byte_order_are_read():
    text = '<GIFTI Version="1.0" NumberOfDataArrays="2">'
    for values, kind, intent in ((VERTICES, "FLOAT32", "POINTSET"), (FACES, "INT32", "TRIANGLE")):
        data = np.array(values, ">f4" if kind == "FLOAT32" else ">i4").tobytes("F")
        text += (
            f'<DataArray Intent="NIFTI_INTENT_{intent}" DataType="NIFTI_TYPE_{kind}" Dimensionality="2"'
            ' Dim0="4" Dim1="3" ArrayIndexingOrder="ColumnMajorOrder" Encoding="Base64Binary"'
            f' Endian="BigEndian"><Data>{base64.b64encode(data).decode()}</Data></DataArray>'
        )
    text = (text + "</GIFTI>").encode()
    points, faces = (array.data for array in nib.GiftiImage.from_bytes(text).darrays)
    assert gifti.parse(text)[0].tolist() == points.tolist() == VERTICES
    assert gifti.parse(text)[1].tolist() == faces.tolist() == FACES


def test_the_command_line_takes_them(tmp_path):
    es.write_mesh(BALL, tmp_path / "lh.pial")
    es.write_mesh(BALL, tmp_path / "ball.surf.gii")
    for name in ("lh.pial", "ball.surf.gii"):
        done = CliRunner().invoke(app, ["info", str(tmp_path / name)])
        assert done.exit_code == 0, done.output
        assert "320" in done.output
        done = CliRunner().invoke(app, ["spectrum", str(tmp_path / name), "-k", "4"])
        assert done.exit_code == 0, done.output
    write_fields(BALL, tmp_path / "ball.func.gii", {"height": HEIGHT})
    arguments = [str(tmp_path / name) for name in ("ball.surf.gii", "lh.white")]
    done = CliRunner().invoke(app, ["repair", arguments[0], "-o", arguments[1]])
    assert done.exit_code == 0, done.output
    assert es.read_mesh(arguments[1]).n_faces == 320
    assert [item.name for item in es.io.find_items(tmp_path)] == [
        "ball.surf",
        "lh.pial",
        "lh.white",
    ]
    done = CliRunner().invoke(app, ["info", str(tmp_path / "ball.func.gii")])
    assert done.exit_code == 1
    assert "read_fields reads the functions" in " ".join(done.output.split())


# Functions.


@pytest.mark.parametrize("suffix", [".gii", ".func.gii", ".shape.gii"])
def test_functions_in_gifti(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    fields = {"height": HEIGHT, "part": PARCELS.labels, "modes": BALL.vertices.astype(np.float32)}
    write_fields(BALL, path, fields)
    found = read_fields(path)
    assert {name: values.tobytes() for name, values in found.items()} == {
        "height": HEIGHT.tobytes(),
        "part": PARCELS.labels.astype(np.int32).tobytes(),
        "modes": fields["modes"].tobytes(),
    }
    read = nib.load(path)
    names = [array.meta.get("Name") for array in read.darrays]
    assert names[-5:] == ["height", "part", "modes", "modes", "modes"]
    assert read.darrays[-5].data.tobytes() == HEIGHT.tobytes()
    if suffix == ".gii":
        mesh, attributes = es.read_mesh(path, attributes=True)
        assert mesh.n_faces == BALL.n_faces
        assert attributes.fields["modes"].shape == (BALL.n_vertices, 3)
        es.write_mesh(mesh, path, attributes=attributes)
        assert read_fields(path).keys() == fields.keys()


@pytest.mark.parametrize(
    "path",
    [
        *sorted(CORTICES.glob("*den-4k*[pk].*.gii")),
        OF_NIBABEL / "task.func.gii",
        OF_NIBABEL / "rh.shape.curv.gii",
    ],
    ids=lambda p: p.name,
)
def test_functions_are_what_nibabel_reads(path):
    arrays = both(path)
    (values,) = read_fields(path).values()
    assert np.array_equal(values.reshape(len(values), -1), np.column_stack(arrays), equal_nan=True)


@pytest.mark.parametrize("name", ["rh.thickness", "a.curv", "a.mgh", "a.mgz"])
def test_one_function_in_files_of_freesurfer(tmp_path, name):
    path = tmp_path / name
    write_fields(TETRAHEDRON, path, {"thickness": FOUR})
    assert read_fields(path)["values"].tobytes() == FOUR.tobytes()
    data = path.read_bytes()
    if ".mg" in name:
        data = gzip.decompress(data) if name == "a.mgz" else data
        read = np.asarray(nib.MGHImage.from_bytes(data).dataobj).ravel()
    else:
        read = freesurfer.read_morph_data(path)
    assert read.astype(np.float32).tobytes() == FOUR.tobytes()


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.int32, np.float32])
@pytest.mark.parametrize("suffix", [".mgh", ".mgz"])
def test_frames_of_mgh(tmp_path, kind, suffix):
    table = np.arange(12).reshape(4, 3).astype(kind)
    nib.save(nib.MGHImage(table.reshape(4, 1, 1, 3), np.eye(4)), tmp_path / f"a{suffix}")
    found = read_fields(tmp_path / f"a{suffix}")["values"]
    assert found.dtype == kind
    assert np.array_equal(found, table)
    write_fields(TETRAHEDRON, tmp_path / f"b{suffix}", {"any": table})
    data = (tmp_path / f"b{suffix}").read_bytes()
    read = nib.MGHImage.from_bytes(gzip.decompress(data) if suffix == ".mgz" else data)
    assert np.array_equal(np.asarray(read.dataobj)[:, 0, 0], table)


def test_dense_scalars_of_cifti(tmp_path):
    path = tmp_path / "a.dscalar.nii"
    left, right = FOUR, np.array([1, 2, np.nan, np.nan], np.float32)
    fields = {
        f"cortex_{side}:{name}": factor * values
        for side, values in (("left", left), ("right", right))
        for name, factor in (("myelin", np.float32(1)), ("two", np.float32(2)))
    }
    write_fields(TETRAHEDRON, path, fields)
    found = read_fields(path)
    assert {name: values.tobytes() for name, values in found.items()} == {
        name: values.tobytes() for name, values in fields.items()
    }
    read = nib.load(path)
    assert read.nifti_header.get_intent()[0] == "ConnDenseScalar"
    assert (
        np.asarray(read.dataobj).tobytes()
        == np.float32([[0.5, -1, 3, 1, 2], [1, -2, 6, 2, 4]]).tobytes()
    )
    (first, second) = [
        model.vertex.tolist() for _, _, model in read.header.get_axis(1).iter_structures()
    ]
    assert (first, second) == ([0, 1, 3], [0, 1])


def test_dense_scalars_of_voxels(tmp_path):
    voxels = cifti2_axes.BrainModelAxis.from_mask(np.ones((2, 1, 1)), "thalamus_left", np.eye(4))
    surface = cifti2_axes.BrainModelAxis.from_surface([1, 2], 4, "cortex_right")
    image = nib.Cifti2Image(
        np.float32([[1, 2, 3, 4]]), (cifti2_axes.ScalarAxis(["a"]), surface + voxels)
    )
    nib.save(image, tmp_path / "a.dscalar.nii")
    found = read_fields(tmp_path / "a.dscalar.nii")
    assert found["thalamus_left:a"].tolist() == [3, 4]
    assert np.array_equal(found["cortex_right:a"], [np.nan, 1, 2, np.nan], equal_nan=True)


def test_a_series_of_cifti_is_a_table(tmp_path):
    voxels = cifti2_axes.BrainModelAxis.from_mask(np.ones((2, 1, 1)), "thalamus_left", np.eye(4))
    surface = cifti2_axes.BrainModelAxis.from_surface([1, 2], 4, "cortex_right")
    table = np.arange(12, dtype=np.float32).reshape(3, 4)
    axes = (cifti2_axes.SeriesAxis(0, 0.72, 3), surface + voxels)
    nib.save(nib.Cifti2Image(table, axes), tmp_path / "a.dtseries.nii")
    found = read_fields(tmp_path / "a.dtseries.nii")
    assert list(found) == ["cortex_right:series", "thalamus_left:series"]
    assert found["thalamus_left:series"].tolist() == table[:, 2:].T.tolist()
    right = found["cortex_right:series"]
    assert right[1:3].tolist() == table[:, :2].T.tolist()
    assert np.isnan(right[[0, 3]]).all()


# Parcels.


SIDES = (("left", -3), ("right", 3))


@pytest.mark.parametrize("name", ["lh.aparc.annot", "ball.label.gii"])
def test_parcels_read_back_with_names_and_colors(tmp_path, name):
    path = tmp_path / name
    write_parcellation(BALL, path, PARCELS)
    found = read_parcellation(path, BALL)
    assert np.array_equal(found.labels, PARCELS.labels)
    assert found.names == PARCELS.names
    np.testing.assert_allclose(found.colors, PARCELS.colors, atol=1e-15)


def test_nibabel_reads_our_annotation_and_we_read_its(tmp_path):
    write_parcellation(BALL, tmp_path / "a.annot", PARCELS)
    labels, table, names = freesurfer.read_annot(tmp_path / "a.annot")
    assert np.array_equal(labels, PARCELS.labels)
    assert [name.decode() for name in names] == list(PARCELS.names)
    assert np.array_equal(table[:, :4], [[255, 0, 0, 0], [0, 51, 255, 153], [0, 255, 0, 0]])
    freesurfer.write_annot(tmp_path / "b.annot", labels, table, names)
    found = read_parcellation(tmp_path / "b.annot", BALL)
    assert np.array_equal(found.labels, PARCELS.labels)
    assert found.names == PARCELS.names


def test_dense_labels_of_cifti(tmp_path):
    path = tmp_path / "a.dlabel.nii"
    sides = {
        side: es.TriangleMesh(BALL.vertices + np.array([x, 0, 0]), BALL.faces) for side, x in SIDES
    }
    write_parcellation(sides["left"], path, PARCELS)
    found = read_parcellation(path, sides["left"])
    assert np.array_equal(found.labels, PARCELS.labels)
    assert found.names == PARCELS.names
    np.testing.assert_allclose(found.colors, PARCELS.colors)
    with pytest.raises(
        FileFormatError, match=r"lies on the right; it has \['cortex_left:parcels'\]"
    ):
        read_parcellation(path, sides["right"])
    # Both hemispheres, as files of the Human Connectome Project have them, without the medial wall.
    axes = [
        cifti2_axes.BrainModelAxis.from_mask(BALL.vertices[:, 2] > z, name=f"cortex_{side}")
        for side, z in (("left", -0.5), ("right", 0))
    ]
    rows = [np.where(BALL.vertices[axis.vertex, 0] > 0, 7, 3) for axis in axes]
    table = {0: ("???", (0, 0, 0, 0)), 3: ("back", (1, 0, 0, 1)), 7: ("front", (0, 1, 0, 1))}
    header = cifti2_axes.LabelAxis(["atlas"], [table]), axes[0] + axes[1]
    nib.save(nib.Cifti2Image(np.concatenate(rows)[None].astype(np.int32), header), path)
    for side, z in (("left", -0.5), ("right", 0)):
        found = read_parcellation(path, sides[side])
        front = BALL.vertices[:, 0] > 0
        wanted = np.where(BALL.vertices[:, 2] > z, front.astype(int), -1)
        assert found.labels.tolist() == wanted.tolist()
        assert found.names == ("back", "front")
    with pytest.raises(FileFormatError, match="which lies on the left and right"):
        read_parcellation(path, BALL)
    rows[0][5] = 9
    nib.save(nib.Cifti2Image(np.concatenate(rows)[None].astype(np.int32), header), path)
    with pytest.raises(FileFormatError, match=r"stand in its table; that of vertex \d+ is 9"):
        read_parcellation(path, sides["left"])


def test_an_annotation_of_the_first_version_is_read():
    def numbers(*values):
        return np.array(values, ">i4").tobytes()

    data = numbers(2, 0, 255, 1, 0, 1, 1, 2) + b"a\0" + numbers(2) + b"x\0" + numbers(255, 0, 0, 0)
    (found,) = annotations.parse_parcels(data, TETRAHEDRON)
    assert found.labels.tolist() == [0, -1]
    assert found.names == ("x",)


def test_nibabel_reads_our_labels_and_we_read_its(tmp_path):
    write_parcellation(BALL, tmp_path / "a.label.gii", PARCELS)
    image = nib.load(tmp_path / "a.label.gii")
    assert np.array_equal(image.darrays[0].data, PARCELS.labels + 1)
    assert image.labeltable.get_labels_as_dict() == dict(enumerate(("???", *PARCELS.names)))
    path = OF_NIBABEL / "rh.aparc.annot.gii"
    image = nib.load(path)
    (found,) = gifti.parse_parcels(path.read_bytes(), TETRAHEDRON)
    names = image.labeltable.get_labels_as_dict()
    keys = [label.key for label in image.labeltable.labels]
    assert found.names == tuple(names.values())
    assert np.array_equal(np.append(keys, 0)[found.labels], image.darrays[0].data)
    colors = [label.rgba for label in image.labeltable.labels]
    assert np.array_equal(found.colors, colors)
    # An old file, which has Index in place of Key, and no colors
    old = OF_NIBABEL / "label.gii"
    (found,) = gifti.parse_parcels(old.read_bytes(), TETRAHEDRON)
    assert found.names == ("Positive", "Negative")
    assert np.array_equal(found.labels, nib.load(old).darrays[0].data - 1)


def test_a_label_file_is_one_parcel(tmp_path):
    cap = Parcellation(np.where(BALL.vertices[:, 2] > 0.5, 0, -1), ("cap",))
    write_parcellation(BALL, tmp_path / "a.label", cap)
    assert np.array_equal(
        freesurfer.read_label(tmp_path / "a.label"), np.flatnonzero(cap.labels == 0)
    )
    assert np.array_equal(read_parcellation(tmp_path / "a.label", BALL).labels, cap.labels)
    (found,) = annotations.parse_parcels(b"#!ascii none\n0\n", TETRAHEDRON)
    assert found.labels.tolist() == [-1] * 4


def test_parcels_of_another_surface_or_hemisphere_are_named(tmp_path):
    path = tmp_path / "lh.aparc.annot"
    right = es.TriangleMesh(BALL.vertices + 3.0, BALL.faces)
    write_parcellation(BALL, path, PARCELS)
    with pytest.raises(
        FileFormatError, match="each of 42 vertices; it has 162, so it belongs to another"
    ):
        read_parcellation(path, es.icosphere(1))
    with pytest.raises(
        FileFormatError, match=r"the left one \(lh.aparc.annot\), and the surface lies on the right"
    ):
        read_parcellation(path, right)
    path = tmp_path / "sub-01_hemi-R.label.gii"
    write_parcellation(BALL, path, PARCELS)
    assert read_parcellation(path, right).names == PARCELS.names
    left = es.TriangleMesh(BALL.vertices - 3.0, BALL.faces)
    with pytest.raises(FileFormatError, match="hemisphere of the surface; it is of the right one"):
        read_parcellation(path, left)
    path.write_bytes(path.read_bytes().replace(b"CortexRight", b"CortexLeft"))
    with pytest.raises(FileFormatError, match=r"the left one \(CortexLeft\)"):
        read_parcellation(path, right)
    with pytest.raises(FileFormatError, match="table of names and colors; it has none"):
        read_parcellation(
            CORTICES / f"{LEFT}medmask.label.gii",
            es.read_mesh(CORTICES / f"{LEFT}midthickness.surf.gii"),
        )
    with pytest.raises(es.InvalidParameterError, match="a label for each of 42 vertices"):
        write_parcellation(es.icosphere(1), path, PARCELS)


# Skeletons.

SKELETON = b"# a neuron\n1 1 0 0 0 2.0 -1\n2 3 1 0 0 1.0 1\n7 3 2 0 0 1.0 2\n9 3 1 1 0 0.5 2\n"


def test_a_skeleton_is_a_graph(tmp_path):
    (tmp_path / "a.swc").write_bytes(SKELETON)
    shape = es.read_shape(tmp_path / "a.swc")
    assert shape.simplices.tolist() == [[1, 0], [2, 1], [3, 1]]
    assert shape.points.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]]
    assert es.solve_spectrum(es.cotangent_laplacian(shape), 2).eigenvalues[0] < 1e-9


@pytest.mark.parametrize(
    ("data", "segments", "note"),
    [
        (b"0 0 0 0 -5 nan -1\n1 6 0 0 5 NaN 0\n", [[1, 0]], None),  # of skeletor
        (b"5 1 0 0 0 1 9\n9 1 1 0 0 1 -1\n", [[0, 1]], None),  # the parent comes later
        (
            b"1 1 0 0 0 1 -1 7\n2 1 1 0 0 1 1 8\n",
            [[1, 0]],
            "columns after the seventh were left out",
        ),
        (
            b"1 1 0 0 0 1 1\n2 1 1 0 0 1 1\n",
            [[1, 0]],
            r"were read as roots; point 1 is one \(1 such\)",
        ),
    ],
)
def test_skeletons_of_other_programs(tmp_path, data, segments, note):
    path = tmp_path / "a.swc"
    path.write_bytes(data)
    with (
        pytest.warns(UserWarning, match=rf"a\.swc: .*{note}") if note else contextlib.nullcontext()
    ):
        assert es.read_shape(path).simplices.tolist() == segments


# Volumes.


@pytest.mark.parametrize("name", ["a.mgz", "a.mgh", "a.nii", "a.nii.gz"])
@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.int32, np.float32])
def test_a_volume_is_what_nibabel_reads(tmp_path, name, kind):
    values = np.arange(24).reshape(2, 3, 4).astype(kind)
    to_space = np.array([[-1, 0, 0, 3], [0, 0, 2, -4], [0, -0.5, 0, 5], [0, 0, 0, 1]], float)
    image = nib.MGHImage if ".mg" in name else nib.Nifti1Image
    image(values, to_space).to_filename(tmp_path / name)
    found, place = read_volume(tmp_path / name)
    assert found.dtype == kind
    assert np.array_equal(found, values)
    assert np.array_equal(place, to_space)


def test_volumes_of_nibabel(tmp_path):
    folder = Path(nib.__file__).parent / "tests" / "data"
    for name in ("standard.nii.gz", "anatomical.nii", "reoriented_anat_moved.nii"):
        found, place = read_volume(folder / name)
        image = nib.load(folder / name)
        assert np.array_equal(found, np.asanyarray(image.dataobj))
        assert np.array_equal(place, image.affine)
    for name, fact in (
        ("test.mgz", r"it has \[3, 4, 5, 2\]"),
        ("functional.nii", r"it has \[17, 21, 3, 20\]"),
        ("example_nifti2.nii.gz", "it has"),
    ):
        with pytest.raises(FileFormatError, match=f"one frame; .*{fact}"):
            read_volume(folder / name)
    nib.Nifti2Image(np.ones((2, 3, 4), np.int16), np.eye(4)).to_filename(tmp_path / "two.nii")
    assert read_volume(tmp_path / "two.nii")[0].shape == (2, 3, 4)
    # A volume of one number a voxel that has an axis of length one too many
    nib.Nifti1Image(np.ones((2, 3, 4, 1), np.int16), np.eye(4)).to_filename(tmp_path / "b.nii")
    assert read_volume(tmp_path / "b.nii")[0].shape == (2, 3, 4)


def test_a_volume_that_does_not_say_where_it_lies(tmp_path):
    nib.MGHImage(np.zeros((2, 4, 6), np.uint8), None).to_filename(tmp_path / "a.mgh")
    data = bytearray((tmp_path / "a.mgh").read_bytes())
    data[28:30] = b"\0\0"
    (tmp_path / "a.mgh").write_bytes(data)
    # The right is where x decreases, down where y increases, the front where z increases.
    expected = [[-1, 0, 0, 1], [0, 0, 1, -3], [0, -1, 0, 2], [0, 0, 0, 1]]
    assert np.array_equal(read_volume(tmp_path / "a.mgh")[1], expected)


def test_a_head_of_few_labels_packs_well_and_is_read(tmp_path):
    nib.MGHImage(np.zeros((256, 256, 200), np.int32), np.eye(4)).to_filename(tmp_path / "a.mgz")
    assert (tmp_path / "a.mgz").stat().st_size < 300_000
    assert read_volume(tmp_path / "a.mgz")[0].shape == (256, 256, 200)


def test_a_volume_is_no_mesh(tmp_path):
    (tmp_path / "a.nii.gz").write_bytes(b"")
    with pytest.raises(FileFormatError, match=r"it is '.nii.gz'. es.io.read_volume reads"):
        es.read_mesh(tmp_path / "a.nii.gz")


def volume_errors(data, name, message, tmp_path):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FileFormatError, match=message):
        read_volume(tmp_path / name)


@pytest.mark.long
def test_volumes_that_lie_are_refused(tmp_path):
    nib.Nifti1Image(np.ones((2, 3, 4), np.int16), np.eye(4)).to_filename(tmp_path / "a.nii")
    good = (tmp_path / "a.nii").read_bytes()
    volume_errors(b"abcdef", "b.nii", "must begin with its header", tmp_path)
    volume_errors(good[:300], "b.nii", "has 300 bytes", tmp_path)
    volume_errors(good[:-1], "b.nii", "must hold a volume; ", tmp_path)
    large = bytearray(good)
    large[42:48] = np.full(3, 30000, "<i2").tobytes()
    volume_errors(bytes(large), "b.nii", "54000000000000 bytes do not fit", tmp_path)
    volume_errors(packed(good)[:50], "b.nii.gz", "must be whole; it ends too early", tmp_path)
    volume_errors(b"\x1f\x8b" + good, "b.nii.gz", "A packed file must be whole", tmp_path)
    volume_errors(packed(bytes(large)), "b.nii.gz", "54000000000000 bytes do not fit", tmp_path)
    bomb = packed(bytes(2**28 + 2**25))
    volume_errors(bomb, "b.nii.gz", "and 256 MiB; it declares", tmp_path)
    color = np.zeros((2, 3, 4), np.dtype([("R", "u1"), ("G", "u1"), ("B", "u1")]))
    nib.Nifti1Image(color, np.eye(4)).to_filename(tmp_path / "c.nii")
    with pytest.raises(FileFormatError, match="one number for each voxel"):
        read_volume(tmp_path / "c.nii")
    nib.MGHImage(np.ones((2, 3, 4), np.uint8), np.eye(4)).to_filename(tmp_path / "a.mgh")
    head = bytearray((tmp_path / "a.mgh").read_bytes())
    head[78:82] = np.array(np.nan, ">f4").tobytes()
    volume_errors(bytes(head), "b.mgh", "Places of voxels in an MGH file must be finite", tmp_path)


# What is wrong is named.

LABELS = gifti.format_parcels(TETRAHEDRON, Parcellation([0, 1, 0, -1], ("x", "y")), ".label.gii")
ANNOTATION = annotations.format_parcels(
    TETRAHEDRON, Parcellation([0, 1, 0, -1], ("x", "y")), ".annot"
)
SURFACE = gifti.format_fields(TETRAHEDRON, {}, {})
MAPS = gifti.format_maps(TETRAHEDRON, {"a": FOUR, "b": FOUR}, ".func.gii")
CURVATURE = fs.format_maps(TETRAHEDRON, {"a": FOUR}, ".curv")
MGH = fs.format_maps(TETRAHEDRON, {"a": FOUR}, ".mgh")
ON_THE_LEFT = es.TriangleMesh(TETRAHEDRON.vertices - [9, 0, 0], TETRAHEDRON.faces)
CIFTI_LABELS = cifti.format_parcels(ON_THE_LEFT, Parcellation([0, 1, 0, -1]), ".dlabel.nii")
CIFTI = cifti.format_maps(TETRAHEDRON, {"cortex_left:a": FOUR}, ".dscalar.nii")


def parcels(parse):
    return lambda data: parse(data, TETRAHEDRON)


def unpacked(parse):
    return lambda data: parse(unpack_gzip(data))


def words(start, *values):
    """Return an annotation whose numbers from one on are others."""
    data = bytearray(ANNOTATION)
    data[start : start + 4 * len(values)] = np.array(values, ">i4").tobytes()
    return bytes(data)


@pytest.mark.parametrize(
    ("parse", "data", "message"),
    [
        (gifti.parse, MAPS, "one array NIFTI_INTENT_POINTSET; it has 0"),
        (
            gifti.parse,
            SURFACE.replace(b'Dimensionality="2"', b'Dimensionality="1"'),
            "takes 16 bytes|must unpack",
        ),
        (gifti.parse, SURFACE.replace(b"INT32", b"FLOAT32"), "three numbers a row"),
        (gifti.parse, SURFACE.replace(b"INT32", b"COMPLEX"), "declare their type"),
        (
            gifti.parse,
            SURFACE.replace(b'Dim0="4"', b'Dim0="-4"'),
            "declare their type, byte order and size",
        ),
        (gifti.parse, SURFACE.replace(b'Dim0="4"', b'Dim0="4000000000"'), "must unpack to at most"),
        (
            gifti.parse,
            SURFACE.replace(b"GZipBase64Binary", b"ExternalFileBinary"),
            "'' from byte 0 on, which is not there. Save it with the data inside",
        ),
        (
            gifti.parse,
            SURFACE.replace(b"GZipBase64Binary", b"Zip"),
            "is 'Zip'. Save it with the data",
        ),
        (gifti.parse, SURFACE.replace(b"GZipBase64Binary", b"ASCII"), "must be of numbers"),
        (gifti.parse, SURFACE.replace(b"GZipBase64Binary", b"Base64Binary"), "takes 48 bytes, not"),
        (gifti.parse, SURFACE.replace(b"<Data>", b"<Data>!"), "must be in base64"),
        (
            gifti.parse,
            SURFACE.replace(b"DOCTYPE GIFTI", b"DOCTYPE GIFTI [<!ENTITY a 'a'>]"),
            "declares entities",
        ),
        (gifti.parse, SURFACE[:-3], "must be whole XML"),
        (
            gifti.parse,
            SURFACE.replace(b'Arrays="2"', b'Arrays="3"'),
            "hold the arrays that it declares",
        ),
        (
            gifti.parse_fields,
            MAPS.replace(b"INTENT_NONE", b"INTENT_NODE_INDEX"),
            "a value for every vertex",
        ),
        (parcels(gifti.parse_parcels), MAPS, "one array NIFTI_INTENT_LABEL; it has 0"),
        (
            parcels(gifti.parse_parcels),
            re.sub(rb'Red="[\d.]+"', b"", LABELS),
            "must have a key and a color; 'x' has",
        ),
        (
            parcels(gifti.parse_parcels),
            re.sub(rb'Red="[\d.]+"', b'Red="2"', LABELS),
            "a key and a color; 'x' has",
        ),
        (
            parcels(gifti.parse_parcels),
            re.sub(rb"<Label .*?/Label>", b"", LABELS),
            "of names and colors; it has none",
        ),
        (
            parcels(gifti.parse_parcels),
            LABELS.replace(b'Key="2"', b'Key="9"'),
            "stand in its table; that of vertex 1 is 2",
        ),
        (fs.parse, CURVATURE, "must begin with the bytes ff ff fe; it begins with ff ff ff"),
        (fs.parse, fs.format_binary(TETRAHEDRON)[:-2], "must hold what it declares"),
        (fs.parse_fields, CURVATURE + b"0", "more follows"),
        (fs.parse_fields, CURVATURE[:14] + b"\2" + CURVATURE[15:], "one number a vertex; it has 2"),
        (fs.parse_fields, MGH[:11] + b"\2" + MGH[12:], r"n x 1 x 1, .*it has \[4, 2, 1, 1\]"),
        (fs.parse_fields, MGH[:-1], "must hold what it declares"),
        (
            fs.parse_fields,
            MGH[:3] + b"\2" + MGH[4:],
            "version 1 and of numbers; it is of version 2",
        ),
        (unpacked(fs.parse_fields), packed(MGH)[:-30], "must be whole; it ends too early"),
        (
            unpacked(fs.parse_fields),
            packed(MGH[:7] + b"\x7f" + MGH[8:16] + b"\x7f" + MGH[17:]),
            "declares; 270599716991 items at byte 284 do not fit into its 300 bytes",
        ),
        (
            parcels(annotations.parse_parcels),
            words(4, 3),
            "each of its 4 vertices once; it does not list 0",
        ),
        (
            parcels(annotations.parse_parcels),
            ANNOTATION[:36],
            "names and colors after its 4 vertices; it has none",
        ),
        (parcels(annotations.parse_parcels), words(36, 0), "it has none"),
        (parcels(annotations.parse_parcels), words(40, -3), "must be 1 or 2; it is 3"),
        (
            parcels(annotations.parse_parcels),
            words(8, 77),
            "stand in its table; that of vertex 0 is 77",
        ),
        (
            parcels(annotations.parse_parcels),
            words(len(ANNOTATION) - 4, 999),
            "must lie in 0..255; that of 'y'",
        ),
        (
            parcels(annotations.parse_parcels),
            b"#!ascii\n2\n0 0 0 0 0\n",
            "it declares 2 and holds 1",
        ),
        (
            parcels(annotations.parse_parcels),
            b"#!ascii\n1\n4 0 0 0 0\n",
            "vertices are 0..3; it lists 4",
        ),
        (cifti.parse_fields, CIFTI[:-9], f"uncompressed; {len(CIFTI)} bytes do not fit into its"),
        (cifti.parse_fields, CIFTI.replace(b"n+2", b"n+3"), "-1: the header is damaged"),
        (
            cifti.parse_fields,
            CIFTI.replace(b"BrainModel", b"BrainNodel"),
            "functions on brain models",
        ),
        (
            swc.parse,
            b"# a\n1 1 0 0 0 2.0\n",
            "rows of seven numbers.*; the first is b'1 1 0 0 0 2.0'",
        ),
        (swc.parse, b"1 1 0 x 0 2.0 -1\n", "rows of seven numbers.*; the first is b'1 1 0 x"),
        (swc.parse, b"", "rows of seven numbers"),
        (swc.parse, SKELETON.replace(b"7 3", b"2 3"), "must differ; 2 occurs twice"),
        (swc.parse, SKELETON.replace(b"0.5 2", b"0.5 4"), "that of point 9 is 4"),
    ],
)
def test_errors_of_reading(parse, data, message):
    with pytest.raises(FileFormatError, match=message):
        parse(data)


def test_a_surface_is_checked_as_any_other(tmp_path):
    path = tmp_path / "a.gii"
    bad = gifti.format_fields(TETRAHEDRON, {}, {})
    image = nib.GiftiImage.from_bytes(bad)
    image.darrays[1].data[2, 1] = 9
    path.write_bytes(image.to_bytes())
    with pytest.raises(InvalidShapeError, match=r"index vertices 0..3; face 2 is \[1, 9, 3\]"):
        es.read_mesh(path)
    image.darrays[0].data[1] = np.nan
    path.write_bytes(image.to_bytes())
    with pytest.raises(InvalidShapeError, match="must be finite; vertex 1"):
        es.read_mesh(path)


@pytest.mark.parametrize(
    ("name", "fields", "message"),
    [
        ("a.gii", {"a": np.arange(3)}, "must have a row for each"),
        ("a.func.gii", {"a": np.arange(320)}, "hold functions on vertices; 'a' is on faces"),
        ("a.gii", {"a": np.arange(320)}, "GIFTI files hold functions on vertices"),
        (
            "a.func.gii",
            {"a": np.full(162, 1e300)},
            "fit into 32 bits; that of 'a' at vertex 0 is 1e",
        ),
        ("a.func.gii", {"a": np.full(162, 2**40)}, "fit into 32 bits"),
        ("a.curv", {"a": HEIGHT, "b": HEIGHT}, "one function, without a name; there are 2"),
        ("a.curv", {"a": BALL.vertices}, "holds one number a vertex; there are 3"),
        ("a.dscalar.nii", {"a": HEIGHT}, "must begin with cortex_left: or cortex_right:"),
        ("a.dscalar.nii", {"cortex_left:a": HEIGHT, "cortex_right:b": HEIGHT}, "same functions"),
        ("a.dscalar.nii", {}, "same functions, and at least one"),
        ("a.dtseries.nii", {"cortex_left:a": HEIGHT}, "in .dtseries.nii are only read"),
    ],
)
def test_errors_of_writing_functions(tmp_path, name, fields, message):
    with pytest.raises((FileFormatError, es.InvalidParameterError), match=message):
        write_fields(BALL, tmp_path / name, fields)


@pytest.mark.parametrize(
    ("name", "colors", "message"),
    [
        ("a.label", None, "holds one parcel; there are 3"),
        (
            "a.annot",
            np.ones((3, 4)),
            "must differ in their colors, and none is black; that of 'low'",
        ),
        ("a.dlabel.nii", None, "lies on both sides of x = 0. Write .label.gii"),
        ("a.annot", [[1, 0, 0, 1], [0, 0, 0, 1], [0, 1, 0, 1]], "none is black; that of 'middle'"),
    ],
)
def test_errors_of_writing_parcels(tmp_path, name, colors, message):
    with pytest.raises(FileFormatError, match=message):
        write_parcellation(
            BALL, tmp_path / name, Parcellation(PARCELS.labels, PARCELS.names, colors)
        )


def test_gifti_names_the_structure(tmp_path):
    left = es.TriangleMesh(BALL.vertices - [3, 0, 0], BALL.faces)
    path = tmp_path / "sub-01_hemi-L.surf.gii"
    es.write_mesh(left, path)
    assert gifti.structure_of(path.read_bytes()) == "CortexLeft"
    assert nib.load(path).darrays[0].meta["AnatomicalStructurePrimary"] == "CortexLeft"
    for name, write in (("lh.a.func.gii", write_fields), ("lh.a.label.gii", write_parcellation)):
        write(left, tmp_path / name, {"a": HEIGHT} if write is write_fields else PARCELS)
        assert gifti.structure_of((tmp_path / name).read_bytes()) == "CortexLeft"
    right = es.TriangleMesh(BALL.vertices + np.array([3, 0, 0]), BALL.faces)
    for name in ("lh.a.func.gii", "lh.sulc", "x_hemi-L.surf.gii"):
        with pytest.raises(
            FileFormatError, match=r"the left one \(.*\), and the surface lies on the r"
        ):
            write_fields(right, tmp_path / name, {"a": HEIGHT})
    # What the file says is carried over, whatever the name of the new one.
    mesh, attributes = es.read_mesh(path, attributes=True)
    es.write_mesh(mesh, tmp_path / "other.gii", attributes=attributes)
    assert gifti.structure_of((tmp_path / "other.gii").read_bytes()) == "CortexLeft"


def test_what_else_a_file_holds_is_named(tmp_path):
    write_parcellation(BALL, tmp_path / "a.annot", PARCELS)
    with pytest.raises(FileFormatError, match="read_parcellation reads the parcels"):
        es.read_mesh(tmp_path / "a.annot")
    write_fields(BALL, tmp_path / "lh.sulc", {"a": HEIGHT})
    with pytest.raises(
        FileFormatError, match=r"it is '.curv'. es.io.read_fields reads the functions"
    ):
        es.read_mesh(tmp_path / "lh.sulc")


def test_without_nibabel_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("eigenshape._extras.import_module", _no_module)
    with pytest.raises(es.MissingExtraError, match=r"eigenshape\[neuro\]"):
        es.write_mesh(BALL, tmp_path / "a.gii")


def _no_module(name):
    raise ImportError(name)


QUADRANGLES = b"\xff\xff\xff\0\0\4\0\0\1" + b"\0\1" * 12 + b"\0\0\0\0\0\1\0\0\2\0\0\3"
MNI = b"P 0.3 0.3 0.4 10 1 3\n0 0 0\n1 0 0\n0 1 0\n" + b"0 0 1\n" * 3 + b"1\n0 1 1 1 1\n3\n0 1 2\n"
NUMBERS = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
VOLUMES = [kind(NUMBERS, np.eye(4)).to_bytes() for kind in (nib.MGHImage, nib.Nifti1Image)]
FILES = {
    "surface": (gifti.parse, SURFACE),
    "maps": (gifti.parse_fields, MAPS),
    "labels": (parcels(gifti.parse_parcels), LABELS),
    "freesurfer": (fs.parse, fs.format_binary(TETRAHEDRON)),
    "curvature": (fs.parse_fields, CURVATURE),
    "mgh": (fs.parse_fields, MGH),
    "mgz": (unpacked(fs.parse_fields), fs.format_maps(TETRAHEDRON, {"a": FOUR}, ".mgz")),
    "annotation": (parcels(annotations.parse_parcels), ANNOTATION),
    "label": (parcels(annotations.parse_parcels), b"#!ascii label\n2\n0 0 0 0 0\n3 0 0 1 0\n"),
    "cifti": (cifti.parse_fields, CIFTI),
    "cifti labels": (lambda data: cifti.parse_parcels(data, ON_THE_LEFT), CIFTI_LABELS),
    "skeleton": (swc.parse, SKELETON),
    "volume": (fs.parse_volume, VOLUMES[0]),
    "packed volume": (unpacked(fs.parse_volume), packed(VOLUMES[0])),
    "nifti": (nifti.parse_volume, VOLUMES[1]),
    "packed nifti": (unpacked(nifti.parse_volume), packed(VOLUMES[1])),
    "quadrangles": (fs.parse, QUADRANGLES),
    "surface in text": (
        fs.parse,
        b"#!ascii version of a\n3 1\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 1 2 0\n",
    ),
    "old functions": (fs.parse_fields, b"\0\0\4\0\0\4" + b"\1\2" * 4),
    "mni": (mni_obj.parse, MNI),
    "nifti functions": (
        nifti.parse_fields,
        nib.Nifti1Image(FOUR[:, None, None], np.eye(4)).to_bytes(),
    ),
}


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_refused_or_read(name):
    """Of each format 300 files: cut off, with bits flipped, with a number or a word changed."""
    parse, good = FILES[name]
    rng = np.random.default_rng(1)
    n_refused = 0
    for trial in range(300):
        bad = bytearray(good)
        place = int(rng.integers(len(bad)))
        if trial % 3 == 0:
            del bad[place:]
        elif trial % 3 == 1:
            for each in rng.integers(len(bad), size=rng.integers(1, 5)):
                bad[each] ^= 1 << int(rng.integers(8))
        else:
            pieces = [
                b"\x7f\xff\xff\xff",
                b"\xff" * 4,
                b"\0" * 4,
                b"9" * 9,
                b"-1",
                b"nan",
                b"<",
                b'"',
            ]
            bad[place : place + 4] = pieces[int(rng.integers(len(pieces)))]
        try:
            with np.errstate(all="ignore"):
                parse(bytes(bad))
        except es.EigenshapeError:
            n_refused += 1
    # What is cut off is refused, but for the end of text.
    assert n_refused >= 80
