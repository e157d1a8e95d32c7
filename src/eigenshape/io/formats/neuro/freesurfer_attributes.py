"""What a surface of FreeSurfer holds besides triangles: the volume that it was made from."""

from dataclasses import replace
from pathlib import Path

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.attributes import MeshAttributes, WriteJob
from eigenshape.io.formats.neuro.freesurfer import footer_of, format_binary
from eigenshape.io.opening import SourceFile

VOLUME = "the place of the volume of FreeSurfer (c_ras)"


def read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Name what follows the triangles."""
    others = (VOLUME,) if footer_of(source.data) else ()
    return replace(MeshAttributes.plain(mesh), others=others, source=source)


def write(job: WriteJob) -> dict[Path, bytes]:
    """Write a surface, and behind it what follows that of the source."""
    source = job.attributes.source
    footer = footer_of(source.data) if source and source.suffix == job.suffix else b""
    job.lose(job.attributes.contents, kept=[VOLUME] if footer else [])
    return {job.path: format_binary(job.mesh) + footer}
