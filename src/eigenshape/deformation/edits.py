"""Edits as values: what was moved and how, fit to be kept as JSON and done again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from eigenshape._arrays import whole_number
from eigenshape._errors import FileFormatError
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import Mode, bend, require_mode
from eigenshape.deformation.handles import Handle, Rotation, Translation
from eigenshape.deformation.region import Box, Brush, Region
from eigenshape.deformation.rig import EigenRig, posed
from eigenshape.geometry.mesh import TriangleMesh

KIND, VERSION = "eigenshape edits", 1


@dataclass(frozen=True, eq=False)
class Move:
    """A region and the handle that moves it."""

    region: Region
    handle: Handle


@dataclass(frozen=True, eq=False)
class Edit:
    """Regions that move at once, and what stays.

    Attributes
    ----------
    moves : tuple of Move
    fixed : region, optional
    n_modes : int, optional
        As for `bind`.
    mode : "graded", "uncrossed" or "thesis"
        As for `bend`.
    """

    moves: tuple[Move, ...]
    fixed: Region | None = None
    n_modes: int | None = None
    mode: Mode = "graded"


def apply_edit(rig: EigenRig, edit: Edit) -> EigenRig:
    """Return the rig in the pose that an edit gives it; boxes and brushes are looked up in its present pose.

    Raises
    ------
    InvalidParameterError
        As for `bind` and `bend`.
    """
    binding = bind(rig, [move.region for move in edit.moves], fixed=edit.fixed, n_modes=edit.n_modes)
    return posed(rig, bend(binding, [move.handle for move in edit.moves], mode=edit.mode).vertices)


def carry_edit(edit: Edit, source: TriangleMesh, target: TriangleMesh) -> Edit:
    """Return an edit for another mesh of the same shape in the same place, vertices by their nearest.

    Boxes and brushes stay as they are; of masks and indices, each vertex of the target asks its nearest in the source.
    """
    nearest = cKDTree(source.vertices).query(target.vertices)[1]

    def carried(region: Region) -> Region:
        if isinstance(region, Box | Brush):
            return region
        mask = np.zeros(source.n_vertices, dtype=bool)
        mask[np.asarray(region)] = True
        return mask[nearest]

    moves = tuple(Move(carried(move.region), move.handle) for move in edit.moves)
    return Edit(moves, None if edit.fixed is None else carried(edit.fixed), edit.n_modes, edit.mode)


def edits_to_json(edits: Sequence[Edit], mesh: TriangleMesh) -> dict[str, Any]:
    """Return edits of a mesh as what JSON holds; regions of vertices by their indices."""
    return {"kind": KIND, "version": VERSION, "n_vertices": mesh.n_vertices, "edits": [_edit_out(e) for e in edits]}


def _edit_out(edit: Edit) -> dict[str, Any]:
    moves = [{"region": _region_out(move.region), "handle": _handle_out(move.handle)} for move in edit.moves]
    fixed = None if edit.fixed is None else _region_out(edit.fixed)
    return {"moves": moves, "fixed": fixed, "n_modes": edit.n_modes, "mode": edit.mode}


def _region_out(region: Region) -> dict[str, Any]:
    if isinstance(region, Box):
        low, high = ([value if np.isfinite(value) else None for value in c.tolist()] for c in (region.low, region.high))
        return {"kind": "box", "low": low, "high": high}  # JSON has no infinity
    if isinstance(region, Brush):
        return {"kind": "brush", "center": region.center.tolist(), "radius": region.radius}
    chosen = np.asarray(region)
    return {"kind": "vertices", "vertices": (np.flatnonzero(chosen) if chosen.dtype == bool else chosen).tolist()}


def _handle_out(handle: Handle) -> dict[str, Any]:
    if isinstance(handle, Rotation):
        pivot, axis = handle.pivot.tolist(), handle.axis.tolist()
        return {"kind": "rotation", "pivot": pivot, "axis": axis, "angle": handle.angle}
    return {"kind": "translation", "vector": handle.vector.tolist()}


def edits_from_json(content: Any) -> tuple[int, list[Edit]]:
    """Return the number of vertices of the mesh that was edited, and its edits, as `edits_to_json` gave them.

    Raises
    ------
    FileFormatError
        If the content is no such thing; the message names the first edit at fault.
    """
    if not isinstance(content, Mapping) or content.get("kind") != KIND:
        raise FileFormatError(f"Edits are kept as a JSON object of kind {KIND!r}; this is none.")
    if content.get("version") != VERSION:
        raise FileFormatError(f"Edits of version {VERSION} are read; this is version {content.get('version')!r}.")
    found = []
    try:
        n_vertices = whole_number(content["n_vertices"], "n_vertices", 1)
        for entry in content["edits"]:
            found.append(_edit_in(entry, n_vertices))
    except (KeyError, TypeError, ValueError, AttributeError) as err:
        raise FileFormatError(f"Edit {len(found)} cannot be read: {err}.") from err
    return n_vertices, found


def _edit_in(entry: Mapping[str, Any], n_vertices: int) -> Edit:
    moves = tuple(Move(_region_in(move["region"], n_vertices), _handle_in(move["handle"])) for move in entry["moves"])
    fixed = None if entry["fixed"] is None else _region_in(entry["fixed"], n_vertices)
    n_modes = None if entry["n_modes"] is None else whole_number(entry["n_modes"], "n_modes", 1)
    return Edit(moves, fixed, n_modes, require_mode(entry["mode"]))


def _region_in(entry: Mapping[str, Any], n_vertices: int) -> Region:
    readers: dict[str, Callable[[], Region]] = {
        "box": lambda: Box(_or_open(entry["low"], -np.inf), _or_open(entry["high"], np.inf)),
        "brush": lambda: Brush(entry["center"], entry["radius"]),
        "vertices": lambda: np.array([whole_number(v, "A vertex", 0, n_vertices - 1) for v in entry["vertices"]]),
    }
    return readers[entry["kind"]]()


def _or_open(corner: Sequence[float | None], end: float) -> list[float]:
    return [end if value is None else value for value in corner]


def _handle_in(entry: Mapping[str, Any]) -> Handle:
    readers: dict[str, Callable[[], Handle]] = {
        "rotation": lambda: Rotation(entry["pivot"], entry["axis"], entry["angle"]),
        "translation": lambda: Translation(entry["vector"]),
    }
    return readers[entry["kind"]]()
