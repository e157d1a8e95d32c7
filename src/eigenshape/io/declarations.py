"""What files of unstructured meshes say about themselves, looked at before meshio believes it."""

import re
from contextlib import suppress

from eigenshape._errors import FileFormatError
from eigenshape.io.gmsh_sections import mesh_sections
from eigenshape.io.text import shown

# A keyword on a line and a count on the next: meshio makes room for that many rows, or passes over as many lines.
COUNTED = re.compile(rb"^[ \t]*[A-Za-z][^\r\n]*(?:\r\n|\r|\n)(?=([^\r\n]*))", re.MULTILINE)


def checked(suffix: str, data: bytes) -> tuple[bytes, int | None]:
    """Return what meshio is to read, and how many cells it must find where the file declares that.

    Refused is what would keep meshio busy for ever, or have it make room for far more than the file holds.

    Raises
    ------
    FileFormatError
        With what the file declares.
    """
    if suffix == ".msh":
        return mesh_sections(data)
    for match in COUNTED.finditer(data) if suffix == ".mesh" else ():
        count = 0
        with suppress(ValueError):  # what is no number meshio refuses
            count = int(match[1].decode("utf-8"))
        if count > len(data):
            raise FileFormatError(
                f"A mesh file must hold the lines it declares; {shown((0, match[1]))} do not fit into it."
            )
    return data, None
