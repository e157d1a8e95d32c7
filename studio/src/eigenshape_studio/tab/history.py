"""What the hand did in one tab: states one after the other, so that undo returns to the one before."""

import pickle
import threading
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.deformation.edits import mesh_fingerprint
from eigenshape_studio.calls import RequestError
from eigenshape_studio.others.folders import MOST_LISTED
from eigenshape_studio.shape.analysis import Analysis
from eigenshape_studio.shape.loading import Loaded, load_file
from eigenshape_studio.shape.look import Skin, count_images, find_skin
from eigenshape_studio.tab.sessions import Row, SessionFile, unpack

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
        self.rest = Pose(0, self)
        self._load, self._make = load, partial(make, shared=True) if shared else make
        self._found: Loaded | None = None
        self._analysis: Analysis | None = None
        self._digest = ""
        self._lock = threading.RLock()

    @property
    def analysis(self) -> Analysis:
        """What is computed of the mesh; it begins now if the shape was not shown yet."""
        with self._lock:
            if self._analysis is None:
                self._analysis = self._make(self.found.mesh, self.name)
                if self.found.side != ("auto", "auto"):
                    self._analysis.look_from(*self.found.side)
            return self._analysis

    @property
    def found(self) -> Loaded:
        """What is read of the shape, now if it was not yet."""
        with self._lock:
            if self._found is None:
                self._found = self._load()
            return self._found

    @property
    def is_read(self) -> bool:
        """Whether the shape was read already; otherwise its file may still change."""
        return self._found is not None

    @property
    def mesh(self) -> es.TriangleMesh:
        """The mesh at rest, of which nothing else needs to be computed."""
        return self.found.mesh

    @cached_property
    def skin(self) -> Skin | None:
        """How the shape looks, if its file says so."""
        attributes = self.found.attributes
        if attributes is None or count_images(attributes) < 0:
            return None
        return find_skin(attributes)

    @property
    def digest(self) -> str:
        """Text that two shapes share only if their meshes are equal; empty before it is read."""
        if self.is_read and not self._digest:
            self._digest = mesh_fingerprint(self.mesh).digest
        return self._digest

    @property
    def loaded(self) -> bool:
        """Whether the shape was shown already."""
        return self._analysis is not None

    def fork(self) -> "Shape":
        """Return the shape for another tab; what is computed already is shared."""
        twin = Shape(self.number, self.name, self._load, self._make, self.path)
        twin._digest, twin._found = self._digest, self._found
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
    edits : tuple of Edit
        Those since the pose before.
    mesh : TriangleMesh, optional
        None: the file of the tab has it.
    n_edits : int
        All that lead here from the shape at rest.
    """

    number: int
    shape: Shape
    parent: "Pose | None" = None
    edits: tuple[es.deformation.Edit, ...] = ()
    mesh: es.TriangleMesh | None = None
    n_edits: int = field(init=False)

    def __post_init__(self) -> None:
        self.n_edits = len(self.edits) + (0 if self.parent is None else self.parent.n_edits)


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
        # No number is used twice, also of what was undone because it could not be written.
        self._pose_numbers, self._moment_numbers = count(1), count(1)
        # Moments and poses that the file has, and shapes, with whether it has more than their paths
        self._kept: set[object] = set()
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
        now, number = self.now, next(self._moment_numbers)
        changed |= {"number": number, "text": text}
        if pose is not None:
            changed |= {"pose": pose, "shape": pose.shape}
            if pose.shape is not now.shape:
                before = self._latest(pose.shape)
                changed |= {"regions": before.regions, "selected": before.selected}
                changed |= {"landmarks": before.landmarks, "pairs": b""}
        if regions is not None:
            changed |= {"regions": regions, "selected": number}
        done = [*self.moments[: self.place + 1], replace(now, **changed)]
        self.moments = done[-MOST_MOMENTS:]
        self.go(len(self.moments) - 1)

    def go(self, place: int) -> None:
        """Return to a state, or on to one that was undone."""
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
        shape = self.add(name, lambda: loaded)
        self.did(text, pose=shape.rest)
        return shape

    def add(self, name: str, load: Callable[[], Loaded], path: str | None = None) -> Shape:
        """Add a shape to the list."""
        shape = Shape(max(self.shapes) + 1, name, load, path=path)
        self.shapes = {**self.shapes, shape.number: shape}
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
                listed[str(path)] = self.add(name, partial(load_file, path), str(path))
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
        self,
        edits: tuple[es.deformation.Edit, ...],
        mesh: es.TriangleMesh,
        text: str,
        *,
        at_rest: bool = False,
    ) -> None:
        """Enter the pose after some more edits, or after edits of the shape at rest."""
        before = self.now.pose
        parent = None if at_rest or not before.number else before
        self.did(text, pose=Pose(next(self._pose_numbers), before.shape, parent, edits, mesh))

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
        if pose.mesh is None:
            assert self.file is not None  # noqa: S101  only what is in a file leaves the memory
            vertices = np.frombuffer(self.file.row("poses", pose.number)[4]).reshape(-1, 3)
            pose.mesh = es.TriangleMesh(vertices, pose.shape.mesh.faces)
        return pose.mesh

    def edits(self, pose: Pose | None) -> tuple[es.deformation.Edit, ...]:
        """Return the edits that lead from the shape at rest to a pose."""
        found: list[tuple[es.deformation.Edit, ...]] = []
        while pose is not None:
            found.append(pose.edits)
            pose = pose.parent
        return tuple(edit for edits in reversed(found) for edit in edits)

    def save(self) -> None:
        """Write what is new to the file of the tab, if it has one."""
        if self.file is None:
            return
        shapes = {(shape, shape.is_read) for shape in self.shapes.values()}
        poses = {moment.pose for moment in self.moments if moment.pose.number}
        kept = self._kept
        rows = {
            "places": [(1, self.now.number, self.last, self.index, self.collection)],
            "shapes": [_shape_row(shape) for shape, _ in shapes - kept],
            "poses": [_pose_row(pose) for pose in poses - kept],
            "steps": [_moment_row(moment) for moment in self.moments if moment not in kept],
        }
        self.file.write(rows, [moment.number for moment in self.moments], begin=not kept)
        self._kept = {*shapes, *poses, *self.moments}
        # Of the poses in the file, those near the present one stay in memory, too.
        near = {moment.pose for moment in self.moments[-N_IN_MEMORY:]}
        for pose in poses - near - {self.now.pose}:
            pose.mesh = None

    def _restore(self, file: SessionFile) -> bool:
        """Continue the session of a file; return False if there is none."""
        tables = file.read()
        if not tables.get("steps"):
            return False
        place = max(tables["steps"])
        if 1 in tables["places"]:
            _, place, self.last, self.index, self.collection = tables["places"][1]
        for number, name, path, digest in tables["shapes"].values():
            # What the server shows to all tabs is analyzed once.
            shared = self.shapes.get(number)
            if shared is None or (shared.path, shared.digest) != (path, digest):
                load = partial(_load, file, number) if digest else partial(load_file, path)
                shared = self.shapes[number] = Shape(number, name, load, path=path)
            self._kept |= {(shared, False), (shared, bool(digest))}
        poses: dict[int, Pose] = {}
        for number, shape, parent, edits in tables["poses"].values():
            owner = self.shapes[shape]
            poses[number] = Pose(number, owner, poses.get(parent), unpack(edits))
        for number, text, shape, pose, *others in tables["steps"].values():
            owner = self.shapes[shape]
            there = poses[pose] if pose else owner.rest
            self.moments.append(Moment(number, text, owner, there, *others))
        self._kept |= {*self.moments, *poses.values()}
        numbers = [moment.number for moment in self.moments]
        self._pose_numbers = count(max(poses, default=0) + 1)
        self._moment_numbers = count(numbers[-1] + 1)
        # Where the present state was damaged, the one before it is shown.
        self.place = max(0, bisect_right(numbers, place) - 1)
        return True


def _load(file: SessionFile, number: int) -> Loaded:
    """Read a shape from the file of a tab."""
    return unpack(file.row("shapes", number)[4])


def _shape_row(shape: Shape) -> Row:
    packed = None
    if shape.path is None or shape.is_read:
        side = shape.analysis.side if shape.loaded else shape.found.side
        packed = pickle.dumps(replace(shape.found, side=side, report=()))
    return shape.number, shape.name, shape.path, shape.digest, packed


def _pose_row(pose: Pose) -> Row:
    assert pose.mesh is not None  # noqa: S101  it is new
    parent = None if pose.parent is None else pose.parent.number
    packed = pickle.dumps(pose.edits), pose.mesh.vertices.tobytes()
    return pose.number, pose.shape.number, parent, *packed


def _moment_row(moment: Moment) -> Row:
    numbers = moment.shape.number, moment.pose.number
    chosen = moment.regions, moment.selected, moment.landmarks, moment.beside, moment.pairs
    return moment.number, moment.text, *numbers, *chosen
