"""Edits as values: what was moved and how, fit to be kept as JSON and done again."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from eigenshape._arguments import require_each, require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import FileFormatError, InvalidParameterError
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import Mode, bend, require_mode
from eigenshape.deformation.handles import Handle, Rotation, Translation
from eigenshape.deformation.region import BoxRegion, BrushRegion, Region, kept_region, region_mask
from eigenshape.deformation.rig import EigenRig, posed
from eigenshape.geometry.mesh import TriangleMesh

KIND, VERSION = "eigenshape edits", 2


@dataclass(frozen=True)
class MeshFingerprint:
    """What tells a mesh from all others: its regions are indices of vertices, and mean nothing on another.

    Attributes
    ----------
    n_vertices, n_faces : int
    digest : str
        SHA-256 of coordinates and faces, hexadecimal.
    """

    n_vertices: int
    n_faces: int
    digest: str

    def __str__(self) -> str:
        return f"{self.n_vertices:,} vertices and {self.n_faces:,} faces ({self.digest[:8]})"


def mesh_fingerprint(mesh: TriangleMesh) -> MeshFingerprint:
    """Return the fingerprint of a mesh, the same on every machine."""
    numbers = mesh.vertices.astype("<f8") + 0.0  # -0 is 0
    digest = sha256(numbers.tobytes() + mesh.faces.astype("<i8").tobytes()).hexdigest()
    return MeshFingerprint(mesh.n_vertices, mesh.n_faces, digest)


@dataclass(frozen=True, eq=False)
class Move:
    """A region and the handle that moves it."""

    region: Region
    handle: Handle

    def __post_init__(self) -> None:
        require_type(self.handle, Handle, "handle")
        object.__setattr__(self, "region", kept_region(self.region))


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

    def __post_init__(self) -> None:
        require_each(self.moves, Move, "moves")
        object.__setattr__(self, "fixed", None if self.fixed is None else kept_region(self.fixed))


def apply_edit(rig: EigenRig, edit: Edit) -> EigenRig:
    """Return the rig in the pose that an edit gives it; boxes and brushes are looked up in its present pose.

    Raises
    ------
    InvalidParameterError
        As for `bind` and `bend`.
    """
    require_type(rig, EigenRig, "rig")
    require_type(edit, Edit, "edit")
    binding = bind(
        rig, [move.region for move in edit.moves], fixed=edit.fixed, n_modes=edit.n_modes
    )
    return posed(rig, bend(binding, [move.handle for move in edit.moves], mode=edit.mode).vertices)


def carry_edit(edit: Edit, source: TriangleMesh, target: TriangleMesh) -> Edit:
    """Return an edit for another mesh of the same shape in the same place, vertices by their nearest.

    Boxes and brushes stay as they are; of masks and indices, each vertex of the target asks its nearest in the source.
    """
    nearest = cKDTree(source.vertices).query(target.vertices)[1]

    def carried(region: Region) -> Region:
        return (
            region
            if isinstance(region, BoxRegion | BrushRegion)
            else region_mask(source, region)[nearest]
        )

    moves = tuple(Move(carried(move.region), move.handle) for move in edit.moves)
    return Edit(moves, None if edit.fixed is None else carried(edit.fixed), edit.n_modes, edit.mode)


def edits_to_json(edits: Sequence[Edit], mesh: TriangleMesh) -> dict[str, Any]:
    """Return edits of a mesh as what JSON holds; regions of vertices by their indices.

    Raises
    ------
    InvalidParameterError
        If a region is none of the mesh.
    """
    out = [_edit_out(edit, mesh) for edit in edits]
    return {"kind": KIND, "version": VERSION, "mesh": asdict(mesh_fingerprint(mesh)), "edits": out}


def _edit_out(edit: Edit, mesh: TriangleMesh) -> dict[str, Any]:
    moves = [
        {"region": _region_out(move.region, mesh), "handle": _handle_out(move.handle)}
        for move in edit.moves
    ]
    fixed = None if edit.fixed is None else _region_out(edit.fixed, mesh)
    return {"moves": moves, "fixed": fixed, "n_modes": edit.n_modes, "mode": edit.mode}


def _region_out(region: Region, mesh: TriangleMesh) -> dict[str, Any]:
    if isinstance(region, BoxRegion):
        low, high = (
            [value if np.isfinite(value) else None for value in c.tolist()]
            for c in (region.low, region.high)
        )
        return {"kind": "box", "low": low, "high": high}  # JSON has no infinity
    if isinstance(region, BrushRegion):
        return {"kind": "brush", "center": region.center.tolist(), "radius": region.radius}
    return {"kind": "vertices", "vertices": np.flatnonzero(region_mask(mesh, region)).tolist()}


def _handle_out(handle: Handle) -> dict[str, Any]:
    if isinstance(handle, Rotation):
        pivot, axis = handle.pivot.tolist(), handle.axis.tolist()
        return {"kind": "rotation", "pivot": pivot, "axis": axis, "angle": handle.angle}
    return {"kind": "translation", "vector": handle.vector.tolist()}


def edits_from_json(content: Any, mesh: TriangleMesh) -> list[Edit]:
    """Return the edits of a mesh, as `edits_to_json` gave them.

    Raises
    ------
    FileFormatError
        If the content is no such thing; the message names the first edit at fault.
    InvalidParameterError
        If they were made on another mesh, with the size and digest of both.
    """
    if not isinstance(content, Mapping) or content.get("kind") != KIND:
        raise FileFormatError(f"Edits are kept as a JSON object of kind {KIND!r}; this is none.")
    if content.get("version") != VERSION:
        raise FileFormatError(
            f"Edits of version {VERSION} are read; this is version {content.get('version')!r}."
        )
    found: list[Edit] = []
    try:
        made_on = _fingerprint_in(content["mesh"])
        n_vertices = made_on.n_vertices
        for entry in _listed(content["edits"], "edits"):
            found.append(_edit_in(entry, n_vertices))
    except (KeyError, TypeError, ValueError, OverflowError) as err:
        raise FileFormatError(f"Edit {len(found)} cannot be read: {_reason(err)}") from err
    present = mesh_fingerprint(mesh)
    if made_on != present:
        raise InvalidParameterError(
            f"Edits name vertices of the mesh that they were made on; that has {made_on}, and this mesh has {present}. "
            "Read them with the mesh that they were made on, and give it to replay as source to carry them over."
        )
    return found


def _fingerprint_in(entry: Any) -> MeshFingerprint:
    n_vertices, n_faces = (_whole(entry[name], name, 0) for name in ("n_vertices", "n_faces"))
    return MeshFingerprint(n_vertices, n_faces, str(entry["digest"]))


def _reason(err: Exception) -> str:
    return f"{err} is missing, or not known." if isinstance(err, KeyError) else str(err)


def _edit_in(entry: Any, n_vertices: int) -> Edit:
    moves = [
        (_region_in(move["region"], n_vertices), _handle_in(move["handle"]))
        for move in _listed(entry["moves"], "moves")
    ]
    fixed = None if entry["fixed"] is None else _region_in(entry["fixed"], n_vertices)
    n_modes = None if entry["n_modes"] is None else _whole(entry["n_modes"], "n_modes", 1)
    return Edit(
        tuple(Move(*pair) for pair in moves), fixed, n_modes, require_mode(str(entry["mode"]))
    )


def _region_in(entry: Any, n_vertices: int) -> Region:
    readers: dict[str, Callable[[], Region]] = {
        "box": lambda: BoxRegion(
            _numbers(entry["low"], "low", -np.inf), _numbers(entry["high"], "high", np.inf)
        ),
        "brush": lambda: BrushRegion(
            _numbers(entry["center"], "center"), _number(entry["radius"], "radius")
        ),
        "vertices": lambda: np.array(
            [
                _whole(v, "A vertex", 0, n_vertices - 1)
                for v in _listed(entry["vertices"], "vertices")
            ],
            dtype=np.int64,
        ),
    }
    return readers[entry["kind"]]()


def _handle_in(entry: Any) -> Handle:
    readers: dict[str, Callable[[], Handle]] = {
        "rotation": lambda: Rotation(
            _numbers(entry["pivot"], "pivot"),
            _numbers(entry["axis"], "axis"),
            _number(entry["angle"], "angle"),
        ),
        "translation": lambda: Translation(_numbers(entry["vector"], "vector")),
    }
    return readers[entry["kind"]]()


def _listed(value: Any, name: str) -> list[Any]:
    if not isinstance(value, list):
        raise InvalidParameterError(f"{name} must be a list; it is {value!r}.")
    return value


def _whole(value: Any, name: str, low: int, high: int | None = None) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InvalidParameterError(f"{name} must be a whole number; it is {value!r}.")
    return whole_number(value, name, low, high)


def _number(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidParameterError(f"{name} must be a number; it is {value!r}.")
    return float(value)


def _numbers(value: Any, name: str, end: float | None = None) -> list[float]:
    """Return numbers; where there is an end, it stands for null."""
    return [
        end if end is not None and part is None else _number(part, name)
        for part in _listed(value, name)
    ]
