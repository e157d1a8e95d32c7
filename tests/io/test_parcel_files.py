"""Parcels and functions of brains that other programs mean in another way, and what is said of them."""

import gzip
import warnings

import nibabel as nib
import numpy as np
import pytest
from nibabel import freesurfer
from tetrahedra import TETRAHEDRON

import eigenshape as es
from eigenshape import FileFormatError
from eigenshape.features import Parcellation
from eigenshape.io import read_fields, read_parcellation, read_volume, write_parcellation

RED, BLUE, BLACK = [255, 0, 0, 0], [0, 0, 255, 0], [0, 0, 0, 0]


def annotation(path, colors, labels, names=("a", "b")):
    """Write an annotation as nibabel does."""
    table = np.column_stack([colors, np.zeros(len(colors), int)])
    freesurfer.write_annot(path, np.array(labels), table, list(names), fill_ctab=True)
    return path


def test_parcels_of_one_color_are_named(tmp_path):
    path = annotation(tmp_path / "a.annot", [RED, RED], [0, 1, 1, 0])
    with pytest.warns(UserWarning, match=r"told apart by their colors, and those of 'a' and 'b'"):
        found = read_parcellation(path, TETRAHEDRON)
    assert found.labels.tolist() == [0, 0, 0, 0]
    assert found.names == ("a", "b")


def test_parcels_of_one_color_are_refused_and_the_remedy_keeps_them(tmp_path):
    gray = [0.5, 0.5, 0.5, 1]
    for colors in ([gray, gray], [[1, 0, 0, 1], [0, 0, 0, 1]]):
        twins = Parcellation([0, 1, 1, -1], ("a", "b"), colors)
        with pytest.raises(FileFormatError, match=r"must differ in their colors.*Write .label.gii"):
            write_parcellation(TETRAHEDRON, tmp_path / "a.annot", twins)
        write_parcellation(TETRAHEDRON, tmp_path / "a.label.gii", twins)
        found = read_parcellation(tmp_path / "a.label.gii", TETRAHEDRON)
        assert found.labels.tolist() == [0, 1, 1, -1]
        assert np.allclose(found.colors, colors)


def test_black_is_no_parcel_as_in_nibabel(tmp_path):
    path = annotation(tmp_path / "a.annot", [BLACK, RED], [0, 1, 1, 0])
    with pytest.warns(UserWarning, match=r"black stands for no parcel .* of 'a': its 2 vertices"):
        found = read_parcellation(path, TETRAHEDRON)
    labels, _, _ = freesurfer.read_annot(path)
    assert found.labels.tolist() == labels.tolist() == [-1, 1, 1, -1]
    # What FreeSurfer calls unknown is no parcel in any case.
    path = annotation(tmp_path / "a.annot", [BLACK, RED], [0, 1, 1, 0], ("Unknown", "b"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read_parcellation(path, TETRAHEDRON).labels.tolist() == [-1, 1, 1, -1]


def test_transparent_parcels_are_named(tmp_path):
    path = annotation(tmp_path / "a.annot", [[255, 0, 0, 255], BLUE], [0, 1, 1, 0])
    with pytest.warns(UserWarning, match=r"that of 'a' is 255 \(1 such\), so it has the opacity 0"):
        found = read_parcellation(path, TETRAHEDRON)
    assert found.colors.tolist() == [[1, 0, 0, 0], [0, 0, 1, 1]]
    # The remedy
    colors = found.colors.copy()
    colors[:, 3] = 1
    write_parcellation(TETRAHEDRON, path, Parcellation(found.labels, found.names, colors))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read_parcellation(path, TETRAHEDRON)
    assert found.colors.tolist() == [[1, 0, 0, 1], [0, 0, 1, 1]]
    assert freesurfer.read_annot(path)[1][:, 3].tolist() == [0, 0]


def test_points_without_a_vertex_are_named(tmp_path):
    path = tmp_path / "a.label"
    path.write_text("#!ascii label\n3\n0 0 0 0 0\n-1 1 0 0 0\n2 0 1 0 0\n")
    with pytest.warns(UserWarning, match="1 of its 3 points have no vertex, but -1"):
        assert read_parcellation(path, TETRAHEDRON).labels.tolist() == [0, -1, 0, -1]
    path.write_text("#!ascii label\n1\n-2 0 0 0 0\n")
    with pytest.raises(FileFormatError, match=r"0..3; it lists -2"):
        read_parcellation(path, TETRAHEDRON)


def labels_gifti(path, table, kind="INT32", numbers="0 1 1 3"):
    path.write_text(
        f'<GIFTI Version="1.0" NumberOfDataArrays="1"><LabelTable>{table}</LabelTable>'
        f'<DataArray Intent="NIFTI_INTENT_LABEL" DataType="NIFTI_TYPE_{kind}" Encoding="ASCII" '
        'ArrayIndexingOrder="RowMajorOrder" Dimensionality="1" Dim0="4" Endian="LittleEndian">'
        f"<Data>{numbers}</Data></DataArray></GIFTI>"
    )
    return path


@pytest.mark.parametrize("key", ["Key", "Index"])
@pytest.mark.parametrize("kind", ["INT32", "INT16", "UINT8", "FLOAT32"])
def test_labels_without_colors_get_hues(tmp_path, key, kind):
    table = f'<Label {key}="0">???</Label><Label {key}="1">a</Label><Label {key}="3">b</Label>'
    found = read_parcellation(labels_gifti(tmp_path / "a.label.gii", table, kind), TETRAHEDRON)
    assert found.labels.tolist() == [-1, 0, 0, 1]
    assert found.names == ("a", "b")
    assert np.array_equal(found.colors, Parcellation([], ("a", "b")).colors)


def test_a_label_may_have_a_color_and_no_opacity(tmp_path):
    table = '<Label Key="1" Red="0.5" Green="0" Blue="1">a</Label><Label Key="3">b</Label>'
    path = labels_gifti(tmp_path / "a.label.gii", table)
    found = read_parcellation(path, TETRAHEDRON)
    assert found.colors[0].tolist() == [0.5, 0, 1, 1]
    assert np.array_equal(found.colors[1], Parcellation([], ("a", "b")).colors[1])


def test_labels_of_one_key_are_named(tmp_path):
    table = '<Label Key="1">a</Label><Label Key="1">b</Label><Label Key="3">c</Label>'
    with pytest.warns(UserWarning, match=r"told apart by their keys, and those of 'a' and 'b'"):
        found = read_parcellation(labels_gifti(tmp_path / "a.label.gii", table), TETRAHEDRON)
    assert found.labels.tolist() == [-1, 0, 0, 2]


# Functions that are stored as volumes


@pytest.mark.parametrize("name", ["a.mgh", "a.mgz", "a.nii", "a.nii.gz"])
@pytest.mark.parametrize("shape", [(12,), (12, 1, 1), (6, 1, 2), (4, 1, 3), (12, 1, 1, 1)])
def test_functions_of_one_frame_in_volumes(tmp_path, name, shape):
    values = np.arange(12, dtype=np.float32)
    image = nib.MGHImage if ".mg" in name else nib.Nifti1Image
    if ".mg" in name:  # which nibabel writes with three axes
        shape = (*shape, 1, 1)[:3]
    image(values.reshape(shape, order="F"), np.eye(4)).to_filename(tmp_path / name)
    found = read_fields(tmp_path / name)["values"]
    assert found.dtype == np.float32
    assert found.tolist() == values.tolist()


@pytest.mark.parametrize("name", ["a.mgz", "a.nii", "a.nii.gz"])
@pytest.mark.parametrize("shape", [(12, 1, 1, 3), (6, 1, 2, 3)])
def test_frames_in_volumes_are_columns(tmp_path, name, shape):
    table = np.arange(36, dtype=np.int16).reshape(12, 3)
    image = nib.MGHImage if ".mg" in name else nib.Nifti1Image
    image(table.reshape(shape, order="F"), np.eye(4)).to_filename(tmp_path / name)
    assert np.array_equal(read_fields(tmp_path / name)["values"], table)


def test_more_vertices_than_a_header_of_nifti_holds(tmp_path):
    values = np.arange(163_842, dtype=np.float32)
    path = tmp_path / "a.nii.gz"
    # FreeSurfer writes -1, and the number elsewhere.
    image = nib.Nifti1Image(values.reshape(27_307, 1, 6, order="F"), np.eye(4))
    data = bytearray(image.to_bytes())
    path.write_bytes(gzip.compress(data, mtime=0))
    assert np.array_equal(read_fields(path)["values"], values)
    data[40:48] = np.array([3, -1, 1, 1], "<i2").tobytes()
    data[144:148] = np.array([163_842], "<i4").tobytes()
    path.write_bytes(gzip.compress(data, mtime=0))
    assert np.array_equal(read_fields(path)["values"], values)
    data[144:148] = np.array([0], "<i4").tobytes()
    path.write_bytes(gzip.compress(data, mtime=0))
    with pytest.raises(FileFormatError, match="A NIfTI file must hold a volume; HeaderDataError"):
        read_fields(path)
    nib.Nifti2Image(values[:, None, None], np.eye(4)).to_filename(tmp_path / "b.nii")
    assert np.array_equal(read_fields(tmp_path / "b.nii")["values"], values)


def test_a_volume_is_no_function_on_vertices(tmp_path):
    image = nib.Nifti1Image(np.ones((2, 3, 4), np.int16), np.eye(4))
    image.to_filename(tmp_path / "a.nii")
    with pytest.raises(
        FileFormatError,
        match=r"A NIfTI file of functions on vertices must be n x 1 x 1, .*it has \[2, 3, 4\]",
    ):
        read_fields(tmp_path / "a.nii")
    assert read_volume(tmp_path / "a.nii")[0].shape == (2, 3, 4)
    with pytest.raises(FileFormatError, match=r"are only read. Write .mgh"):
        es.io.write_fields(TETRAHEDRON, tmp_path / "a.nii", {"a": np.arange(4)})
    es.io.write_fields(TETRAHEDRON, tmp_path / "a.mgh", {"a": np.arange(4)})
