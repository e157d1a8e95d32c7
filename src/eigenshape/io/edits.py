"""Lists of edits in JSON files."""

import json
from collections.abc import Sequence
from pathlib import Path

from eigenshape._arguments import require_each
from eigenshape._errors import FileFormatError
from eigenshape._files import read_regular, replacing
from eigenshape.deformation.edits import Edit, edits_from_json, edits_to_json
from eigenshape.geometry.conversion import MeshLike, as_mesh


def write_edits(edits: Sequence[Edit], mesh: MeshLike, path: str | Path) -> None:
    """Write edits of a mesh to a JSON file, whole or not at all; numbers to the last digit.

    Raises
    ------
    OSError
        If the system cannot write there.
    """
    require_each(edits, Edit, "edits")
    mesh = as_mesh(mesh)
    text = json.dumps(edits_to_json(edits, mesh), indent=1) + "\n"
    with replacing(Path(path)) as file:
        file.write(text.encode())


def read_edits(path: str | Path, mesh: MeshLike) -> list[Edit]:
    """Read edits that `write_edits` wrote.

    Parameters
    ----------
    path : path
    mesh : MeshLike
        The one that they were made on, to the last digit. To do them on another mesh of the shape, pass this one on to
        `replay` as `source`.

    Returns
    -------
    list of Edit

    Raises
    ------
    OSError
        If the system cannot read it.
    FileFormatError
        If it is no such file.
    InvalidParameterError
        If they were made on another mesh.
    """
    mesh = as_mesh(mesh)
    try:
        content = json.loads(read_regular(Path(path), "edits"))
    except (ValueError, RecursionError) as err:
        raise FileFormatError(f"{path} must hold JSON; {err}.") from err
    return edits_from_json(content, mesh)
