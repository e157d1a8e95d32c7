"""Read and write meshes. The content of a file is checked before a mesh is returned."""

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Literal, overload

import numpy as np
from jaxtyping import Float, Int, UInt8

from certeig.kit.arguments import require_type
from certeig.kit.errors import FileFormatError, InvalidParameterError
from certeig.kit.files import as_path, replace_file
from eigenshape._errors import PLURALS, InvalidShapeError, count_nouns
from eigenshape._typing import FileLike
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.attributes import MeshAttributes, WriteJob, label_attributes
from eigenshape.io.carrying import carry_attributes
from eigenshape.io.formats.cells import SEGMENTS, require_kind, select_cells, split_sentence
from eigenshape.io.formats.registry import (
    MESH_FORMATS,
    WITH_COLORS,
    WRITTEN,
    CellKind,
    format_of,
    suffix_to_write,
    suffixes_with,
)
from eigenshape.io.formats.rounding import loss_in_single
from eigenshape.io.opening import SourceFile, naming, open_file

KINDS = {2: SEGMENTS, 3: "triangles"}  # of cells, by their number of corners
# What programs for terrain write for a height that is not known: GDAL, ArcGIS; SRTM
NOT_MEASURED = (-9999, -32768)
REPLACED = {
    "vertex colors": "vertex colors, since each part has a color of its own",
    "materials": "materials and images, since each part has a material of its own",
}


@overload
def read_mesh(
    path: FileLike,
    *,
    file_format: str | None = None,
    cells: CellKind | None = None,
    scene: str | int | None = None,
    drop_missing: bool = False,
    attributes: Literal[False] = False,
) -> TriangleMesh: ...
@overload
def read_mesh(
    path: FileLike,
    *,
    file_format: str | None = None,
    cells: CellKind | None = None,
    scene: str | int | None = None,
    drop_missing: bool = False,
    attributes: Literal[True],
) -> tuple[TriangleMesh, MeshAttributes]: ...
def read_mesh(
    path: FileLike,
    *,
    file_format: str | None = None,
    cells: CellKind | None = None,
    scene: str | int | None = None,
    drop_missing: bool = False,
    attributes: bool = False,
) -> TriangleMesh | tuple[TriangleMesh, MeshAttributes]:
    r"""Read a triangle mesh from a file.

    Vertices keep their order and are neither merged nor split. The exception is STL, which does not
    store shared vertices: there, corners with equal coordinates become one vertex. A polygon of k
    corners, convex or not, becomes k - 2 triangles inside of it. Colors, normals, textures and
    materials come as attributes, if they are requested. The whole file is read into memory.

    Parameters
    ----------
    path : str, Path, bytes or binary file
        A file of a format in `eigenshape.io.MESH_FORMATS`, such as .off, .obj, .ply, .stl or .glb,
        also packed by gzip; its content; or the file, open for reading bytes. A surface of
        FreeSurfer, such as lh.pial, is recognized by its first bytes.
    file_format : str, optional
        Suffix of the format, such as "ply" or ".ply". By default the suffix of the path. Bytes that
        do not begin with the name of their format need it.
    cells : {"triangles", "quads", "tetrahedra"}, optional
        Kind of cells to read, if the file holds several kinds or does not name the kind; see
        `read_shape`.
    scene : str or int, optional
        Name or number of the scene of a glTF file. By default the one that the file names.
    drop_missing : bool
        Whether to leave out vertices that are not finite, and the faces at them. By default they
        raise an error.
    attributes : bool
        Whether to return also what the file holds besides: texture coordinates, materials, images,
        colors, groups, fields. OBJ, PLY, GLB, glTF, VTU, VTP, VTK, NPZ, GIFTI and FreeSurfer files
        hold such content.

    Returns
    -------
    TriangleMesh
        With vertices (n, 3) in the unit of the file.
    MeshAttributes
        If `attributes` is True; see `write_mesh`.

    Raises
    ------
    FileFormatError
        If the format is unknown, the path is not a regular file, the content differs from what its
        header declares, or it holds no triangles in R³.
    InvalidShapeError
        If a coordinate is not finite, a face has an index that is not that of a vertex, or a
        polygon crosses itself.
    InvalidParameterError
        If `cells` is unknown.
    OSError
        If the system cannot open the file, such as FileNotFoundError.

    See Also
    --------
    read_shape : Read a shape of any kind, also tetrahedra, curves and points.
    write_mesh : Write a mesh.
    repair : Repair a mesh with faults.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "square.off")
    >>> _ = path.write_text("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
    >>> mesh = es.read_mesh(path)
    >>> mesh.faces.tolist()
    [[0, 1, 2], [0, 2, 3]]
    """
    require_kind(cells)
    source = open_file(path, file_format, MESH_FORMATS, scene)
    with naming(source.path):
        points, simplices = parse_file(source, cells)
        require_surface(points, simplices)
        kept, faces, *_ = require_finite(points, simplices, drop_missing=drop_missing)
        mesh = TriangleMesh(kept, faces)
        if not attributes:
            return mesh
        try:
            # Attributes are listed by the faces of the file, so they are read with all of them.
            whole = TriangleMesh(np.where(np.isfinite(points), points, 0.0), simplices)
            return mesh, carry_attributes(_read_attributes(source, whole), mesh)
        except FileFormatError:
            raise
        except (LookupError, TypeError, AttributeError, ValueError) as err:
            raise FileFormatError(
                f"Materials and other attributes must be whole; these are not: {err!r}. "
                "Without attributes=True the file can be read."
            ) from err


def parse_file(
    source: SourceFile, cells: CellKind | None
) -> tuple[Float[np.ndarray, "n d"], Int[np.ndarray, "s corners"]]:
    """Return points and the selected simplices, of shape (0, 3) if there are only points.

    Warns
    -----
    UserWarning
        If hexahedra, wedges or pyramids were split, the lowest coordinate is one of `NOT_MEASURED`, or
        the format's `parse` returned notes.
    """
    known = format_of(source.suffix)
    options = source.options
    if "scenes" in known.traits:
        options["scene"] = source.scene
    elif source.scene is not None:
        raise InvalidParameterError(
            f"scene is for {', '.join(suffixes_with('scenes'))}; the suffix is {source.suffix}."
        )
    points, found, *notes = known.load().parse(source.data, **options)
    blocks = found if isinstance(found, dict) else {KINDS[found.shape[1]]: found}
    simplices = select_cells(points, blocks, cells)
    if simplices.shape[1] == 4 and (sentence := split_sentence(blocks)):
        notes.append(sentence)
    if np.isin(points.min(axis=0, initial=0), NOT_MEASURED).any():
        notes.append(
            "its lowest coordinate is one that programs write where they measured nothing "
            f"({', '.join(map(str, NOT_MEASURED))}); if so, leave out the points that have it"
        )
    for note in notes:
        warnings.warn(f"{source.path}: {note}", stacklevel=4)
    return points, simplices


def require_finite(
    points: Float[np.ndarray, "n d"],
    simplices: Int[np.ndarray, "s corners"],
    *,
    drop_missing: bool,
) -> tuple[
    Float[np.ndarray, "m d"],
    Int[np.ndarray, "r corners"],
    Int[np.ndarray, " m"],
    tuple[str, ...],
]:
    """Leave out points that are not finite, and the simplices at them, if that is requested.

    Returns the points and simplices that stay, the indices of these points in the file, and a
    report of one sentence or none.

    Raise InvalidShapeError if a point is not finite, and such points are not to be left out, or no
    face is without one.
    """
    is_surface = len(simplices) > 0 and simplices.shape[1] == points.shape[1] == 3
    noun, cell = ("vertex", "face") if is_surface else ("point", "cell")
    missing = np.flatnonzero(~np.isfinite(points).all(axis=1))
    stays = ~np.isin(simplices, missing).any(axis=1)
    nothing_stays = len(simplices) > 0 and not stays.any()
    if missing.size and (nothing_stays or not drop_missing):
        first = int(missing[0])
        remedy = (
            "Without them no face is left."
            if nothing_stays
            else "Scanners write such points if they measured nothing: drop_missing=True, or "
            "--repair drop_missing, leaves them out, and the faces at them."
        )
        raise InvalidShapeError(
            f"{PLURALS.get(noun, 'points')} must be finite; {noun} {first} is {points[first].tolist()} "
            f"({missing.size} such). {remedy}"
        )
    if not missing.size:
        return points, simplices, np.arange(len(points)), ()
    kept = np.delete(np.arange(len(points)), missing)
    # An index is lower by the number of missing points before it.
    renumbered = simplices[stays] - np.searchsorted(missing, simplices[stays])
    sentence = f"drop_missing left out {count_nouns(missing.size, noun)} without finite coordinates"
    if len(simplices):
        sentence += f" and {count_nouns(int((~stays).sum()), cell)} at them"
    return points[kept], renumbered, kept, (sentence,)


def _read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    module = format_of(source.suffix).load_attributes()
    if module is None:
        return MeshAttributes.plain(mesh)
    return module.read_attributes(source, mesh)


def require_surface(points: np.ndarray, simplices: np.ndarray) -> None:
    """Raise an error if simplices are no triangles in R³."""
    if not len(simplices):
        raise FileFormatError(
            f"A mesh file must hold triangles; it holds {len(points)} points and no face. "
            "read_points reads points, and es.io.read_surface makes a surface of them."
        )
    n_corners, dim = simplices.shape[1], points.shape[1]
    if (n_corners, dim) != (3, 3):
        what = KINDS.get(n_corners, "tetrahedra")
        remedies = {
            4: ' cells="triangles" reads the triangles beside them, if there are any.',
            3: " es.io.read_surface, or eigenshape repair, takes them at z = 0.",
        }
        raise FileFormatError(
            f"A mesh file must hold triangles in R^3; it holds {len(simplices)} {what} in R^{dim}, which read_shape "
            f"reads.{remedies.get(n_corners, '')}"
        )


def write_mesh(
    mesh: MeshLike,
    path: str | Path,
    *,
    binary: bool | None = None,
    colors: UInt8[np.ndarray, "n 3"] | None = None,
    face_labels: Int[np.ndarray, " f"] | None = None,
    attributes: MeshAttributes | None = None,
) -> None:
    """Write a mesh to a file, in the format of its suffix.

    The file appears complete or not at all. `read_mesh` reads OFF, OBJ and PLY back exactly. STL
    stores triangles without shared vertices; GLB, binary STL, GIFTI and FreeSurfer (.surf, or a name
    such as lh.pial) store single precision.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices and f faces.
    path : str or Path
        Its suffix, such as .ply, names the format. Another one raises an error that lists all.
    binary : bool, optional
        Whether to write binary data, where the format has both forms, such as PLY and STL. By
        default True.
    colors : (n, 3) uint8, optional
        Red, green and blue of each vertex; for PLY, OBJ and GLB.
    face_labels : (f,) int, optional
        A whole number of 32 bits for each face, such as the number of its part. In PLY it is the
        property `label` of faces; OBJ and GLB get a material for each part, named part_0, part_1
        and so on, in the mean color of its vertices.
    attributes : MeshAttributes, optional
        What the file that the mesh was read from holds besides, as `read_mesh` returns it. From OBJ
        to OBJ and from glTF to GLB, everything but positions and normals is written again as it
        was; normals are computed anew. To other formats goes what they can hold. A warning names
        what is lost. After repairs `carry_attributes` comes first.

    Raises
    ------
    FileFormatError
        If the suffix is unknown, or the format has only single precision and coordinates do not fit
        into it.
    InvalidParameterError
        If the format has no such binary or text form, if it takes no colors or labels, if
        their shapes are wrong, or if attributes belong to other faces.
    OSError
        If the system cannot write the file.

    See Also
    --------
    read_mesh : Read a mesh.
    eigenshape.io.carry_attributes : Carry attributes to a repaired mesh.
    eigenshape.io.write_fields : Write a mesh with functions on vertices and faces.
    eigenshape.plot.value_colors, eigenshape.plot.part_colors : Compute colors.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> mesh = es.icosphere(1)
    >>> path = pathlib.Path(tempfile.mkdtemp(), "ball.ply")
    >>> es.write_mesh(mesh, path, colors=es.plot.value_colors(mesh.vertices[:, 1]))
    >>> bool((es.read_mesh(path).vertices == mesh.vertices).all())
    True
    """
    lost = save_mesh(
        as_mesh(mesh),
        as_path(path),
        binary=binary,
        colors=colors,
        face_labels=face_labels,
        attributes=attributes,
    )
    if lost:
        warnings.warn(lost, stacklevel=2)


def save_mesh(
    mesh: TriangleMesh,
    path: Path,
    *,
    binary: bool | None = None,
    colors: UInt8[np.ndarray, "n 3"] | None = None,
    face_labels: Int[np.ndarray, " f"] | None = None,
    attributes: MeshAttributes | None = None,
) -> str:
    """Write a mesh as `write_mesh` does, and return a sentence that names what is lost, or none."""
    suffix = suffix_to_write(path, WRITTEN)
    known = format_of(suffix)
    held = attributes or MeshAttributes.plain(mesh)
    if not np.array_equal(held.mesh.faces, mesh.faces):
        raise InvalidParameterError(
            f"attributes must belong to the {mesh.n_faces} faces of the mesh; they belong to {held.mesh.n_faces} "
            "other ones. Carry them by es.io.carry_attributes(attributes, repaired_mesh)."
        )
    is_binary = "binary" in known.traits if binary is None else binary
    kinds = suffixes_with("binary" if is_binary else "text")
    if suffix not in kinds:
        raise InvalidParameterError(
            f"binary={binary} is for {', '.join(kinds)}; the suffix is {suffix}."
        )
    if colors is not None:
        _require_array(colors, "colors", f"({mesh.n_vertices}, 3) uint8", suffix)
    if face_labels is not None:
        _require_labels(face_labels, mesh, suffix)
    lost: list[str] = []
    if face_labels is not None and "labels" not in known.traits:
        lost += _replaced_by_parts(held, "vertex colors", "materials")
        gray = np.full((mesh.n_vertices, 3), 200, np.uint8)
        held = label_attributes(held, face_labels, gray if colors is None else colors)
    elif colors is not None:
        lost += [] if face_labels is None else _replaced_by_parts(held, "vertex colors")
        opaque = np.column_stack([colors, np.full(len(colors), 255, np.uint8)])
        held = replace(held, colors=opaque[mesh.faces], source=None)
    job = WriteJob(mesh, path, suffix, is_binary, held, face_labels, lost)
    try:
        if module := known.load_attributes():
            files = module.write(job)
        else:
            job.lose(held.contents)
            module = known.load()
            files = {path: (module.format_binary if is_binary else module.format_text)(mesh)}
        lost += loss_in_single(mesh) if is_binary and "single" in known.traits else []
    except FileFormatError as err:
        raise FileFormatError(f"{path} cannot hold the mesh. {err}") from err
    for place, data in files.items():
        replace_file(place, data)
    return f"{path.name} does not keep: {', '.join(dict.fromkeys(lost))}." if lost else ""


def _replaced_by_parts(held: MeshAttributes, *kinds: str) -> list[str]:
    """Name the looks of a file that those of parts take the place of."""
    return [REPLACED[kind] for kind in kinds if held.contents[kind]]


def _require_array(values: np.ndarray, name: str, wanted: str, suffix: str) -> None:
    """Raise an error if values are not of the wanted shape and type, or the format does not take them."""
    require_type(values, np.ndarray, name)
    found = f"{values.shape} {values.dtype}"
    if suffix not in WITH_COLORS or not found.startswith(wanted):
        raise InvalidParameterError(
            f"{name} must be {wanted} and go to {', '.join(WITH_COLORS)}; they are {found} and go to {suffix}."
        )


def _require_labels(labels: np.ndarray, mesh: TriangleMesh, suffix: str) -> None:
    _require_array(labels, "face_labels", f"({mesh.n_faces},)", suffix)
    beyond = np.flatnonzero(labels != labels.astype(np.int32))
    if beyond.size:
        raise InvalidParameterError(
            f"face_labels must fit into 32 bits; that of face {beyond[0]} is {labels[beyond[0]]}."
        )
