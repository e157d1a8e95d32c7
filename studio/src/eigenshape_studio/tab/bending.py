"""Bending the shape of a tab: regions that are bound, motions of them, and edits from files."""

import json
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from time import perf_counter
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.deformation.rig import pose_rig
from eigenshape_studio.calls import (
    Arrays,
    Families,
    Meta,
    Reply,
    RequestError,
    Works,
    file_bytes,
    whole,
)
from eigenshape_studio.shape.jobs import NO_JOB, PreparingError
from eigenshape_studio.tab.history import Pose
from eigenshape_studio.tab.scene import Scene

MOST_REGIONS = 4  # one component each of the attribute `shares` of the vertex shader
MOST_MODES = 2000  # that the page may request
MODES = ("graded", "uncrossed", "thesis")
# The filters of warnings belong to the whole process, so only one thread may listen at a time.
# Only bends in the mode "uncrossed" warn, and bindings.
LISTENING = Lock()


@dataclass(frozen=True, eq=False)
class Bound:
    """What the handles of the present drag move: vertices of each region, and those that stay."""

    regions: list[np.ndarray]
    fixed: np.ndarray | None
    n_modes: int | None


class Bending:
    """What is bound in a tab, and how it is moved.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    works : Works
    families : Families
    """

    def __init__(self, scene: Scene) -> None:
        self._of = scene
        self.bound: Bound | None = None
        self._mode = "graded"
        # The pose that is dragged, and the session in which it is.
        self._dragged: tuple[Pose | None, es.DeformationSession | None] = (None, None)
        self.works: Works = {
            "preview": self._preview,
            "commit": self._commit,
            "cancel": self._cancel,
            "replay": self._replay,
        }
        self.families: Families = {"skeleton": self._skeleton}

    def facts(self) -> dict[str, Any]:
        """Return what the page shows of it."""
        bound = self.bound
        return {
            **NO_JOB,
            **self._of.analysis.rig.facts(),
            "mode": self._mode,
            "n_edits": self._of.history.now.pose.n_edits,
            "regions": [] if bound is None else [len(region) for region in bound.regions],
        }

    def _skeleton(self, tail: str) -> np.ndarray:
        rig = self._session().rig
        if not tail.isdecimal() or not 1 <= int(tail) <= rig.n_modes:
            raise RequestError(
                f"A skeleton must be of 1 to {rig.n_modes} modes; not {tail[:80]!r}."
            )
        return es.deformation.eigen_skeleton(rig, int(tail)).astype("<f4")

    def _session(self) -> es.DeformationSession:
        """Return a session in the present pose, which begins when the rig is ready."""
        with self._of.changing:
            now = self._of.history.now
            pose, session = self._dragged
            # A session with an edit is of a commit that could not be written.
            if session is None or pose is not now.pose or session.edits:
                rig = self._rig_at_rest()
                if now.pose.number:
                    rig = pose_rig(rig, self._of.mesh.vertices)
                session = es.DeformationSession(rig)
                self._dragged = now.pose, session
            return session

    def _rig_at_rest(self) -> es.deformation.EigenRig:
        job = self._of.analysis.rig
        if job.status == "running":
            raise PreparingError("The shape is being prepared for bending.")
        if job.result is None:
            why = job.message or "ask for it above the panels."
            raise RequestError(f"The shape must be prepared for bending: {why}")
        return job.result

    def bind(self, meta: Meta, arrays: Arrays) -> Reply:
        """Bind regions, and return the share by which each vertex follows each of them."""
        n_regions = whole(meta, "n_regions", 1, MOST_REGIONS)
        names = [f"region{number}" for number in range(n_regions)]
        names += ["fixed"] if meta.get("fixed") else []
        missing = [name for name in names if name not in arrays]
        if missing:
            raise RequestError(
                f"A rig must have an array for each region; {missing[0]} is missing."
            )
        regions = [np.unique(arrays[name].astype(np.int64)) for name in names]
        fixed = regions.pop() if meta.get("fixed") else None
        bound = Bound(regions, fixed, _n_modes(meta))
        began = perf_counter()
        with self._of.changing:
            self.bound, self._of.warnings = None, []
            binding = self._listen(lambda: self._drag(bound, [None] * n_regions))
        facts = {
            "warnings": self._of.warnings,
            "n_modes": binding.n_modes.tolist(),
            "pivots": [_rim_center(self._of.mesh, region) for region in regions],
            "seconds": perf_counter() - began,
        }
        # As the vertex shader takes them.
        shares = np.zeros((self._of.mesh.n_vertices, MOST_REGIONS), dtype="<f4")
        shares[:, :n_regions] = binding.shares.T
        return facts, {"shares": shares}

    def _drag(self, bound: Bound, handles: list[Any]) -> es.deformation.Binding:
        """Drag the bound regions by handles, and return by how much each vertex follows."""
        session = self._session()
        moves = [
            es.deformation.Move(region, handle_from(entry))
            for region, entry in zip(bound.regions, handles, strict=True)
        ]
        session.drag_all(moves, fixed=bound.fixed, n_modes=bound.n_modes)
        self.bound = bound
        return session.binding

    def _preview(self, meta: Meta, _arrays: Arrays) -> np.ndarray:
        """Return the exact result of a motion, which is not kept."""
        bound, entries, mode = self._motion(meta)
        binding = self._drag(bound, entries)
        handles = [handle_from(entry) for entry in entries]
        bent = self._bent(mode, lambda: es.deformation.bend(binding, handles, mode=mode))
        return bent.vertices

    def _commit(self, meta: Meta, _arrays: Arrays) -> None:
        bound, entries, mode = self._motion(meta)
        self._drag(bound, entries)
        session = self._session()
        bent = self._bent(mode, lambda: session.commit(mode=mode))
        self._mode = mode
        self._of.history.bend(session.edits, bent, "Bend")

    def _motion(self, meta: Meta) -> tuple[Bound, list[Any], Any]:
        """Return what a call moves, by which handles and in which mode."""
        entries, mode = meta.get("handles"), meta.get("mode", self._mode)
        if self.bound is None:
            self.bound = self._chosen(meta)
        if self.bound is None:
            raise RequestError(
                "A region must be bound before it moves; none is. Choose a region first."
            )
        if not isinstance(entries, list) or len(entries) != len(self.bound.regions):
            raise RequestError(
                f"There must be one handle for each of the {len(self.bound.regions)} regions."
            )
        if mode not in MODES:
            raise RequestError(f"mode must be one of {', '.join(MODES)}; it is {mode!r:.80}.")
        return self.bound, entries, mode

    def _chosen(self, meta: Meta) -> Bound | None:
        """Return what the chosen regions move; the server may have begun anew since they were bound."""
        history = self._of.history
        owners = history.owners(history.now)
        if owners is None:
            return None
        members = [np.flatnonzero(owners == region) for region in range(MOST_REGIONS + 1)]
        fixed = members.pop()
        regions = [region for region in members if len(region)]
        return Bound(regions, fixed if len(fixed) else None, _n_modes(meta)) if regions else None

    def _bent(self, mode: str, work: Callable[[], Any]) -> Any:
        """Return what some work returns that bends the shape; only in one mode can it warn."""
        return self._listen(work) if mode == "uncrossed" else work()

    def _listen(self, work: Callable[[], Any]) -> Any:
        """Do some work, and keep what it warns of for the page."""
        with LISTENING, warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always", UserWarning)
            result = work()
        self._of.warnings += [str(warning.message) for warning in heard]
        return result

    def _cancel(self, _meta: Meta, _arrays: Arrays) -> None:
        self.bound = None
        self._session().cancel()

    def _replay(self, meta: Meta, arrays: Arrays) -> None:
        """Apply stored edits; of another mesh of the shape if the array `source` holds its file."""
        rig = self._rig_at_rest()
        source = None
        if "source" in arrays:
            given = self._of.parse(str(meta.get("source")), file_bytes(arrays, "source"))
            source = given.mesh
        with TemporaryDirectory() as folder:
            path = Path(folder, "edits.json")
            path.write_text(json.dumps(meta.get("edits")))
            try:
                edits = es.io.read_edits(path, source or self._of.analysis.mesh)
            except es.InvalidParameterError as error:
                raise RequestError(
                    "These edits were made on another mesh than that of this shape. To carry them "
                    "over, choose its file together with the edits."
                ) from error
        session = es.deformation.replay(rig, edits, source=source)
        self._of.history.bend(session.edits, session.mesh, "Load edits", at_rest=True)


def handle_from(entry: Any) -> es.types.Handle:
    """Return the handle that an entry of a call stands for; null stands for no motion.

    Raises
    ------
    RequestError, InvalidParameterError
        If it is no handle.
    """
    if entry is None:
        return es.Translation([0.0, 0.0, 0.0])
    try:
        if entry["type"] == "rotation":
            return es.Rotation(entry["pivot"], entry["axis"], entry["angle"])
        if entry["type"] == "translation":
            return es.Translation(entry["vector"])
        if entry["type"] == "scaling":
            return es.deformation.Scaling(entry["pivot"], entry["factors"])
    except (KeyError, TypeError) as err:
        raise RequestError(f"A handle must have all its entries; {err} is missing.") from err
    raise RequestError("The type of a handle must be rotation, translation or scaling.")


def _n_modes(meta: Meta) -> int | None:
    return None if meta.get("n_modes") is None else whole(meta, "n_modes", 1, MOST_MODES)


def _rim_center(mesh: es.TriangleMesh, region: np.ndarray) -> list[float]:
    """Return the mean of the vertices at the boundary of a region, about which it turns."""
    rim = es.deformation.region_boundary(mesh, es.deformation.region_mask(mesh, region))
    return mesh.vertices[rim if len(rim) else region].mean(axis=0).tolist()
