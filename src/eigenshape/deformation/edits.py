"""Edits as values that can be stored as JSON and applied again."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from hashlib import sha256
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from certeig.kit.arguments import describe_value, require_each
from certeig.kit.arrays import ReadOnly, record, whole_number
from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import bend
from eigenshape.deformation.handles import (
    Handle,
    Rotation,
    Scaling,
    Translation,
    require_handle,
)
from eigenshape.deformation.modes import Mode, require_mode
from eigenshape.deformation.region import BoxRegion, BrushRegion, Region, copy_region, region_mask
from eigenshape.deformation.rig import EigenRig, pose_rig
from eigenshape.geometry.mesh import TriangleMesh

# The entries "kind" and "version" of the JSON object. The version grows when older readers could
# not read what is written.
KIND, VERSION = "eigenshape edits", 2
# Names of handles and regions in it; a mask is written as the list of its vertices.
HANDLES = {"rotation": Rotation, "translation": Translation, "scaling": Scaling}
REGIONS = {"box": BoxRegion, "brush": BrushRegion}
OPEN_SIDES = {"low": -np.inf, "high": np.inf}


@dataclass(frozen=True)
class MeshFingerprint:
    """Identifies the mesh of some edits, because indices of vertices mean nothing on another mesh.

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
    """Return the fingerprint of a mesh, which is the same on every machine."""
    numbers = mesh.vertices.astype("<f8") + 0.0  # turns -0 into 0
    digest = sha256(numbers.tobytes() + mesh.faces.astype("<i8").tobytes()).hexdigest()
    return MeshFingerprint(mesh.n_vertices, mesh.n_faces, digest)


@record
class Move(ReadOnly):
    """A region and the handle that moves it.

    Parameters
    ----------
    region : (n,) bool, (k,) int, BoxRegion or BrushRegion
        See `region_mask`.
    handle : Rotation, Translation or Scaling

    Raises
    ------
    InvalidParameterError
        If the region or the handle is of another type.

    Examples
    --------
    >>> import eigenshape as es
    >>> top = es.deformation.BoxRegion([-9, -9, 0.2], [9, 9, 9])
    >>> move = es.deformation.Move(top, es.Translation([0, 0, 1]))
    """

    region: Region
    handle: Handle

    def __post_init__(self) -> None:
        require_handle(self.handle)
        vars(self).update(region=copy_region(self.region))


@record
class Edit(ReadOnly):
    """One edit of a shape: regions that move together, and the region that stays.

    Parameters
    ----------
    moves : tuple of Move
    fixed : region, optional
        The vertices that must stay; see `bind`.
    n_modes : int, optional
        Number of modes; see `bind`.
    mode : "graded", "uncrossed" or "thesis"
        The method; see `bend`.

    Raises
    ------
    InvalidParameterError
        If an entry of `moves` is not a `Move`, or `fixed` is not a region.

    See Also
    --------
    replay : Apply edits one after the other.

    Examples
    --------
    Pull two ends of a sphere apart at the same time:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> top = es.deformation.Move(mesh.vertices[:, 2] > 0.6, es.Translation([0, 0, 0.5]))
    >>> bottom = es.deformation.Move(mesh.vertices[:, 2] < -0.6, es.Translation([0, 0, -0.5]))
    >>> edit = es.deformation.Edit((top, bottom))
    >>> heights = es.deformation.replay(es.rig_shape(mesh), [edit]).mesh.vertices[:, 2]
    >>> heights.max().round(1).item(), heights.min().round(1).item()
    (1.5, -1.5)
    """

    moves: tuple[Move, ...]
    fixed: Region | None = None
    n_modes: int | None = None
    mode: Mode = "graded"

    def __post_init__(self) -> None:
        require_each(self.moves, Move, "moves")
        vars(self).update(fixed=None if self.fixed is None else copy_region(self.fixed))


def apply_edit(rig: EigenRig, edit: Edit) -> EigenRig:
    """Return a rig in its new pose; boxes and brushes select vertices in the present one."""
    regions = [move.region for move in edit.moves]
    handles = [move.handle for move in edit.moves]
    binding = bind(rig, regions, fixed=edit.fixed, n_modes=edit.n_modes)
    return pose_rig(rig, bend(binding, handles, mode=edit.mode).vertices)


def carry_edit(edit: Edit, source: TriangleMesh, target: TriangleMesh) -> Edit:
    """Return an edit for another mesh of the same shape in the same place.

    Boxes and brushes stay as they are. For masks and indices, each vertex of the target belongs to
    a region if its nearest vertex of the source does.
    """
    nearest = cKDTree(source.vertices).query(target.vertices)[1]

    def carry(region: Region) -> Region:
        if isinstance(region, BoxRegion | BrushRegion):
            return region
        return region_mask(source, region)[nearest]

    moves = tuple(Move(carry(move.region), move.handle) for move in edit.moves)
    return Edit(moves, None if edit.fixed is None else carry(edit.fixed), edit.n_modes, edit.mode)


def edits_to_json(edits: Sequence[Edit], mesh: TriangleMesh) -> dict[str, Any]:
    """Return the edits of a mesh as a dictionary for JSON, with regions as indices of vertices.

    Raise InvalidParameterError if a region does not fit the mesh.
    """
    entries = []
    for edit in edits:
        moves = [
            {"region": _region_to_json(move.region, mesh), "handle": _to_json(move.handle)}
            for move in edit.moves
        ]
        fixed = None if edit.fixed is None else _region_to_json(edit.fixed, mesh)
        entries.append({"moves": moves, "fixed": fixed, "n_modes": edit.n_modes, "mode": edit.mode})
    fingerprint = asdict(mesh_fingerprint(mesh))
    return {"kind": KIND, "version": VERSION, "mesh": fingerprint, "edits": entries}


def _region_to_json(region: Region, mesh: TriangleMesh) -> dict[str, Any]:
    if isinstance(region, BoxRegion | BrushRegion):
        return _to_json(region)
    return {"kind": "vertices", "vertices": np.flatnonzero(region_mask(mesh, region)).tolist()}


def _to_json(value: Handle | BoxRegion | BrushRegion) -> dict[str, Any]:
    """Return the kind of a value and its fields; null stands for an open side of a box."""
    kinds = {made: kind for kind, made in (HANDLES | REGIONS).items()}
    entry: dict[str, Any] = {"kind": kinds[type(value)]}
    for field in fields(value):
        content = getattr(value, field.name)
        if isinstance(content, np.ndarray):
            # JSON has no infinity.
            content = [part if np.isfinite(part) else None for part in content.tolist()]
        entry[field.name] = content
    return entry


def edits_from_json(content: Any, mesh: TriangleMesh) -> list[Edit]:
    """Return the edits of a mesh from what `edits_to_json` returned.

    Raise FileFormatError if the content is of another form, and InvalidParameterError if the edits
    belong to another mesh.
    """
    if not isinstance(content, Mapping):
        raise FileFormatError(
            f"Edits must be a JSON object of kind {KIND!r}; this is {describe_value(content)}."
        )
    if content.get("kind") != KIND:
        raise FileFormatError(
            f"Edits must be a JSON object of kind {KIND!r}; the kind is {content.get('kind')!r}."
        )
    if content.get("version") != VERSION:
        raise FileFormatError(
            f"Edits must be of version {VERSION}; the version is {content.get('version')!r}."
        )
    found: list[Edit] = []
    try:
        entry = content["mesh"]
        n_vertices, n_faces = (_whole(entry[name], name, 0) for name in ("n_vertices", "n_faces"))
        original = MeshFingerprint(n_vertices, n_faces, str(entry["digest"]))
        for entry in _as_list(content["edits"], "edits"):
            moves = [
                Move(
                    _region_from_json(move["region"], n_vertices),
                    _from_json(move["handle"], HANDLES),
                )
                for move in _as_list(entry["moves"], "moves")
            ]
            fixed, n_modes = entry["fixed"], entry["n_modes"]
            fixed = None if fixed is None else _region_from_json(fixed, n_vertices)
            n_modes = None if n_modes is None else _whole(n_modes, "n_modes", 1)
            found.append(Edit(tuple(moves), fixed, n_modes, require_mode(str(entry["mode"]))))
    except (KeyError, TypeError, ValueError, OverflowError) as err:
        reason = f"{err} is missing or unknown." if isinstance(err, KeyError) else str(err)
        raise FileFormatError(f"Edit {len(found)} cannot be read: {reason}") from err
    present = mesh_fingerprint(mesh)
    if original != present:
        raise InvalidParameterError(
            "Edits name vertices of the mesh on which they were made; "
            f"that has {original}, and this mesh has {present}. "
            "Read them with the original mesh, and pass that to replay as source."
        )
    return found


def _region_from_json(entry: Any, n_vertices: int) -> Region:
    if entry["kind"] != "vertices":
        return _from_json(entry, REGIONS)
    vertices = _as_list(entry["vertices"], "vertices")
    whole = [_whole(vertex, "A vertex", 0, n_vertices - 1) for vertex in vertices]
    return np.array(whole, dtype=np.int64)


def _from_json(entry: Any, kinds: dict[str, Any]) -> Any:
    """Make a value of its kind and its fields, which are numbers or lists of numbers."""
    made = kinds[entry["kind"]]
    arguments: dict[str, Any] = {}
    for field in fields(made):
        name, content = field.name, entry[field.name]
        if field.type is float:
            arguments[name] = _number(content, name)
        else:
            parts = [
                OPEN_SIDES[name] if part is None and name in OPEN_SIDES else _number(part, name)
                for part in _as_list(content, name)
            ]
            arguments[name] = parts
    return made(**arguments)


def _as_list(value: Any, name: str) -> list[Any]:
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
