"""eigenshape decompress: the mesh of a file that `eigenshape compress` wrote."""

from pathlib import Path
from typing import Annotated

import typer

import eigenshape as es
from eigenshape._files import read_regular
from eigenshape.cli import steps
from eigenshape.cli.console import print_written, progress_bar
from eigenshape.cli.inputs import MESHES_TO_WRITE


def decompress(
    packed: Annotated[Path, typer.Argument(help="File that `eigenshape compress` wrote (.esz).")],
    *,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", help=f"Mesh to write: {MESHES_TO_WRITE}."),
    ],
) -> None:
    """Write the mesh of a file that `eigenshape compress` wrote.

    For instance: eigenshape decompress scan.esz -o scan.ply
    """
    steps.require_mesh_path(output)
    with progress_bar("decompress") as progress:
        mesh = es.spectral.decompress_mesh(
            read_regular(packed, "a compressed mesh"), progress=progress
        )
    es.write_mesh(mesh, output)
    print_written(output)
