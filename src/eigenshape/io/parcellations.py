"""Read and write parcels of a surface: annotation, label, GIFTI and CIFTI files."""

import warnings
from pathlib import Path

from certeig.kit.arguments import require_type
from certeig.kit.errors import FileFormatError
from certeig.kit.files import as_path, replace_file
from eigenshape.features.parcellation import Parcellation
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.io.field_files import structure_named
from eigenshape.io.formats.registry import PARCEL_FORMATS, format_of, suffix_to_write
from eigenshape.io.hemispheres import side_of_file
from eigenshape.io.opening import naming, open_file


def read_parcellation(path: str | Path, mesh: MeshLike) -> Parcellation:
    """Read the parcels of a surface, with their names and colors.

    Parameters
    ----------
    path : str or Path
        An annotation (.annot) or label file (.label) of FreeSurfer, a GIFTI file (.label.gii), or a
        CIFTI file (.dlabel.nii), of which the hemisphere is taken that the surface is of. A label
        file lists the vertices of one parcel.
    mesh : MeshLike
        The surface that the file belongs to.

    Returns
    -------
    Parcellation
        Label -1 is for vertices in no parcel: those that are black in an annotation, and ??? in
        GIFTI. Parcels without colors in GIFTI get different hues.

    Warns
    -----
    UserWarning
        If a parcel is empty because an earlier one has its color or key, if a black parcel has
        vertices, if one is transparent, or if a label file lists points without a vertex.

    Raises
    ------
    FileFormatError
        If the file is of another surface or hemisphere, has no names, or does not hold what it
        declares, or the surface lies on both sides of x = 0 and the file is of both.
    MissingExtraError
        If nibabel is not installed, which reads .nii.
    OSError
        If the system cannot open the file.

    See Also
    --------
    es.io.write_parcellation : Write parcels.
    es.io.read_fields : Read numbers without names, such as those of a mask.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "halves.annot")
    >>> ball = es.icosphere(1)
    >>> halves = es.features.Parcellation((ball.vertices[:, 2] > 0).astype(int), ("low", "high"))
    >>> es.io.write_parcellation(ball, path, halves)
    >>> es.io.read_parcellation(path, ball).names
    ('low', 'high')
    """
    mesh = as_mesh(mesh)
    source = open_file(path, None, PARCEL_FORMATS)
    with naming(source.path):
        module = format_of(source.suffix).load()
        parcellation: Parcellation
        parcellation, *notes = module.parse_parcels(source.data, mesh, **source.options)
        n_labels = len(parcellation.labels)
        if n_labels != mesh.n_vertices:
            raise FileFormatError(
                f"A parcellation must have a label for each of {mesh.n_vertices} vertices; it has "
                f"{n_labels}, so it belongs to another surface."
            )
        structure = module.structure_of(source.data) if source.suffix == ".label.gii" else ""
        if source.suffix != ".dlabel.nii":  # which holds both
            side_of_file(mesh, source.path.name, structure)
    for note in notes:
        warnings.warn(f"{source.path}: {note}", stacklevel=2)
    return parcellation


def write_parcellation(mesh: MeshLike, path: str | Path, parcellation: Parcellation) -> None:
    """Write the parcels of a surface, as FreeSurfer and Connectome Workbench keep them.

    Parameters
    ----------
    mesh : MeshLike
        With n vertices.
    path : str or Path
        Must end in .annot, .label, .label.gii or .dlabel.nii. Annotations keep colors in bytes, and a label file
        keeps one parcel without its name. In GIFTI and CIFTI, parcel i has the label i + 1.
    parcellation : Parcellation
        Of the n vertices.

    Raises
    ------
    FileFormatError
        If the suffix is another one, or the format cannot hold the parcels: colors in an annotation
        must differ, and a label file holds one parcel.
    InvalidParameterError
        If the parcellation is of another number of vertices.
    MissingExtraError
        If nibabel is not installed, which writes GIFTI and CIFTI.
    OSError
        If the system cannot write the file.

    See Also
    --------
    es.io.read_parcellation : Read parcels.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> path = pathlib.Path(tempfile.mkdtemp(), "cap.label")
    >>> ball = es.icosphere(1)
    >>> cap = es.features.Parcellation((ball.vertices[:, 2] > 0.5).astype(int) - 1, ("cap",))
    >>> es.io.write_parcellation(ball, path, cap)
    >>> int((es.io.read_parcellation(path, ball).labels == 0).sum())
    9
    """
    mesh, path = as_mesh(mesh), as_path(path)
    require_type(parcellation, Parcellation, "parcellation")
    parcellation.require_vertices(mesh.n_vertices)
    suffix = suffix_to_write(path, PARCEL_FORMATS)
    structure = structure_named(mesh, path, ".gii")
    named = {"structure": structure} if suffix.endswith(".gii") else {}
    module = format_of(suffix).load()
    replace_file(path, module.format_parcels(mesh, parcellation, suffix, **named))
