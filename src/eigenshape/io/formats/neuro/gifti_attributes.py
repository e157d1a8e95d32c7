"""What a GIFTI file holds besides a surface: functions, where its coordinates belong, and metadata."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.attributes import MeshAttributes, WriteJob
from eigenshape.io.field_files import format_fields, read_field_attributes, structure_named
from eigenshape.io.formats.neuro.gifti import POINTS, parse_tags
from eigenshape.io.opening import SourceFile

TAGS = ("MetaData", "CoordinateSystemTransformMatrix")
KEPT = "metadata, and the transformation to other coordinates"  # by a GIFTI file only


def read_attributes(source: SourceFile, mesh: TriangleMesh) -> MeshAttributes:
    """Return the functions, and name what else there is."""
    held, root = read_field_attributes(source, mesh), parse_tags(source.data)
    matrices = [np.array((each.text or "").split(), float) for each in root.iter("MatrixData")]
    is_plain = all(np.array_equal(matrix, np.eye(4).ravel()) for matrix in matrices)
    if is_plain and root.find(".//MD") is None:
        return held
    return replace(held, others=(*held.others, KEPT))


def write(job: WriteJob) -> dict[Path, bytes]:
    """Write a surface and functions, with the metadata and coordinate systems of a GIFTI source."""
    held, source = job.attributes, job.attributes.source
    old = parse_tags(source.data) if source and source.suffix == job.suffix else None
    kinds = [kind for kind in held.contents if kind != "fields"]
    job.lose(kinds, kept=[] if old is None else [KEPT])
    structure = structure_named(job.mesh, job.path, job.suffix) if old is None else ""
    data = format_fields(job.mesh, job.suffix, held.fields, structure)
    if old is None:
        return {job.path: data}
    new = ElementTree.fromstring(data)
    for owner in (".", f"DataArray[@Intent='{POINTS}']"):  # the file, and its points
        target = new.findall(owner)[0]
        found = [each for tag in TAGS for each in old.findall(f"{owner}/{tag}")]
        tags = {each.tag for each in found}
        target[:] = found + [each for each in target if each.tag not in tags]
    head = data[: data.index(b"<GIFTI")]
    return {job.path: head + ElementTree.tostring(new)}
