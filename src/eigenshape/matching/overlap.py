"""The region that two parts of one shape share, and the map in it.

A pair of windows, one on each part, in which patches, distances and directions agree is a start. The
first part is bent so that the window lies on the other part, and the region is grown round by round:
it takes in what then lies on the other part, and drops what changes its distances. A boundary of the other
part draws nothing and takes nothing in (compare Turk and Levoy 1994 for scans of rigid shapes).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree
from scipy.special import expit

from certeig.kit.arrays import TINY, record
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
    log_differences,
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
# The part is stiffer than one that lies on the whole in whole: fewer features keep it from sliding.
STIFFNESSES = tuple(3 * each for each in STIFFNESS)
# A region ends where one of the parts ends: this near to a boundary, in units, or in mean edges. What
# ends within both parts is not explained; a shorter length than this share of the root of the area says little.
ENDS, ENDS_IN_EDGES, SHORT = 0.06, 2.0, 0.2
# Log odds that a region is right: a constant, and weights of the median change of distances, of the
# logarithm of how many points have patches that are more alike, and of how much of its end is explained.
WORTH = np.array([-7.5, -29.0, -1.83, 6.6])
LEAST_RANK = 1e-3
# A region is taken from odds of two to one. Of 17 pairs of the tuning half that share nothing, the best two have
# odds of one to two. Rivals count from lower odds, too.
LEAST_WORTH, LEAST_OF_RIVALS = 0.7, -0.5
# Patches tell two regions apart if their logarithms of differences, at points that both have, differ by
# so many standard errors: of 16 pairs of the tuning half, the right region leads by 2.1 to 10.4 in 13, and by
# 0.9 to 1.4 in three (an ant, a fish, a snake). Gaps are smaller in the right region of 15, and of these three.
CLEARLY = 2.0
# Logistic regression on vertices of regions of the tuning half: a constant, change of distances, gap,
# and how good the region is
CALIBRATION = np.array([1.52, -5.0, -49.0, 0.69])
NEARBY = 0.75  # mean edges from an image within which a vertex of the other part is in the region


@record
class Region:
    """A part bent so that a region of it lies on another part.

    `fit` is that of the vertices of the part, or roughly of its points, which are rows `at` of it.
    `stretch` is how far distances from there to the region change, as a share. `worth` are the log
    odds that the region is right.
    """

    fit: Fit
    at: Int[np.ndarray, " m"]
    inside: Bool[np.ndarray, " k"]
    stretch: Float[np.ndarray, " k"]
    worth: float
    area: float

    @property
    def promise(self) -> float:
        """The area that can be expected to be right."""
        return float(expit(self.worth)) * self.area


@record
class Signs:
    """What tells right regions of two parts from wrong ones.

    `ranks` is the share of points of the other part that are more alike than each one. `ours` and
    `theirs` tell which vertices of the two parts lie near to a boundary.
    """

    ranks: Float[np.ndarray, "m k"]
    ours: Bool[np.ndarray, " n"]
    theirs: Bool[np.ndarray, " v"]


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
    part = describe_surface(piece.copy.clean, other.unit / factor, N_PART)
    found, n_equally_good = find_region(part, whole, patch_differences(part, whole))
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
    # Each of several equally good places is as likely as the others.
    sure = expit(CALIBRATION[0] + told @ CALIBRATION[1:]) / n_equally_good

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
        n_equally_good=n_equally_good if is_found else 1,
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


def find_region(
    part: Surface, whole: Surface, differences: Float[np.ndarray, "m k"]
) -> tuple[Region, int]:
    """Return the best region of a part that lies on another part, and how many are as good as any.

    Its worth is -inf if there is none.
    """
    starts: list[Pairs] = []
    if min(len(part.points), len(whole.points)) >= N_FAR:
        starts = window_pairs(part, whole, differences)
        starts += grow_starts(part, whole, descriptor_costs(differences))
    inner = np.ones(whole.mesh.n_vertices, dtype=bool)
    inner[boundary_vertices(whole.mesh)] = False
    plan = replace(plan_fit(part, whole), inner=inner)
    rough = replace(plan_rough_fit(part, whole), inner=inner)
    signs = _signs(part, whole, differences)

    def grow_roughly(pairs: Pairs) -> Region:
        first = _bend(rough, signs, pairs, FIRST_REACH)
        return _grow(rough, signs, first, N_ROUGH_ROUNDS)

    grown = [one for one in map_in_threads(grow_roughly, starts) if one.worth > -np.inf]
    # Many starts lead to one map, so only the best of those that agree is grown finely.
    first = _different(whole, grown)[:N_FINISHED]
    fine = map_in_threads(lambda one: _grow(plan, signs, one, N_ROUNDS), first)
    fine = [one for one in fine if one.worth > -np.inf]
    if fine:
        best, *others = _different(whole, fine)
        # A shape whose front and back are alike fits both ways: the smaller gap decides, and both count.
        rivals = [
            one
            for one in others
            if one.worth >= LEAST_OF_RIVALS and not _are_distinct(plan, differences, best, one)
        ]
        for one in rivals:
            both = best.inside & one.inside
            if part.areas[both] @ one.fit.gaps[both] < part.areas[both] @ best.fit.gaps[both]:
                best = one
        return best, 1 + len(rivals)
    n = part.mesh.n_vertices
    nowhere = Fit(part.mesh.vertices, np.zeros(n, dtype=np.int64), np.full(n, LARGEST_GAP), 1.0)
    return Region(nowhere, part.points, np.zeros(n, dtype=bool), np.ones(n), -np.inf, 0.0), 1


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
        unlike = float(log_differences(differences, pairs.points, pairs.partners).mean())
        return support**2 / len(chosen) * np.exp(-unlike / 2), pairs

    found = map_in_threads(agree, range(len(ours) * len(theirs)))
    best = sorted((one for one in found if one), key=lambda one: -one[0])
    return [pairs for _, pairs in best[:N_STARTS]]


def _windows(surface: Surface, count: int) -> Int[np.ndarray, "w p"]:
    """Return the points nearest to each of the first few points, in order."""
    size = max(int(WINDOW * len(surface.points)), N_PARTNERS)
    near = np.argsort(surface.between[:count], axis=1, kind="stable")[:, :size]
    return np.sort(near, axis=1)


def _different(whole: Surface, regions: Sequence[Region]) -> list[Region]:
    """Return regions of which no two place the part alike, the most promising first."""
    found: list[Region] = []
    for one in sorted(regions, key=lambda one: -one.promise):
        if not any(_agree(whole, one, other) for other in found):
            found.append(one)
    return found


def _are_distinct(
    plan: FitPlan, differences: Float[np.ndarray, "m k"], one: Region, other: Region
) -> bool:
    """Return whether patches are clearly more alike in a region than in another one."""
    points = plan.part.points
    both = np.flatnonzero(one.inside[points] & other.inside[points])
    if len(both) < FEWEST:
        return True
    ours, theirs = (
        log_differences(differences, both, plan.whole.nearest[each.fit.places[points[both]]])
        for each in (one, other)
    )
    away = theirs - ours
    return bool(away.mean() > CLEARLY * away.std() / np.sqrt(len(both)))


def _agree(whole: Surface, one: Region, other: Region) -> bool:
    """Return whether two rough maps place most of the smaller region alike."""
    both = one.inside & other.inside
    ends = [whole.nearest[each.fit.places[both]] for each in (one, other)]
    n_alike = (whole.between[ends[0], ends[1]] < APART).sum()
    return bool(2 * n_alike >= min(one.inside.sum(), other.inside.sum()))


def _grow(plan: FitPlan, signs: Signs, one: Region, rounds: int) -> Region:
    """Bend the part anew, round by round, with what is near the region; return the best round."""
    best = replace(one, worth=-np.inf)
    for _ in range(rounds):
        points = np.flatnonzero(one.inside[one.at])
        if len(points) < FEWEST:
            break
        partners = plan.whole.nearest[one.fit.places[one.at[points]]]
        one = _bend(plan, signs, Pairs(points, partners, np.ones(len(points))), REACH)
        best = max(best, one, key=lambda each: each.promise)
    return best


def _bend(plan: FitPlan, signs: Signs, pairs: Pairs, reach: float) -> Region:
    """Bend what is near pairs, and return the region of the part that then lies on the other one."""
    part, whole = plan.part, plan.whole
    # The rest of the part is moved along, but drawn to nothing.
    near = part.distances[pairs.points].min(axis=0) < reach
    pull = plan.pull * near[plan.samples]
    drawn = replace(plan, pull=pull / max(pull.sum(), TINY))
    ends, _ = place_points(part, whole, pairs, plan.frames)
    fit = bend_part(drawn, ends, STIFFNESSES, SLIDING_ALONG)

    lies = near[plan.compared] & (fit.gaps < MOST_GAP) & plan.inner[fit.places]
    is_rough = _is_rough(plan)
    at = np.arange(len(lies)) if is_rough else part.points
    stretch = _stretches(plan, fit.places[at], lies[at])
    if is_rough:
        inside = lies & (stretch < MOST_STRETCH)
    else:
        stretch = stretch[part.nearest]
        inside = _large_pieces(part, lies & (stretch < MOST_STRETCH))
    worth, area = _worth(plan, signs, fit.places, at, inside, stretch)
    return Region(fit, at, inside, stretch, worth, area)


def _is_rough(plan: FitPlan) -> bool:
    """Return whether a fit has places of points alone; of a small part, all vertices may be points."""
    return np.array_equal(plan.compared, plan.part.points)


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
    if not len(points):
        return np.ones(len(ends))
    medians = np.ma.median(changes, axis=0)
    return np.asarray(medians.filled(1.0))


def _worth(
    plan: FitPlan,
    signs: Signs,
    places: Int[np.ndarray, " k"],
    at: Int[np.ndarray, " m"],
    inside: Bool[np.ndarray, " k"],
    stretch: Float[np.ndarray, " k"],
) -> tuple[float, float]:
    """Return the log odds that a region is right, -inf if it has too few points, and its area."""
    part = plan.part
    points = np.flatnonzero(inside[at])
    if len(points) < FEWEST:
        return -np.inf, 0.0
    ranks = signs.ranks[points, plan.whole.nearest[places[at[points]]]]
    rank = np.log(np.median(ranks) + LEAST_RANK)
    if _is_rough(plan):
        # Each vertex is with its nearest point.
        places, inside = places[part.nearest], inside[part.nearest]
    explained = _explained_end(part, signs, places, inside)
    worth = float(WORTH @ [1, np.median(stretch[at[points]]), rank, explained])
    return worth, float(part.areas[inside].sum())


def _explained_end(
    part: Surface, signs: Signs, places: Int[np.ndarray, " n"], inside: Bool[np.ndarray, " n"]
) -> float:
    """Return for which share of its end a region ends because the other part does."""
    edges = edge_table(part.mesh).edges
    crossing = edges[inside[edges].sum(axis=1) == 1].ravel()
    last = np.unique(crossing[inside[crossing]])
    last = last[~signs.ours[last]]
    lengths = np.sqrt(part.areas[last])
    unexplained = lengths @ ~signs.theirs[places[last]]
    short = SHORT * np.sqrt(part.areas[inside].sum())
    return float(1 - unexplained / (lengths.sum() + short))


def _signs(part: Surface, whole: Surface, differences: Float[np.ndarray, "m k"]) -> Signs:
    """Return what tells right regions from wrong ones."""
    n_more_alike = np.array([np.searchsorted(np.sort(row), row) for row in differences])
    meshes = part.mesh, whole.mesh
    near = max(ENDS, *(ENDS_IN_EDGES * edge_lengths(mesh).mean() for mesh in meshes))
    # In a straight line; a closed surface has no vertex near to a boundary.
    trees = [cKDTree(mesh.vertices[boundary_vertices(mesh)]) for mesh in meshes]
    ends = [tree.query(mesh.vertices)[0] < near for tree, mesh in zip(trees, meshes, strict=True)]
    return Signs(n_more_alike / differences.shape[1], *ends)


def _large_pieces(part: Surface, inside: Bool[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Return the connected pieces of a region that are not small."""
    edges = edge_table(part.mesh).edges
    kept = edges[inside[edges].all(axis=1)]
    _, labels = label_components(part.mesh.n_vertices, kept[:, 0], kept[:, 1])
    areas = np.bincount(labels, weights=part.areas * inside)
    return inside & (areas >= SMALL_PIECE * areas.max())[labels]
