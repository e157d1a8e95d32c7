"""The shapes of one tab, and the five calls of the page: the same for all hosts."""

import json
import threading
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.deformation.rig import pose_rig
from eigenshape.geometry.resolution.thinning import thin_out
from eigenshape_studio.analysis import (
    LIGHT,
    N_MODES,
    Analysis,
    cut_rows,
    diagram_rows,
    vertex_labels,
)
from eigenshape_studio.brush import Brush
from eigenshape_studio.calls import Arrays, Reply, RequestError, file_bytes, whole
from eigenshape_studio.company import Company
from eigenshape_studio.folders import Folders, look_in
from eigenshape_studio.history import History, Pose, Shape
from eigenshape_studio.jobs import NO_JOB, PreparingError, window_message
from eigenshape_studio.loading import Field, Loaded, check_fields
from eigenshape_studio.onefile import N_MODES as N_REPORTED
from eigenshape_studio.onefile import report_page
from eigenshape_studio.parse import Upload, display_name, parse_surface
from eigenshape_studio.poses import carry_pose
from eigenshape_studio.samples import SAMPLES, sample_mesh, sample_picture
from eigenshape_studio.search import Shelf
from eigenshape_studio.sessions import SessionFile
from eigenshape_studio.sides import remember_side
from eigenshape_studio.specimens import Specimens
from eigenshape_studio.wire import WireError, decode, encode

MOST_REGIONS = 4  # one component each of the attribute `shares` of the vertex shader
MOST_MODES = 2000  # that the page may request
N_BRACKETS = 20  # bracketing costs a solve with three times as many unknowns
CAPABILITIES = ("rig", "finish", "query", "open", "repair", "solve", "beside")
CALLS = ("meta", "array", "rig", "finish", "query")
MODES = ("graded", "uncrossed", "thesis")
# The filters of warnings belong to the whole process, so only one thread may listen at a time.
# Only the mode "uncrossed" warns.
LISTENING = threading.Lock()


@dataclass(frozen=True)
class Answer:
    """The message that answers a call.

    Attributes
    ----------
    message : bytes
    status : int
        As in HTTP: 200, 400 if the call was at fault, 500 if the studio was, 503 if the call can be
        sent again in a while.
    """

    message: bytes
    status: int


@dataclass(frozen=True, eq=False)
class Bound:
    """What the handles of the present drag move: vertices of each region, and those that stay."""

    regions: list[np.ndarray]
    fixed: np.ndarray | None
    n_modes: int | None


class Workspace:
    """The shapes of one tab: what is computed of them, what was done to them, and the five calls.

    Calls of one workspace that change anything run one after the other; `meta` and `array` never
    wait for them. Workspaces do not share anything that changes.

    Parameters
    ----------
    mesh : MeshLike or list of Shape
        The shape, or the shapes to choose from, of which the first one is shown.
    name : str
    values : {title: (n,) array}, optional
        Functions on the vertices.
    index : path, optional
        Folder of an index to search in.
    n_modes : int
        Number of eigenpairs to compute at first; a rig of fewer than 300 bends less sharply.
    shared : bool
        Whether the workspace is forked for several tabs.
    """

    def __init__(
        self,
        mesh: es.types.MeshLike | list[Shape],
        name: str = "shape",
        *,
        values: Mapping[str, Any] | None = None,
        index: str | Path | None = None,
        n_modes: int = N_MODES,
        shared: bool = False,
    ) -> None:
        shapes = mesh if isinstance(mesh, list) else []
        if not isinstance(mesh, list):
            surface = es.as_mesh(mesh)
            loaded = Loaded(surface, fields=check_fields(values or {}, surface.n_vertices))
            make = partial(Analysis, n_modes=n_modes, shared=shared)
            shapes = [Shape(0, display_name(name), lambda: loaded, make)]
        self.history = History(shapes)
        self.analysis  # noqa: B018  it begins before a page asks
        self.shelf = None if index is None else Shelf(index)
        self.bound: Bound | None = None
        self.most_bytes = 256 << 20  # of a file; the server has a limit of its own
        self.matches: list[str] = []  # names, of the last query
        self._searched: tuple[Any, Reply] | None = None  # for what, and what was found
        self.specimens: Specimens | None = None  # of the collection that the studio was opened with
        self.folders: Folders | None = None  # that the page may open
        self.notes: list[str] = []  # what the page says when it is opened
        self.mode = "graded"
        self.welcome = False  # whether the page offers samples first
        self._begin()

    def _begin(self) -> None:
        """Set up what no two workspaces share."""
        self.company = Company(self)
        self._changing = threading.RLock()
        self._brush = Brush()
        # The pose that is dragged, and the session in which it is.
        self._dragged: tuple[Pose | None, es.DeformationSession | None] = (None, None)

    def fork(self, file: SessionFile | None = None) -> "Workspace":
        """Return a workspace of the same shapes for another tab; it continues what a file holds."""
        twin = object.__new__(Workspace)
        twin.__dict__.update(self.__dict__)
        shapes = self.history.shapes.values()
        twin.history = History([shape.fork() for shape in shapes], file)
        twin.bound, twin.mode, twin.matches = None, "graded", []
        twin._begin()
        with suppress(es.EigenshapeError, OSError):  # they may have gone
            twin._use(twin.history.index, twin.history.collection)
        return twin

    def close(self) -> None:
        """Stop what is still computed, and let go of the file."""
        self.company.close()
        for shape in self.history.shapes.values():
            shape.leave()
        if self.history.file is not None:
            self.history.file.close()

    @property
    def analysis(self) -> Analysis:
        """What is computed of the shape."""
        return self.history.now.shape.analysis

    @property
    def fields(self) -> dict[str, Field]:
        """Functions on the vertices of the shape."""
        self.analysis  # noqa: B018  they are read with the mesh
        return self.history.now.shape.fields

    @property
    def attributes(self) -> es.io.MeshAttributes | None:
        """What the file of the shape holds besides."""
        self.analysis  # noqa: B018  they are read with the mesh
        return self.history.now.shape.attributes

    @property
    def mesh(self) -> es.TriangleMesh:
        """The shape in its present pose."""
        return self.history.mesh(self.history.now.pose)

    @property
    def edits(self) -> tuple[es.deformation.Edit, ...]:
        """The edits that lead to the present pose, oldest first."""
        return self.history.edits(self.history.now.pose)

    def answer(self, call: str, message: bytes) -> Answer:
        """Answer a call; whatever is wrong with it becomes an answer, too."""
        try:
            meta, arrays = decode(message)
            return Answer(encode(*self._dispatch(call, meta, arrays)), 200)
        except (es.EigenshapeError, WireError, RequestError, OSError) as error:
            return Answer(error_message(type(error).__name__, window_message(error)), 400)
        except PreparingError as error:
            return Answer(error_message("PreparingError", str(error)), 503)
        except MemoryError:
            return Answer(error_message("MemoryError", "There is not enough memory for this."), 400)
        except Exception as error:  # noqa: BLE001  the other tabs must go on
            return Answer(error_message("InternalError", f"{type(error).__name__}: {error}"), 500)

    def _dispatch(self, call: str, meta: Any, arrays: Arrays) -> Reply:
        if call not in CALLS:
            raise RequestError(f"A call must be one of {', '.join(CALLS)}; it is {call!r:.80}.")
        if not isinstance(meta, dict):
            raise RequestError("The meta of a call must be an object.")
        work: Callable[[dict[str, Any], Arrays], Reply] = getattr(self, f"call_{call}")
        return work(meta, arrays)

    def call_meta(self, _meta: dict[str, Any], _arrays: Arrays) -> Reply:
        """Return the state."""
        return self.state(), {}

    def state(self) -> dict[str, Any]:
        """Return what the page shows beside the arrays."""
        analysis, history = self.analysis, self.history
        now = history.now
        capabilities = [name for name in CAPABILITIES if name != "query" or self.shelf is not None]
        capabilities += [] if self.specimens is None else ["collection"]
        capabilities += [] if self.folders is None else ["folders"]
        return {
            "name": analysis.name,
            "n_vertices": analysis.mesh.n_vertices,
            "n_faces": analysis.mesh.n_faces,
            **analysis.view(),
            "capabilities": capabilities,
            "most_bytes": self.most_bytes,
            "suffixes": ",".join(es.io.SHAPE_FORMATS),
            "notes": self.notes,
            "large": analysis.large_facts(),
            "health": analysis.health_facts(),
            "values": [_field_facts(name, field) for name, field in self.fields.items()],
            "spectrum": analysis.spectrum_facts(),
            "parts": analysis.parts_facts(),
            "deformation": self._deformation_facts(),
            "index": None if self.shelf is None else self.shelf.facts(),
            **self.company.facts(),
            "n_points": 0 if now.shape.points is None else len(now.shape.points),
            "shapes": [[shape.number, shape.name] for shape in history.shapes.values()],
            "history": [moment.text for moment in history.moments[1:]],
            "place": history.place,
            "digest": now.shape.digest,
            "selected": now.selected,
            "pose": now.pose.number,
            "shape": now.shape.number,
            "samples": list(SAMPLES) if self.welcome else [],
        }

    def _deformation_facts(self) -> dict[str, Any]:
        bound, history = self.bound, self.history
        return {
            **NO_JOB,
            **self.analysis.rig.facts(),
            "mode": self.mode,
            "n_edits": history.now.pose.n_edits,
            "regions": [] if bound is None else [len(region) for region in bound.regions],
        }

    def call_array(self, meta: dict[str, Any], _arrays: Arrays) -> Reply:
        """Return one array by its name."""
        name = meta.get("name")
        if not isinstance(name, str):
            raise RequestError(f"The name of an array must be text; it is {name!r:.80}.")
        return {}, {name: self.array(name, meta)}

    def array(self, name: str, meta: dict[str, Any] | None = None) -> np.ndarray:
        """Return one array by its name; `meta` may hold the range start..stop.

        Raises
        ------
        RequestError
            If there is no such array, or not yet.
        """
        meta = meta or {}
        head, _, tail = name.partition("/")
        makers: dict[str, Callable[..., np.ndarray]] = {
            "vertices": self._vertices,
            "faces": lambda: self.analysis.mesh.faces.astype("<u4"),
            "points": self._points,
            "areas": lambda: self.analysis.areas.astype("<f4"),
            "modes": lambda: self._modes(meta),
            "eigenvalues": lambda: self._spectrum().eigenvalues.astype("<f8"),
            "coefficients": self._coefficients,
            "brackets": lambda: self._brackets(meta),
            "diagram": self._diagram,
            "crossings": self._crossings,
            "regions": self._regions,
        }
        families: dict[str, Callable[[str], np.ndarray]] = {
            "parts": self._parts_array,
            "values": self._values_array,
            "skeleton": self._skeleton,
            "disc": lambda tail: self._brush.disc(self.mesh, tail),
            "file": self._file,
            "match": self._match_array,
            "folder": lambda tail: self._require_folders().list(tail),
            **self.company.families,
            "sample": sample_picture,
        }
        if not tail and head in makers:
            return makers[head]()
        if tail and head in families:
            return families[head](tail)
        raise RequestError(f"There must be an array of the requested name; {name[:80]!r} is none.")

    def _regions(self) -> np.ndarray:
        """Return the region of each vertex, as the page chose it; empty where it chose none."""
        found = self.history.owners(self.history.now)
        return np.empty(0, np.uint8) if found is None else found

    def _vertices(self) -> np.ndarray:
        return self.mesh.vertices.astype("<f4")

    def _points(self) -> np.ndarray:
        points = self.history.now.shape.points
        if points is None:
            raise RequestError("There must be points that the surface was made of; there are none.")
        return points.astype("<f4")

    def _spectrum(self) -> es.Spectrum:
        found = self.analysis.spectrum.result
        if found is None:
            raise RequestError(
                "The spectrum must be ready; it is not. Wait for it, or solve again."
            )
        return found

    def _modes(self, meta: dict[str, Any]) -> np.ndarray:
        modes = self._spectrum().eigenvectors
        start = whole(meta, "start", 0, modes.shape[1], 0)
        stop = whole(meta, "stop", start, modes.shape[1], modes.shape[1])
        return np.ascontiguousarray(modes[:, start:stop].T, dtype="<f4")

    def _coefficients(self) -> np.ndarray:
        """Return the coordinates of the present pose in terms of the modes, (k, 3)."""
        spectrum = self._spectrum()
        weighted = spectrum.mass @ self.mesh.vertices
        return np.asarray(spectrum.eigenvectors.T @ weighted).astype("<f4")

    def _brackets(self, meta: dict[str, Any]) -> np.ndarray:
        k = whole(meta, "stop", 1, min(300, self.analysis.mesh.n_vertices), N_BRACKETS)
        found = self.analysis.brackets
        if found is None or len(found.lower) < k:
            found = es.bracket_eigenvalues(self.analysis.mesh, k)
            self.analysis.brackets = found
        return np.column_stack([found.lower, found.upper])[:k]

    def _require_parts(self) -> es.features.PartDecomposition:
        found = None if self.analysis.parts is None else self.analysis.parts.result
        if found is None:
            raise RequestError("The parts must be ready; they are not. Find the parts first.")
        return found

    def _diagram(self) -> np.ndarray:
        found = self._require_parts()
        return diagram_rows(found.mesh, found.heat)

    def _parts_array(self, tail: str) -> np.ndarray:
        found = self._require_parts()
        if tail == "labels":
            return vertex_labels(found.mesh, found.fine.labels)
        if tail == "cuts":
            return cut_rows(found)
        raise RequestError(f"Of parts there are labels and cuts; {tail[:80]!r} was requested.")

    def _values_array(self, tail: str) -> np.ndarray:
        if tail not in self.fields:
            raise RequestError(f"Values must be among {list(self.fields)}; {tail[:80]!r} is not.")
        return self.fields[tail].values.astype("<f4")

    def _crossings(self) -> np.ndarray:
        return es.geometry.self_intersections(self.mesh).astype("<u4").reshape(-1, 2)

    def _skeleton(self, tail: str) -> np.ndarray:
        rig = self._session().rig
        if not tail.isdecimal() or not 1 <= int(tail) <= rig.n_modes:
            raise RequestError(
                f"A skeleton must be of 1 to {rig.n_modes} modes; not {tail[:80]!r}."
            )
        return es.deformation.eigen_skeleton(rig, int(tail)).astype("<f4")

    def _file(self, tail: str) -> np.ndarray:
        if tail not in ("ply", "obj", "glb", "html", "edits"):
            raise RequestError(
                f"A file must be ply, obj, glb, html or edits; {tail[:80]!r} was requested."
            )
        if tail == "html":
            return np.frombuffer(self._report(), np.uint8)
        with TemporaryDirectory() as folder:
            path = Path(folder, f"shape.{tail}")
            if tail == "edits":
                es.io.write_edits(self.edits, self.analysis.mesh, path)
            else:
                # A file of materials beside an OBJ file would not be sent.
                kept = None if tail == "obj" else self.attributes
                es.write_mesh(self.mesh, path, attributes=kept)
            return np.frombuffer(path.read_bytes(), np.uint8)

    def _report(self) -> bytes:
        """Return a page of the present pose that opens without the studio."""
        values = {name: field.values for name, field in self.fields.items()}
        name = self.analysis.name
        apart = type(self)(self.mesh, name, values=values, n_modes=N_REPORTED)
        side = self.analysis.view()
        apart.analysis.look_from(side["towards"], side["up"])
        try:
            return report_page(apart)
        finally:
            apart.close()

    def _session(self) -> es.DeformationSession:
        """Return a session in the present pose, which begins when the rig is ready."""
        with self._changing:
            now = self.history.now
            pose, session = self._dragged
            if session is None or pose is not now.pose:
                rig = self._rig_at_rest()
                if now.pose.number:
                    rig = pose_rig(rig, self.mesh.vertices)
                session = es.DeformationSession(rig)
                self._dragged = now.pose, session
            return session

    def _rig_at_rest(self) -> es.deformation.EigenRig:
        job = self.analysis.rig
        if job.status == "running":
            raise PreparingError("The shape is being prepared for bending.")
        if job.result is None:
            why = job.message or "ask for it above the panels."
            raise RequestError(f"The shape must be prepared for bending: {why}")
        return job.result

    def _require_shelf(self) -> Shelf:
        if self.shelf is None:
            raise RequestError("There must be an index to search in; open the studio with --index.")
        return self.shelf

    def call_rig(self, meta: dict[str, Any], arrays: Arrays) -> Reply:
        """Bind regions, and return the share by which each vertex follows each of them."""
        n_regions = whole(meta, "n_regions", 1, MOST_REGIONS)
        n_modes = None if meta.get("n_modes") is None else whole(meta, "n_modes", 1, MOST_MODES)
        names = [f"region{number}" for number in range(n_regions)]
        names += ["fixed"] if meta.get("fixed") else []
        missing = [name for name in names if name not in arrays]
        if missing:
            raise RequestError(
                f"A rig must have an array for each region; {missing[0]} is missing."
            )
        regions = [np.unique(arrays[name].astype(np.int64)) for name in names]
        fixed = regions.pop() if meta.get("fixed") else None
        began = perf_counter()
        with self._changing:
            self.bound = None
            binding = self._drag(Bound(regions, fixed, n_modes), [None] * n_regions)
        facts = {
            "n_modes": binding.n_modes.tolist(),
            "pivots": [_rim_center(self.mesh, region) for region in regions],
            "seconds": perf_counter() - began,
        }
        # As the vertex shader takes them.
        shares = np.zeros((self.mesh.n_vertices, MOST_REGIONS), dtype="<f4")
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

    def call_finish(self, meta: dict[str, Any], arrays: Arrays) -> Reply:
        """Change something, and return the new state."""
        kind = meta.get("kind")
        works: dict[Any, Callable[[dict[str, Any], Arrays], np.ndarray | None]] = {
            "preview": self._preview,
            "commit": self._commit,
            "undo": self._undo,
            "redo": self._redo,
            "go": self._go,
            "select": self._select,
            "reset": self._reset,
            "cancel": self._cancel,
            "replay": self._replay,
            "repair": self._repair,
            "open": self._open,
            "folder": self._open_folder,
            "solve": self._solve,
            "examine": lambda *_: self.analysis.health.start(),
            "prepare": lambda *_: self.analysis.prepare(),
            "lighten": self._lighten,
            "parts": lambda *_: self.analysis.find_parts(),
            "transfer": self._transfer,
            "choose": self._choose,
            **self.company.works,
            "face": self._face,
        }
        if not isinstance(kind, str) or kind not in works:
            raise RequestError(f"kind must be one of {', '.join(works)}; it is {kind!r:.80}.")
        began = perf_counter()
        with self._changing:
            self._warnings: list[str] = []
            history, before, vertices = self.history, self.history.now, None
            # A page that did not hear of an answer sends its change again.
            name = str(meta.get("id", ""))[:64]
            again = bool(name) and name == history.last
            if not again:
                vertices = works[kind](meta, arrays)
            if history.now.pose is not before.pose:
                self.bound = None
            if again or history.now.pose is not before.pose:
                vertices = self.mesh.vertices
            if history.now is not before:
                history.last = name
                history.save()
            told = self._warnings
            state = self.state()
        facts = {"state": state, "seconds": perf_counter() - began, "warnings": told}
        return facts, {} if vertices is None else {"vertices": vertices.astype("<f4")}

    def _preview(self, meta: dict[str, Any], _arrays: Arrays) -> np.ndarray:
        """Return the exact result of a motion, which is not kept."""
        bound, entries, mode = self._motion(meta)
        binding = self._drag(bound, entries)
        handles = [handle_from(entry) for entry in entries]
        return self._listen(mode, lambda: es.deformation.bend(binding, handles, mode=mode).vertices)

    def _commit(self, meta: dict[str, Any], _arrays: Arrays) -> None:
        bound, entries, mode = self._motion(meta)
        self._drag(bound, entries)
        session = self._session()
        bent = self._listen(mode, lambda: session.commit(mode=mode))
        self.mode = mode
        self.history.bend(session.edits, bent, "Bend")

    def _motion(self, meta: dict[str, Any]) -> tuple[Bound, list[Any], Any]:
        """Return what a call moves, by which handles and in which mode."""
        entries, mode = meta.get("handles"), meta.get("mode", self.mode)
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

    def _chosen(self, meta: dict[str, Any]) -> Bound | None:
        """Return what the chosen regions move; the server may have begun anew since they were bound."""
        owners = self._regions()
        members = [np.flatnonzero(owners == region) for region in range(MOST_REGIONS + 1)]
        fixed = members.pop()
        regions = [region for region in members if len(region)]
        n_modes = None if meta.get("n_modes") is None else whole(meta, "n_modes", 1, MOST_MODES)
        return Bound(regions, fixed if len(fixed) else None, n_modes) if regions else None

    def _listen(self, mode: str, work: Callable[[], Any]) -> Any:
        """Do some work, and keep what it warns of for the page."""
        if mode != "uncrossed":
            return work()
        with LISTENING, warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always", UserWarning)
            result = work()
        self._warnings += [str(warning.message) for warning in heard]
        return result

    def _undo(self, _meta: dict[str, Any], _arrays: Arrays) -> None:
        if not self.history.place:
            raise RequestError("There must be an edit to undo; there is none.")
        self.history.go(self.history.place - 1)

    def _redo(self, _meta: dict[str, Any], _arrays: Arrays) -> None:
        if self.history.place == len(self.history.moments) - 1:
            raise RequestError("There must be an undone edit to redo; there is none.")
        self.history.go(self.history.place + 1)

    def _go(self, meta: dict[str, Any], _arrays: Arrays) -> None:
        """Go to a place of the history."""
        self.history.go(whole(meta, "place", 0, len(self.history.moments) - 1))

    def _select(self, meta: dict[str, Any], arrays: Arrays) -> None:
        """Take the region of each vertex."""
        if "regions" not in arrays:
            raise RequestError("The call must have an array 'regions'.")
        self.history.select(arrays["regions"], str(meta.get("text", "Select"))[:60])

    def _choose(self, meta: dict[str, Any], _arrays: Arrays) -> None:
        """Show a shape of the list."""
        self.history.choose(self.listed_shape(meta.get("shape")))

    def listed_shape(self, number: Any) -> Shape:
        """Return a shape of the list."""
        shapes = self.history.shapes
        if not isinstance(number, int) or number not in shapes:
            raise RequestError(f"shape must be one of {[*shapes]}; it is {number!r:.80}.")
        return shapes[number]

    def _cancel(self, _meta: dict[str, Any], _arrays: Arrays) -> None:
        self.bound = None
        self._session().cancel()

    def _reset(self, _meta: dict[str, Any], _arrays: Arrays) -> None:
        self.history.did("All undone", pose=self.history.now.shape.rest)

    def _replay(self, meta: dict[str, Any], arrays: Arrays) -> None:
        """Apply stored edits; of another mesh of the shape if the array `source` holds its file."""
        rig = self._rig_at_rest()
        source = None
        if "source" in arrays:
            source = self.read_surface(str(meta.get("source")), file_bytes(arrays, "source"))
        with TemporaryDirectory() as folder:
            path = Path(folder, "edits.json")
            path.write_text(json.dumps(meta.get("edits")))
            try:
                edits = es.io.read_edits(path, source or self.analysis.mesh)
            except es.InvalidParameterError as error:
                raise RequestError(
                    "These edits were made on another mesh than that of this shape. To carry them "
                    "over, choose its file together with the edits."
                ) from error
        session = es.deformation.replay(rig, edits, source=source)
        self.history.replace_edits(session.edits, session.mesh, "Load edits")

    def _repair(self, meta: dict[str, Any], _arrays: Arrays) -> None:
        """Repair the shape in its present pose, which becomes the shape."""
        names = meta.get("names")
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise RequestError("names must be a list of the names of repairs.")
        done, kept = es.repair(self.mesh, names), self.attributes
        if kept is not None:
            kept = es.io.carry_attributes(replace(kept, mesh=self.mesh), done.mesh)
        loaded = Loaded(done.mesh, kept, side=self.analysis.side)
        self.history.show(loaded, self.analysis.name, f"Repair: {', '.join(names)}")
        self._warnings += done.report

    def _lighten(self, _meta: dict[str, Any], _arrays: Arrays) -> None:
        """Show a copy of the shape in its present pose that has fewer vertices."""
        n_vertices = self.mesh.n_vertices
        thin, source = thin_out(self.mesh, LIGHT)
        fields = {
            name: replace(field, values=field.values[source])
            for name, field in self.fields.items()
            if not np.isnan(field.values[source]).all()
        }
        name = f"{self.analysis.name}, lighter"
        self.history.show(
            Loaded(thin, fields=fields, side=self.analysis.side), name, "Lighter copy"
        )
        self._warnings.append(f"{thin.n_vertices:,} of {n_vertices:,} vertices were kept.")

    def _open(self, meta: dict[str, Any], arrays: Arrays) -> None:
        """Show the mesh of a file, a sample, or a shape of the index by its name."""
        if "match" in meta:
            self.show(*self.read_match(meta["match"]))
            return
        if "sample" in meta:
            name = str(meta["sample"])
            self.show(sample_mesh(name), name)
            return
        name = display_name(meta.get("name"))
        found = self._parse(name, file_bytes(arrays, "file"))
        loaded = Loaded(found.mesh, points=found.points)
        self.history.show(loaded, name, f"Open {name}")

    def _require_folders(self) -> Folders:
        if self.folders is None:
            raise RequestError("Folders of this machine are opened from the command line here.")
        return self.folders

    def _open_folder(self, meta: dict[str, Any], _arrays: Arrays) -> None:
        """Show what a folder holds: a collection, or the first shape of an index or of files."""
        folder = self._require_folders().path(str(meta.get("folder")))
        found, before = look_in(folder), self.history.now
        if found.files:
            self._warnings += self.history.open_files(found.files)
        self._use(found.index, found.collection)
        if found.collection and self.specimens is not None:
            self.show(self.specimens.mean, self.specimens.title)
        if self.history.now is before:  # no file is there, or its shape is shown already
            self.history.did(f"Open {folder.name}")

    def _use(self, index: str | Path | None, collection: str | Path | None) -> None:
        """Search in another index, and show another collection; None leaves what was there."""
        if index:
            self.shelf, self.matches, self._searched = Shelf(index), [], None
            self.history.index = str(index)
        if collection:
            self.specimens = Specimens(collection)
            self.history.collection = str(collection)

    def read_surface(self, name: str, data: bytes) -> es.TriangleMesh:
        """Read a surface from the bytes of a file from outside."""
        return self._parse(name, data).mesh

    def _parse(self, name: str, data: bytes) -> Upload:
        """Read a file from outside; what had to be made of points is told with the answer."""
        found = parse_surface(name, data)
        self._warnings += found.report
        return found

    def warn(self, lines: list[str]) -> None:
        """Tell something with the answer to the present call."""
        self._warnings += lines

    def _face(self, meta: dict[str, Any], _arrays: Arrays) -> None:
        """Let another direction be up and another side the front, now and later on."""
        analysis = self.analysis
        analysis.look_from(meta.get("towards", "auto"), meta.get("up", "auto"))
        side = analysis.view()
        remember_side(analysis.mesh, side["up"], side["towards"])

    def _solve(self, meta: dict[str, Any], _arrays: Arrays) -> None:
        most = min(MOST_MODES, self.analysis.mesh.n_vertices)
        self.analysis.solve(whole(meta, "k", 1, most))

    def _transfer(self, meta: dict[str, Any], arrays: Arrays) -> None:
        """Bend another shape as this one was bent; the result becomes the shape."""
        name = display_name(meta.get("name"))
        target = self.read_surface(name, file_bytes(arrays, "file"))
        source = self.analysis.mesh
        pairs = arrays["pairs"].astype(np.int64) if "pairs" in arrays else None
        bent = carry_pose(source, self.mesh, target, pairs)
        self.show(bent, name)

    def show(self, mesh: es.TriangleMesh, name: str) -> None:
        """Show another shape; those before stay in the list, with their edits."""
        self.history.show(Loaded(mesh), name, f"Open {name}")

    def call_query(self, meta: dict[str, Any], arrays: Arrays) -> Reply:
        """Search an index for shapes like the present one, a part of it, or that of a file."""
        shelf = self._require_shelf()
        n_matches = whole(meta, "n_matches", 1, 100, 5)
        mesh = self.mesh
        report: tuple[str, ...] = ()
        if "file" in arrays:
            surface = parse_surface(display_name(meta.get("name")), file_bytes(arrays, "file"))
            mesh, report = surface.mesh, surface.report
        # A page that is loaded again asks again.
        region = arrays.get("region")
        key = (mesh, n_matches, b"" if region is None else region.tobytes())
        if self._searched is None or self._searched[0] != key:
            self._searched = key, shelf.query(mesh, n_matches, region)
        found = self._searched[1]
        found[0]["warnings"] = list(report)
        self.matches = [match["name"] for match in found[0]["matches"]]
        return found

    def _match_array(self, tail: str) -> np.ndarray:
        """Return the array "N/vertices" or "N/faces" of match N of the last query."""
        number, _, what = tail.partition("/")
        if not number.isdecimal() or what not in ("vertices", "faces"):
            raise RequestError(f"Of a match there are vertices and faces; not {tail[:80]!r}.")
        mesh = self._require_shelf().mesh(self._match_name(int(number[:9])))
        return mesh.faces.astype("<u4") if what == "faces" else mesh.vertices.astype("<f4")

    def _match_name(self, number: Any) -> str:
        place = whole({"match": number}, "match", 0, len(self.matches) - 1)
        return self.matches[place]

    def read_match(self, number: Any) -> tuple[es.TriangleMesh, str]:
        """Return the mesh and the name of a match of the last query."""
        name = self._match_name(number)
        return self._require_shelf().mesh(name), name


def error_message(kind: str, text: str) -> bytes:
    """Return the message that answers a call which failed."""
    return encode({"error": {"kind": kind, "message": text}})


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
    except (KeyError, TypeError) as err:
        raise RequestError(f"A handle must have all its entries; {err} is missing.") from err
    raise RequestError("The type of a handle must be rotation or translation.")


def _rim_center(mesh: es.TriangleMesh, region: np.ndarray) -> list[float]:
    """Return the mean of the vertices at the rim of a region, about which it turns."""
    rim = es.deformation.region_boundary(mesh, es.deformation.region_mask(mesh, region))
    center: list[float] = mesh.vertices[rim if len(rim) else region].mean(axis=0).tolist()
    return center


def _field_facts(name: str, field: Field) -> dict[str, Any]:
    low, high = float(np.nanmin(field.values)), float(np.nanmax(field.values))
    return {"name": name, "title": field.title, "unit": field.unit, "min": low, "max": high}
