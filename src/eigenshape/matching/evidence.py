"""How good a map is: of the whole part, and of each vertex as a probability."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.special import expit

from eigenshape.geometry.measure import area_vectors
from eigenshape.geometry.topology import edge_table
from eigenshape.matching.pairs import Pairs, couplings
from eigenshape.matching.surface import Surface

SMOOTHING = 10  # means over neighbors: local evidence is that of a disc of about three edges
TINY = np.finfo(float).tiny
# Logistic regression on the tuning half of experiments/ch7_matching (`calibrate.py`): a constant,
# then the columns of `vertex_evidence`.
CALIBRATION = np.zeros(9)


@dataclass(frozen=True)
class Quality:
    """Numbers that rate a map as a whole; see `ShapeMatch`."""

    orientation: float
    coverage: float
    support: float

    @property
    def score(self) -> float:
        """Orientation × coverage² × support, at least 0."""
        return max(self.orientation, 0.0) * self.coverage**2 * self.support


def rate_map(
    part: Surface, whole: Surface, places: Int[np.ndarray, " n"], pairs: Pairs
) -> tuple[Quality, Float[np.ndarray, " f"]]:
    """Rate a map of vertices to vertices; return also the signed area ratio of each face, -1 to 1."""
    faces = part.mesh.faces
    areas = np.linalg.norm(area_vectors(part.mesh.vertices[faces]), axis=1)
    moved = area_vectors(whole.mesh.vertices[places[faces]])
    normals = whole.normals[places[faces]].sum(axis=1)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), TINY)
    kept = np.clip(np.einsum("fi,fi->f", moved, normals) / np.maximum(areas, TINY), -1, 1)
    cells = np.bincount(whole.nearest, weights=whole.areas, minlength=len(whole.points))
    covered = cells[np.unique(whole.nearest[places])].sum() / part.area
    coupling = couplings(part, whole, pairs.points, pairs.partners)
    support = np.abs(coupling.sum(axis=1)).sum() / len(part.points) ** 2
    orientation = float(areas @ kept / areas.sum())
    return Quality(orientation, float(min(covered, 1.0)), float(support)), kept


def vertex_evidence(
    part: Surface,
    whole: Surface,
    places: Int[np.ndarray, " n"],
    pairs: Pairs,
    rated: tuple[Quality, Float[np.ndarray, " f"]],
    others: list[Int[np.ndarray, " n"]],
    misfits: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n c"]:
    """Return what tells how sure each vertex is, in columns.

    Local orientation, local misfit of distances, distance to the next pair, distance to where other
    starts put the vertex, local stretch, weight of the patch of the nearest point; and orientation
    and support of the whole map.
    """
    quality, kept = rated
    faces, n = part.mesh.faces, part.mesh.n_vertices
    flat = np.bincount(faces.ravel(), weights=np.repeat(kept, 3), minlength=n)
    local = flat / np.maximum(np.bincount(faces.ravel(), minlength=n), 1)
    edges = edge_table(part.mesh).edges
    ours = np.linalg.norm(np.subtract(*part.mesh.vertices[edges.T]), axis=1)
    theirs = np.linalg.norm(np.subtract(*whole.mesh.vertices[places[edges.T]]), axis=1)
    jumps = np.minimum(theirs / np.maximum(ours, TINY), 5.0)
    stretch = np.bincount(edges.ravel(), weights=np.repeat(jumps, 2), minlength=n)
    stretch /= np.maximum(np.bincount(edges.ravel(), minlength=n), 1)
    away = part.distances[pairs.points].min(axis=0)
    spread = np.zeros(n)
    for other in others:
        gaps = np.linalg.norm(whole.mesh.vertices[places] - whole.mesh.vertices[other], axis=1)
        spread += np.minimum(gaps, 0.3) / len(others)
    mean = _neighbor_means(edges, n)
    columns = [local, misfits, np.minimum(away, 0.5), spread, stretch]
    for _ in range(SMOOTHING):
        columns = [mean @ column for column in columns]
    rim = part.weights.min(axis=1)[part.nearest]
    whole_map = (quality.orientation, quality.support)
    return np.column_stack([*columns, rim, *(np.full(n, value) for value in whole_map)])


def confidence(evidence: Float[np.ndarray, "n c"]) -> Float[np.ndarray, " n"]:
    """Return the probability that a vertex is right, from its evidence."""
    return expit(CALIBRATION[0] + evidence @ CALIBRATION[1:])


def _neighbor_means(edges: Int[np.ndarray, "e 2"], n: int) -> sp.csr_array:
    """Return the matrix of means over each vertex and its neighbors."""
    links = sp.coo_array((np.ones(len(edges)), edges.T), shape=(n, n)).tocsr()
    links = links + links.T + sp.eye_array(n)
    return sp.csr_array(sp.diags_array(1 / links.sum(axis=1)) @ links)
