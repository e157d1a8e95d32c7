"""The shapes of one tab, and the five calls of the page: the same for all hosts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import Arrays, Families, Meta, Reply, RequestError, Works
from eigenshape_studio.onefile import N_MODES as N_REPORTED
from eigenshape_studio.onefile import report_page
from eigenshape_studio.others.search import Shelf
from eigenshape_studio.shape.analysis import N_MODES, Analysis
from eigenshape_studio.shape.jobs import PreparingError, window_message
from eigenshape_studio.shape.loading import Field, Loaded, check_fields
from eigenshape_studio.shape.look import count_images
from eigenshape_studio.shape.parse import display_name
from eigenshape_studio.shape.samples import SAMPLES
from eigenshape_studio.tab.arrays import ShapeArrays
from eigenshape_studio.tab.bending import Bending
from eigenshape_studio.tab.changes import Changes
from eigenshape_studio.tab.company import Company
from eigenshape_studio.tab.history import History, Shape
from eigenshape_studio.tab.scene import Scene
from eigenshape_studio.tab.searching import Searching
from eigenshape_studio.tab.sessions import NotKeptError, SessionFile
from eigenshape_studio.wire import WireError, decode, encode

POLL = 0.1  # seconds between reports of the progress of a report
CAPABILITIES = ("rig", "finish", "query", "open", "repair", "solve", "beside")


@dataclass(frozen=True)
class Answer:
    """The message that answers a call.

    Attributes
    ----------
    message : bytes
    status : int
        As in HTTP: 200, 400 if the call was at fault, 500 if the studio was, 503 if the call can be
        sent again in a while, 507 if a change could not be written, so that it was not made.
    """

    message: bytes
    status: int


class Workspace(Scene):
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
        super().__init__(History(shapes))
        self.analysis  # noqa: B018  it begins before a page asks
        self.most_bytes = 256 << 20  # of a file; the server has a limit of its own
        self.notes: list[str] = []  # what the page says when it is opened
        self.welcome = False  # whether the page offers samples first
        self._begin(None if index is None else Shelf(index))

    def _begin(self, shelf: Shelf | None) -> None:
        """Set up what works on the shapes of this tab."""
        self.searching = Searching(self, shelf)
        self.bending = Bending(self)
        self.company = Company(self, self.searching)
        self.changes = Changes(self, self.searching)
        shown = ShapeArrays(self)
        self._calls: dict[str, Callable[[Meta, Arrays], Reply]] = {
            "meta": lambda *_: (self.state(), {}),
            "array": self._call_array,
            "rig": self.bending.bind,
            "finish": self._finish,
            "query": self.searching.query,
        }
        self._works: Works = {
            **self.bending.works,
            **self.changes.works,
            **self.company.works,
        }
        self._makers = shown.makers
        self._families: Families = {
            **shown.families,
            **self.bending.families,
            **self.company.families,
            "match": self.searching.match_array,
            "file": self._file,
            "folder": lambda tail: self.require_folders().list(tail),
        }

    def fork(self, file: SessionFile | None = None) -> "Workspace":
        """Return a workspace of the same shapes for another tab; it continues what a file holds."""
        twin = object.__new__(Workspace)
        twin.__dict__.update(self.__dict__)
        shapes = self.history.shapes.values()
        history = History([shape.fork() for shape in shapes], file)
        Scene.__init__(twin, history, self.specimens, self.folders)
        twin._begin(self.searching.shelf)
        for folders in ((history.index, ""), ("", history.collection)):
            try:
                twin.changes.use(*folders)
            except (es.EigenshapeError, OSError) as error:
                twin.losses.append(f"{''.join(folders)} cannot be opened any more: {error}")
        return twin

    def close(self) -> None:
        """Stop what is still computed, and let go of the file."""
        self.company.close()
        for shape in self.history.shapes.values():
            shape.leave()
        with self.changing:
            self.history.file = None

    def answer(self, call: str, message: bytes) -> Answer:
        """Answer a call; whatever is wrong with it becomes an answer, too."""
        try:
            meta, arrays = decode(message)
            return Answer(encode(*self._dispatch(call, meta, arrays)), 200)
        except NotKeptError as error:
            return Answer(error_message("NotKeptError", str(error)), 507)
        except (es.EigenshapeError, WireError, RequestError, OSError) as error:
            return Answer(error_message(type(error).__name__, window_message(error)), 400)
        except PreparingError as error:
            return Answer(error_message("PreparingError", str(error)), 503)
        except MemoryError:
            return Answer(error_message("MemoryError", "There is not enough memory for this."), 400)
        except Exception as error:  # noqa: BLE001  the other tabs must go on
            return Answer(error_message("InternalError", f"{type(error).__name__}: {error}"), 500)

    def _dispatch(self, call: str, meta: Any, arrays: Arrays) -> Reply:
        if call not in self._calls:
            names = ", ".join(self._calls)
            raise RequestError(f"A call must be one of {names}; it is {call!r:.80}.")
        if not isinstance(meta, dict):
            raise RequestError("The meta of a call must be an object.")
        return self._calls[call](meta, arrays)

    def state(self) -> dict[str, Any]:
        """Return what the page shows beside the arrays."""
        analysis, history = self.analysis, self.history
        now, points = history.now, history.now.shape.found.points
        shelf = self.searching.shelf
        capabilities = [name for name in CAPABILITIES if name != "query" or shelf is not None]
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
            "losses": self.losses,
            "large": analysis.large_facts(),
            "health": analysis.health_facts(),
            "values": [_field_facts(name, field) for name, field in self.fields.items()],
            "spectrum": analysis.spectrum_facts(),
            "parts": analysis.parts_facts(),
            "deformation": self.bending.facts(),
            "index": None if shelf is None else shelf.facts(),
            **self.company.facts(),
            "n_images": count_images(self.attributes),
            "n_points": 0 if points is None else len(points),
            "shapes": [[shape.number, shape.name] for shape in history.shapes.values()],
            "history": [moment.text for moment in history.moments[1:]],
            "place": history.place,
            "digest": now.shape.digest,
            "selected": now.selected,
            "pose": now.pose.number,
            "shape": now.shape.number,
            "samples": list(SAMPLES) if self.welcome else [],
        }

    def _call_array(self, meta: Meta, _arrays: Arrays) -> Reply:
        """Return one array by its name."""
        name = meta.get("name")
        if not isinstance(name, str):
            raise RequestError(f"The name of an array must be text; it is {name!r:.80}.")
        return {}, {name: self.array(name, meta)}

    def array(self, name: str, meta: Meta | None = None) -> np.ndarray:
        """Return one array by its name; `meta` may hold the range start..stop.

        Raises
        ------
        RequestError
            If there is no such array, or not yet.
        """
        head, _, tail = name.partition("/")
        if not tail and head in self._makers:
            return self._makers[head](meta or {})
        if tail and head in self._families:
            return self._families[head](tail)
        raise RequestError(f"There must be an array of the requested name; {name[:80]!r} is none.")

    def _file(self, tail: str) -> np.ndarray:
        if tail not in ("ply", "obj", "glb", "html", "edits"):
            raise RequestError(
                f"A file must be ply, obj, glb, html or edits; {tail[:80]!r} was requested."
            )
        if tail == "html":
            return np.frombuffer(self._report_in_pose(), np.uint8)
        with TemporaryDirectory() as folder:
            path = Path(folder, f"shape.{tail}")
            if tail == "edits":
                es.io.write_edits(self.edits, self.analysis.mesh, path)
            else:
                # A file of materials beside an OBJ file would not be sent.
                kept = None if tail == "obj" else self.attributes
                es.write_mesh(self.mesh, path, attributes=kept)
            return np.frombuffer(path.read_bytes(), np.uint8)

    def _report_in_pose(self) -> bytes:
        """Return a page of the present pose that opens without the studio."""
        values = {name: field.values for name, field in self.fields.items()}
        name = self.analysis.name
        apart = Workspace(self.mesh, name, values=values, n_modes=N_REPORTED)
        side = self.analysis.view()
        apart.analysis.look_from(side["towards"], side["up"])
        try:
            return apart.report()
        finally:
            apart.close()

    def report(self, progress: Callable[[float, str], None] | None = None) -> bytes:
        """Return a page of the shape at rest that opens without the studio.

        It waits for the spectrum and the parts.
        """
        analysis = self.analysis
        analysis.find_parts()
        for job in (analysis.spectrum, analysis.parts, analysis.health):
            while job is not None and not job.wait(POLL):
                if progress is not None:
                    progress(job.progress, job.message)
        if analysis.spectrum.error is not None:
            raise analysis.spectrum.error
        state = self.state() | {"capabilities": []}
        state["deformation"] |= {"status": "none", "message": ""}
        names = ["vertices", "faces", "eigenvalues", "coefficients", "areas"]
        names += [f"values/{name}" for name in self.fields]
        if state["parts"]["status"] == "ready":
            names += ["parts/labels", "parts/cuts", "diagram"]
        return report_page(state, {name: self.array(name) for name in names}, self.array("modes"))

    def _finish(self, meta: Meta, arrays: Arrays) -> Reply:
        """Change something, and return the new state."""
        kind = meta.get("kind")
        if not isinstance(kind, str) or kind not in self._works:
            raise RequestError(f"kind must be one of {', '.join(self._works)}; it is {kind!r:.80}.")
        began = perf_counter()
        with self.changing:
            self.warnings = []
            history, before, vertices = self.history, self.history.now, None
            # A page that did not hear of an answer sends its change again.
            name = str(meta.get("id", ""))[:64]
            again = bool(name) and name == history.last
            kept = [(each, dict(vars(each))) for each in (self, self.searching, history)]
            try:
                if not again:
                    vertices = self._works[kind](meta, arrays)
                if history.now is not before:
                    history.last = name
                    history.save()
            except BaseException:  # all of a change is made, or nothing
                if history.now.shape is not before.shape:
                    history.now.shape.leave()
                    before.shape.enter()
                for each, values in kept:
                    vars(each).update(values)
                raise
            if history.now.pose is not before.pose:
                self.bending.bound = None
            if again or history.now.pose is not before.pose:
                vertices = self.mesh.vertices
            told = self.warnings
            state = self.state()
        facts = {"state": state, "seconds": perf_counter() - began, "warnings": told}
        return facts, {} if vertices is None else {"vertices": vertices.astype("<f4")}


def error_message(kind: str, text: str) -> bytes:
    """Return the message that answers a call which failed."""
    return encode({"error": {"kind": kind, "message": text}})


def _field_facts(name: str, field: Field) -> dict[str, Any]:
    low, high = float(np.nanmin(field.values)), float(np.nanmax(field.values))
    return {"name": name, "title": field.title, "unit": field.unit, "min": low, "max": high}
