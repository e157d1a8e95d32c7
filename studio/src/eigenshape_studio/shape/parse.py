"""Mesh files from outside, parsed in a child process with limits of memory and time.

Run as a module, this reads a file from the standard input and writes a message (`wire`) to the
standard output: the mesh, or the reason why there is none.
"""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

import eigenshape as es
from eigenshape.io.formats.registry import HEMISPHERES, suffix_in
from eigenshape_studio.shape.look import pack_look, unpack_look
from eigenshape_studio.wire import WireError, decode, encode

SEAMS = ("weld_seams",)  # textured shapes would come apart along their seams
LONGEST_NAME = 120  # characters that are kept of a file's name


@dataclass(frozen=True)
class Limits:
    """What parsing one file may take.

    Attributes
    ----------
    seconds : float
        Of processor time and of waiting.
    memory : int
        Address space in bytes. The library takes about 1 GB of it before it reads anything.
    n_faces : int
        Faces that a mesh may have.
    """

    seconds: float = 60.0
    memory: int = 6 << 30
    n_faces: int = 2_000_000


@dataclass(frozen=True, eq=False)
class Upload:
    """A mesh of a file, what was done to it in sentences, its look, and the points it was made of."""

    mesh: es.TriangleMesh
    report: tuple[str, ...]
    attributes: es.io.MeshAttributes | None
    points: np.ndarray | None


def display_name(name: object) -> str:
    """Return the last part of a file's name, printable and short."""
    text = PurePosixPath(str(name).replace("\\", "/")).name
    return "".join(letter for letter in text if letter.isprintable())[:LONGEST_NAME] or "shape"


def shape_suffix(name: str) -> str:
    """Return the suffix of a file's name; raise FileFormatError if it is not one of a shape."""
    suffix = suffix_in(name)
    if suffix not in es.io.SHAPE_FORMATS and name.startswith(HEMISPHERES):
        return ".surf"  # as lh.pial; what is none is refused by its first bytes
    if suffix not in es.io.SHAPE_FORMATS:
        known = ", ".join(es.io.SHAPE_FORMATS)
        raise es.FileFormatError(
            f"A file of a shape must end in {known}; {display_name(name)} does not."
        )
    return suffix


def parse_surface(name: str, data: bytes, limits: Limits | None = None) -> Upload:
    """Parse a file of a mesh, or of points that become a surface, in a child process.

    Parameters
    ----------
    name : str
        Name of the file; only its suffix counts.
    data : bytes
    limits : Limits, optional

    Returns
    -------
    Upload

    Raises
    ------
    FileFormatError
        If the suffix is unknown, the file does not hold a mesh, or a limit is reached.
    """
    limits = limits or Limits()
    suffix = shape_suffix(name)
    command = [sys.executable, "-m", "eigenshape_studio.shape.parse", suffix]
    numbers = [limits.seconds, limits.memory, limits.n_faces]
    try:
        done = subprocess.run(
            [*command, *map(str, numbers)],
            input=data,
            capture_output=True,
            check=False,
            timeout=limits.seconds,
        )
        meta, arrays = decode(done.stdout)
    except subprocess.TimeoutExpired as err:
        raise es.FileFormatError(
            f"A mesh file must be read within {limits.seconds:g} s; {display_name(name)} is not."
        ) from err
    except WireError as err:  # the child died before it wrote anything
        raise es.FileFormatError(
            f"{display_name(name)} cannot be read within the limits of {limits.seconds:g} s and "
            f"{limits.memory / 1e9:.3g} GB."
        ) from err
    if "error" in meta:
        raise es.FileFormatError(meta["error"])
    mesh, points = es.TriangleMesh(arrays["vertices"], arrays["faces"]), arrays["points"]
    held = None if meta["look"] is None else unpack_look(mesh, meta["look"], arrays)
    return Upload(mesh, tuple(meta["report"]), held, points if len(points) else None)


def attributes_in(path: Path, mesh: es.TriangleMesh) -> es.io.MeshAttributes | None:
    """Return what a file holds beside the shape; None of points, and where that is broken."""
    with suppress(es.FileFormatError):
        held = es.read_mesh(path, attributes=True, drop_missing=True)[1]
        return es.io.carry_attributes(held, mesh)
    return None


def points_in(path: Path, report: Sequence[str]) -> np.ndarray | None:
    """Return the points of a file that a surface was made of, as its report says; None of a mesh."""
    if not any(line.startswith("reconstruct_surface") for line in report):
        return None
    return es.io.read_points(path, drop_missing=True).points


def main() -> None:
    """Read a file from the standard input, and write a mesh or an error to the standard output."""
    suffix, seconds, memory, n_faces = sys.argv[1:]
    _limit(float(seconds), int(memory))
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"shape{suffix}")
            path.write_bytes(sys.stdin.buffer.read())
            found = read_upload(path, int(n_faces), SEAMS)
            points = points_in(path, found.report)
            held = attributes_in(path, found.mesh)
        arrays = {
            "vertices": found.mesh.vertices,
            "faces": found.mesh.faces.astype("<u4"),
            "points": np.empty((0, 3)) if points is None else points,
        }
        look = None
        if held is not None:
            look, more = pack_look(held)
            arrays |= more
        message = encode({"report": list(found.report), "look": look}, arrays)
    except MemoryError:
        message = encode({"error": "The file takes more memory than a mesh may."})
    except (es.EigenshapeError, OSError) as error:
        message = encode({"error": str(error)})
    sys.stdout.buffer.write(message)


def _limit(seconds: float, memory: int) -> None:
    """Limit the processor time and the address space of this process, where the system can."""
    try:
        import resource  # noqa: PLC0415  not on Windows, where only the time is limited, outside
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 1))
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def read_upload(
    path: Path, n_faces: int, repair: Sequence[str] = ()
) -> es.geometry.RepairedMesh[es.TriangleMesh]:
    """Read and repair a file from outside, whose path is ours and is not shown in errors.

    Raises
    ------
    FileFormatError
        If no surface can be made of it, or it has too many faces, or coordinates beyond single
        precision.
    """
    try:
        found = es.io.read_surface(path, repair=repair)
    except es.EigenshapeError as error:
        # The folder is ours; the person knows the file by another name.
        text = str(error).replace(str(path), "The file")
        raise es.FileFormatError(text) from error
    mesh = found.mesh
    if mesh.n_faces > n_faces:
        raise es.FileFormatError(
            f"A mesh may have {n_faces:,} faces; the file has {mesh.n_faces:,}."
        )
    if not np.abs(mesh.vertices).max() < np.finfo(np.float32).max:
        raise es.FileFormatError("Coordinates must fit into single precision; some do not.")
    return found


if __name__ == "__main__":
    main()
