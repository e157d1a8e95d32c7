"""CIFTI files of dense scalars: functions on the vertices of both hemispheres, and on voxels below them."""

import numpy as np

from eigenshape._errors import FileFormatError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import Arrays, narrow, require_nibabel
from eigenshape.io.formats.numbers import require_reasonable

PREFIX = "CIFTI_STRUCTURE_"
NIFTI_HEADER = 540  # bytes
MAGIC = b"n+2\0\r\n\x1a\n"
SURFACES = ("cortex_left", "cortex_right")  # structures that files are written for


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return each function on each structure, named as in "cortex_left:thickness".

    On a surface there is a row for every vertex, with NaN where the file has none, as on the medial
    wall; other structures have a row for each voxel.

    Raise FileFormatError if the file does not hold what it declares.
    """
    nibabel = require_nibabel("nibabel")
    _require_size(data)
    try:
        image = nibabel.Cifti2Image.from_bytes(data)
        maps, models = image.header.get_axis(0), image.header.get_axis(1)
        values = np.asarray(image.dataobj)
        values = values if values.dtype.kind == "f" else values.astype(np.float64)
        structures = [
            (name.removeprefix(PREFIX).lower(), place, part)
            for name, place, part in models.iter_structures()
        ]
        found: Arrays = {}
        for map_name, row in zip(maps.name.tolist(), values, strict=True):
            for structure, place, part in structures:
                held = row[place]
                is_surface = bool(part.surface_mask.all())
                if is_surface:
                    n_vertices = next(iter(part.nvertices.values()))
                    require_reasonable(8 * n_vertices, len(data))
                    held = np.full(n_vertices, np.nan, values.dtype)
                    held[part.vertex] = row[place]
                found[f"{structure}:{map_name}"] = held
    except FileFormatError:
        raise
    except Exception as err:  # nibabel and its parser of XML each raise their own
        raise FileFormatError(
            f"A CIFTI file must hold functions on brain models; {type(err).__name__}: {err}."
        ) from err
    return found, {}


def _require_size(data: bytes) -> None:
    """Raise an error for a damaged header, which nibabel would mend, and for numbers that the file cannot hold."""
    order = "<" if data[:4] == b"\x1c\x02\0\0" else ">"
    size = -1.0
    if len(data) >= NIFTI_HEADER and data[4:12] == MAGIC:
        bits = int(np.frombuffer(data, f"{order}i2", 1, 14)[0])
        shape = np.frombuffer(data, f"{order}i8", 8, 16)
        offset = np.frombuffer(data, f"{order}i8", 1, 168)[0]
        if offset >= NIFTI_HEADER:
            size = float(offset) + bits / 8 * float(np.prod(shape[1:].astype(float)))
    if not 0 < size <= len(data):
        raise FileFormatError(
            "A CIFTI file must hold a header of NIfTI-2 and what that declares, uncompressed; "
            f"{size:.0f} bytes do not fit into its {len(data)} (-1: the header is damaged)."
        )


def format_maps(mesh: TriangleMesh, of_vertices: Arrays, suffix: str) -> bytes:
    """Write functions with names as in "cortex_left:thickness"; vertices where all are NaN are left out.

    Raise FileFormatError if a name has no such structure, or the structures differ in their functions.
    """
    nibabel = require_nibabel("nibabel")
    axes = require_nibabel("nibabel.cifti2.cifti2_axes")
    by_structure: dict[str, Arrays] = {}
    for name, values in of_vertices.items():
        structure, _, map_name = name.partition(":")
        if structure not in SURFACES or not map_name or values.ndim != 1:
            raise FileFormatError(
                f"Names of functions in a CIFTI file must begin with {SURFACES[0]}: or {SURFACES[1]}:, "
                f"and each has one number a vertex; {name!r} is of shape {values.shape}."
            )
        by_structure.setdefault(structure, {})[map_name] = values.astype(np.float64)
    names = [list(held) for held in by_structure.values()]
    if not names or any(each != names[0] for each in names):
        raise FileFormatError(
            f"Each hemisphere in a CIFTI file must have the same functions, and at least one; they are "
            f"{names}."
        )
    models, columns = None, []
    for structure, held in by_structure.items():
        table = np.stack(list(held.values()))
        kept = ~np.isnan(table).all(axis=0)
        model = axes.BrainModelAxis.from_mask(kept, name=structure)
        models = model if models is None else models + model
        columns.append(table[:, kept])
    rows = narrow("functions", np.hstack(columns))
    image = nibabel.Cifti2Image(rows, (axes.ScalarAxis(names[0]), models))
    written: bytes = image.to_bytes()
    return written
