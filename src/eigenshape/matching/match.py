"""Dense correspondences of a part or a whole with a whole, without training."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from certeig.kit.arguments import require_choice
from certeig.kit.arrays import record
from certeig.kit.errors import InvalidParameterError
from certeig.kit.progress import Progress, silent
from certeig.kit.threads import map_in_threads, one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import outward_vote
from eigenshape.geometry.topology import vertex_components
from eigenshape.matching.evidence import (
    N_COLUMNS,
    Quality,
    confidence,
    rate_map,
    vertex_evidence,
)
from eigenshape.matching.fitting import plan_fit
from eigenshape.matching.growth import equally_good_maps, find_maps, first_support
from eigenshape.matching.overlap import factor_of_overlap, match_overlap
from eigenshape.matching.pairs import Pairs, patch_differences
from eigenshape.matching.pieces import (
    Piece,
    WorkingCopy,
    carry_map,
    longest_edge,
    report_left_out,
    split_pieces,
)
from eigenshape.matching.scale import MOST_AREA, N_PART, choose_factors, require_scale
from eigenshape.matching.shape_match import ShapeMatch
from eigenshape.matching.spectral_refinement import (
    N_MODES,
    corners_of_faces,
    modes_of_part,
    places_in_faces,
    refine_places,
)
from eigenshape.matching.surface import describe_surface, turn_over
from eigenshape.matching.target import (
    LEAST_AREA,
    MatchTarget,
    TargetPiece,
    prepare_target,
    require_matchable,
)
from eigenshape.matching.turns import is_rigid

# Support of the part turned inside out, as a share of that of the part, from which nothing tells
# the outside from the inside, and so left from right.
AS_HANDED = 0.9
# Mean agreement of normals with those of the convex hull (`outward_vote`) from which the outside is
# known. All of 46 parts of the tuning half have at least 0.49, and patches were wrong on four.
CLEAR_VOTE = 0.3
# Support of the mirror image of the part, as a multiple of that of the part, from which it is matched,
# too. Left bones on right ones have 1.1 to 3.5 (humeri 1.0), left hands on right ones 1.2 to 1.3; of 22 scans
# of cats, horses, wolves and creatures three have more, up to 1.5.
MIRROR_HINT = 1.05
# The same where nothing tells the part's outside from its inside: a left hemisphere of 4,000 vertices fits the
# right one badly either way, and its mirror image has 2.1.
CLEAR_HINT = 1.5
# It is kept if bending leaves less than this share of the misfit (left on right 0.0 to 0.3, these scans
# 0.8 to 1.3), or if its mean confidence is so much higher: on two sides of an animal it is by 0.15.
CLOSER, SURER = 0.6, 0.3
# A piece of the whole with less free area than this share of a piece of the part is taken.
FREE = 0.5
Overlap = Literal["full", "partial"]


@one_blas_thread()
def match_shapes(
    part: MeshLike,
    whole: MeshLike | MatchTarget,
    *,
    scale: str | float = "auto",
    mirrored: str | bool = "auto",
    overlap: str = "full",
    progress: Progress | None = None,
) -> ShapeMatch:
    """Find the point of a whole shape that corresponds to each vertex of a part of it.

    The part may be in another pose and have other triangles, holes, cuts and noise; it may be what
    a scanner saw from one side, or a whole shape. Nothing is trained and no landmarks are needed:

    1. Geodesic discs around 300 points of the part and 500 of the whole are described
       (`extract_patches`); each point has five candidate partners. If the part has a boundary,
       its discs are also compared with discs of what eight viewpoints see of the whole, which end at
       boundaries, too.
    2. Two candidate pairs support each other if their distances along the surface agree, and the
       turn from the direction on the part to that on the whole is the same as for other pairs: the
       leading fixed point of x_i ← |Σ_j c_ij x_j|, with complex c_ij. Mirror images get no support,
       since their turns do not agree (compare Leordeanu and Hebert 2005, Singer 2011).
    3. There are 33 starts. Three are the fixed points for distances that agree within 40, 30 and
       20 %. The others assign 14 points far from each other to points of the whole, so that limbs
       are tried in all places: a beam search for what agrees best in distances, directions and
       patches. The part is bent roughly by each assignment, and the best nine are kept.
    4. Of each start, the largest continuous piece is kept and grown over the rest, twice. The part is
       bent onto the whole by each of these maps: first to where the map places its points, then to
       the nearest points that face the same way (non-rigid registration). The map after which the
       smallest gaps are left with the least strain is taken. Four of the nine come first: if no map
       elsewhere is nearly as good as the best of them, the other starts are left out.
    5. The four best maps are grown and bent again, and the best one, and others elsewhere that are
       about as good, also from where they lie after 60 eigenfunctions of both shapes made them
       smooth. From there the part slides: it is bent once more, nearly free to move along the surface.
    6. Eigenfunctions of both shapes make the best map smooth, if the whole has 750 vertices or more.

    A rigid turn decides what bending leaves open. If the turn in which the best map settles (nearest
    points, Besl and McKay 1992) leaves the part on the surface, that turn is the map. If it nearly does,
    the part is also bent from rolls about its long axis, as bones are round.

    Parameters
    ----------
    part : MeshLike
        A part of the whole, or a whole shape. Each piece that is not tiny is matched by itself.
    whole : MeshLike or MatchTarget
        Prepare it once with `prepare_target` to match many parts. Each piece of the part is placed on
        the piece of the whole where its map has the highest score.
    scale : "auto", "known", "unknown" or float
        "known": both shapes have one unit of length. A number: lengths of the part are multiplied
        by it first. "unknown": seven sizes are tried, which takes five times as long. "auto": the
        root of the ratio of areas if both shapes are complete and differ in size by more than
        10 %; else "known", or "unknown" if the part is too large or too small for that. If the
        numbers of pieces differ, the piece of the whole that is nearest in size to the largest one
        of the part stands for all.
        Where both shapes are complete but have other proportions, as a broken bone and a whole one,
        both the root and "known" are tried.
    mirrored : "auto", True or False
        Whether the part is matched as its mirror image, as a left hand to a right one. "auto" tries that,
        too, where the patches of the mirror image support each other a little better, and keeps it
        if bending leaves much less of it apart, or its map is much surer; `ShapeMatch.mirrored` and
        the report say so. Of parts that overlap, the mirror image is matched only on request.
    overlap : "full" or "partial"
        "full": all of the part lies on the whole. "partial": each of the two shapes has regions that
        the other one lacks. The region that both have is found, and the map in it; no vertex has a
        place if there is none. The largest piece of each shape is matched, in one unit of length or
        by the factor `scale`.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    ShapeMatch

    Raises
    ------
    InvalidParameterError
        If `scale`, `mirrored` or `overlap` is none of these; if `scale` is "unknown" for parts that
        overlap; or if `scale` is "known" or a number, and the part has more than 1.5
        times the area of the whole, or several pieces and none with 1 % of that area.
    InvalidShapeError
        If a mesh has a face without area or twice, a vertex without face, or neighboring faces that
        disagree in orientation.

    See Also
    --------
    prepare_target : Prepare the whole once.
    take_pose : Bend a shape into the pose of another one.
    eigenshape.spectral.refine_map : A map from a few known pairs of points.

    Notes
    -----
    Nothing is found where part and whole have nothing in common, but a map is returned all the
    same: look at `confidence`, or pass overlap="partial". If the shape can be turned into itself,
    there are several maps: look at `n_equally_good`. A piece of more than 16,000 vertices or with
    needles is matched by way of a copy with fewer vertices, one with edges longer than 0.06 roots of the
    larger area by way of a copy in which these are split, and the map is transferred. A part
    of 5,000 vertices takes 2 to 4 s on one core, by the machine.

    Examples
    --------
    What a scanner sees from one side, on the whole animal in another pose:

    >>> import eigenshape as es
    >>> poses = [es.make_creature("quadruped", pose, n_vertices=1000) for pose in (0, 1)]
    >>> scan = es.partial_scan(poses[0], [0, 0, 1])
    >>> match = es.match_shapes(scan.mesh, poses[1])
    >>> match.vertices.shape == (scan.mesh.n_vertices,)
    True
    >>> image = match.pull(poses[1].vertices)  # the place of each vertex on the whole
    >>> image.shape == scan.mesh.vertices.shape
    True
    """
    tell = progress or silent
    mesh = as_mesh(part, "part")
    require_matchable(mesh)
    scale = require_scale(scale)
    if not (isinstance(mirrored, bool) or mirrored == "auto"):
        raise InvalidParameterError(f'mirrored must be "auto", True or False; it is {mirrored!r}.')
    require_choice(overlap, Overlap, "overlap")
    is_partial = overlap == "partial"
    if is_partial:
        factor = factor_of_overlap(scale)
    tell(0.0, "prepare the whole")
    target = whole if isinstance(whole, MatchTarget) else prepare_target(whole)
    # Even a part that is as large as it may be has its large pieces among these.
    split = partial(
        split_pieces, least=LEAST_AREA / MOST_AREA, longest=longest_edge(mesh, target.mesh)
    )
    pieces = split(mesh)
    image = TriangleMesh(mesh.vertices * [-1, 1, 1], mesh.faces[:, ::-1])
    if is_partial:
        tell(0.5, "match")
        in_mirror = mirrored is True
        largest = (split(image) if in_mirror else pieces)[0]
        found = replace(match_overlap(mesh, largest, target, factor), mirrored=in_mirror)
        tell(1.0, "matched")
        return found
    if scale == "unknown":
        tell(0.3, "find the scale")
    hypotheses = choose_factors(mesh, pieces, target, scale)
    tell(0.5, "match")

    def surest(pieces: Sequence[Piece]) -> tuple[ShapeMatch, _Piece]:
        maps = [_match_pieces(mesh, pieces, target, *each) for each in hypotheses]
        return max(maps, key=lambda each: each[0].confidence.mean())

    if mirrored is True:
        found = replace(surest(split(image))[0], mirrored=True)
    else:
        found, one = surest(pieces)
        hint = MIRROR_HINT if found.handed else CLEAR_HINT
        if mirrored == "auto" and one.mirror_support > hint:
            other, reflected = surest(split(image))
            # One place of a mirror image is not surer than four places, each of which fits better.
            surer = reflected.confidence.mean() > one.confidence.mean() + SURER
            if surer or reflected.misfit < CLOSER * one.misfit:
                said = "the part was matched as its mirror image, which fits better"
                found = replace(other, mirrored=True, report=(*other.report, said))
    tell(1.0, "matched")
    return found


@record
class _Piece:
    """The map of a connected part; see `ShapeMatch`.

    `confidence` is that without other maps that fit as well, which put each vertex at `n_places`.
    `n_perfect` is the number of those maps, this one among them; 0 if this one fits less well.
    `mirror_support` is how much better the mirror image is supported, as a ratio, and `misfit` what
    bending leaves.
    """

    faces: Int[np.ndarray, " n"]
    weights: Float[np.ndarray, "n 3"]
    confidence: Float[np.ndarray, " n"]
    n_places: Float[np.ndarray, " n"]
    evidence: Float[np.ndarray, "n c"]
    quality: Quality
    handed: bool
    n_perfect: int
    mirror_support: float
    misfit: float


class _Placed(NamedTuple):
    """A piece of a part, the number of the piece of the whole on which it lies, its map, and where it fits as well."""

    piece: Piece
    place: int
    one: _Piece
    others: list[int]


def _match_pieces(
    mesh: TriangleMesh,
    pieces: Sequence[Piece],
    target: MatchTarget,
    factor: float,
    report: tuple[str, ...],
) -> tuple[ShapeMatch, _Piece]:
    """Match each piece by itself; tiny ones go where their nearest neighbors in space go.

    Also return the map of the largest piece.
    """
    n = mesh.n_vertices
    faces, weights = np.zeros(n, dtype=np.int64), np.full((n, 3), 1 / 3)
    sure, evidence, done = np.zeros(n), np.zeros((n, N_COLUMNS)), np.zeros(n, dtype=bool)
    least = LEAST_AREA * surface_area(target.mesh) / factor**2
    # A connected part is matched, however small it is.
    is_connected = len(pieces) == 1 and len(pieces[0].vertices) == n
    matched = [piece for piece in pieces if is_connected or piece.area >= least]
    if not matched:
        raise InvalidParameterError(
            f"A part must have a piece with {LEAST_AREA:.0%} of the area of the whole; none of its "
            f'{vertex_components(mesh)[0]} pieces has. Pass scale="unknown" if units may differ '
            "(--scale unknown on the command line)."
        )
    report += report_left_out(mesh, matched, "part") + target.report
    placed = _place_pieces(matched, target, factor)
    for number, (piece, place, one, others) in enumerate(placed):
        faces[piece.vertices] = target.pieces[place].piece.faces[one.faces]
        weights[piece.vertices] = one.weights
        # Each of several equally good places is as likely as the others.
        sure[piece.vertices] = one.confidence / (one.n_places + one.n_perfect * len(others))
        evidence[piece.vertices] = one.evidence
        done[piece.vertices] = True
        if len(target.pieces) > 1:
            report += (f"piece {number} of the part was placed on piece {place} of the whole",)
        for other in others:
            report += (f"piece {number} of the part fits piece {other} of the whole as well",)
    if not done.all():
        nearest = np.flatnonzero(done)[cKDTree(mesh.vertices[done]).query(mesh.vertices[~done])[1]]
        faces[~done], weights[~done] = faces[nearest], weights[nearest]
    corners = target.mesh.faces[faces]
    found, areas = [each.one for each in placed], [piece.area for piece in matched]

    def mean(what: str) -> float:
        return float(np.average([getattr(one.quality, what) for one in found], weights=areas))

    match = ShapeMatch(
        vertices=corners[np.arange(n), weights.argmax(axis=1)],
        faces=faces,
        corners=corners,
        weights=weights,
        confidence=sure,
        evidence=evidence,
        score=mean("score"),
        orientation=mean("orientation"),
        coverage=mean("coverage"),
        handed=all(one.handed for one in found),
        n_equally_good=max(1, *(one.n_perfect * (1 + len(others)) for _, _, one, others in placed)),
        scale=factor,
        report=report,
    )
    return match, found[0]


def _place_pieces(pieces: Sequence[Piece], target: MatchTarget, factor: float) -> list[_Placed]:
    """Place each piece of a part where it fits best among the pieces of the whole."""
    free = [each.piece.area / factor**2 for each in target.pieces]
    # Pieces of the whole on which a piece of the part fits equally well
    twins = np.zeros((len(free), len(free)), dtype=bool)
    placed = []
    for piece in pieces:
        # A piece of the whole that other pieces cover is only taken if there is no other.
        roomy = [k for k, area in enumerate(free) if area >= FREE * piece.area] or [0]
        maps = {k: _match_piece(piece.copy, target.pieces[k], factor) for k in roomy}
        best = max(maps, key=lambda k: maps[k].quality.score)
        one = maps[best]
        free[best] -= piece.area
        others = [k for k in maps if k != best and one.n_perfect and maps[k].n_perfect]
        twins[best, others] = twins[others, best] = True
        if one.n_perfect:
            # Had a piece before this one taken the twin, this one might lie where that one does.
            others += [k for k in np.flatnonzero(twins[best]).tolist() if k not in maps]
        placed.append(_Placed(piece, best, one, others))
    return placed


def _match_piece(copy: WorkingCopy, target: TargetPiece, factor: float) -> _Piece:
    """Match a connected part to a connected whole; the steps are those of `match_shapes`."""
    # Step 1: describe the part, and turn it over if it supports the whole better inside out.
    whole = target.surface
    part = describe_surface(copy.clean, target.unit / factor, N_PART)
    sides = part, turn_over(part)
    both = map_in_threads(lambda side: patch_differences(side, whole), sides)
    upright, turned = map_in_threads(
        lambda number: first_support(sides[number], whole, both[number]), (0, 1)
    )
    handed = min(upright, turned) < AS_HANDED * max(upright, turned)
    is_inside_out = handed and turned > upright and outward_vote(part.mesh) < CLEAR_VOTE
    part, differences = sides[is_inside_out], both[is_inside_out]
    # In a mirror, patches are what they were, and directions turn the other way.
    mirrored = replace(part, ways=np.conj(part.ways))
    # A part of a few points may have no support at all.
    mirror_support = first_support(mirrored, whole, differences) / (max(upright, turned) or np.inf)
    # Steps 2 to 5: pairs that support each other, starts, bends
    modes = modes_of_part(part.mesh, target.modes)
    plan = plan_fit(part, whole)
    maps, turn = find_maps(plan, differences, modes, target.modes)
    if turn is not None:
        best = maps[0]
        quality = rate_map(part, whole, differences, best.pairs, best.fit.places)
        evidence = vertex_evidence(part, whole, differences, maps, quality)
        if is_rigid(plan, turn) or len(target.modes.eigenvalues) < N_MODES[-1]:
            # A coarse whole has few modes, which would move vertices away from where they lie:
            # animals of 400 vertices in two poses have an error of 3.6 with them, and of 1.5 here.
            faces, weights = places_in_faces(
                whole.mesh, whole.mesh.vertices, best.fit.points, best.fit.places
            )
        else:
            # Step 6: make the best map smooth.
            faces, weights = refine_places(modes, target.modes, whole.mesh, best.fit.places)
        n_perfect, n_places = equally_good_maps(plan, differences, maps, turn)
        sure = confidence(evidence)
    else:
        # Too few points agree for a map: take the most similar patch of each, and trust none.
        partners = differences.argmin(axis=1)
        places = whole.points[partners][part.nearest]
        pairs = Pairs(np.arange(len(partners)), partners, np.ones(len(partners)))
        quality = rate_map(part, whole, differences, pairs, places)
        faces, weights = corners_of_faces(whole.mesh, places)
        sure, evidence = np.zeros(len(places)), np.zeros((len(places), N_COLUMNS))
        n_perfect, n_places = 0, np.ones(len(places))
    misfit = maps[0].fit.misfit if maps else np.inf
    values = np.column_stack([sure, n_places, evidence])
    faces, weights, values = carry_map(copy, target.piece.copy, faces, weights, values)
    return _Piece(
        faces,
        weights,
        values[:, 0],
        values[:, 1],
        values[:, 2:],
        quality,
        handed,
        n_perfect,
        mirror_support,
        misfit,
    )
