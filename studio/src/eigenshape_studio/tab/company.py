"""What stands beside the shape of a tab: a second shape with a map, landmarks, a collection."""

import pickle
import threading
import warnings
from functools import partial
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import Arrays, Families, Meta, RequestError, Works, file_bytes
from eigenshape_studio.others.beside import Beside, part_and_whole
from eigenshape_studio.others.landmarks import (
    SurfaceLandmarks,
    landmark_file,
    parse_landmarks,
    place_landmarks,
)
from eigenshape_studio.others.mapping import DenseMap, map_of_match
from eigenshape_studio.others.specimens import Specimens
from eigenshape_studio.shape.loading import Loaded
from eigenshape_studio.shape.parse import display_name
from eigenshape_studio.tab.bending import LISTENING
from eigenshape_studio.tab.history import Shape
from eigenshape_studio.tab.scene import Scene
from eigenshape_studio.tab.searching import Searching
from eigenshape_studio.tab.sessions import map_number, unpack

MOST_KEPT = 4  # second shapes whose maps are kept, so that undo finds them again
SAMPLE_POSE = 1  # of a sample beside the shape; the one that opens as the shape has pose 0


class Company:
    """The second shape, landmarks and collection of a tab.

    Parameters
    ----------
    scene : Scene
    searching : Searching

    Attributes
    ----------
    works : {str: callable}
        What changes something, by the kind of the call.
    families : {str: callable}
        What returns an array, by the first part of its name.
    """

    def __init__(self, scene: Scene, searching: Searching) -> None:
        self._of, self._searching = scene, searching
        # Each of a shape at rest and a second one; the present one stands last.
        self._kept: list[Beside] = []
        self._lock = threading.Lock()
        self.works: Works = {
            "beside": self._open,
            "map": lambda *_: self._require_beside().start(),
            "correct": self._correct,
            "pose": self._take_pose,
            "landmarks": self._set_landmarks,
            "mean": self._show_mean,
        }
        self.families: Families = {
            "beside": lambda tail: self._require_beside().array(tail),
            "landmarks": self._landmarks_array,
            "collection": lambda tail: self._require_specimens().array(tail),
        }

    def close(self) -> None:
        """Stop what is still computed."""
        for kept in self._kept:
            kept.cancel()

    def facts(self) -> dict[str, Any]:
        """Return what the page shows."""
        beside, specimens = self.beside, self._of.specimens
        shown = None
        if specimens is not None:
            is_mean = specimens.is_mean(self._of.analysis.mesh)
            shown = {**specimens.facts(), "is_mean": is_mean}
        return {
            "beside": None if beside is None else beside.facts(),
            "landmarks": self.landmarks.facts(self._of.mesh),
            "collection": shown,
        }

    @property
    def landmarks(self) -> SurfaceLandmarks:
        """The landmarks of the shape."""
        return SurfaceLandmarks.read(self._of.history.now.landmarks)

    @property
    def beside(self) -> Beside | None:
        """The second shape of the present moment, with the corrections of its map."""
        now, shapes = self._of.history.now, self._of.history.shapes
        with self._lock:
            if now.beside not in shapes:  # -1 is none; a damaged file may have lost one
                self._leave()
                return None
            mesh, second = now.shape.mesh, shapes[now.beside]
            try:
                other = second.mesh
            except (es.EigenshapeError, OSError) as error:  # its file has gone, or changed
                loss = f"{second.name} cannot stand beside the shape any more: {error}"
                self._of.losses += [loss] if loss not in self._of.losses else []
                return None
            pair = mesh, second.number
            kept = next((each for each in self._kept if each.is_of(*pair)), None)
            if kept is None:
                self._leave()
                known = self._known_map(mesh, second)
                kept = Beside(mesh, other, second.name, second.number, known, self._keep_match)
                self._kept = [*self._kept, kept][-MOST_KEPT:]
            kept.correct(np.frombuffer(now.pairs, dtype=np.int64).reshape(-1, 2))
            return kept

    def _leave(self) -> None:
        """Stop maps that are on the way; those that were found are kept."""
        self.close()
        self._kept = [kept for kept in self._kept if kept.has_map]

    def _known_map(self, mesh: es.TriangleMesh, second: Shape) -> DenseMap | None:
        """Return the map of a collection from its mean to a specimen, or that of an earlier server."""
        specimens, file = self._of.specimens, self._of.history.file
        is_known = specimens is not None and second.name in specimens.collection.names
        if specimens is not None and is_known and specimens.is_mean(mesh):
            return specimens.map_to(second.name, second.mesh)
        if file is None:
            return None
        pair = part_and_whole(mesh, second.mesh)
        try:
            row = file.row("maps", map_number(*pair))
        except es.StoreError:  # none was kept; if it was lost, the page says so
            return None
        return map_of_match(*pair, unpack(row[1]))

    def _keep_match(
        self, part: es.TriangleMesh, whole: es.TriangleMesh, match: es.matching.ShapeMatch
    ) -> None:
        """Write a match of two meshes to the file of the tab, if it has one."""
        history = self._of.history
        with self._of.changing:
            if history.file is not None:
                history.save()  # the meshes, if nothing was changed yet
                row = map_number(part, whole), pickle.dumps(match)
                history.file.write({"maps": [row]})

    def _require_beside(self) -> Beside:
        if self.beside is None:
            raise RequestError("There must be a second shape; none is open.")
        return self.beside

    def _require_specimens(self) -> Specimens:
        if self._of.specimens is None:
            raise RequestError("There must be a collection; open the studio with its folder.")
        return self._of.specimens

    def _open(self, meta: Meta, arrays: Arrays) -> None:
        """Show a second shape: of the list, a file, a match, a sample or a specimen; or none."""
        history = self._of.history
        if meta.get("close"):
            history.did("Close the second shape", beside=-1, pairs=b"")
            return
        if "shape" in meta:
            second = self._of.listed_shape(meta["shape"])
        else:
            mesh, name = self._read(meta, arrays)
            second = history.add(name, partial(Loaded, mesh))
        second.mesh  # noqa: B018  a file that cannot be read must not stand beside
        history.did(f"{second.name} beside", beside=second.number, pairs=b"")

    def _read(self, meta: Meta, arrays: Arrays) -> tuple[es.TriangleMesh, str]:
        """Return the mesh and the name of what a call wants to see."""
        if "match" in meta:
            return self._searching.read_match(meta["match"])
        if "sample" in meta:
            kind = str(meta["sample"])
            return es.make_creature(kind, SAMPLE_POSE), kind
        if "specimen" in meta:
            name = str(meta["specimen"])
            return self._require_specimens().mesh(name), name
        name = display_name(meta.get("name"))
        return self._of.parse(name, file_bytes(arrays, "file")).mesh, name

    def _correct(self, _meta: Meta, arrays: Arrays) -> None:
        """Correct the map by pairs of vertices."""
        given = arrays.get("pairs", np.empty(0, dtype=np.int64))
        pairs = self._require_beside().check_pairs(given)
        self._of.history.did("Correct the map", pairs=pairs.tobytes())

    def _take_pose(self, _meta: Meta, _arrays: Arrays) -> None:
        """Bend the shape into the pose of the second one; the result becomes the shape.

        The map stays: its vertices are the same.
        """
        beside = self._require_beside()
        bent = beside.take_pose()
        with self._lock:
            self._kept = [*self._kept, beside.of_pose(bent)][-MOST_KEPT:]
        self._of.show(bent, self._of.analysis.name)

    def _show_mean(self, _meta: Meta, _arrays: Arrays) -> None:
        """Show the mean of the collection."""
        specimens = self._require_specimens()
        self._of.show(specimens.mean, specimens.title)

    def _set_landmarks(self, meta: Meta, arrays: Arrays) -> None:
        """Take all landmarks anew: by names and points, or from a file."""
        names, points = meta.get("names"), arrays.get("points", np.empty(0))
        notes = []
        if "file" in arrays:
            name = display_name(meta.get("name"))
            with LISTENING, warnings.catch_warnings(record=True) as heard:
                warnings.simplefilter("always", UserWarning)
                given = parse_landmarks(name, file_bytes(arrays, "file"))
            # A warning begins with the path of the file, whose folder is the server's.
            notes = [name + str(each.message).rpartition(name)[2] for each in heard]
            names, points = list(given.names), given.points
        if not isinstance(names, list):
            raise RequestError("names must be a list of the names of landmarks.")
        placed, told = place_landmarks(self._of.mesh, names, points, self._of.analysis.name)
        self._of.history.did("Landmarks", landmarks=placed.write())
        self._of.warnings += notes + told

    def _landmarks_array(self, tail: str) -> np.ndarray:
        """Return a file of the landmarks of a side, as "0/fcsv", or vertices near carried ones."""
        side, _, what = tail.partition("/")
        if side not in ("0", "1"):
            raise RequestError(f"Landmarks are those of side 0 or 1; not {tail[:80]!r}.")
        mesh, points = self._of.mesh, self.landmarks.points(self._of.mesh)
        if side == "1":
            beside = self._require_beside()
            mesh = beside.meshes[1]
            points = beside.carry(self.landmarks.points(self._of.analysis.mesh))
        if what == "vertices":  # -1 where nothing corresponds
            vertices = np.full(len(points), -1, dtype="<i4")
            known = np.isfinite(points).all(axis=1)
            if known.any():
                there = es.geometry.closest_points(mesh, points[known])
                rows = mesh.faces[there.simplices]
                vertices[known] = rows[np.arange(len(rows)), there.weights.argmax(axis=1)]
            return vertices
        return landmark_file(self.landmarks.names, points, what)
