"""Parts of bodies with sharp concave creases: the bosses, ribs and plates of machine parts."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arrays import record
from eigenshape._arrays import label_components
from eigenshape._vectors import area_vectors, row_dots, scale_to_unit, sum_rows, unit_vectors
from eigenshape.features.contrast import FINE_CONTRAST
from eigenshape.features.part_merging import tree_of_merges
from eigenshape.features.region_tree import PartTree
from eigenshape.features.segmentation import FeaturePoints, Segmentation
from eigenshape.geometry.creases import smooth_pairs
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table

# A patch is flat if its projection along its mean normal has at least this share of its area:
# normals are within about 0.8° of the mean.
FLATNESS = 1 - 1e-4
# Least area of a part and of a ledge, as shares of the area. Smaller ledges would take long: each
# is compared with all faces, and there are at most 200 of this size.
LEAST_AREA, LEAST_LEDGE = 0.01, 0.005
# Least length of the creases of a ledge, and least height of a part above it, as shares of √area.
# A cube that stands on 1 % of the area has sides of 0.1.
LEAST_LENGTH, LEAST_HEIGHT = 0.1, 0.01
# Largest ratio of creases to other edges along the boundary of a part, so that parts with creases
# all around are not all certain.
MOST_CREASES = 3.0
# Least share of creases that no earlier cut has used. Of the creases of a wall in a tray, up to half
# are upright ones, which remain when the floor has cut all walls off.
LEAST_FRESH = 2 / 3
# Heights below this share of √area are 0: coordinates in single precision are as exact.
ROUNDING = 1e-5


@record
class _Measures:
    """A surface scaled to area 1: its points, area vectors and areas of faces, and lengths of edges."""

    points: Float[np.ndarray, "n 3"]
    vectors: Float[np.ndarray, "f 3"]
    areas: Float[np.ndarray, " f"]
    lengths: Float[np.ndarray, " e"]


@record
class _Cut:
    """What rises from a ledge: its faces, its area, the creases at its foot, and the odds of a part."""

    inside: Bool[np.ndarray, " f"]
    area: float
    creases: Int[np.ndarray, " k"]
    odds: float


def crease_tree(mesh: TriangleMesh, heat: Float[np.ndarray, " n"]) -> PartTree:
    """Build the tree of the parts that rise from flat ledges behind concave creases.

    A ledge is a flat patch with a concave crease, such as the face of a plate around a boss. Its
    plane cuts off what rises behind the crease. The odds that people see this as a part are taken
    to be

        o = (area of the ledge / area of the cross-section) · min(3, l / m),

    where l is the length of the boundary along creases and m its length elsewhere: a part begins
    where the cross-section changes much, along creases that surround it. Cuts are made in the order
    of falling odds. For each, most creases must be such as no earlier cut has used.

    Parameters
    ----------
    mesh : TriangleMesh
        Closed, with faces counter-clockwise as seen from outside.
    heat : (n,) float
        The vertex with the most heat of each part is its feature point.

    Returns
    -------
    PartTree
        With the persistence o / (1 + o), at least `FINE_CONTRAST`.
    """
    n_bodies, bodies = label_components(mesh.n_faces, *edge_table(mesh).face_pairs[0].T)
    measures = _measure(mesh)
    areas, lengths = measures.areas, measures.lengths
    cuts: list[_Cut] = []
    labels, parents = bodies, [-1] * n_bodies
    for cut in sorted(_cuts_at_ledges(mesh, measures), key=lambda cut: -cut.odds):
        used = np.concatenate([np.empty(0, dtype=np.int64), *(other.creases for other in cuts)])
        fresh = np.setdiff1d(cut.creases, used)
        if lengths[fresh].sum() < LEAST_FRESH * lengths[cut.creases].sum():
            continue
        # Of nested parts, the inner one is painted last.
        trial = sorted([*cuts, cut], key=lambda cut: -cut.area)
        painted, around = bodies.copy(), [-1] * n_bodies
        for number, each in enumerate(trial, n_bodies):
            around.append(int(np.bincount(painted[each.inside], areas[each.inside]).argmax()))
            painted[each.inside] = number
        sizes = np.bincount(painted, areas, n_bodies + len(trial))
        if sizes[np.union1d(around[n_bodies:], range(n_bodies, len(sizes)))].min() >= LEAST_AREA:
            cuts, labels, parents = trial, painted, around

    tips = []
    for part in range(len(parents)):
        vertices = mesh.faces[labels == part].ravel()
        tips.append(vertices[heat[vertices].argmax()])
    merges = []
    for number in np.argsort([cut.odds for cut in cuts], kind="stable").tolist():
        ends, odds = n_bodies + number, cuts[number].odds
        merges.append((ends, parents[ends], odds / (1 + odds)))
        parents = [parents[ends] if parent == ends else parent for parent in parents]
    points = FeaturePoints(np.array(tips), heat[tips], np.full(len(tips), np.inf))
    return tree_of_merges(Segmentation(labels, points), merges)


def _measure(mesh: TriangleMesh) -> _Measures:
    """Scale a surface to area 1, and measure its faces and edges."""
    points, _ = scale_to_unit(mesh.vertices)
    vectors = area_vectors(points[mesh.faces])
    areas = np.linalg.norm(vectors, axis=1)
    begin, end = points[edge_table(mesh).edges].transpose(1, 0, 2)
    area = areas.sum()
    return _Measures(
        points / area**0.5,
        vectors / area,
        areas / area,
        np.linalg.norm(end - begin, axis=1) / area**0.5,
    )


def _cuts_at_ledges(mesh: TriangleMesh, measures: _Measures) -> Iterator[_Cut]:
    """List what rises from each flat ledge behind a concave crease, if the odds are high enough."""
    points, vectors = measures.points, measures.vectors
    areas, lengths = measures.areas, measures.lengths
    table = edge_table(mesh)
    pairs, edges = table.face_pairs

    # Patches are bounded by creases. A crease is concave if one face rises above the other.
    smooth = smooth_pairs(mesh)
    n_patches, patches = label_components(mesh.n_faces, *pairs[smooth].T)
    normals = sum_rows(patches, vectors, n_patches)
    patch_areas = np.bincount(patches, areas, n_patches)
    one, two = points[mesh.faces].mean(axis=1)[pairs].transpose(1, 0, 2)
    concave = ~smooth & (row_dots(vectors[pairs[:, 0]], two - one) > 0)
    ends = np.concatenate([pairs[concave], pairs[concave, ::-1]])
    creases = np.tile(edges[concave], 2)
    creased = np.bincount(patches[ends[:, 0]], lengths[creases], n_patches)
    is_ledge = np.linalg.norm(normals, axis=1) > FLATNESS * patch_areas
    is_ledge &= (patch_areas >= LEAST_LEDGE) & (creased >= LEAST_LENGTH)

    for ledge in np.flatnonzero(is_ledge):
        normal = unit_vectors(normals[[ledge]])[0]
        heights = points @ normal
        heights -= heights[mesh.faces[patches == ledge]].mean()
        heights[np.abs(heights) < ROUNDING] = 0
        low, high = heights[mesh.faces].min(axis=1), heights[mesh.faces].max(axis=1)
        # Faces are connected above the plane if their common edge reaches above it.
        rising = heights[table.edges[edges]].max(axis=1) > 0
        _, regions = label_components(mesh.n_faces, *pairs[rising].T)
        here = patches[ends[:, 0]] == ledge
        behind, at_foot = ends[here, 1], creases[here]
        for region in np.unique(regions[behind]):
            inside = (regions == region) & (low + high > 0)
            foot = np.unique(at_foot[regions[behind] == region])
            boundary = edges[inside[pairs[:, 0]] != inside[pairs[:, 1]]]
            along = lengths[foot].sum()
            elsewhere = max(lengths[boundary].sum() - along, along / MOST_CREASES)
            # What is above the plane turns upward as much as its cross-section turns downward.
            section = (vectors[inside] @ normal).sum()
            if section > 0 and high[inside].max() >= LEAST_HEIGHT:
                odds = float(patch_areas[ledge] / section * along / elsewhere)
                if odds / (1 + odds) >= FINE_CONTRAST:
                    yield _Cut(inside, float(areas[inside].sum()), foot, odds)
