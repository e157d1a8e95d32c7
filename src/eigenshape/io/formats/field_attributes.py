"""Fields beside the mesh of a file: all that VTU, VTP, VTK and NPZ files hold."""

from pathlib import Path

from eigenshape.io.attributes import WriteJob
from eigenshape.io.field_files import format_fields, read_field_attributes

read_attributes = read_field_attributes


def write(job: WriteJob) -> dict[Path, bytes]:
    """Return the file with its fields; other content is lost."""
    held = job.attributes
    job.lose([kind for kind in held.contents if kind != "fields"])
    return {job.path: format_fields(job.mesh, job.suffix, held.fields)}
