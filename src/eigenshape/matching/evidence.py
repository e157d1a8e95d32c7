"""How good a map is: of the whole part, and of each vertex as a probability."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.special import expit

from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.topology import edge_table
from eigenshape.matching.pairs import Pairs, couplings, patch_differences
from eigenshape.matching.surface import Surface

SMOOTHING = 10  # means over neighbors: local evidence is that of a disc of about three edges
FARTHEST = 0.3  # units: longer distances say no more
MOST_STRETCH = 5.0  # the same, for ratios of lengths
TINY = np.finfo(float).tiny
# Logistic regression on the tuning half of experiments/ch7_matching, and on 27 parts that were
# matched to shapes of other kinds, where nothing is right: a constant, then the columns of
# `vertex_evidence`. On these the area under the curve is 0.93.
CALIBRATION = np.array([9.07, 2.12, -81.6, -19.0, -1.17, -0.528, 0.935, -0.422, -8.24, 8.8, -3.28])
N_COLUMNS = len(CALIBRATION) - 1


@dataclass(frozen=True)
class Quality:
    """Numbers that rate a map as a whole; see `ShapeMatch`."""

    orientation: float
    coverage: float
    support: float
    likeness: float

    @property
    def score(self) -> float:
        """Orientation × coverage² × support × likeness⁴, at least 0.

        Without likeness, 3 of 33 small parts of the tuning half were placed on another part of the
        whole, with it 1; powers from 4 to 6 choose the same maps.
        """
        kept = max(self.orientation, 0.0)
        return kept * self.coverage**2 * self.support * self.likeness**4


@dataclass(frozen=True, eq=False)
class PlacedMap:
    """A map of a connected part: vertices of the whole, from which pairs, and how good it is.

    `kept` is the signed ratio of areas of each face of the part, between -1 and 1.
    """

    places: Int[np.ndarray, " n"]
    misfits: Float[np.ndarray, " n"]
    pairs: Pairs
    quality: Quality
    kept: Float[np.ndarray, " f"]


def rate_map(
    part: Surface,
    whole: Surface,
    pairs: Pairs,
    places: Int[np.ndarray, " n"],
    misfits: Float[np.ndarray, " n"],
) -> PlacedMap:
    """Rate a map of vertices to vertices."""
    faces = part.mesh.faces
    areas = np.linalg.norm(area_vectors(part.mesh.vertices[faces]), axis=1)
    moved = area_vectors(whole.mesh.vertices[places[faces]])
    normals = whole.normals[places[faces]].sum(axis=1)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), TINY)
    kept = np.clip(np.einsum("fi,fi->f", moved, normals) / np.maximum(areas, TINY), -1, 1)
    cells = np.bincount(whole.nearest, weights=whole.areas, minlength=len(whole.points))
    covered = cells[np.unique(whole.nearest[places])].sum() / part.area
    coupling = couplings(part, whole, pairs.points, pairs.partners)
    support = np.abs(coupling.sum(axis=1)).sum() / len(part.points) ** 2
    orientation = float(areas @ kept / areas.sum())
    differences = patch_differences(part, whole)
    ends = whole.nearest[places[part.points]]
    unlike = np.median(differences[np.arange(len(ends)), ends])
    likeness = np.median(differences.min(axis=1)) / max(float(unlike), TINY)
    quality = Quality(
        orientation, float(min(covered, 1.0)), float(support), float(min(likeness, 1.0))
    )
    return PlacedMap(places, misfits, pairs, quality, kept)


def vertex_evidence(
    part: Surface, whole: Surface, found: PlacedMap, others: Sequence[PlacedMap]
) -> Float[np.ndarray, "n c"]:
    """Return what tells how sure each vertex is, in columns; see `ShapeMatch.evidence`.

    Local columns are means over discs of about three edges.
    """
    places, kept = found.places, found.kept
    faces, n = part.mesh.faces, part.mesh.n_vertices
    flat = np.bincount(faces.ravel(), weights=np.repeat(kept, 3), minlength=n)
    local = flat / np.maximum(np.bincount(faces.ravel(), minlength=n), 1)
    edges = edge_table(part.mesh).edges
    ours = np.linalg.norm(np.subtract(*part.mesh.vertices[edges.T]), axis=1)
    theirs = np.linalg.norm(np.subtract(*whole.mesh.vertices[places[edges.T]]), axis=1)
    jumps = np.minimum(theirs / np.maximum(ours, TINY), MOST_STRETCH)
    sums = np.bincount(edges.ravel(), weights=np.repeat(jumps, 2), minlength=n)
    stretch = sums / np.maximum(np.bincount(edges.ravel(), minlength=n), 1)
    away = part.distances[found.pairs.points].min(axis=0)
    spread = np.zeros(n)
    for other in others:
        gap = whole.mesh.vertices[places] - whole.mesh.vertices[other.places]
        spread += np.minimum(np.linalg.norm(gap, axis=1), FARTHEST) / len(others)
    mean = _neighbor_means(edges, n)
    columns = [local, found.misfits, np.minimum(away, FARTHEST), spread, stretch]
    for _ in range(SMOOTHING):
        columns = [mean @ column for column in columns]
    rim = part.weights.min(axis=1)[part.nearest]
    ends = whole.nearest[places[part.points]]
    unlike = np.log1p(patch_differences(part, whole)[np.arange(len(ends)), ends])
    of_map = found.quality.orientation, found.quality.support, unlike.mean()
    rows = [*columns, rim, unlike[part.nearest], *(np.full(n, value) for value in of_map)]
    return np.column_stack(rows)


def confidence(evidence: Float[np.ndarray, "n c"]) -> Float[np.ndarray, " n"]:
    """Return the probability that a vertex is right, from its evidence."""
    return expit(CALIBRATION[0] + evidence @ CALIBRATION[1:])


def _neighbor_means(edges: Int[np.ndarray, "e 2"], n: int) -> sp.csr_array:
    """Return the matrix of means over each vertex and its neighbors."""
    links = sp.coo_array((np.ones(len(edges)), edges.T), shape=(n, n)).tocsr()
    links = links + links.T + sp.eye_array(n)
    return sp.csr_array(sp.diags_array(1 / links.sum(axis=1)) @ links)
