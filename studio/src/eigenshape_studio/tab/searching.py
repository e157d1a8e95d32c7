"""Searching the index of the studio for shapes like that of a tab."""

from pathlib import Path
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import Arrays, Meta, Reply, RequestError, file_bytes, whole
from eigenshape_studio.others.search import Shelf
from eigenshape_studio.shape.parse import display_name, parse_surface
from eigenshape_studio.tab.scene import Scene


class Searching:
    """The last query of a tab, and its matches.

    Parameters
    ----------
    scene : Scene
    shelf : Shelf, optional

    Attributes
    ----------
    shelf : Shelf, optional
        The index to search in.
    """

    def __init__(self, scene: Scene, shelf: Shelf | None) -> None:
        self._of, self.shelf = scene, shelf
        self._matches: list[str] = []  # names, of the last query
        self._searched: tuple[Any, Reply] | None = None  # for what, and what was found

    def search_in(self, index: str | Path) -> None:
        """Search in another index from now on."""
        self.shelf, self._matches, self._searched = Shelf(index), [], None
        self._of.history.index = str(index)

    def _require_shelf(self) -> Shelf:
        if self.shelf is None:
            raise RequestError("There must be an index to search in; open the studio with --index.")
        return self.shelf

    def query(self, meta: Meta, arrays: Arrays) -> Reply:
        """Search an index for shapes like the present one, a part of it, or that of a file."""
        shelf = self._require_shelf()
        n_matches = whole(meta, "n_matches", 1, 100, 5)
        mesh = self._of.mesh
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
        self._matches = [match["name"] for match in found[0]["matches"]]
        return found

    def match_array(self, tail: str) -> np.ndarray:
        """Return the array "N/vertices" or "N/faces" of match N of the last query."""
        number, _, what = tail.partition("/")
        if not number.isdecimal() or what not in ("vertices", "faces"):
            raise RequestError(f"Of a match there are vertices and faces; not {tail[:80]!r}.")
        mesh = self._require_shelf().mesh(self._match_name(int(number[:9])))
        return mesh.faces.astype("<u4") if what == "faces" else mesh.vertices.astype("<f4")

    def _match_name(self, number: Any) -> str:
        place = whole({"match": number}, "match", 0, len(self._matches) - 1)
        return self._matches[place]

    def read_match(self, number: Any) -> tuple[es.TriangleMesh, str]:
        """Return the mesh and the name of a match of the last query."""
        name = self._match_name(number)
        return self._require_shelf().mesh(name), name
