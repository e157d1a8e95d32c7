"""How good a map is: of the whole part, and of each vertex as a probability."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.special import expit

from certeig.kit.arrays import TINY, record
from eigenshape._corners import at_points
from eigenshape._vectors import area_vectors, row_dots, triangle_areas, unit_vectors
from eigenshape.geometry.measure import edge_lengths, face_areas
from eigenshape.geometry.topology import edge_table, neighbor_links
from eigenshape.matching.fitting import Fit
from eigenshape.matching.pairs import Pairs, couplings, place_points
from eigenshape.matching.surface import Surface

SMOOTHING = 10  # means over neighbors: local evidence is that of a disc of about three edges
FARTHEST_SPREAD = 0.3  # units: longer distances say no more
MOST_STRETCH = 5.0  # the same, for ratios of lengths
N_OTHERS = 2  # maps of other starts that are compared
# Mean distance of a point of the surface from the nearest vertex, in mean edges
BETWEEN_VERTICES = 0.35
LEAST_MISFIT = 1e-4  # a pair of equal shapes has less, which says no more
# Fitted by experiments/ch7_matching/calibrate.py, which prints how good they are: logistic regression on
# parts of its tuning half, 52 cuts and scans of cats and horses that a smooth field stretches (22 of them
# with noise), 8 parts matched to hands, planes, people and teddies, where nothing is right, and, with as
# much weight in all, 15 of plain pairs. A constant, then the columns of `vertex_evidence`. Three more
# columns (the gap after a rigid turn, the lead over the best rival, the share of the area), fitted with
# 35 pairs of other kinds, made confidence on lions worse: a Brier score of 0.224 in place of 0.138.
CALIBRATION = np.array(
    [
        0.312,  # constant
        0.964,  # local orientation
        -42.6,  # misfit of distances
        -6.56,  # distance to the next matched point
        -8.68,  # distance to places by other starts
        0.653,  # local stretch
        -47.6,  # gap after bending
        0.885,  # weight of the patch
        0.0691,  # difference of the patch
        4.68,  # orientation
        0.773,  # support
        -1.27,  # mean difference
        -0.229,  # gap times the root of strain
    ]
)
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


@record
class FittedMap:
    """A map of a connected part: the pairs that it was grown from, and the part bent by them."""

    pairs: Pairs
    fit: Fit


def signed_area_ratios(
    part: Surface, whole: Surface, places: Int[np.ndarray, " n"]
) -> Float[np.ndarray, " f"]:
    """Return the signed ratio of areas of each face of the part, between -1 and 1."""
    faces = part.mesh.faces
    areas = triangle_areas(part.mesh.vertices[faces])
    moved = area_vectors(whole.mesh.vertices[places[faces]])
    normals = unit_vectors(whole.normals[places[faces]].sum(axis=1))
    return np.clip(row_dots(moved, normals) / np.maximum(areas, TINY), -1, 1)


def rate_map(
    part: Surface,
    whole: Surface,
    differences: Float[np.ndarray, "m k"],
    pairs: Pairs,
    places: Int[np.ndarray, " n"],
) -> Quality:
    """Rate a map of vertices to vertices, given the differences of patches."""
    areas = face_areas(part.mesh)
    orientation = float(areas @ signed_area_ratios(part, whole, places) / areas.sum())
    cells = np.bincount(whole.nearest, weights=whole.areas, minlength=len(whole.points))
    covered = cells[np.unique(whole.nearest[places])].sum() / part.area
    coupling = couplings(part, whole, pairs.points, pairs.partners)
    support = np.abs(coupling.sum(axis=1)).sum() / len(part.points) ** 2
    ends = whole.nearest[places[part.points]]
    unlike = np.median(differences[np.arange(len(ends)), ends])
    likeness = np.median(differences.min(axis=1)) / max(float(unlike), TINY)
    return Quality(orientation, float(min(covered, 1.0)), float(support), float(min(likeness, 1.0)))


def vertex_evidence(
    part: Surface,
    whole: Surface,
    differences: Float[np.ndarray, "m k"],
    maps: Sequence[FittedMap],
    quality: Quality,
) -> Float[np.ndarray, "n c"]:
    """Return what tells how sure each vertex is, in columns; see `ShapeMatch.evidence`.

    The first map is the one that is taken; the next two say where else a vertex might be. Local
    columns are means over discs of about three edges.
    """
    fit, pairs = maps[0].fit, maps[0].pairs
    others = [other.fit for other in maps[1 : N_OTHERS + 1]]
    places, n = fit.places, part.mesh.n_vertices
    # Local orientation: a mirrored or torn place turns faces over.
    ratios = signed_area_ratios(part, whole, places)
    n_faces = np.bincount(part.mesh.faces.ravel(), minlength=n)
    local = at_points(part.mesh, ratios) / np.maximum(n_faces, 1)
    # Misfit of distances along the surface to the matched points around
    misfits = place_points(part, whole, pairs, np.arange(n))[1]
    # Local stretch: mean ratio of the lengths of edges, after and before
    edges = edge_table(part.mesh).edges
    ours = edge_lengths(part.mesh)
    theirs = np.linalg.norm(np.subtract(*whole.mesh.vertices[places[edges.T]]), axis=1)
    jumps = np.minimum(theirs / np.maximum(ours, TINY), MOST_STRETCH)
    sums = np.bincount(edges.ravel(), weights=np.repeat(jumps, 2), minlength=n)
    stretch = sums / np.maximum(np.bincount(edges.ravel(), minlength=n), 1)
    # Distance to the next matched point: what lies between is interpolated.
    away = np.minimum(part.distances[pairs.points].min(axis=0), FARTHEST_SPREAD)
    # Distance to where maps from other starts put the vertex
    spread = np.zeros(n)
    for other in others:
        gap = whole.mesh.vertices[places] - whole.mesh.vertices[other.places]
        spread += np.minimum(np.linalg.norm(gap, axis=1), FARTHEST_SPREAD) / len(others)
    # Gap that is left after bending, without what lies between the vertices of the whole
    gaps = fit.gaps - BETWEEN_VERTICES * edge_lengths(whole.mesh).mean()
    links = neighbor_links(part.mesh) + sp.eye_array(n)
    mean = sp.csr_array(sp.diags_array(1 / links.sum(axis=1)) @ links)
    columns = [local, misfits, away, spread, stretch, gaps]
    for _ in range(SMOOTHING):
        columns = [mean @ column for column in columns]
    # Weight of the nearest patch, least at boundaries, and its difference from that of its image
    rim = part.weights.min(axis=1)[part.nearest]
    ends = whole.nearest[places[part.points]]
    unlike = np.log1p(differences[np.arange(len(ends)), ends])
    of_map = (
        quality.orientation,
        quality.support,
        unlike.mean(),
        # gap after bending times the root of strain
        np.log(max(fit.misfit, LEAST_MISFIT)),
    )
    rows = [*columns, rim, unlike[part.nearest], *(np.full(n, value) for value in of_map)]
    return np.column_stack(rows)


def confidence(evidence: Float[np.ndarray, "n c"]) -> Float[np.ndarray, " n"]:
    """Return the probability that a vertex is right, from its evidence."""
    return expit(CALIBRATION[0] + evidence @ CALIBRATION[1:])
