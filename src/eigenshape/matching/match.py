"""Dense correspondences of a part or a whole with a whole, without training."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from eigenshape._arrays import freeze
from eigenshape._errors import InvalidParameterError
from eigenshape._progress import Progress, silent
from eigenshape._threads import one_blas_thread
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import face_areas, surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import outward_vote
from eigenshape.geometry.topology import submesh, vertex_components
from eigenshape.matching.evidence import (
    N_COLUMNS,
    Quality,
    confidence,
    rate_map,
    vertex_evidence,
)
from eigenshape.matching.fitting import plan_fit
from eigenshape.matching.growth import find_maps, first_support, fitted_maps
from eigenshape.matching.pairs import Pairs, patch_differences
from eigenshape.matching.shape_match import ShapeMatch
from eigenshape.matching.spectral_refinement import modes_of_part, refine_places
from eigenshape.matching.surface import Surface, describe_surface, turn_over
from eigenshape.matching.target import MatchTarget, as_target, require_matchable
from eigenshape.operators.smoothing import denoise

N_PART = 300  # points of the part
# A part with this many times the area of the whole is not a part of it in the same unit.
MOST_AREA = 1.5
# Pieces with less of the area of the whole are not matched: they have too few patches.
LEAST_AREA = 0.01
# Support of the part turned inside out, as a share of that of the part, from which nothing tells
# the outside from the inside, and so left from right.
AS_HANDED = 0.9
# Mean agreement of normals with those of the convex hull (`outward_vote`) from which the outside is
# known. All of 46 parts of the tuning half have at least 0.49, and patches were wrong on four.
CLEAR_VOTE = 0.3
# Sizes of the part that are tried, as shares of the longest side of the whole's box
SIZES = 1.25 ** np.arange(1, -6, -1.0)
# Quantile of the ratios of distances on the whole to those on the part that stands for its size.
# Ways around what was cut off are longer on the part, so that the median is 4 to 15 % too small; on
# eight cuts and scans of the tuning half this quantile was 10 % too small to 6 % too large.
UNCUT = 0.7


@one_blas_thread()
def match_shapes(
    part: MeshLike,
    whole: MeshLike | MatchTarget,
    *,
    scale: str | float = "known",
    progress: Progress | None = None,
) -> ShapeMatch:
    """Find the point of a whole shape that corresponds to each vertex of a part of it.

    The part may be in another pose and have other triangles, holes, cuts and noise; it may be what
    a scanner saw from one side, or a whole shape. Nothing is trained and no landmarks are needed:

    1. Geodesic discs around 300 points of the part and 500 of the whole are described
       (`extract_patches`); each point has five candidate partners. If the part has a rim, its discs
       are also compared with those of what eight viewpoints see of the whole, which end at rims, too.
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
       smallest gaps are left with the least strain is taken.
    5. The four best maps are grown and bent again, and the best one also from where it lies after 60
       eigenfunctions of both shapes made it smooth. From there the part slides: it is bent once
       more, nearly free to move along the surface.
    6. Eigenfunctions of both shapes make the best map smooth.

    Parameters
    ----------
    part : MeshLike
        A part of the whole, or a whole shape. Each piece that is not tiny is matched by itself.
    whole : MeshLike or MatchTarget
        A connected surface; prepare it once with `prepare_target` to match many parts.
    scale : "known", "unknown" or float
        "known": both shapes have one unit of length. A number: lengths of the part are multiplied
        by it first. "unknown": seven sizes are tried, which takes five times as long.
    progress : callable, optional
        Called as progress(fraction_done, message).

    Returns
    -------
    ShapeMatch

    Raises
    ------
    InvalidParameterError
        If `scale` is none of these, or the part has more than 1.5 times the area of the whole.
    InvalidShapeError
        If a mesh has a face without area or twice, a vertex without face, or neighboring faces that
        disagree in orientation; or the whole has several components.

    See Also
    --------
    prepare_target : Prepare the whole once.
    take_pose : Bend a shape into the pose of another one.
    eigenshape.spectral.refine_map : A map from a few known pairs of points.

    Notes
    -----
    Nothing is found where part and whole have nothing in common, but a map is returned all the
    same: look at `confidence`. A part of 5,000 vertices takes about 3 s on one core.

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
    report = progress or silent
    mesh = as_mesh(part, "part")
    require_matchable(mesh)
    factor = _require_scale(scale)
    report(0.0, "prepare the whole")
    target = as_target(whole)
    if scale == "unknown":
        report(0.3, "find the scale")
        factor = _find_scale(mesh, target)
    _require_smaller(mesh, target, factor)
    report(0.5, "match")
    found = _match_pieces(mesh, target, factor)
    report(1.0, "matched")
    return found


def _require_scale(scale: object) -> float:
    """Return the factor that a scale stands for, 1 where it is known or has to be found."""
    if isinstance(scale, str) and scale in ("known", "unknown"):
        return 1.0
    numbers = np.asarray(scale)
    if numbers.dtype.kind not in "iuf" or numbers.shape != () or not 0 < float(numbers) < np.inf:
        raise InvalidParameterError(
            f'scale must be "known", "unknown" or a positive number; it is {scale!r}.'
        )
    return float(numbers)


def _require_smaller(mesh: TriangleMesh, target: MatchTarget, factor: float) -> None:
    limit = MOST_AREA * surface_area(target.mesh) / factor**2
    # Noise of a quarter of an edge adds a fifth to the area, which must not refuse a whole.
    if surface_area(mesh) > limit and surface_area(denoise(mesh)) > limit:
        share = surface_area(mesh) * MOST_AREA / limit
        raise InvalidParameterError(
            f"A part must not have more than {MOST_AREA} times the area of the whole; it has "
            f'{share:.3g} times. Exchange the two shapes, or pass scale="unknown".'
        )


def _find_scale(mesh: TriangleMesh, target: MatchTarget) -> float:
    """Return the factor for the part at which its largest piece fits the whole best."""
    labels, areas = _pieces(mesh)
    largest, _ = submesh(mesh, labels[mesh.faces[:, 0]] == areas.argmax())
    ours, theirs = (float(np.ptp(m.vertices, axis=0).max()) for m in (largest, target.mesh))
    factors = SIZES * theirs / ours
    share = surface_area(largest) / surface_area(target.mesh)
    factors = factors[factors**2 * share <= MOST_AREA]
    best, highest = 1.0, -1.0
    for factor in factors.tolist():
        surface = describe_surface(largest, target.unit / factor, N_PART)
        differences = patch_differences(surface, target.surface)
        maps = fitted_maps(plan_fit(surface, target.surface), differences)
        score = 0.0
        if maps:
            one = maps[0]
            quality = rate_map(surface, target.surface, differences, one.pairs, one.fit.places)
            score = quality.score * np.sqrt(surface.area)
        if score > highest:
            # Between the sizes that are tried, distances between pairs say how large the part is.
            stretch = _stretch(surface, target.surface, maps[0].pairs) if maps else 1.0
            best, highest = factor * stretch, score
    return best


def _stretch(part: Surface, whole: Surface, pairs: Pairs) -> float:
    """Return how much larger than the part it is on the whole, from distances between pairs."""
    ours = part.between[np.ix_(pairs.points, pairs.points)].astype(np.float64)
    theirs = whole.between[np.ix_(pairs.partners, pairs.partners)]
    known = (ours > 0) & (theirs > 0)
    return float(np.quantile(theirs[known] / ours[known], UNCUT)) if known.any() else 1.0


def _pieces(mesh: TriangleMesh) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, " k"]]:
    """Return the component of each vertex, and the area of each component."""
    count, labels = vertex_components(mesh)
    owners = labels[mesh.faces[:, 0]]
    return labels, np.bincount(owners, weights=face_areas(mesh), minlength=count)


@dataclass(frozen=True, eq=False)
class _Piece:
    """The map of a connected part; see `ShapeMatch`."""

    faces: Int[np.ndarray, " n"]
    weights: Float[np.ndarray, "n 3"]
    confidence: Float[np.ndarray, " n"]
    evidence: Float[np.ndarray, "n c"]
    quality: Quality
    handed: bool


def _match_pieces(mesh: TriangleMesh, target: MatchTarget, factor: float) -> ShapeMatch:
    """Match each piece by itself; tiny ones go where their nearest neighbors in space go."""
    n = mesh.n_vertices
    faces, weights = np.zeros(n, dtype=np.int64), np.full((n, 3), 1 / 3)
    sure, evidence, done = np.zeros(n), np.zeros((n, N_COLUMNS)), np.zeros(n, dtype=bool)
    least = LEAST_AREA * surface_area(target.mesh) / factor**2
    labels, areas = _pieces(mesh)
    matched = np.flatnonzero(areas >= least) if len(areas) > 1 else np.array([0])
    found: list[_Piece] = []
    for number in matched.tolist():
        part, vertices = submesh(mesh, labels[mesh.faces[:, 0]] == number)
        piece = _match_piece(part, target, factor)
        faces[vertices], weights[vertices] = piece.faces, piece.weights
        sure[vertices], evidence[vertices], done[vertices] = piece.confidence, piece.evidence, True
        found.append(piece)
    if not found:
        raise InvalidParameterError(
            f"A part must have a piece with {LEAST_AREA:.0%} of the area of the whole; "
            f'none of its {len(areas)} pieces has. Pass scale="unknown" if units may differ.'
        )
    if not done.all():
        nearest = np.flatnonzero(done)[cKDTree(mesh.vertices[done]).query(mesh.vertices[~done])[1]]
        faces[~done], weights[~done] = faces[nearest], weights[nearest]
    corners = target.mesh.faces[faces]

    def mean(what: str) -> float:
        return float(
            np.average([getattr(piece.quality, what) for piece in found], weights=areas[matched])
        )

    return ShapeMatch(
        vertices=freeze(corners[np.arange(n), weights.argmax(axis=1)]),
        faces=freeze(faces),
        corners=freeze(corners),
        weights=freeze(weights),
        confidence=freeze(sure),
        evidence=freeze(evidence),
        score=mean("score"),
        orientation=mean("orientation"),
        coverage=mean("coverage"),
        handed=all(piece.handed for piece in found),
        scale=factor,
    )


def _match_piece(mesh: TriangleMesh, target: MatchTarget, factor: float) -> _Piece:
    """Match a connected part."""
    whole = target.surface
    part = describe_surface(mesh, target.unit / factor, N_PART)
    upright, turned = (first_support(part, whole, turned=side) for side in (False, True))
    handed = min(upright, turned) < AS_HANDED * max(upright, turned)
    if handed and turned > upright and outward_vote(part.mesh) < CLEAR_VOTE:
        part = turn_over(part)
    differences = patch_differences(part, whole)
    modes = modes_of_part(part.mesh, target.modes)
    maps = find_maps(plan_fit(part, whole), differences, modes, target.modes)
    if maps:
        best = maps[0]
        quality = rate_map(part, whole, differences, best.pairs, best.fit.places)
        evidence = vertex_evidence(part, whole, differences, maps, quality)
        faces, weights = refine_places(modes, target.modes, whole.mesh, best.fit.places)
        return _Piece(faces, weights, confidence(evidence), evidence, quality, handed)
    # Too few points agree for a map: take the most similar patch of each, and trust none.
    partners = differences.argmin(axis=1)
    places = whole.points[partners][part.nearest]
    pairs = Pairs(np.arange(len(partners)), partners, np.ones(len(partners)))
    quality = rate_map(part, whole, differences, pairs, places)
    faces, weights = _at_vertices(target.mesh, places)
    n = len(places)
    return _Piece(faces, weights, np.zeros(n), np.zeros((n, N_COLUMNS)), quality, handed)


def _at_vertices(
    mesh: TriangleMesh, places: Int[np.ndarray, " n"]
) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Return a face at each vertex, and the weights of the vertex in it."""
    first = np.zeros(mesh.n_vertices, dtype=np.int64)
    first[mesh.faces[::-1].ravel()] = np.repeat(np.arange(mesh.n_faces)[::-1], 3)
    faces = first[places]
    return faces, (mesh.faces[faces] == places[:, None]).astype(np.float64)
