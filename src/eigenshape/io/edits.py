"""Lists of edits in JSON files."""

import json
from collections.abc import Sequence
from pathlib import Path

from eigenshape._errors import FileFormatError
from eigenshape._files import read_regular, replacing
from eigenshape.deformation.edits import Edit, edits_from_json, edits_to_json
from eigenshape.geometry.mesh import TriangleMesh


def write_edits(edits: Sequence[Edit], mesh: TriangleMesh, path: str | Path) -> None:
    """Write edits of a mesh to a JSON file, whole or not at all; numbers to the last digit.

    Raises
    ------
    OSError
        If the system cannot write there.
    """
    text = json.dumps(edits_to_json(edits, mesh), indent=1) + "\n"
    with replacing(Path(path)) as file:
        file.write(text.encode())


def read_edits(path: str | Path) -> tuple[int, list[Edit]]:
    """Read edits that `write_edits` wrote.

    Returns
    -------
    n_vertices : int
        Of the mesh that was edited.
    edits : list of Edit

    Raises
    ------
    OSError
        If the system cannot read it.
    FileFormatError
        If it is no such file.
    """
    try:
        content = json.loads(read_regular(Path(path), "edits"))
    except (ValueError, RecursionError) as err:
        raise FileFormatError(f"{path} must hold JSON; {err}.") from err
    return edits_from_json(content)
