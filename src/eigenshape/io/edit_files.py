"""Lists of edits in JSON files."""

import json
from collections.abc import Sequence
from pathlib import Path

from certeig.kit.arguments import require_each
from certeig.kit.errors import FileFormatError
from certeig.kit.files import as_path, read_regular, replacing, require_regular
from eigenshape.deformation.edits import Edit, edits_from_json, edits_to_json
from eigenshape.geometry.conversion import MeshLike, as_mesh


def write_edits(edits: Sequence[Edit], mesh: MeshLike, path: str | Path) -> None:
    """Write edits of a mesh to a JSON file.

    The file appears complete or not at all. Numbers are written without loss of digits.

    Parameters
    ----------
    edits : sequence of Edit
        For example `DeformationSession.edits`.
    mesh : MeshLike
        The mesh that the edits were made on.
    path : str or Path

    Raises
    ------
    OSError
        If the system cannot write the file.

    See Also
    --------
    read_edits : Read the edits.
    eigenshape.deformation.replay : Apply edits.

    Examples
    --------
    >>> import json, pathlib, tempfile
    >>> import eigenshape as es
    >>> move = es.deformation.Move([0, 1], es.Translation([0, 0, 0.2]))
    >>> path = pathlib.Path(tempfile.mkdtemp(), "edits.json")
    >>> es.io.write_edits([es.deformation.Edit((move,))], es.icosphere(2), path)
    >>> json.loads(path.read_text())["mesh"]["n_vertices"]
    162
    """
    require_each(edits, Edit, "edits")
    mesh = as_mesh(mesh)
    text = json.dumps(edits_to_json(edits, mesh), indent=1) + "\n"
    with replacing(as_path(path)) as file:
        file.write(text.encode())


def read_edits(path: str | Path, mesh: MeshLike) -> list[Edit]:
    """Read edits from a JSON file of `write_edits`.

    Parameters
    ----------
    path : str or Path
    mesh : MeshLike
        The mesh that the edits were made on, equal to the last digit. To apply the edits to another
        mesh of the same shape, pass this mesh to `replay` as `source`.

    Returns
    -------
    list of Edit

    Raises
    ------
    OSError
        If the system cannot read the file.
    FileFormatError
        If the file does not hold edits.
    InvalidParameterError
        If the edits were made on another mesh.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> session = es.DeformationSession(es.rig_shape(mesh))
    >>> top = es.deformation.BoxRegion([-2, 0.5, -2], [2, 2, 2])
    >>> _ = session.drag(top, es.Translation([0, 0.2, 0]))
    >>> _ = session.commit()
    >>> path = pathlib.Path(tempfile.mkdtemp(), "edits.json")
    >>> es.io.write_edits(session.edits, mesh, path)
    >>> len(es.io.read_edits(path, mesh))
    1
    """
    mesh, path = as_mesh(mesh), as_path(path)
    require_regular(path)
    try:
        content = json.loads(read_regular(path, "edits"))
    except (ValueError, RecursionError) as err:
        raise FileFormatError(f"A file of edits must hold JSON; {path} does not: {err}.") from err
    return edits_from_json(content, mesh)
