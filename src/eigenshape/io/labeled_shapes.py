"""Labels of faces, and maps between vertices, in files; meshes with labels beside them."""

from collections.abc import Sequence
from pathlib import Path

from scipy.spatial import cKDTree

from certeig.kit.errors import FileFormatError
from certeig.kit.files import as_path
from eigenshape.geometry.repairs.repair import repair as apply_repairs
from eigenshape.io.formats.registry import MESH_FORMATS
from eigenshape.io.label_files import find_labels, read_labels
from eigenshape.io.mesh_files import read_mesh
from eigenshape.retrieval.labels.labeled_shape import LabeledShape

NAMES_FILE = "names.txt"  # in a folder of labeled shapes: the name of label k in line k + 1


def read_labeled_shape(
    path: str | Path, labels: str | Path | None = None, *, repair: Sequence[str] = ()
) -> LabeledShape:
    r"""Read a mesh and the labels of its faces.

    Parameters
    ----------
    path : path
        A mesh, in any format of `read_mesh`.
    labels : path, optional
        One label a line (``.seg``, ``.txt``), the list ``face_labels`` (``.json``), or the property
        ``label`` of faces (``.ply``). By default the file of one of these kinds that lies beside
        the mesh and has its name, or the mesh itself if it is a PLY file.
    repair : sequence of str
        Names of repairs, as `es.repair` takes them, such as ["auto"]. Repairs remove and split
        faces: each takes the label of the nearest one of the file.

    Returns
    -------
    LabeledShape
        Its report says what was repaired.

    Raises
    ------
    FileFormatError
        If there are no labels, or a label is not a whole number.
    InvalidParameterError
        If there is not one label for each face of the file, or as in `es.repair`.
    InvalidShapeError
        As in `es.repair`.
    OSError
        If a file cannot be read.

    See Also
    --------
    read_labeled_shapes, es.transfer_labels

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> es.write_mesh(es.icosphere(1), folder / "ball.off")
    >>> _ = (folder / "ball.seg").write_text("3\n" * 80)
    >>> set(es.io.read_labeled_shape(folder / "ball.off").labels.tolist())
    {3}
    """
    path = as_path(path)
    mesh = read_mesh(path)
    found = find_labels(path) if labels is None else Path(labels)
    given = LabeledShape(mesh, read_labels(found))
    done = apply_repairs(given.mesh, repair)
    if not done.report:
        return given
    middles = [mesh.vertices[mesh.faces].mean(axis=1) for mesh in (given.mesh, done.mesh)]
    nearest = cKDTree(middles[0]).query(middles[1])[1]
    return LabeledShape(done.mesh, given.labels[nearest], done.report)


def read_labeled_shapes(
    folder: str | Path, *, repair: Sequence[str] = ()
) -> dict[str, LabeledShape]:
    """Read all labeled shapes of a folder, for `transfer_labels`.

    Each mesh has its labels beside it, as `read_labeled_shape` takes them. Equal labels must mean
    the same on all shapes of the folder.

    Parameters
    ----------
    folder : path
    repair : sequence of str
        As in `read_labeled_shape`.

    Returns
    -------
    dict of str to LabeledShape
        By the name of the file without its suffix, in the order of names.

    Raises
    ------
    FileFormatError
        If there is no mesh in the folder, or as in `read_labeled_shape`.
    InvalidParameterError, InvalidShapeError
        As in `read_labeled_shape`.
    OSError
        If the folder or a file cannot be read.

    See Also
    --------
    read_label_names, es.transfer_labels

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> es.write_mesh(fish, folder / "fish.ply", face_labels=es.find_parts(fish).parts.labels)
    >>> library = es.io.read_labeled_shapes(folder)
    >>> other = es.make_creature("fish", 1, n_vertices=500)
    >>> found = es.transfer_labels(list(library.values()), other)
    >>> found.labels.shape == (other.n_faces,)
    True
    """
    return {
        path.stem: read_labeled_shape(path, repair=repair)
        for path in find_labeled_shapes(as_path(folder, "folder"))
    }


def find_labeled_shapes(folder: Path) -> list[Path]:
    """Return the meshes of a folder, sorted by name; raise FileFormatError if there are none."""
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in MESH_FORMATS)
    if not paths:
        raise FileFormatError(
            f"A folder of labeled shapes must hold a mesh; {folder} holds none. "
            f"Formats: {', '.join(MESH_FORMATS)}."
        )
    return paths


def read_label_names(folder: str | Path) -> list[str]:
    r"""Read the names of labels from the file ``names.txt`` of a folder of labeled shapes.

    Parameters
    ----------
    folder : path

    Returns
    -------
    list of str
        The name of label 0, of label 1, and so on; empty if there is no such file.

    See Also
    --------
    read_labeled_shapes

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> _ = (folder / "names.txt").write_text("torso\nleg\n")
    >>> es.io.read_label_names(folder)
    ['torso', 'leg']
    """
    path = as_path(folder, "folder") / NAMES_FILE
    if not path.exists():
        return []
    return [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]
