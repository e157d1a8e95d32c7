"""Functions on vertices and faces, in files of a mesh such as .vtu, or without one such as .func.gii."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from certeig.kit.arguments import require_unicode
from certeig.kit.arrays import freeze
from certeig.kit.errors import FileFormatError, InvalidParameterError
from certeig.kit.files import as_path, replace_file
from certeig.kit.typing import ArrayLike
from eigenshape.geometry.conversion import MeshLike, as_simplicial
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import Mesh
from eigenshape.io.attributes import MeshAttributes
from eigenshape.io.formats.registry import (
    FIELD_FORMATS,
    MAP_FORMATS,
    format_of,
    suffix_to_write,
)
from eigenshape.io.formats.rounding import loss_in_single
from eigenshape.io.hemispheres import side_of_file
from eigenshape.io.opening import SourceFile, naming, open_file

WRITABLE = ("f8", "f4", "i8", "i4", "u1")  # numpy's types of fields that are written as they are
Fields = dict[str, np.ndarray]


def write_fields(mesh: MeshLike, path: str | Path, fields: Mapping[str, ArrayLike]) -> None:
    """Write a mesh with functions on its vertices and faces, or functions on its vertices alone.

    .vtu, .vtp, .vtk, .npz and .gii hold the mesh, too. .func.gii, .shape.gii, .label.gii, .dscalar.nii,
    .curv, .mgh and .mgz hold functions on vertices alone, as Connectome Workbench and FreeSurfer
    keep them; a path such as lh.thickness is a file in .curv. Those and .gii hold numbers of 32
    bits. In .dscalar.nii, the name of a function begins with its hemisphere, as in
    "cortex_left:thickness", and vertices with NaN in all functions are left out. GIFTI files name
    the structure CortexLeft or CortexRight if their name does, as lh.modes.func.gii or
    sub-01_hemi-L_modes.func.gii.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices and f faces. Tetrahedra and segments, which go to .vtu, count as faces.
    path : str or Path
        Its suffix names the format.
    fields : mapping of str to array
        Functions by name, (n,) or (n, d) on vertices, (f,) or (f, d) on faces. If there are as many
        vertices as faces, they are on vertices.

    Raises
    ------
    FileFormatError
        If the suffix is another one, or another one than .vtu for tetrahedra or segments, or the
        format cannot hold the functions, or its name names the hemisphere on the other side.
    InvalidParameterError
        If a field has another number of rows, or is not of numbers.
    MissingExtraError
        If nibabel is not installed, which writes .gii and .nii.
    OSError
        If the system cannot write the file.

    See Also
    --------
    read_fields

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.vtk")
    >>> es.io.write_fields(mesh, path, {"area": es.geometry.face_areas(mesh)})
    >>> es.io.read_fields(path)["area"].shape
    (80,)
    """
    mesh, path = as_simplicial(mesh), as_path(path)
    suffix = suffix_to_write(path, FIELD_FORMATS)
    data = format_fields(mesh, suffix, fields, structure_named(mesh, path, suffix))
    lost = []
    if "single" in format_of(suffix).traits and isinstance(mesh, TriangleMesh):
        lost = loss_in_single(mesh)
    replace_file(path, data)
    for loss in lost:
        warnings.warn(f"{path.name} does not keep {loss}", stacklevel=2)


def structure_named(mesh: Mesh, path: Path, suffix: str) -> str:
    """Return CortexLeft or CortexRight by the name of a file that is to be written.

    Raise FileFormatError if the surface lies on the other side than the name says.
    """
    if suffix not in (".gii", *MAP_FORMATS) or not isinstance(mesh, TriangleMesh):
        return ""
    side = side_of_file(mesh, path.name)
    return f"Cortex{side.capitalize()}" if side else ""


def format_fields(
    mesh: Mesh, suffix: str, fields: Mapping[str, ArrayLike], structure: str = ""
) -> bytes:
    """Write a mesh and its fields; each has a row for every vertex, or for every face.

    GIFTI files name the structure.

    Raise FileFormatError if the format holds triangles only, and the mesh has other cells, and
    InvalidParameterError if a field has another number of rows, or is not of numbers.
    """
    of_vertices: Fields = {}
    of_faces: Fields = {}
    for name, values in fields.items():
        require_unicode(name, "Names of fields")
        array = np.asarray(values)
        if array.dtype.kind not in "buif" or array.ndim not in (1, 2):
            raise InvalidParameterError(
                f"fields must be lists or tables of numbers; {name!r} is {array.dtype} of shape {array.shape}."
            )
        if len(array) not in (mesh.n_points, len(mesh.simplices)):
            raise InvalidParameterError(
                f"fields must have a row for each of {mesh.n_points} vertices or {len(mesh.simplices)} faces; "
                f"{name!r} has {len(array)}."
            )
        if array.dtype.str[1:] not in WRITABLE:
            array = array.astype(np.int64 if array.dtype.kind in "bui" else np.float64)
        held = of_vertices if len(array) == mesh.n_points else of_faces
        held[name] = np.ascontiguousarray(array)
    if suffix != ".vtu" and not isinstance(mesh, TriangleMesh):
        raise FileFormatError(
            f"Files in {suffix} hold triangles in R^3; the mesh is {mesh!r}. Write it to .vtu."
        )
    known = format_of(suffix)
    named = {"structure": structure} if suffix.endswith(".gii") else {}
    if "fields" in known.traits:
        data: bytes = known.load().format_fields(mesh, of_vertices, of_faces, **named)
    elif of_faces:
        raise FileFormatError(
            f"Files in {suffix} hold functions on vertices; {next(iter(of_faces))!r} is on faces."
        )
    else:
        data = known.load().format_maps(mesh, of_vertices, suffix, **named)
    return data


def read_fields(path: str | Path) -> Fields:
    """Read the functions on vertices and faces that a file holds, with or without a mesh.

    Parameters
    ----------
    path : str or Path
        A file such as `write_fields` writes; also lh.thickness and other files of FreeSurfer
        without a suffix, and functions on vertices that are stored as a volume of n x 1 x 1 voxels
        in .nii.

    Returns
    -------
    dict of str to array
        By name; each has a row for every vertex or for every face. If a function on faces has the
        name of one on vertices, it comes under ``face_`` and its name. A function without a name is
        called "values", and those of one name in a GIFTI file are columns of one table. Functions
        in .dscalar.nii, .dtseries.nii and .dlabel.nii are named as in "cortex_left:thickness", and
        are NaN at vertices that the file leaves out; a series is a table of (n, times), named as in
        "cortex_left:series".

    Raises
    ------
    FileFormatError
        If the format holds no fields, or the content differs from what the file declares.
    MissingExtraError
        If nibabel is not installed, which reads .nii.
    OSError
        If the system cannot open the file.

    See Also
    --------
    read_parcellation : Read labels with their names and colors.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.vtu")
    >>> es.io.write_fields(mesh, path, {"height": mesh.vertices[:, 2]})
    >>> es.io.read_fields(path)["height"].shape
    (42,)
    """
    return _parse_fields(open_file(path, None, FIELD_FORMATS))


def _parse_fields(source: SourceFile) -> Fields:
    with naming(source.path):
        module = format_of(source.suffix).load()
        of_vertices, of_faces, *notes = module.parse_fields(source.data, **source.options)
    for note in notes:
        warnings.warn(f"{source.path}: {note}", stacklevel=3)
    found = dict(of_vertices)
    for name, values in of_faces.items():
        found[f"face_{name}" if name in found else name] = values
    return {name: freeze(values) for name, values in found.items()}


def read_field_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Return the fields of a file as attributes; those of cells that are no triangles are named."""
    fields = _parse_fields(source)
    fitting = {
        name: values
        for name, values in fields.items()
        if len(values) in (mesh.n_vertices, mesh.n_faces)
    }
    others = tuple(f"the field {name!r}" for name in fields if name not in fitting)
    return replace(MeshAttributes.plain(mesh), fields=fitting, others=others, source=source)
