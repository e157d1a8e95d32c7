"""A second shape beside that of a tab: the map between them, and what it carries across."""

from collections.abc import Callable
from typing import Any

import numpy as np

import eigenshape as es
from eigenshape_studio.calls import RequestError
from eigenshape_studio.others.mapping import DenseMap, correct_map, map_of_match
from eigenshape_studio.shape.analysis import frame_shape
from eigenshape_studio.shape.brush import Brush
from eigenshape_studio.shape.jobs import NO_JOB, Job, Progress

MOST_PAIRS = 100  # corrections by hand
SURE = 0.5  # confidence from which a vertex counts as mapped


Keep = Callable[[es.TriangleMesh, es.TriangleMesh, es.matching.ShapeMatch], None]


def part_and_whole(
    mesh: es.TriangleMesh, other: es.TriangleMesh
) -> tuple[es.TriangleMesh, es.TriangleMesh]:
    """Return two shapes, the part first: the second one if it alone is open, as a scan is."""
    flipped = es.geometry.is_closed(mesh) and not es.geometry.is_closed(other)
    return (other, mesh) if flipped else (mesh, other)


class Beside:
    """A second shape, and the map between the shape of a tab and it.

    Side 0 is the shape of the tab, side 1 the second one. A scan is mapped to a whole: if only the
    second one is open, it is the part.

    Parameters
    ----------
    mesh : TriangleMesh
        The shape of the tab.
    other : TriangleMesh
    name : str
    number : int
        Tells this second shape from others.
    known : DenseMap, optional
        Between the two, the part first.
    keep : callable, optional
        Called with part, whole and match when a match is found, before the page hears of it.
    """

    def __init__(
        self,
        mesh: es.TriangleMesh,
        other: es.TriangleMesh,
        name: str,
        number: int,
        known: DenseMap | None = None,
        keep: Keep = lambda *_: None,
    ) -> None:
        self.meshes = (mesh, other)
        self.name, self.number = name, number
        self.pairs = np.empty((0, 2), dtype=np.int64)  # given by hand: ours, theirs
        part, _ = known.meshes if known else part_and_whole(mesh, other)
        self._flipped, self._keep = part is not mesh, keep
        self._view = frame_shape(other)
        self._brush = Brush()
        self._first = known  # the map before corrections
        self.job: Job[DenseMap] | None = None if known is None else Job(lambda _: known)

    def start(self) -> None:
        """Start to find the map, unless it is there or on the way."""
        if self.job is None or self.job.status in ("none", "failed"):
            self.job = Job(self._match)

    def is_of(self, mesh: es.TriangleMesh, number: int) -> bool:
        """Say whether this is the second shape with a number, beside a mesh."""
        return self.meshes[0] is mesh and self.number == number

    @property
    def has_map(self) -> bool:
        """Whether the map is there."""
        return self.job is not None and self.job.result is not None

    def of_pose(self, mesh: es.TriangleMesh) -> "Beside":
        """Return the second shape beside another pose of the first one, with the map that was found.

        Corrections by hand are not in it yet.
        """
        first = self._first
        assert first is not None  # noqa: S101  a pose is taken by a map
        assert first.match is not None  # noqa: S101
        other = self.meshes[1]
        known = map_of_match(mesh, other, first.match)
        self._keep(mesh, other, first.match)
        return Beside(mesh, other, self.name, self.number, known, self._keep)

    def check_pairs(self, pairs: np.ndarray) -> np.ndarray:
        """Return pairs of vertices, ours and theirs, as a table.

        Raises
        ------
        RequestError
            If there is no map yet, it is that of a collection, or a pair names no vertex.
        """
        counts = [mesh.n_vertices for mesh in self.meshes]
        if self._first is None:
            raise RequestError("There must be a map before it is corrected; find it first.")
        if self._first.match is None:
            raise RequestError("The map of a collection is kept as it is.")
        if pairs.ndim != 1 or pairs.size % 2 or pairs.size > 2 * MOST_PAIRS:
            raise RequestError(f"There must be at most {MOST_PAIRS} pairs of vertices.")
        table = pairs.astype(np.int64).reshape(-1, 2)
        bad = np.flatnonzero((table < 0).any(axis=1) | (table >= counts).any(axis=1))
        if bad.size:
            raise RequestError(
                f"A pair must name vertices 0..{counts[0] - 1} and 0..{counts[1] - 1}; "
                f"pair {bad[0]} is {table[bad[0]].tolist()}."
            )
        return table

    def correct(self, pairs: np.ndarray) -> None:
        """Correct the map by pairs of vertices, unless it is already; none brings the first back."""
        if np.array_equal(pairs, self.pairs):
            return
        self.pairs = pairs
        if self._first is not None:  # otherwise it is corrected when it is found
            self.job = Job(self._correct)

    def cancel(self) -> None:
        """Stop to find the map."""
        if self.job is not None:
            self.job.cancel()

    def facts(self) -> dict[str, Any]:
        """Return what the page shows of it."""
        found = None if self.job is None else self.job.result
        return {
            "name": self.name,
            "number": self.number,
            "n_vertices": self.meshes[1].n_vertices,
            "n_faces": self.meshes[1].n_faces,
            **self._view,
            "map": NO_JOB if self.job is None else self.job.facts(),
            # How the shape is laid on the second one, row by row
            "similarity": None
            if found is None
            else found.similarity(self._side(0)).ravel().tolist(),
            "can_correct": found is not None and found.match is not None,
            "can_pose": found is not None and found.match is not None and not self._flipped,
            "lines": [] if found is None else self._describe(found),
            "pairs": self.pairs.tolist(),
        }

    def array(self, tail: str) -> np.ndarray:
        """Return an array by its name: vertices, faces, "disc/7/0.5"; of the map "partners/0", ...

        Raises
        ------
        RequestError
            If there is no such array, or not yet.
        """
        other = self.meshes[1]
        if tail == "vertices":
            return other.vertices.astype("<f4")
        if tail == "faces":
            return other.faces.astype("<u4")
        name, _, side = tail.partition("/")
        if name == "disc":
            return self._brush.disc(other, side)
        if side not in ("0", "1") or name not in ("partners", "confidence", "colors"):
            raise RequestError(
                "Of a second shape there are vertices, faces, discs, and partners, confidence and colors "
                f"of sides 0 and 1; not {tail[:80]!r}."
            )
        found = self.require_map()
        number = self._side(int(side))
        if name == "colors":
            return found.colors()[number]
        placed = found.placed[number]
        if name == "partners":
            return placed.partners.astype("<i4")
        return placed.confidence.astype("<f4")

    def carry(self, points: np.ndarray) -> np.ndarray:
        """Return the points of the second shape that correspond to points of the first one."""
        return self.require_map().carry(self._side(0), points)

    def take_pose(self) -> es.TriangleMesh:
        """Bend the first shape into the pose of the second one.

        Raises
        ------
        RequestError
            If there is no map yet, or it is one of a part to the first shape.
        """
        found = self.require_map()
        if self._flipped or found.match is None:
            raise RequestError(
                "The pose can be taken over if the whole first shape was matched to the second one."
            )
        return es.matching.take_pose(*self.meshes, match=found.match)

    def require_map(self) -> DenseMap:
        """Return the map; raise RequestError if it is not ready."""
        found = None if self.job is None else self.job.result
        if found is None:
            raise RequestError("The map must be ready; it is not. Find it first.")
        return found

    def _side(self, side: int) -> int:
        """Return the place in a map, which has the part first, of a side of the page."""
        return 1 - side if self._flipped else side

    def _match(self, progress: Progress) -> DenseMap:
        part, whole = self.meshes[::-1] if self._flipped else self.meshes
        match = es.match_shapes(part, whole, progress=progress)
        self._keep(part, whole, match)
        self._first = map_of_match(part, whole, match)
        return self._correct(progress)

    def _correct(self, progress: Progress) -> DenseMap:
        first, pairs = self._first, self.pairs
        assert first is not None  # noqa: S101  it was found before
        if first.match is None or not len(pairs):
            return first
        ordered = pairs[:, ::-1] if self._flipped else pairs
        return correct_map(first, first.match, ordered, progress)

    def _describe(self, found: DenseMap) -> list[str]:
        """Return what a person should know of the map, in sentences."""
        sure = found.placed[0].confidence >= SURE
        lines = [
            f"{100 * sure.mean():.0f} % of the vertices are placed with a confidence of 50 % or more."
        ]
        match = found.match
        if match is None:
            return lines
        if not match.handed:
            lines.append("Left and right may be exchanged: the mirror image fits as well.")
        if match.n_equally_good > 1:
            lines.append(f"{match.n_equally_good} different maps fit equally well.")
        return [*lines, *(f"{line[:1].upper()}{line[1:]}." for line in match.report)]
