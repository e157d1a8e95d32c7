"""A collection in the studio: its mean, the modes in which it varies, and its specimens."""

from pathlib import Path
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import RequestError
from eigenshape_studio.others.mapping import DenseMap, map_between

N_MODES = 5  # sliders, as in the report of a collection


class Specimens:
    """A collection that `eigenshape collection` has made.

    Only its own specimens are read, by their names: a page cannot name a path.

    Parameters
    ----------
    folder : path
    """

    def __init__(self, folder: str | Path) -> None:
        self.collection = es.collections.open_collection(folder)
        together = es.morphometrics.fit_procrustes(self.collection.unreflected)
        found = es.morphometrics.principal_components(together.shapes)
        size = float(np.median(together.sizes))
        # Three standard deviations of a mode without variance would be nothing.
        deviations = np.sqrt(found.variances[:N_MODES])
        self.title = Path(folder).absolute().name
        self.mean = es.TriangleMesh(size * found.mean, self.collection.mean.faces)
        self.modes = found.modes[: len(deviations)] * (size * deviations)[:, None, None]
        self._shares = found.shares[: len(deviations)]
        self._scores = found.scores[:, : len(deviations)] / deviations

    def is_mean(self, mesh: es.TriangleMesh) -> bool:
        """Say whether a shape is the mean, which a session that continues has read from its file."""
        return mesh is self.mean or np.array_equal(mesh.vertices, self.mean.vertices)

    def facts(self) -> dict[str, Any]:
        """Return what the page shows of it; scores are in standard deviations."""
        rows = zip(self.collection.names, self._scores.tolist(), strict=True)
        notes = self.collection.notes
        return {
            "title": self.title,
            "specimens": [
                {"name": name, "notes": list(notes[name]), "scores": scores}
                for name, scores in rows
            ],
            "failures": list(self.collection.failures.items()),
            "shares": self._shares.tolist(),
        }

    def array(self, tail: str) -> np.ndarray:
        """Return the modes, each a change of all vertices by one standard deviation.

        Raises
        ------
        RequestError
            If another array is requested.
        """
        if tail != "modes":
            raise RequestError(f"Of a collection there are modes; {tail[:80]!r} was requested.")
        return self.modes.astype("<f4")

    def mesh(self, name: str) -> es.TriangleMesh:
        """Read the surface of a specimen.

        Raises
        ------
        InvalidParameterError
            If no specimen has this name.
        """
        return self.collection.read_specimen(name)

    def map_to(self, name: str, mesh: es.TriangleMesh) -> DenseMap:
        """Return the map from the mean to a specimen, which the collection knows."""
        row = self.collection.number(name)
        there = es.geometry.closest_points(mesh, self.collection.points[row])
        sure = self.collection.confidence[row]
        return map_between(self.mean, mesh, there.simplices, there.weights, sure)


def is_collection(folder: Path) -> bool:
    """Say whether a folder holds a collection, also one of an earlier version, which is named as such."""
    return any((folder / f"collection.{suffix}").is_file() for suffix in ("sqlite", "json"))
