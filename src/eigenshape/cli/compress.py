"""eigenshape compress and decompress: a mesh as a small file, and back."""

from pathlib import Path

import eigenshape as es
from certeig.kit.files import read_regular, replace_file
from eigenshape.cli import steps
from eigenshape.cli.console import out, print_json, print_written, progress_bar


def compress(
    mesh: Path,
    *,
    output: Path,
    bits: int = 12,
    repair: str = "none",
    as_json: bool = False,
) -> None:
    """Write a mesh as a small file, by the spectral coefficients of its coordinates.

    For instance: eigenshape compress scan.ply -o scan.esz --bits 12

    Parameters
    ----------
    output
        Write the compressed mesh, in a file that ends in .esz.
    bits
        Precision of coordinates, 4 to 24: vertices move by about 1 / 2^bits of the longest side
        of the bounding box.
    """
    steps.require_output(output, (".esz",), "A compressed mesh")
    surface = steps.load_surface(mesh, repair)
    with progress_bar("compress") as progress:
        packed = es.spectral.compress_mesh(surface, bits, progress=progress)
    replace_file(output, packed.data)
    print_written(output)
    n = surface.n_vertices
    facts = {
        "bytes": len(packed.data),
        "connectivity_bytes": packed.n_connectivity_bytes,
        "geometry_bytes": packed.n_geometry_bytes,
        "bits_per_vertex": 8 * len(packed.data) / n,
        "rms_error": packed.rms_error,
        "max_error": packed.max_error,
    }
    if as_json:
        print_json({"path": mesh, "output": output, **facts})
        return
    out.print(
        f"{facts['bytes']:,} bytes, {facts['bits_per_vertex']:.1f} bits a vertex "
        f"(faces {8 * packed.n_connectivity_bytes / n:.1f}, coordinates "
        f"{8 * packed.n_geometry_bytes / n:.1f}); vertices move by {packed.rms_error:.3g} (root mean "
        f"square), at most {packed.max_error:.3g}"
    )


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
