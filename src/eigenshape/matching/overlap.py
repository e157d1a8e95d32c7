"""The region that two parts of one shape share, and the map in it.

A pair of windows, one on each part, in which patches, distances and directions agree is a start. The
first part is bent so that the window lies on the other part, and the region is grown round by round:
it takes in what then lies on the other part, and drops what changes its distances. A boundary of the other
part draws nothing and takes nothing in (compare Turk and Levoy 1994 for scans of rigid shapes).
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree
from scipy.special import expit

from certeig.kit.arrays import record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import map_in_threads
from eigenshape._arrays import label_components
from eigenshape.geometry.measure import edge_lengths, face_areas, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import boundary_vertices, edge_table
from eigenshape.matching.assignment import APART, N_FAR
from eigenshape.matching.evidence import signed_area_ratios
from eigenshape.matching.fitting import (
    LARGEST_GAP,
    SLIDING_ALONG,
    STIFFNESS,
    TINY,
    Fit,
    FitPlan,
    bend_part,
    plan_fit,
    plan_rough_fit,
)
from eigenshape.matching.growth import grow_starts
from eigenshape.matching.match_loops import nearest_rows
from eigenshape.matching.pairs import (
    Pairs,
    couplings,
    descriptor_costs,
    patch_differences,
    place_points,
    select_pairs,
)
from eigenshape.matching.pieces import Piece, carry_map, report_left_out
from eigenshape.matching.scale import N_PART
from eigenshape.matching.shape_match import ShapeMatch
from eigenshape.matching.spectral_refinement import places_in_faces
from eigenshape.matching.surface import Surface, describe_surface
from eigenshape.matching.target import MatchTarget

# Lengths are in units of `Surface`. Numbers were chosen on the tuning half of experiments/ch7_overlap.
# Windows around the first points of each part: how many, and their share of all points. Of pairs that
# overlap by 40 %, 2 to 34 of these 480 pairs of windows are right.
N_OURS, N_THEIRS, WINDOW = 20, 24, 0.15
N_PARTNERS = 3  # of a point in the other window that are tried
WINDOW_SLACK, WINDOW_ROUNDS = 0.3, 12  # as `DISTANCE_SLACK` and `FIRST_ROUNDS`
FEWEST = 6  # points that make a region
N_STARTS, N_FINISHED = 60, 8  # pairs of windows that are grown roughly, and regions of these finely
N_ROUGH_ROUNDS, N_ROUNDS = 3, 6
FIRST_REACH, REACH = 0.12, 0.25  # how far from a region a bend looks for more of it
MOST_GAP = 0.05  # of a vertex in the region, with normals
# A point belongs to a region if its distances to the points there that are NEAR to FAR away change by
# less, on the median. Without this, errors grow with each round; with 0.15 wrong limbs are taken in.
NEAR, FAR, MOST_STRETCH = 0.15, 0.5, 0.12
SMALL_PIECE = 0.1  # pieces of a region with a smaller share of the largest one are dropped
LEAST_DIFFERENCE = 1.0  # of patches; that of copies is 0
# The part is stiffer than one that lies on the whole in whole: fewer features keep it from sliding.
STIFFNESSES = tuple(3 * each for each in STIFFNESS)
# How good a region is: weights of the logarithm of its share of the part, of the median change of
# distances, and of the mean logarithm of differences of patches. Of the tuning half, the best regions
# of four pairs that overlap have -3.5 to -4.5, and the best of three that do not -4.5 to -4.8.
WEIGHTS = np.array([0.5, -30, -1])
LEAST_WORTH = -4.4
# Logistic regression on vertices of regions of the tuning half: a constant, change of distances, gap,
# and how good the region is
CALIBRATION = np.array([36.0, -25.9, 11.5, 7.98])
NEARBY = 0.75  # mean edges from an image within which a vertex of the other part is in the region


@record
class Region:
    """A part bent so that a region of it lies on another part.

    `fit` is that of the vertices of the part, or roughly of its points, which are rows `at` of it.
    `stretch` is how far distances from there to the region change, as a share.
    """

    fit: Fit
    at: Int[np.ndarray, " m"]
    inside: Bool[np.ndarray, " k"]
    stretch: Float[np.ndarray, " k"]
    worth: float


def factor_of_overlap(scale: str | float) -> float:
    """Return the factor for lengths of a part that overlaps another one; raise an error if it is unknown."""
    if scale == "unknown":
        raise InvalidParameterError(
            'scale must be "auto", "known" or a number if overlap is "partial"; it is "unknown". '
            "Bring both shapes to one unit of length."
        )
    return 1.0 if isinstance(scale, str) else scale


def match_overlap(
    mesh: TriangleMesh, piece: Piece, target: MatchTarget, factor: float
) -> ShapeMatch:
    """Map the region of a piece that the largest piece of a target has, too."""
    other = target.pieces[0]
    whole = other.surface
    part = describe_surface(piece.copy.mesh, other.unit / factor, N_PART)
    found = find_region(part, whole, patch_differences(part, whole))
    is_found = found.worth >= LEAST_WORTH

    # Carry the map of all vertices, and what tells where it holds, to the meshes as they were given.
    fit = found.fit
    faces, weights = places_in_faces(whole.mesh, whole.mesh.vertices, fit.points, fit.places)
    tells = np.column_stack([found.inside & is_found, found.stretch, fit.gaps])
    faces, weights, tells = carry_map(piece.copy, other.piece.copy, faces, weights, tells)
    inside = tells[:, 0] > 0.5
    mapped, faces, weights = (
        piece.vertices[inside],
        other.piece.faces[faces[inside]],
        weights[inside],
    )
    corners = target.mesh.faces[faces]
    told = np.column_stack([tells[inside, 1:], np.full(len(mapped), found.worth)])
    images = np.einsum("nc,ncd->nd", weights, target.mesh.vertices[corners])
    covered = _covered_vertices(mesh, target.mesh, images)

    ours = dual_volumes(mesh)[mapped].sum()
    theirs = dual_volumes(target.mesh)[covered].sum()
    report = report_left_out(mesh, [piece], "part")
    orientation = coverage = 0.0
    if is_found:
        kept = face_areas(part.mesh) * found.inside[part.mesh.faces].all(axis=1)
        ratios = signed_area_ratios(part, whole, fit.places)
        orientation = float(kept @ ratios / max(kept.sum(), TINY))
        coverage = min(float(theirs / (ours * factor**2)), 1.0)
        shares = ours / surface_area(mesh), theirs / surface_area(target.mesh)
        report += ("the shapes share {:.0%} of the first and {:.0%} of the second".format(*shares),)
    else:
        report += ("no region was found that both shapes have",)
    sure = expit(CALIBRATION[0] + told @ CALIBRATION[1:])

    def at_all(values: np.ndarray, elsewhere: float) -> np.ndarray:
        """Return values of all vertices of the part, given those in the region."""
        every = np.full((mesh.n_vertices, *values.shape[1:]), elsewhere, dtype=values.dtype)
        every[mapped] = values
        return every

    return ShapeMatch(
        vertices=at_all(corners[np.arange(len(corners)), weights.argmax(axis=1)], -1),
        faces=at_all(faces, -1),
        corners=at_all(corners, -1),
        weights=at_all(weights, np.nan),
        confidence=at_all(sure, 0),
        evidence=at_all(told, 0),
        score=float(sure.mean()) if is_found else 0.0,
        orientation=orientation,
        coverage=coverage,
        handed=True,
        n_equally_good=1,
        scale=factor,
        report=report,
        covered=covered,
    )


def _covered_vertices(
    part: TriangleMesh, whole: TriangleMesh, images: Float[np.ndarray, "k 3"]
) -> Bool[np.ndarray, " m"]:
    """Return which vertices of the whole lie near an image of a vertex of the part."""
    if not len(images):
        return np.zeros(whole.n_vertices, dtype=bool)
    edge = max(edge_lengths(part).mean(), edge_lengths(whole).mean())
    return cKDTree(images).query(whole.vertices)[0] <= NEARBY * edge


def find_region(part: Surface, whole: Surface, differences: Float[np.ndarray, "m k"]) -> Region:
    """Return the best region of a part that lies on another part; its worth is -inf if there is none."""
    starts: list[Pairs] = []
    if min(len(part.points), len(whole.points)) >= N_FAR:
        starts = window_pairs(part, whole, differences)
        starts += grow_starts(part, whole, descriptor_costs(differences))
    inner = np.ones(whole.mesh.n_vertices, dtype=bool)
    inner[boundary_vertices(whole.mesh)] = False
    plan = replace(plan_fit(part, whole), inner=inner)
    rough = replace(plan_rough_fit(part, whole), inner=inner)

    def grow_roughly(pairs: Pairs) -> Region:
        first = _bend(rough, differences, pairs, FIRST_REACH)
        return _grow(rough, differences, first, N_ROUGH_ROUNDS)

    grown = [one for one in map_in_threads(grow_roughly, starts) if one.worth > -np.inf]
    # Many starts lead to one map, so only the best of those that agree is grown finely.
    different: list[Region] = []
    for one in sorted(grown, key=lambda one: -one.worth):
        if not any(_agree(whole, one, other) for other in different):
            different.append(one)
    best = map_in_threads(
        lambda one: _grow(plan, differences, one, N_ROUNDS), different[:N_FINISHED]
    )
    if best:
        return max(best, key=lambda one: one.worth)
    n = part.mesh.n_vertices
    nowhere = Fit(part.mesh.vertices, np.zeros(n, dtype=np.int64), np.full(n, LARGEST_GAP), 1.0)
    return Region(nowhere, part.points, np.zeros(n, dtype=bool), np.ones(n), -np.inf)


def window_pairs(
    part: Surface, whole: Surface, differences: Float[np.ndarray, "m k"]
) -> list[Pairs]:
    """Return pairs of points of one window on each part that agree, of the best windows first."""
    ours, theirs = _windows(part, N_OURS), _windows(whole, N_THEIRS)

    def agree(number: int) -> tuple[float, Pairs] | None:
        window, other = ours[number // len(theirs)], theirs[number % len(theirs)]
        nearest = nearest_rows(differences[np.ix_(window, other)].T, N_PARTNERS)
        points, partners = np.repeat(window, N_PARTNERS), other[nearest].ravel()
        coupling = couplings(part, whole, points, partners, WINDOW_SLACK)
        pairs, chosen = select_pairs(coupling, points, partners, WINDOW_ROUNDS)
        if len(chosen) < FEWEST:
            return None
        support = float(np.abs(coupling[np.ix_(chosen, chosen)].sum(axis=1)).mean())
        unlike = _unlikeness(differences, pairs.points, pairs.partners)
        return support**2 / len(chosen) * np.exp(-unlike / 2), pairs

    found = map_in_threads(agree, range(len(ours) * len(theirs)))
    best = sorted((one for one in found if one), key=lambda one: -one[0])
    return [pairs for _, pairs in best[:N_STARTS]]


def _windows(surface: Surface, count: int) -> Int[np.ndarray, "w p"]:
    """Return the points nearest to each of the first few points, in order."""
    size = max(int(WINDOW * len(surface.points)), N_PARTNERS)
    near = np.argsort(surface.between[:count], axis=1, kind="stable")[:, :size]
    return np.sort(near, axis=1)


def _unlikeness(
    differences: Float[np.ndarray, "m k"],
    points: Int[np.ndarray, " p"],
    partners: Int[np.ndarray, " p"],
) -> float:
    """Return the mean logarithm of the differences of the patches of pairs."""
    return float(np.log(np.maximum(differences[points, partners], LEAST_DIFFERENCE)).mean())


def _agree(whole: Surface, one: Region, other: Region) -> bool:
    """Return whether two rough maps place most of the smaller region alike."""
    both = one.inside & other.inside
    ends = [whole.nearest[each.fit.places[both]] for each in (one, other)]
    n_alike = (whole.between[ends[0], ends[1]] < APART).sum()
    return bool(2 * n_alike >= min(one.inside.sum(), other.inside.sum()))


def _grow(plan: FitPlan, differences: Float[np.ndarray, "m k"], one: Region, rounds: int) -> Region:
    """Bend the part anew, round by round, with what is near the region."""
    for _ in range(rounds):
        points = np.flatnonzero(one.inside[one.at])
        if len(points) < FEWEST:
            break
        partners = plan.whole.nearest[one.fit.places[one.at[points]]]
        one = _bend(plan, differences, Pairs(points, partners, np.ones(len(points))), REACH)
    return one


def _bend(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], pairs: Pairs, reach: float
) -> Region:
    """Bend what is near pairs, and return the region of the part that then lies on the other one."""
    part, whole = plan.part, plan.whole
    # The rest of the part is moved along, but drawn to nothing.
    near = part.distances[pairs.points].min(axis=0) < reach
    pull = plan.pull * near[plan.samples]
    drawn = replace(plan, pull=pull / max(pull.sum(), TINY))
    ends, _ = place_points(part, whole, pairs, plan.frames)
    fit = bend_part(drawn, ends, STIFFNESSES, SLIDING_ALONG)

    lies = near[plan.compared] & (fit.gaps < MOST_GAP) & plan.inner[fit.places]
    is_rough = np.array_equal(plan.compared, part.points)
    at = np.arange(len(lies)) if is_rough else part.points
    stretch = _stretches(plan, fit.places[at], lies[at])
    points = np.flatnonzero(lies[at] & (stretch < MOST_STRETCH))
    worth = _worth(plan, differences, fit.places[at], points)
    if not is_rough:
        stretch = stretch[part.nearest]
    inside = lies & (stretch < MOST_STRETCH)
    return Region(fit, at, inside if is_rough else _large_pieces(part, inside), stretch, worth)


def _stretches(
    plan: FitPlan, ends: Int[np.ndarray, " m"], inside: Bool[np.ndarray, " m"]
) -> Float[np.ndarray, " m"]:
    """Return the median change of distances of each point to those inside, as a share; 1 if it is unknown."""
    part, whole = plan.part, plan.whole
    points = np.flatnonzero(inside)
    ours = part.between[points].astype(np.float64)
    theirs = whole.columns[np.ix_(ends, whole.nearest[ends[points]])].T
    known = (ours > NEAR) & (ours < FAR) & np.isfinite(theirs)
    changes = np.ma.masked_array(
        np.abs(ours - theirs) / np.maximum(np.maximum(ours, theirs), NEAR), ~known
    )
    return np.ma.median(changes, axis=0).filled(1.0) if len(points) else np.ones(len(ends))


def _worth(
    plan: FitPlan,
    differences: Float[np.ndarray, "m k"],
    ends: Int[np.ndarray, " m"],
    points: Int[np.ndarray, " p"],
) -> float:
    """Return how good it is that some points of a part lie where they do; -inf if they are too few."""
    part = plan.part
    if len(points) < FEWEST:
        return -np.inf
    cells = np.bincount(part.nearest, weights=part.areas, minlength=len(part.points))
    inside = np.isin(np.arange(len(ends)), points)
    stretch = np.median(_stretches(plan, ends, inside)[points])
    unlike = _unlikeness(differences, points, plan.whole.nearest[ends[points]])
    return float(np.array([np.log(cells[points].sum() / part.area), stretch, unlike]) @ WEIGHTS)


def _large_pieces(part: Surface, inside: Bool[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Return the connected pieces of a region that are not small."""
    edges = edge_table(part.mesh).edges
    kept = edges[inside[edges].all(axis=1)]
    _, labels = label_components(part.mesh.n_vertices, kept[:, 0], kept[:, 1])
    areas = np.bincount(labels, weights=part.areas * inside)
    return inside & (areas >= SMALL_PIECE * areas.max())[labels]
