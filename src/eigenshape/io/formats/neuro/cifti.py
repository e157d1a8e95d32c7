"""CIFTI files: functions, series and parcels on the vertices of both hemispheres, and on voxels below them.

Read: scalars, series and labels of both hemispheres.
Kept: names of maps; names and colors of parcels.
Named: nothing.
Refused: files without surfaces.
"""

from typing import Any

import numpy as np

from certeig.kit.errors import FileFormatError
from eigenshape.features.parcellation import Parcellation
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.formats.neuro.shared import (
    NO_PARCEL,
    Arrays,
    drop_nameless,
    find_labels,
    label_table,
    narrow,
    require_nibabel,
)
from eigenshape.io.formats.numbers import require_reasonable
from eigenshape.io.hemispheres import hemisphere_of

PREFIX = "CIFTI_STRUCTURE_"
NIFTI_HEADER = 540  # bytes
SURFACES = ("cortex_left", "cortex_right")  # structures that files are written for
SERIES = "series"


def parse_fields(data: bytes) -> tuple[Arrays, Arrays]:
    """Return each function on each structure, named as in "cortex_left:thickness".

    A series of functions is one table of the name "series". On a surface there is a row for every
    vertex, with NaN where the file has none, as on the medial wall; other structures have a row for
    each voxel.

    Raise FileFormatError if the file does not hold what it declares.
    """
    _, found = _parse(data)
    return found, {}


def _parse(data: bytes) -> tuple[Any, Arrays]:
    """Return the axis of the functions, and the functions."""
    nibabel = require_nibabel("nibabel")
    try:
        _require_size(nibabel.Nifti2Header(data[:NIFTI_HEADER], check=False), len(data))
        image = nibabel.Cifti2Image.from_bytes(data)
        maps, models = image.header.get_axis(0), image.header.get_axis(1)
        values = np.asarray(image.dataobj)
        values = values if values.dtype.kind == "f" else values.astype(np.float64)
        tables: Arrays = {}
        for name, place, part in models.iter_structures():
            table = held = values[:, place].T
            if part.surface_mask.all():
                n_vertices = next(iter(part.nvertices.values()))
                require_reasonable(8 * n_vertices * len(values), len(data))
                table = np.full((n_vertices, len(values)), np.nan, values.dtype)
                table[part.vertex] = held
            tables[name.removeprefix(PREFIX).lower()] = table
        if not hasattr(maps, "name"):
            return maps, {f"{structure}:{SERIES}": table for structure, table in tables.items()}
        found = {
            f"{structure}:{name}": np.ascontiguousarray(table[:, number])
            for number, name in enumerate(maps.name.tolist())
            for structure, table in tables.items()
        }
    except FileFormatError:
        raise
    except Exception as err:  # nibabel and its parser of XML each raise their own
        raise FileFormatError(
            f"A CIFTI file must hold functions on brain models; {type(err).__name__}: {err}."
        ) from err
    return maps, found


def parse_parcels(data: bytes, mesh: TriangleMesh) -> tuple[Parcellation]:
    """Return the parcellation of the hemisphere that a mesh is of; the label named ??? is no parcel.

    Raise FileFormatError if the file does not hold one function of labels on that hemisphere.
    """
    maps, found = _parse(data)
    side = hemisphere_of(mesh)
    held = {name: labels for name, labels in found.items() if name.startswith(SURFACES)}
    of_side = [labels for name, labels in held.items() if name.startswith(f"cortex_{side}")]
    tables = getattr(maps, "label", [])
    if len(of_side) != 1 or len(tables) != 1:
        raise FileFormatError(
            f"A CIFTI file of parcels must have one function of labels on the hemisphere of the surface, "
            f"which lies on the {side or 'left and right'}; it has {list(held)}, {len(tables)} with names. "
            "Move the surface to its side of x = 0 if that is not known."
        )
    labels = np.nan_to_num(of_side[0])
    names = [name for name, _ in tables[0].values()]
    colors = [color for name, color in tables[0].values() if name != NO_PARCEL]
    places = find_labels("Labels of a CIFTI file", np.array(list(tables[0])), labels)
    return (Parcellation(*drop_nameless(places, names), colors),)


def format_parcels(mesh: TriangleMesh, parcellation: Parcellation, suffix: str) -> bytes:
    """Write the parcels of one hemisphere; parcel i has the label i + 1, since 0 is for none."""
    side = hemisphere_of(mesh)
    if not side:
        raise FileFormatError(
            "A CIFTI file holds parcels of a hemisphere; the surface lies on both sides of x = 0. "
            "Write .label.gii."
        )
    axes = require_nibabel("nibabel.cifti2.cifti2_axes")
    everywhere = np.ones(mesh.n_vertices, dtype=bool)
    model = axes.BrainModelAxis.from_mask(everywhere, name=f"cortex_{side}")
    maps = axes.LabelAxis(["parcels"], [label_table(parcellation)])
    labels = (parcellation.labels[None] + 1).astype(np.int32)
    return _write(labels, maps, model, "ConnDenseLabel")


def _require_size(header: Any, n_bytes: int) -> None:
    """Raise an error for a damaged header, which nibabel would mend, and for numbers that the file cannot hold."""
    size = -1.0
    if header["magic"] == b"n+2" and header["vox_offset"] >= NIFTI_HEADER:
        size = header["vox_offset"] + header["bitpix"] / 8 * np.prod(
            header["dim"][1:].astype(float)
        )
    if not 0 < size <= n_bytes:
        raise FileFormatError(
            "A CIFTI file must hold a header of NIfTI-2 and what that declares, uncompressed; "
            f"{size:.0f} bytes do not fit into its {n_bytes} (-1: the header is damaged)."
        )


def format_maps(mesh: TriangleMesh, of_vertices: Arrays, suffix: str) -> bytes:
    """Write functions with names as in "cortex_left:thickness"; vertices where all are NaN are left out.

    Raise FileFormatError if a name has no such structure, or the structures differ in their functions.
    """
    if suffix != ".dscalar.nii":
        raise FileFormatError(
            f"Functions are written to .dscalar.nii, each map of a series by itself; files in {suffix} "
            "are only read, and es.io.write_parcellation writes parcels."
        )
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
    return _write(rows, axes.ScalarAxis(names[0]), models, "ConnDenseScalar")


def _write(rows: np.ndarray, maps: Any, models: Any, intent: str) -> bytes:
    image = require_nibabel("nibabel").Cifti2Image(rows, (maps, models))
    image.nifti_header.set_intent(intent)
    return image.to_bytes()
