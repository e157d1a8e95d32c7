"""How clearly people see two parts: by heat flow, creases, thickness and lines of sight."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from certeig.kit.arrays import record
from eigenshape._vectors import row_dots, scale_to_unit, unit_vectors
from eigenshape.features.contrast import FINE_CONTRAST, PART_CONTRAST
from eigenshape.features.part_merging import (
    PART_TIME,
    Merge,
    heat_coordinates,
    join_means,
    merge_cheapest,
    region_means,
    tree_of_merges,
)
from eigenshape.features.region_tree import PartTree
from eigenshape.features.segmentation import FeaturePoints, Segmentation, adjacent_parts
from eigenshape.geometry.measure import face_areas, face_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table
from eigenshape.spectral.spectrum import Spectrum

# The constants were chosen on the tuning half of experiments/ch5_parts, where their neighbors
# are nearly as good. Exponent of the smaller parts' areas: small parts count more than heat alone
# would let them.
AREA_POWER = 0.6
# Weight of the mean angle, in radians, by which the surface turns across a boundary.
TURN_WEIGHT = 0.6
# Weight of the difference of log thickness.
THICKNESS_WEIGHT = 0.5
# Log contrast of parts that people see as often as not.
LOG_CONTRAST = 0.25
# Factor by which the persistence of one end of a body is raised at most to that of the other end.
# With 1.15 to 1.3 the error on the tuning half is 0.001 lower than with 1; from 1.2 on, both ends
# of the metacarpal bones and proximal phalanges of one hand are parts.
ALIKE_ENDS = 1.25
# Half width of the strip in which a boundary's turn is measured, as a share of √area: about an
# edge of a mesh of 5,000 vertices.
TURN_REACH = 0.02
# Faces at which balls are inscribed, and between which lines of sight are drawn. A part of 1 % of
# the area has 10. With 600 the error on the tuning half is 0.001 larger; the number of lines grows
# with the square.
N_SAMPLES = 1000
# Points in a leaf of the tree that finds those in balls. Many points are nearly as far from the
# center of a ball as the nearest: among 390,000, leaves of 10 took four times as long.
LEAF_SIZE = 128
# Largest ball, as a share of √area. A sphere's is 0.28.
LARGEST_BALL = 0.3
# Reach of lines of sight, as a share of √area: a line of length d weighs exp(-(d / reach)²).
SIGHT_REACH = 0.25
# Sine of the least angle between a line of sight and the surface at its ends, so that rounding does
# not decide whether points of one plane see each other: they do not.
LEAST_SINE = 0.02
# Added to shares of lines of sight, so that parts with few clear lines, such as flat sheets, are
# neither joined nor kept for them.
SIGHT_PRIOR = 0.05
# Cosine of the widest angle between the normal and the chord of an inscribed ball. Beyond it, the
# ball touches the same side of the surface, where noise decides its radius.
LEAST_CHORD_COSINE = 0.3
# A ball that shrinks by less than this share holds no further point; radii are not needed to more
# digits.
SHRINKAGE = 1e-6
# Nearly all balls stop shrinking in five rounds.
N_SHRINKAGES = 12


def weigh_parts(
    mesh: TriangleMesh, tree: PartTree, fine: Segmentation, spectrum: Spectrum
) -> PartTree:
    """Merge parts of a fine cut anew, in the order in which people would join them.

    The odds that two adjacent parts R and S are seen as two are taken to be proportional to

        (|R||S| / (|R| + |S|))^0.6 · |c_R - c_S|² · exp(0.6 ϑ + 0.5 |log r_R - log r_S|)
            · (min(v_R, v_S) + 0.05) / (v_RS + 0.05),

    with the areas |R|, |S| and the coordinates c = mean of e^{-tλ} φ of `part_tree`, the mean angle
    ϑ by which the surface turns across the boundary (concave is positive: the minima rule of
    Hoffman and Richards 1984), and the geometric mean r of the radii of inscribed balls (thickness;
    Shapira, Shamir and Cohen-Or 2008). Of the short lines between points of R and S, v_RS is the
    share of those that run inside the solid at both ends; of lines within R it is v_R. It is large
    within convex parts and between parts of one convex body (Asafi, Goren and Cohen-Or 2013, who
    ask whether whole lines are inside). Parts of one thickness with no crease between them, such as
    the halves of a wall, merge earlier than by heat alone.

    A body that has absorbed one of two ends is larger, so that the odds of the other end rise. If
    both ends were about as clear before (a factor of 1.25), and the other end is the next to merge,
    the persistence of the first is raised to that of the other, by this factor at most.

    Parameters
    ----------
    mesh : TriangleMesh
        With faces counter-clockwise as seen from outside.
    tree : PartTree
        Of `part_tree`.
    fine : Segmentation
        Its cut at `FINE_CONTRAST`, with smooth boundaries.
    spectrum : Spectrum

    Returns
    -------
    PartTree
        The merges of the given tree up to the fine cut, then the new ones. Their persistence is
        the odds o as o / (1 + o), at least `FINE_CONTRAST`.
    """
    # The merges that come before the fine cut: regions are sorted by falling persistence.
    ends = np.flatnonzero(tree.persistence < FINE_CONTRAST)[::-1]
    columns = ends, tree.parent[ends], tree.persistence[ends]
    merges = list(zip(*(column.tolist() for column in columns), strict=True))
    merges += _merge_by_contrast(_measure(mesh, fine, spectrum), fine)
    points = FeaturePoints(tree.maxima, tree.values, tree.persistence)
    return tree_of_merges(Segmentation(tree.basins, points), merges)


@record
class _Parts:
    """What is measured of parts, for a surface of area 1.

    areas, means: as of `region_means`; sampled, logs: area of the faces at which balls are
    inscribed, and the integral of the logarithms of their radii over it; borders: for each part its
    neighbors, with the length of the boundary and the integral of the angle by which the surface
    turns across it; rows: the row of each part in the next two, -1 if no point was sampled in it;
    lines, clear: weights of the lines between points of two parts, all lines and clear ones.
    """

    areas: Float[np.ndarray, " r"]
    means: Float[np.ndarray, "r k"]
    sampled: Float[np.ndarray, " r"]
    logs: Float[np.ndarray, " r"]
    borders: list[dict[int, Float[np.ndarray, " 2"]]]
    adjacent: Int[np.ndarray, "p 2"]
    rows: Int[np.ndarray, " r"]
    lines: Float[np.ndarray, "s s"]
    clear: Float[np.ndarray, "s s"]


def _measure(mesh: TriangleMesh, parts: Segmentation, spectrum: Spectrum) -> _Parts:
    labels, count = parts.labels, len(parts.features.vertices)
    areas, means = region_means(mesh, labels, heat_coordinates(spectrum, PART_TIME))

    points, _ = scale_to_unit(mesh.vertices)
    unit = TriangleMesh(points, mesh.faces)
    face_area = face_areas(unit)
    side = float(face_area.sum()) ** 0.5
    normals = face_normals(unit)
    tree = KDTree(points[mesh.faces].mean(axis=1), leafsize=LEAF_SIZE)

    # Weighted by area, because faces differ in size.
    n_samples = min(N_SAMPLES, mesh.n_faces)
    sample = np.arange(n_samples) * mesh.n_faces // n_samples
    radii = inscribed_radii(tree, normals, sample, LARGEST_BALL * side)
    weights = face_area[sample] / side**2
    sampled = np.bincount(labels[sample], weights=weights, minlength=count)
    log_radii = weights * np.log(radii / side)
    logs = np.bincount(labels[sample], weights=log_radii, minlength=count)
    borders = _measure_borders(mesh, points, labels, tree, normals, side)

    # Only parts with a sample have a row: a shape may have thousands of fragments.
    present, members = np.unique(labels[sample], return_inverse=True)
    rows = np.full(count, -1)
    rows[present] = np.arange(len(present))
    lines, clear = lines_of_sight(tree.data[sample] / side, normals[sample])
    shares = sp.csr_array((weights, (members, np.arange(n_samples))))
    return _Parts(
        areas,
        means,
        sampled,
        logs,
        borders,
        adjacent_parts(mesh, labels),
        rows,
        shares @ lines @ shares.T,
        shares @ clear @ shares.T,
    )


def inscribed_radii(
    tree: KDTree,
    normals: Float[np.ndarray, "n 3"],
    chosen: Int[np.ndarray, " m"],
    largest: float,
) -> Float[np.ndarray, " m"]:
    """Return the radii of the largest balls that touch the surface at points from inside.

    A ball shrinks until it holds no other point (Ma, Bae and Choi 2012): through the touching point
    p and a point q inside, the ball with its center at p - R n has the radius
    R = |p - q|² / (2 (p - q) · n).

    Parameters
    ----------
    tree : KDTree
        Of points of the surface.
    normals : (n, 3) float
        Outward unit normals of the points.
    chosen : (m,) int
        The points at which balls touch.
    largest : float
        Radius from which the balls shrink, as long as the points' coordinates.
    """
    points = tree.data
    radii = np.full(len(chosen), largest)
    live = np.arange(len(chosen))
    for _ in range(N_SHRINKAGES):
        here, inward = points[chosen[live]], -normals[chosen[live]]
        gaps, nearest = tree.query(here + radii[live, None] * inward)
        inside = gaps < radii[live] * (1 - SHRINKAGE)
        live = live[inside]
        chords = points[nearest[inside]] - here[inside]
        heights = row_dots(chords, inward[inside])
        squares = row_dots(chords, chords)
        facing = heights > LEAST_CHORD_COSINE * np.sqrt(squares)
        live = live[facing]
        if not len(live):
            break
        radii[live] = squares[facing] / (2 * heights[facing])
    return radii


def lines_of_sight(
    points: Float[np.ndarray, "m 3"], normals: Float[np.ndarray, "m 3"]
) -> tuple[Float[np.ndarray, "m m"], Float[np.ndarray, "m m"]]:
    """Return the weights of the lines between points: of all lines, and of the clear ones.

    A line is clear if it runs inside the solid at both ends. What it meets in between is not
    tested: the lines that count are short.
    """
    distances = cdist(points, points)
    # Entry (i, j): how far point j lies behind the tangent plane of point i.
    behind = row_dots(points, normals)[:, None] - normals @ points.T
    inside = behind > LEAST_SINE * distances
    np.fill_diagonal(inside, False)  # both sides are 0 there, up to rounding
    lines = np.exp(-np.square(distances / SIGHT_REACH))
    return lines, np.where(inside & inside.T, lines, 0)


def _measure_borders(
    mesh: TriangleMesh,
    points: Float[np.ndarray, "n 3"],
    labels: Int[np.ndarray, " f"],
    tree: KDTree,
    normals: Float[np.ndarray, "f 3"],
    side: float,
) -> list[dict[int, Float[np.ndarray, " 2"]]]:
    """Return the neighbors of each part, with length and integrated turn of the boundary.

    `points`, `tree` and `normals` are those of the mesh scaled to unit size.
    """
    table = edge_table(mesh)
    pairs, edges = table.face_pairs
    crossing = labels[pairs[:, 0]] != labels[pairs[:, 1]]
    pairs, edges = pairs[crossing], edges[crossing]
    ends = points[table.edges[edges]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    # Compare normals at a fixed distance from the boundary, because the angle between neighboring
    # faces depends on the size of the faces.
    first, second = tree.data[pairs[:, 0]], tree.data[pairs[:, 1]]
    across = unit_vectors(second - first)
    middle = (first + second) / 2
    _, before = tree.query(middle - TURN_REACH * side * across)
    _, after = tree.query(middle + TURN_REACH * side * across)
    cosines = row_dots(normals[before], normals[after])
    turns = np.minimum(np.arccos(np.clip(cosines, -1, 1)), 1)
    spread = row_dots(normals[after] - normals[before], across)
    turns *= -np.sign(spread)

    count = int(labels.max()) + 1
    low, high = np.sort(labels[pairs], axis=1).T
    keys, border = np.unique(low * count + high, return_inverse=True)
    sums = [np.bincount(border, weights=values) for values in (lengths, lengths * turns)]
    borders: list[dict[int, Float[np.ndarray, " 2"]]] = [{} for _ in range(count)]
    for key, both in zip(keys.tolist(), np.column_stack(sums), strict=True):
        one, two = divmod(key, count)
        borders[one][two] = borders[two][one] = both
    return borders


def _merge_by_contrast(parts: _Parts, fine: Segmentation) -> list[Merge]:
    """Merge parts by the odds of `weigh_parts`, as persistences; what was measured changes in place."""
    areas, means, sampled, logs = parts.areas, parts.means, parts.sampled, parts.logs
    borders, rows, lines, clear = parts.borders, parts.rows, parts.lines, parts.clear
    scale = PART_CONTRAST / (1 - PART_CONTRAST) * np.exp(-LOG_CONTRAST)

    prices: dict[int, float] = {}  # at which regions ended
    # For each body, the region that it absorbed last, and its other ends that were then as clear
    absorbed: dict[int, tuple[int, set[int]]] = {}

    def contrast(one: int, two: int) -> float:
        share = areas[one] * areas[two] / (areas[one] + areas[two])
        gap = np.square(means[one] - means[two]).sum()
        length, turned = borders[one][two]
        evidence = TURN_WEIGHT * turned / length if length > 0 else 0.0
        if sampled[one] > 0 and sampled[two] > 0:
            difference = abs(logs[one] / sampled[one] - logs[two] / sampled[two])
            evidence += THICKNESS_WEIGHT * difference
            row, column = rows[one], rows[two]  # both have points
            if lines[row, column] > 0:
                between = clear[row, column] / lines[row, column]
                within = min(clear[i, i] / lines[i, i] for i in (row, column))
                evidence += np.log((within + SIGHT_PRIOR) / (between + SIGHT_PRIOR))
        odds = scale * share**AREA_POWER * gap * np.exp(evidence)
        return float(odds / (1 + odds))

    def join(remains: int, ends: int) -> None:
        price = prices[ends] = contrast(remains, ends)
        pair = (remains, ends), (ends, remains)
        # Both ends of a bone are about as clear. As soon as the shaft has absorbed one, it is larger,
        # and the other end is clearer: then the first end counts nearly as much.
        for body, other in pair:
            end, alike = absorbed.pop(body, (-1, set()))
            if other in alike:
                prices[end] = min(price, ALIKE_ENDS * prices[end])
        absorbed[remains] = (
            ends,
            {
                other
                for body, end in pair
                for other in borders[body].keys() - borders[end].keys() - {end}
                if contrast(body, other) <= ALIKE_ENDS * price
            },
        )
        join_means(areas, means, remains, ends)
        for sums in (sampled, logs):
            sums[remains] += sums[ends]
        row, ended = rows[remains], rows[ends]
        if row < 0:
            rows[remains] = ended
        elif ended >= 0:
            for sums in (lines, clear):
                sums[row] += sums[ended]
                sums[:, row] += sums[:, ended]
        for other, both in borders[ends].items():
            del borders[other][ends]
            if other != remains:
                borders[remains][other] = borders[remains].get(other, 0) + both
                borders[other][remains] = borders[remains][other]

    heights = fine.features.values
    merges = merge_cheapest(parts.adjacent, heights, contrast, join, FINE_CONTRAST)
    raised = [(ends, remains, max(price, prices[ends])) for ends, remains, price in merges]
    return sorted(raised, key=lambda merge: merge[2])
