"""Arrays of the shape of a tab, by their names."""

from collections.abc import Callable

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import Families, Meta, RequestError, whole
from eigenshape_studio.shape.analysis import cut_rows, diagram_rows, vertex_labels
from eigenshape_studio.shape.brush import Brush
from eigenshape_studio.shape.samples import sample_picture
from eigenshape_studio.tab.scene import Scene

N_BRACKETS = 20  # bracketing costs a solve with three times as many unknowns


class ShapeArrays:
    """What the page draws of the shape of a tab.

    Parameters
    ----------
    scene : Scene

    Attributes
    ----------
    makers : {str: callable}
        What returns an array, by its name. It is called with the meta of the call.
    families : {str: callable}
        What returns an array, by the first part of its name.
    """

    def __init__(self, scene: Scene) -> None:
        self._of = scene
        brush = Brush()
        self.makers: dict[str, Callable[[Meta], np.ndarray]] = {
            "vertices": lambda _: scene.mesh.vertices.astype("<f4"),
            "faces": lambda _: scene.analysis.mesh.faces.astype("<u4"),
            "points": self._points,
            "areas": lambda _: scene.analysis.areas.astype("<f4"),
            "modes": self._modes,
            "eigenvalues": lambda _: self._spectrum().eigenvalues.astype("<f8"),
            "coefficients": self._coefficients,
            "brackets": self._brackets,
            "diagram": self._diagram,
            "crossings": self._crossings,
            "regions": self._regions,
        }
        self.families: Families = {
            "parts": self._parts,
            "values": self._values,
            "disc": lambda tail: brush.disc(scene.mesh, tail),
            "sample": sample_picture,
            "skin": self._skin,
        }

    def _regions(self, _meta: Meta) -> np.ndarray:
        """Return the region of each vertex, as the page chose it; empty where it chose none."""
        found = self._of.history.owners(self._of.history.now)
        return np.empty(0, np.uint8) if found is None else found

    def _points(self, _meta: Meta) -> np.ndarray:
        points = self._of.history.now.shape.found.points
        if points is None:
            raise RequestError("There must be points that the surface was made of; there are none.")
        return points.astype("<f4")

    def _skin(self, tail: str) -> np.ndarray:
        """Return how the shape looks: the table of split vertices, their corners, or an image."""
        skin = self._of.history.now.shape.skin
        if skin is None:
            raise RequestError("The file of the shape must hold colors or a texture; it does not.")
        if tail in ("rows", "corners"):
            return skin.rows if tail == "rows" else skin.corners
        if not tail.isdecimal() or int(tail) >= len(skin.images):
            raise RequestError(f"There are {len(skin.images)} images; {tail[:80]!r} is none.")
        return np.frombuffer(skin.images[int(tail)], np.uint8)

    def _spectrum(self) -> es.Spectrum:
        found = self._of.analysis.spectrum.result
        if found is None:
            raise RequestError(
                "The spectrum must be ready; it is not. Wait for it, or solve again."
            )
        return found

    def _modes(self, meta: Meta) -> np.ndarray:
        modes = self._spectrum().eigenvectors
        start = whole(meta, "start", 0, modes.shape[1], 0)
        stop = whole(meta, "stop", start, modes.shape[1], modes.shape[1])
        return np.ascontiguousarray(modes[:, start:stop].T, dtype="<f4")

    def _coefficients(self, _meta: Meta) -> np.ndarray:
        """Return the coordinates of the present pose in terms of the modes, (k, 3)."""
        spectrum = self._spectrum()
        weighted = spectrum.mass @ self._of.mesh.vertices
        return np.asarray(spectrum.eigenvectors.T @ weighted).astype("<f4")

    def _brackets(self, meta: Meta) -> np.ndarray:
        k = whole(meta, "stop", 1, min(300, self._of.analysis.mesh.n_vertices), N_BRACKETS)
        found = self._of.analysis.brackets
        if found is None or len(found.lower) < k:
            found = es.bracket_eigenvalues(self._of.analysis.mesh, k)
            self._of.analysis.brackets = found
        return np.column_stack([found.lower, found.upper])[:k]

    def _require_parts(self) -> es.features.PartDecomposition:
        found = None if self._of.analysis.parts is None else self._of.analysis.parts.result
        if found is None:
            raise RequestError("The parts must be ready; they are not. Find the parts first.")
        return found

    def _diagram(self, _meta: Meta) -> np.ndarray:
        found = self._require_parts()
        return diagram_rows(found.mesh, found.heat)

    def _parts(self, tail: str) -> np.ndarray:
        found = self._require_parts()
        if tail == "labels":
            return vertex_labels(found.mesh, found.fine.labels)
        if tail == "cuts":
            return cut_rows(found)
        raise RequestError(f"Of parts there are labels and cuts; {tail[:80]!r} was requested.")

    def _values(self, tail: str) -> np.ndarray:
        if tail not in self._of.fields:
            raise RequestError(
                f"Values must be among {list(self._of.fields)}; {tail[:80]!r} is not."
            )
        return self._of.fields[tail].values.astype("<f4")

    def _crossings(self, _meta: Meta) -> np.ndarray:
        return es.geometry.self_intersections(self._of.mesh).astype("<u4").reshape(-1, 2)
