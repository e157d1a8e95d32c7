"""eigenshape decompress: the mesh of a file that `eigenshape compress` wrote."""

from pathlib import Path

import eigenshape as es
from eigenshape._files import read_regular
from eigenshape.cli import steps
from eigenshape.cli.console import print_written, progress_bar


def decompress(
    packed: Path,
    *,
    output: Path,
) -> None:
    """Write the mesh of a file that `eigenshape compress` wrote.

    For instance: eigenshape decompress scan.esz -o scan.ply

    Parameters
    ----------
    packed
        File that `eigenshape compress` wrote (.esz).
    """
    steps.require_mesh_path(output)
    with progress_bar("decompress") as progress:
        mesh = es.spectral.decompress_mesh(
            read_regular(packed, "a compressed mesh"), progress=progress
        )
    es.write_mesh(mesh, output)
    print_written(output)
