"""What the hand did in one tab: states one after the other, so that undo returns to the one before."""

import pickle
import threading
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.deformation.edits import mesh_fingerprint
from eigenshape_studio.calls import RequestError
from eigenshape_studio.others.folders import MOST_LISTED
from eigenshape_studio.shape.analysis import Analysis
from eigenshape_studio.shape.loading import Field, Loaded, load_file
from eigenshape_studio.shape.look import Skin, count_images, find_skin
from eigenshape_studio.tab.sessions import Row, SessionFile, edits_text
from eigenshape_studio.wire import decode, encode

MOST_MOMENTS = 2000  # of one tab; the oldest are forgotten
N_IN_MEMORY = 16  # poses that stay in memory where a file has all of them


class Shape:
    """One shape of a tab, which is read when it is first shown, and analyzed from then on.

    Parameters
    ----------
    number : int
        Tells it from the other shapes of the tab.
    name : str
    load : callable
        Returns the shape, as `Loaded`.
    make : callable
        Returns the analysis of a mesh with a name, which begins to compute.
    path : str, optional
        The file that the command was given.
    shared : bool
        Whether what is computed is shared by several tabs.
    """

    def __init__(
        self,
        number: int,
        name: str,
        load: Callable[[], Loaded],
        make: Callable[..., Analysis] = Analysis,
        path: str | None = None,
        *,
        shared: bool = False,
    ) -> None:
        self.number, self.name, self.path = number, name, path
        self.attributes: es.io.MeshAttributes | None = None
        self.fields: dict[str, Field] = {}
        self.rest = Pose(0, self)
        self.stored = False  # whether the file of the tab has it
        self._load, self._make = load, partial(make, shared=True) if shared else make
        self._found: Loaded | None = None  # what was read
        self._analysis: Analysis | None = None
        self._digest = ""
        self._lock = threading.Lock()

    @property
    def analysis(self) -> Analysis:
        """What is computed of the mesh; it begins now if the shape was not shown yet."""
        with self._lock:
            if self._analysis is None:
                found = self._read()
                self.attributes, self.fields = found.attributes, dict(found.fields)
                self._analysis = self._make(found.mesh, self.name)
                if found.side != ("auto", "auto"):
                    self._analysis.look_from(*found.side)
                self.stored = False  # where the file has the path alone
            return self._analysis

    def _read(self) -> Loaded:
        if self._found is None:
            self._found = self._load()
        return self._found

    @property
    def mesh(self) -> es.TriangleMesh:
        """The mesh at rest, of which nothing else needs to be computed."""
        with self._lock:
            return self._read().mesh if self._analysis is None else self._analysis.mesh

    @property
    def points(self) -> np.ndarray | None:
        """The points that the surface was made of, if it was."""
        with self._lock:
            return self._read().points

    @property
    def report(self) -> tuple[str, ...]:
        """What was done to the file's shape when it was read, in sentences."""
        with self._lock:
            return self._read().report

    @cached_property
    def skin(self) -> Skin | None:
        """How the shape looks, if its file says so."""
        if count_images(self.attributes) < 0:
            return None
        assert self.attributes is not None  # noqa: S101  they are counted
        return find_skin(self.attributes)

    @property
    def digest(self) -> str:
        """Text that two shapes share only if their meshes are equal; empty before it is read."""
        if self.loaded and not self._digest:
            self._digest = mesh_fingerprint(self.analysis.mesh).digest
        return self._digest

    @property
    def loaded(self) -> bool:
        """Whether the shape was shown already."""
        return self._analysis is not None

    def fork(self) -> "Shape":
        """Return the shape for another tab; what is computed already is shared."""
        twin = Shape(self.number, self.name, self._load, self._make, self.path)
        twin.attributes, twin.fields = self.attributes, dict(self.fields)
        twin._digest = self._digest
        with self._lock:
            twin._analysis = self._analysis and self._analysis.fork()
        return twin

    def enter(self) -> None:
        """Let what `leave` stopped begin anew."""
        with self._lock:
            self._analysis = self._analysis and self._analysis.resume()

    def leave(self) -> None:
        """Stop what is still computed, because another shape is shown."""
        if self._analysis is not None:
            self._analysis.cancel()


@dataclass(eq=False)
class Pose:
    """The vertices of a shape after some edits.

    Attributes
    ----------
    number : int
        0 at rest; otherwise tells it from the other poses of a tab.
    shape : Shape
    parent : Pose, optional
        The pose before, unless it is the shape at rest.
    n_edits : int
        All that lead here from the shape at rest.
    edits : tuple of Edit, optional
        Those since the pose before. None: the file of the tab has them.
    mesh : TriangleMesh, optional
        None: the file of the tab has it.
    """

    number: int
    shape: Shape
    parent: "Pose | None" = None
    n_edits: int = 0
    edits: tuple[es.deformation.Edit, ...] | None = ()
    mesh: es.TriangleMesh | None = None
    stored: bool = False


@dataclass(frozen=True, eq=False)
class Moment:
    """A state that the hand made: a shape, its pose, and its chosen regions.

    Attributes
    ----------
    number : int
    text : str
        What the hand did.
    shape : Shape
    pose : Pose
    regions : bytes
        The region of each vertex, compressed; empty where none was chosen.
    selected : int
        The number of the moment in which these regions were chosen.
    landmarks : str
        Those of the shape, as `SurfaceLandmarks.write` returns them.
    beside : int
        The number of the second shape; -1 if there is none.
    pairs : bytes
        Vertices of both shapes that correspond, given by hand: numbers of 8 bytes.
    """

    number: int
    text: str
    shape: Shape
    pose: Pose
    regions: bytes = b""
    selected: int = 0
    landmarks: str = ""
    beside: int = -1
    pairs: bytes = b""


class History:
    """The states of a tab, one after the other, and the place of the present one.

    Every state is a value that is kept, so undo and redo restore it exactly. Where the tab has a
    file, `save` writes there what is new.

    Parameters
    ----------
    shapes : iterable of Shape
        Those that can be chosen; the first one is shown.
    file : SessionFile, optional
        If it holds a session, that is continued.
    """

    def __init__(self, shapes: Iterable[Shape], file: SessionFile | None = None) -> None:
        self.shapes = {shape.number: shape for shape in shapes}
        self.file = file
        self.moments: list[Moment] = []
        self.place = 0
        self.index = self.collection = ""  # folders that the page has opened
        self.last = ""  # the page's own name for its last change, which it may send again
        self._n_poses = 0
        self._n_written = 0  # of the moments; later ones are new to the file
        if file is None or not self._restore(file):
            first = next(iter(self.shapes.values()))
            # Who opens two shapes wants to compare them.
            others = [number for number in self.shapes if number != first.number]
            beside = others[0] if len(others) == 1 else -1
            self.moments = [Moment(0, "", first, first.rest, beside=beside)]
        self.now = self.moments[self.place]  # one name, so that other threads never see a half

    def did(
        self,
        text: str,
        *,
        pose: Pose | None = None,
        regions: bytes | None = None,
        **changed: Any,
    ) -> None:
        """Note a new state; those that were undone before it are forgotten.

        `changed` has further entries of the moment.
        """
        now, number = self.now, self.moments[-1].number + 1
        changed |= {"number": number, "text": text}
        if pose is not None:
            changed |= {"pose": pose, "shape": pose.shape}
            if pose.shape is not now.shape:
                before = self._latest(pose.shape)
                changed |= {"regions": before.regions, "selected": before.selected}
                changed |= {"landmarks": before.landmarks, "pairs": b""}
        if regions is not None:
            changed |= {"regions": regions, "selected": number}
        del self.moments[self.place + 1 :]
        self._n_written = min(self._n_written, len(self.moments))
        self.moments.append(replace(now, **changed))
        surplus = max(0, len(self.moments) - MOST_MOMENTS)
        del self.moments[:surplus]
        self._n_written = max(0, self._n_written - surplus)
        self._enter(len(self.moments) - 1)

    def go(self, place: int) -> None:
        """Return to a state, or on to one that was undone."""
        self._enter(place)

    def _enter(self, place: int) -> None:
        before, self.place = self.now, place
        if self.moments[place].shape is not before.shape:
            before.shape.leave()
            self.moments[place].shape.enter()
        self.now = self.moments[place]

    def _latest(self, shape: Shape) -> Moment:
        """Return the last state of a shape."""
        for moment in reversed(self.moments[: self.place + 1]):
            if moment.shape is shape:
                return moment
        return Moment(0, "", shape, shape.rest)

    def choose(self, shape: Shape) -> None:
        """Show a shape of the list, in its last pose."""
        if shape is not self.now.shape:
            shape.analysis  # noqa: B018  a file that cannot be read must not become the shape
            self.did(shape.name, pose=self._latest(shape).pose)

    def show(self, loaded: Loaded, name: str, text: str) -> Shape:
        """Add a shape to the list, and show it."""
        shape = self.add(loaded, name)
        self.did(text, pose=shape.rest)
        return shape

    def add(self, loaded: Loaded, name: str) -> Shape:
        """Add a shape to the list."""
        shape = Shape(max(self.shapes) + 1, name, lambda: loaded)
        self.shapes[shape.number] = shape
        return shape

    def open_files(self, files: list[tuple[str, Path]]) -> list[str]:
        """Add files to the list, unless they are in it, and show the first that can be read.

        Returns
        -------
        list of str
            Why those before it cannot.

        Raises
        ------
        RequestError
            If none can be read.
        """
        listed = {shape.path: shape for shape in self.shapes.values() if shape.path}
        for name, path in files[: max(0, MOST_LISTED - len(self.shapes))]:
            if str(path) not in listed:
                number = max(self.shapes) + 1
                shape = Shape(number, name, partial(load_file, path), path=str(path))
                self.shapes[number] = listed[str(path)] = shape
        notes: list[str] = []
        for name, path in files:
            try:
                if str(path) in listed:
                    self.choose(listed[str(path)])
                    return notes
            except (es.EigenshapeError, OSError) as error:
                notes.append(f"{name} cannot be opened: {error}")
        raise RequestError(" ".join(["No shape of the folder can be opened.", *notes[:1]]))

    def bend(
        self, edits: tuple[es.deformation.Edit, ...], mesh: es.TriangleMesh, text: str
    ) -> None:
        """Enter the pose after some more edits."""
        before = self.now.pose
        parent = before if before.number else None
        self.did(text, pose=self._add_pose(edits, mesh, parent))

    def replace_edits(
        self, edits: tuple[es.deformation.Edit, ...], mesh: es.TriangleMesh, text: str
    ) -> None:
        """Enter the pose after edits of the shape at rest."""
        self.did(text, pose=self._add_pose(edits, mesh, None))

    def _add_pose(
        self, edits: tuple[es.deformation.Edit, ...], mesh: es.TriangleMesh, parent: Pose | None
    ) -> Pose:
        self._n_poses += 1
        n_edits = len(edits) + (0 if parent is None else parent.n_edits)
        return Pose(self._n_poses, self.now.shape, parent, n_edits, edits, mesh)

    def select(self, owners: np.ndarray, text: str) -> None:
        """Take the region of each vertex."""
        n_vertices = self.now.shape.analysis.mesh.n_vertices
        if owners.dtype != np.uint8 or owners.shape != (n_vertices,):
            raise RequestError(f"There must be one region for each of the {n_vertices} vertices.")
        before = self.owners(self.now)
        if before is None or not np.array_equal(owners, before):
            self.did(text, regions=zlib.compress(owners.tobytes(), 1))

    def owners(self, moment: Moment) -> np.ndarray | None:
        """Return the region of each vertex; None where none was chosen."""
        packed = moment.regions
        return np.frombuffer(zlib.decompress(packed), np.uint8) if packed else None

    def mesh(self, pose: Pose) -> es.TriangleMesh:
        """Return the shape in a pose."""
        if not pose.number:
            return pose.shape.analysis.mesh
        mesh = pose.mesh
        if mesh is None:
            vertices = self._require_file().vertices(pose.number)
            mesh = pose.mesh = es.TriangleMesh(vertices, pose.shape.analysis.mesh.faces)
        return mesh

    def edits(self, pose: Pose | None) -> tuple[es.deformation.Edit, ...]:
        """Return the edits that lead from the shape at rest to a pose."""
        found: list[tuple[es.deformation.Edit, ...]] = []
        while pose is not None:
            if pose.edits is None:
                rest = pose.shape.analysis.mesh
                pose.edits = self._require_file().edits(pose.number, rest)
            found.append(pose.edits)
            pose = pose.parent
        return tuple(edit for edits in reversed(found) for edit in edits)

    def _require_file(self) -> SessionFile:
        assert self.file is not None  # noqa: S101  only what is in a file leaves the memory
        return self.file

    def save(self) -> None:
        """Write what is new to the file of the tab, if it has one."""
        if self.file is None:
            return
        written, new = self.moments[: self._n_written], self.moments[self._n_written :]
        shapes = [shape for shape in self.shapes.values() if not shape.stored]
        poses = {moment.pose for moment in new if moment.pose.number and not moment.pose.stored}
        self.file.write(
            {
                "place": self.now.number,
                "last": self.last,
                "n_poses": self._n_poses,
                "index": self.index,
                "collection": self.collection,
            },
            map(_shape_row, shapes),
            [_pose_row(pose) for pose in poses],
            [_moment_row(moment) for moment in new],
            (written[0].number, written[-1].number) if written else (0, -1),
        )
        for shape in shapes:
            shape.stored = True
        for pose in poses:
            pose.stored = True
        self._n_written = len(self.moments)
        # Of the poses in the file, those near the present one stay in memory, too.
        near = {moment.pose for moment in self.moments[-N_IN_MEMORY:]} | {self.now.pose}
        for moment in self.moments:
            if moment.pose.stored and moment.pose not in near:
                moment.pose.mesh = None

    def _restore(self, file: SessionFile) -> bool:
        """Continue the session of a file; return False if there is none."""
        tables = file.read()
        if tables is None:
            return False
        facts: dict[str, str] = dict(tables["fact"])
        self.last, self._n_poses = facts["last"], int(facts["n_poses"])
        self.index, self.collection = facts.get("index", ""), facts.get("collection", "")
        for number, name, path, digest in tables["shape"]:
            # What the server shows to all tabs is analyzed once.
            shared = self.shapes.get(number)
            if shared is None or (shared.path, shared.digest) != (path, digest):
                load = partial(_load, file, number, path)
                self.shapes[number] = Shape(number, name, load, path=path)
            self.shapes[number].stored = True
        poses: dict[int, Pose] = {}
        for number, shape, parent, n_edits in tables["pose"]:
            owner = self.shapes[shape]
            poses[number] = Pose(number, owner, poses.get(parent), n_edits, None, None, True)
        for number, text, shape, pose, *others in tables["moment"]:
            owner = self.shapes[shape]
            place = poses[pose] if pose else owner.rest
            self.moments.append(Moment(number, text, owner, place, *others))
        self._n_written = len(self.moments)
        numbers = [moment.number for moment in self.moments]
        self.place = numbers.index(int(facts["place"]))
        return True


def _load(file: SessionFile, number: int, path: str | None) -> Loaded:
    """Read a shape from the file of a tab, or from its own if it was not shown yet."""
    message, pickled = file.shape(number)
    if message is None:
        return load_file(str(path))
    meta, arrays = decode(message)
    mesh = es.TriangleMesh(arrays["vertices"], arrays["faces"].astype(np.int64))
    fields = {
        name: Field(arrays[f"field {place}"], title, unit)
        for place, (name, title, unit) in enumerate(meta["fields"])
    }
    # The file is the user's own: who could change it could change this program.
    attributes = None if pickled is None else pickle.loads(pickled)
    return Loaded(mesh, attributes, fields, tuple(meta["side"]), arrays.get("points"))


def _shape_row(shape: Shape) -> Row:
    if shape.path is not None and not shape.loaded:
        return shape.number, shape.name, shape.path, "", None, None
    mesh = shape.mesh
    arrays = {"vertices": mesh.vertices.astype("<f8"), "faces": mesh.faces.astype("<u4")}
    for place, one in enumerate(shape.fields.values()):
        arrays[f"field {place}"] = one.values.astype("<f8")
    if shape.points is not None:
        arrays["points"] = shape.points.astype("<f8")
    names = [(name, one.title, one.unit) for name, one in shape.fields.items()]
    pickled = None if shape.attributes is None else pickle.dumps(shape.attributes)
    side = shape.analysis.side if shape.loaded else ("auto", "auto")
    message = encode({"fields": names, "side": side}, arrays)
    return shape.number, shape.name, shape.path, shape.digest, message, pickled


def _pose_row(pose: Pose) -> Row:
    assert pose.edits is not None and pose.mesh is not None  # noqa: PT018, S101  it is new
    parent = None if pose.parent is None else pose.parent.number
    text = edits_text(pose.edits, pose.shape.analysis.mesh)
    vertices = pose.mesh.vertices.astype("<f8").tobytes()
    return pose.number, pose.shape.number, parent, pose.n_edits, text, vertices


def _moment_row(moment: Moment) -> Row:
    numbers = moment.shape.number, moment.pose.number
    chosen = moment.regions, moment.selected, moment.landmarks, moment.beside, moment.pairs
    return moment.number, moment.text, *numbers, *chosen
