"""Changes of a tab beside bending: steps through its history, and other shapes."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import eigenshape as es
from eigenshape.geometry.resolution.thinning import thin_out
from eigenshape_studio.calls import Arrays, Meta, RequestError, Works, file_bytes, whole
from eigenshape_studio.others.folders import look_in
from eigenshape_studio.others.poses import carry_pose
from eigenshape_studio.others.specimens import Specimens
from eigenshape_studio.shape.analysis import LIGHT
from eigenshape_studio.shape.loading import Loaded
from eigenshape_studio.shape.parse import display_name
from eigenshape_studio.shape.samples import sample_mesh
from eigenshape_studio.shape.sides import remember_side
from eigenshape_studio.tab.bending import MOST_MODES
from eigenshape_studio.tab.scene import Scene
from eigenshape_studio.tab.searching import Searching


class Changes:
    """What the hand does in a tab beside bending.

    Parameters
    ----------
    scene : Scene
    searching : Searching

    Attributes
    ----------
    works : Works
    """

    def __init__(self, scene: Scene, searching: Searching) -> None:
        self._of, self._history, self._searching = scene, scene.history, searching
        self.works: Works = {
            "undo": lambda *_: self._step(-1, "edit to undo"),
            "redo": lambda *_: self._step(1, "undone edit to redo"),
            "go": self._go,
            "select": self._select,
            "reset": self._reset,
            "repair": self._repair,
            "open": self._open,
            "folder": self._open_folder,
            "solve": self._solve,
            "examine": lambda *_: scene.analysis.health.start(),
            "prepare": lambda *_: scene.analysis.prepare(),
            "lighten": self._lighten,
            "parts": lambda *_: scene.analysis.find_parts(),
            "transfer": self._transfer,
            "choose": self._choose,
            "face": self._face,
        }

    def _step(self, by: int, what: str) -> None:
        place = self._history.place + by
        if not 0 <= place < len(self._history.moments):
            raise RequestError(f"There must be an {what}; there is none.")
        self._history.go(place)

    def _go(self, meta: Meta, _arrays: Arrays) -> None:
        """Go to a place of the history."""
        self._history.go(whole(meta, "place", 0, len(self._history.moments) - 1))

    def _select(self, meta: Meta, arrays: Arrays) -> None:
        """Take the region of each vertex."""
        if "regions" not in arrays:
            raise RequestError("The call must have an array 'regions'.")
        self._history.select(arrays["regions"], str(meta.get("text", "Select"))[:60])

    def _choose(self, meta: Meta, _arrays: Arrays) -> None:
        """Show a shape of the list."""
        shape = self._of.listed_shape(meta.get("shape"))
        is_new = not shape.loaded
        self._history.choose(shape)
        self._of.warnings += shape.found.report if is_new else ()

    def _reset(self, _meta: Meta, _arrays: Arrays) -> None:
        self._history.did("All undone", pose=self._history.now.shape.rest)

    def _repair(self, meta: Meta, _arrays: Arrays) -> None:
        """Repair the shape in its present pose, which becomes the shape."""
        names = meta.get("names")
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise RequestError("names must be a list of the names of repairs.")
        done, kept = es.repair(self._of.mesh, names), self._of.attributes
        if kept is not None:
            kept = es.io.carry_attributes(replace(kept, mesh=self._of.mesh), done.mesh)
        loaded = Loaded(done.mesh, kept, side=self._of.analysis.side)
        self._history.show(loaded, self._of.analysis.name, f"Repair: {', '.join(names)}")
        self._of.warnings += done.report

    def _lighten(self, _meta: Meta, _arrays: Arrays) -> None:
        """Show a copy of the shape in its present pose that has fewer vertices."""
        n_vertices = self._of.mesh.n_vertices
        thin, source = thin_out(self._of.mesh, LIGHT)
        fields = {
            name: replace(field, values=field.values[source])
            for name, field in self._of.fields.items()
            if not np.isnan(field.values[source]).all()
        }
        name = f"{self._of.analysis.name}, lighter"
        self._history.show(
            Loaded(thin, fields=fields, side=self._of.analysis.side), name, "Lighter copy"
        )
        self._of.warnings.append(f"{thin.n_vertices:,} of {n_vertices:,} vertices were kept.")

    def _open(self, meta: Meta, arrays: Arrays) -> None:
        """Show the mesh of a file, a sample, or a shape of the index by its name."""
        if "match" in meta:
            self._of.show(*self._searching.read_match(meta["match"]))
            return
        if "sample" in meta:
            name = str(meta["sample"])
            self._of.show(sample_mesh(name), name)
            return
        name = display_name(meta.get("name"))
        found = self._of.parse(name, file_bytes(arrays, "file"))
        loaded = Loaded(found.mesh, found.attributes, points=found.points)
        self._history.show(loaded, name, f"Open {name}")

    def _open_folder(self, meta: Meta, _arrays: Arrays) -> None:
        """Show what a folder holds: a collection, or the first shape of an index or of files."""
        folder = self._of.require_folders().path(str(meta.get("folder")))
        found, before = look_in(folder), self._history.now
        if found.files:
            self._of.warnings += self._history.open_files(found.files)
        self.use(found.index, found.collection)
        if found.collection and self._of.specimens is not None:
            self._of.show(self._of.specimens.mean, self._of.specimens.title)
        if self._history.now is before:  # no file is there, or its shape is shown already
            self._history.did(f"Open {folder.name}")

    def use(self, index: str | Path | None, collection: str | Path | None) -> None:
        """Search in another index, and show another collection; what is not given stays."""
        if index:
            self._searching.search_in(index)
        if collection:
            self._of.specimens = Specimens(collection)
            self._history.collection = str(collection)

    def _face(self, meta: Meta, _arrays: Arrays) -> None:
        """Let another direction be up and another side the front, now and later on."""
        analysis = self._of.analysis
        analysis.look_from(meta.get("towards", "auto"), meta.get("up", "auto"))
        side = analysis.view()
        remember_side(analysis.mesh, side["up"], side["towards"])

    def _solve(self, meta: Meta, _arrays: Arrays) -> None:
        most = min(MOST_MODES, self._of.analysis.mesh.n_vertices)
        self._of.analysis.solve(whole(meta, "k", 1, most))

    def _transfer(self, meta: Meta, arrays: Arrays) -> None:
        """Bend another shape as this one was bent; the result becomes the shape."""
        name = display_name(meta.get("name"))
        target = self._of.parse(name, file_bytes(arrays, "file")).mesh
        source = self._of.analysis.mesh
        pairs = arrays["pairs"].astype(np.int64) if "pairs" in arrays else None
        bent = carry_pose(source, self._of.mesh, target, pairs)
        self._of.show(bent, name)
