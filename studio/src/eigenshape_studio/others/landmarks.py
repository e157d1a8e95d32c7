"""Named points on the surface of a shape: they move with its pose, and come from and go to files."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape.morphometrics.placement import require_on_surfaces
from eigenshape_studio.calls import RequestError

FORMATS = ("mrk.json", "fcsv", "csv")
MOST_LANDMARKS = 1000
FARTHEST = 1e-6  # share of the size of the shape that a point may be off its surface unsaid


@dataclass(frozen=True, eq=False)
class SurfaceLandmarks:
    """Names, and for each the face in which its point lies and the weights there."""

    names: tuple[str, ...] = ()
    faces: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    weights: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))

    def points(self, mesh: es.TriangleMesh) -> np.ndarray:
        """Return the points on a mesh with the faces that they were placed on."""
        return np.einsum("kc,kcd->kd", self.weights, mesh.vertices[mesh.faces[self.faces]])

    def vertices(self, mesh: es.TriangleMesh) -> np.ndarray:
        """Return the nearest corner of the face of each."""
        return mesh.faces[self.faces, self.weights.argmax(axis=1)]

    def write(self) -> str:
        """Return the landmarks as text, which `read` takes."""
        if not self.names:
            return ""
        return json.dumps([self.names, self.faces.tolist(), self.weights.tolist()])

    @staticmethod
    def read(text: str) -> "SurfaceLandmarks":
        """Return the landmarks that `write` has written."""
        if not text:
            return SurfaceLandmarks()
        names, faces, weights = json.loads(text)
        return SurfaceLandmarks(tuple(names), np.array(faces), np.array(weights))

    def facts(self, mesh: es.TriangleMesh) -> list[dict[str, Any]]:
        """Return what the page shows of them."""
        rows = zip(self.names, self.points(mesh), self.vertices(mesh), strict=True)
        return [
            {"name": name, "point": point.tolist(), "vertex": int(vertex)}
            for name, point, vertex in rows
        ]


def place_landmarks(
    mesh: es.TriangleMesh, names: Sequence[Any], points: np.ndarray, shape: str
) -> tuple[SurfaceLandmarks, list[str]]:
    """Put points on the surface of a shape, and return them with a warning if some lay beside it.

    Raises
    ------
    RequestError
        If there are too many, or not three coordinates for each.
    InvalidParameterError
        As `es.morphometrics.Landmarks`: names that are empty or twice, points that are not finite;
        and if they lie far from the surface, as in another unit or frame.
    """
    if len(names) > MOST_LANDMARKS or points.size != 3 * len(names):
        raise RequestError(
            f"There must be three coordinates for each of at most {MOST_LANDMARKS} landmarks; there "
            f"are {len(names)} names and {points.size} coordinates."
        )
    # Checks the names and the numbers
    given = es.morphometrics.Landmarks([str(name) for name in names], points.reshape(-1, 3))
    known = np.isfinite(given.points).all(axis=1)
    warnings = [f"{name} is not placed in the file." for name in np.array(names)[~known]]
    if not known.any():
        return SurfaceLandmarks(), warnings
    placement = require_on_surfaces([(shape, mesh, given)])[shape]
    there = es.geometry.closest_points(mesh, given.points[known])
    away = float(placement.distances[known].max())
    size = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    if away > FARTHEST * size:
        warnings.append(f"Points were moved to the surface, by {away:.3g} at most.")
    if placement.is_beside:
        warnings.append("All landmarks lie beside the surface: they may be of another shape.")
    kept = tuple(name for name, placed in zip(given.names, known, strict=True) if placed)
    return SurfaceLandmarks(kept, there.simplices, there.weights), warnings


def parse_landmarks(name: str, data: bytes) -> es.morphometrics.Landmarks:
    """Read a file of landmarks.

    Raises
    ------
    FileFormatError
        As `es.morphometrics.read_landmarks`.
    """
    with TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(data)
        try:
            return es.morphometrics.read_landmarks(path)
        except es.EigenshapeError as error:  # without the folder, which is the server's
            raise type(error)(str(error).replace(f"{path.parent}/", "")) from error


def landmark_file(names: Sequence[str], points: np.ndarray, ending: str) -> np.ndarray:
    """Return the bytes of a file of landmarks.

    Raises
    ------
    RequestError
        If the format is unknown, or there is no landmark.
    """
    if ending not in FORMATS or not names:
        raise RequestError(
            f"Landmarks, at least one, are written as {', '.join(FORMATS)}; {ending[:80]!r} was "
            f"requested of {len(names)}."
        )
    with TemporaryDirectory() as folder:
        path = Path(folder, f"landmarks.{ending}")
        es.morphometrics.write_landmarks(es.morphometrics.Landmarks(names, points), path)
        return np.frombuffer(path.read_bytes(), np.uint8)
