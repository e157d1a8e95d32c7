"""The similarity transformation that places one surface on another, found from the surfaces alone."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._vectors import mean_radius, rotations_and_stretches
from eigenshape.collections.spread_points import (
    join_normals,
    main_pieces,
    spread_points,
)
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.matching.nearest import RowTree

# Lengths are in units of the root mean square distance of a surface from its middle. All numbers
# were chosen on the tuning half of experiments/ch7_collection: skulls, whole, and cut by planes.
N_POINTS, N_ROUGH = 1200, 240  # of the surface that is placed, for its refined and rough places
N_WHOLE = 6000, 1200  # of the whole; denser, since a gap ends at the nearest point
N_TURNS = 32  # random ones, after the four that align the principal axes
OFFSET = 0.5  # of further starts along the axes: the middle of a part is not that of the whole
SIZES = (1.0, 0.77)  # of a part at the start, as shares of what its own extent gives
SMALLEST, LARGEST = 0.6, 1.15  # beyond, a part would shrink into one spot of the whole
N_KEPT, N_REFINED = 126, 10  # of up to 448 starts: after half of the rough rounds, and after all
# Distances at which a pair counts a quarter, from the first round to the last
ROUGH_REACH = np.geomspace(0.6, 0.2, 10)
FINE_REACH = np.geomspace(0.2, 0.05, 40)
N_EARLY, N_LAST = 10, 3  # fine rounds of all places, and how many of these the later rounds refine
ON_SURFACE = 0.1  # distance at which a point counts half in a gap
# Gap below which the random turns are not tried. On the tuning half of experiments/ch7_collection and
# for creatures, whole or half, random turns lower a smaller gap by at most 0.015; where they find
# another place, the gap was 0.39 or more.
PLACED = 0.35
# The gap of a surface, as a share of that of its mirror image, below which it is no mirror image, or
# the other way round. On the tuning half of experiments/ch7_collection, skulls of others, whole or
# cut, have 0.98 to 1.03, since their two sides are alike; hands of other individuals 0.55 to 0.67.
CLEAR_SIDE = 0.85
# Angle of a turn, in radians: few regular prisms come near to themselves by it, so what lies on itself
# after it can be turned by any angle.
GOLDEN = np.pi * (3 - 5**0.5)
# Least gap of a surface on itself, as a share of that of a turn that counts as well: boxes, prisms of
# four and six sides and ellipsoids have 0.8 or more, creatures less than 0.7.
ON_ITSELF = 0.75
SAME_TURN = 1 + 2 * np.cos(np.radians(10))  # trace of the turn between two turns that count as one
MIRROR = np.diag([-1.0, 1.0, 1.0])
Side: TypeAlias = Literal["same", "mirrored", "cannot be told"]


@record
class Similarity(ReadOnly):
    """A motion with a change of size that places one surface on another: x ↦ s R x + t.

    Attributes
    ----------
    scale : float
        The factor s of lengths.
    rotation : (3, 3) float
        The orthogonal matrix R. Its determinant is -1 if the surface is reflected.
    translation : (3,) float
        The vector t.
    gap : float
        0 if the surface lies on the other one, 1 if it lies nowhere near it: the mean of
        d² / (d² + 0.1²) over its points, with d the distance to the nearest point of the other
        surface that faces the same way, in units of the root mean square radius.
    mirror_gap : float
        The least gap of the mirror image of the surface; infinite if it was not tried.
    n_ways : float
        How many turns place the surface equally well, since it or the other one can be turned into
        itself: 4 for boxes of three different sides, infinite for forms of revolution.

    See Also
    --------
    align_surfaces

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=500)
    >>> larger = es.TriangleMesh(3 * fish.vertices, fish.faces)
    >>> found = es.collections.align_surfaces(larger, fish)
    >>> bool(np.abs(found.inverse().move(fish.vertices) - larger.vertices).max() < 0.1)
    True
    """

    scale: float
    rotation: Float[np.ndarray, "3 3"]
    translation: Float[np.ndarray, " 3"]
    gap: float = 0.0
    mirror_gap: float = np.inf
    n_ways: float = 1.0

    @property
    def reflected(self) -> bool:
        """Whether it turns left into right."""
        return bool(np.linalg.det(self.rotation) < 0)

    @property
    def side(self) -> Side:
        """Whether one surface is a mirror image of the other's kind: "same", "mirrored", "cannot be told".

        It cannot be told if the smaller gap is above 0.85 of the other one, as of forms whose two
        sides are alike.
        """
        if not self.gap < CLEAR_SIDE * self.mirror_gap:
            return "cannot be told"
        return "mirrored" if self.reflected else "same"

    def move(self, points: ArrayLike) -> Float[np.ndarray, "n 3"]:
        """Return the places of points of the first surface on the second.

        Parameters
        ----------
        points : (n, 3) float
        """
        return self.scale * finite_rows(points, "points", 3) @ self.rotation.T + self.translation

    def inverse(self) -> "Similarity":
        """Return the similarity that places the second surface on the first."""
        back = self.rotation.T / self.scale
        away = -back @ self.translation
        turn = self.rotation.T.copy()
        return Similarity(1 / self.scale, turn, away, self.gap, self.mirror_gap, self.n_ways)


@one_blas_thread()
def align_surfaces(
    surface: MeshLike, whole: MeshLike, *, mirrored: bool | None = None
) -> Similarity:
    """Find the similarity that places a surface, or a part of one, on a whole one of nearly its form.

    Points of the surface are paired with the nearest ones of the whole that face the same way, and
    the similarity of least weighted squares moves them there, again and again (iterated closest
    points: Besl and McKay 1992; here with sizes and with weights against what has no partner). It
    starts with the principal axes in line, from several places and sizes, and if no gap is small
    then, from 32 other turns; the ten with the smallest gaps are refined, the best three to the end.

    Parameters
    ----------
    surface : MeshLike
        In any unit, turned in any way; at least about half of the form of `whole`. Small loose
        pieces are left out; any topology will do.
    whole : MeshLike
        Without large gaps. Faces of both should look outward.
    mirrored : bool, optional
        Whether the surface is a mirror image, where that is known. By default both are tried, and
        the mirror image is taken if it has less than 0.85 of the gap.

    Returns
    -------
    Similarity
        It places `surface` on `whole`. A `gap` above about 0.4 means that no good place is known.
        `side` says whether the surface is a mirror image. A form with two equal sides lies as well
        both ways, so that it cannot be told.

    Raises
    ------
    InvalidShapeError
        If a surface has no area.

    See Also
    --------
    fit_surface : Bend one surface onto another from there.
    es.matching.register_scans : Rigid motions of scans that overlap.

    Examples
    --------
    >>> import eigenshape as es
    >>> hand = es.make_creature("hand", n_vertices=500)
    >>> turned = es.TriangleMesh(hand.vertices[:, [1, 2, 0]] / 10, hand.faces)
    >>> found = es.collections.align_surfaces(turned, hand)
    >>> round(found.scale, 1), found.gap < 0.2, found.reflected
    (10.0, True, False)
    """
    surface, whole = as_mesh(surface, "surface"), as_mesh(whole, "whole")
    ours, our_middle, our_size = _points_in_own_size(surface, N_POINTS)
    theirs, middle, size = _points_in_own_size(whole, N_WHOLE[0])
    tree, rough_tree = RowTree(theirs), RowTree(theirs[:: N_WHOLE[0] // N_WHOLE[1]])

    def search(points: Float[np.ndarray, "k 6"]) -> _Places:
        """Return the best place of points with normals."""
        best = search_from(points, _axis_turns(points[:, :3], theirs[:, :3]))
        if best.gaps[0] < PLACED:
            return best
        random = Rotation.random(N_TURNS, rng=np.random.default_rng(0)).as_matrix()
        return best.joined(search_from(points, random)).best(1)

    def search_from(points: Float[np.ndarray, "k 6"], turns: np.ndarray) -> _Places:
        """Return the best place that is reached from turns."""
        offsets = np.vstack([np.zeros(3), OFFSET * np.eye(3), -OFFSET * np.eye(3)])
        grid = np.indices((len(turns), len(offsets), len(SIZES))).reshape(3, -1)
        sizes = np.array(SIZES)[grid[2]]
        starts = _Places(sizes, turns[grid[0]], offsets[grid[1]], np.zeros(len(sizes)))
        half = len(ROUGH_REACH) // 2
        few = points[:: N_POINTS // N_ROUGH]
        starts = _refine(few, rough_tree, starts, ROUGH_REACH[:half]).best(N_KEPT)
        starts = _refine(few, rough_tree, starts, ROUGH_REACH[half:]).best(N_REFINED)
        return settle(points, starts)

    def settle(points: Float[np.ndarray, "k 6"], places: _Places) -> _Places:
        """Refine places, the best ones of them to the end, and return the best."""
        places = _refine(points, tree, places, FINE_REACH[:N_EARLY]).best(N_LAST)
        return _refine(points, tree, places, FINE_REACH[N_EARLY:]).best(1)

    image = ours @ np.kron(np.eye(2), MIRROR)  # places and normals
    if mirrored is not None:
        best, mirror_gap = search(image if mirrored else ours).similarity(), np.inf
    else:
        upright, reflected = search(ours), search(image)
        # A form with two equal sides lies as well on itself in a mirror: each place, mirrored by
        # the planes of the principal axes of the whole, is a start of the other one.
        axes = np.linalg.svd(theirs[:, :3], full_matrices=False)[2]
        planes = np.eye(3) - 2 * axes[:, :, None] * axes[:, None]
        upright, reflected = (
            own.joined(settle(points, other.mirrored(planes))).best(1)
            for points, own, other in ((ours, upright, reflected), (image, reflected, upright))
        )
        gaps = float(upright.gaps[0]), float(reflected.gaps[0])
        mirrored = gaps[1] < CLEAR_SIDE * gaps[0]
        best, mirror_gap = (reflected if mirrored else upright).similarity(), gaps[not mirrored]
    turn = best.rotation @ MIRROR if mirrored else best.rotation
    scale = best.scale * size / our_size
    away = middle + size * best.translation - scale * turn @ our_middle
    n_ways = max(_count_turns_into_itself(mesh) for mesh in (surface, whole))
    return Similarity(scale, turn, away, best.gap, mirror_gap, n_ways)


def best_similarity(
    starts: Float[np.ndarray, "n 3"],
    ends: Float[np.ndarray, "n 3"],
    weights: Float[np.ndarray, " n"],
) -> Similarity:
    """Return the similarity, without reflection, of least weighted squares."""
    shares = weights / weights.sum()
    middle, target = shares @ starts, shares @ ends
    scales, turns = _best_turns((starts - middle)[None], (ends - target)[None], shares[None])
    scale, turn = float(scales[0]), turns[0]
    return Similarity(scale, turn, target - scale * turn @ middle)


def _count_turns_into_itself(mesh: TriangleMesh) -> float:
    """Return how many turns lay a surface on itself; infinite for a form of revolution."""
    points, whole = (_points_in_own_size(mesh, n)[0] for n in (N_POINTS, N_WHOLE[0]))
    axes = np.linalg.svd(whole[:, :3], full_matrices=False)[2]
    half_turns = _axis_turns(whole[:, :3], whole[:, :3])
    revolving = axes.T @ Rotation.from_rotvec(GOLDEN * np.eye(3)).as_matrix() @ axes
    random = Rotation.random(N_TURNS, rng=np.random.default_rng(0)).as_matrix()
    turns = np.concatenate([revolving, half_turns, random])
    starts = _Places(np.ones(len(turns)), turns, np.zeros((len(turns), 3)), np.zeros(len(turns)))
    few, tree = points[:: N_POINTS // N_ROUGH], RowTree(whole)
    found = _refine(few, tree, starts, np.append(ROUGH_REACH, FINE_REACH[:N_EARLY]))
    fits = found.gaps < found.gaps.min() / ON_ITSELF
    stays = np.einsum("qij,qij->q", turns, found.rotations) > SAME_TURN
    if (fits & stays)[:3].any():
        return np.inf
    group = found.rotations[fits]
    for _ in range(2):  # products of turns into itself are others
        group = (group[:, None] @ group).reshape(-1, 3, 3)
        traces = np.einsum("qij,pij->qp", group, group)
        group = group[(traces > SAME_TURN).argmax(axis=1) == np.arange(len(group))]
    return float(len(group))


def _points_in_own_size(
    mesh: TriangleMesh, n_points: int
) -> tuple[Float[np.ndarray, "k 6"], Float[np.ndarray, " 3"], float]:
    """Return points with normals about their middle, in units of their size; the middle; the size."""
    spread = spread_points(main_pieces(mesh), n_points)
    middle = spread.points.mean(axis=0)
    size = mean_radius(spread.points)
    return (
        join_normals((spread.points - middle) / size, spread.normals),
        middle,
        size,
    )


@dataclass
class _Places:
    """Similarities of points, side by side, with their gaps."""

    scales: Float[np.ndarray, " q"]
    rotations: Float[np.ndarray, "q 3 3"]
    translations: Float[np.ndarray, "q 3"]
    gaps: Float[np.ndarray, " q"]

    def best(self, n: int) -> "_Places":
        """Return those with the smallest gaps."""
        chosen = np.argsort(self.gaps, kind="stable")[:n]
        return _Places(*(entry[chosen] for entry in vars(self).values()))

    def mirrored(self, planes: Float[np.ndarray, "3 3 3"]) -> "_Places":
        """Return the first place after each reflection, for points that are reflected themselves."""
        scales, gaps = np.repeat(self.scales[:1], 3), np.zeros(3)
        turns = planes @ self.rotations[0] @ MIRROR
        return _Places(scales, turns, planes @ self.translations[0], gaps)

    def joined(self, other: "_Places") -> "_Places":
        """Return these places and others."""
        both = zip(vars(self).values(), vars(other).values(), strict=True)
        return _Places(*(np.concatenate(pair) for pair in both))

    def similarity(self) -> Similarity:
        """Return the first place."""
        return Similarity(
            float(self.scales[0]), self.rotations[0], self.translations[0], float(self.gaps[0])
        )


def _axis_turns(
    ours: Float[np.ndarray, "k 3"], theirs: Float[np.ndarray, "m 3"]
) -> Float[np.ndarray, "4 3 3"]:
    """Return the four turns that align the principal axes of points."""
    axes, axes_there = (np.linalg.svd(points, full_matrices=False)[2] for points in (ours, theirs))
    signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    turns = (signs[:, None] * axes_there.T) @ axes
    return turns * np.sign(np.linalg.det(turns))[:, None, None]


def _refine(
    points: Float[np.ndarray, "k 6"], tree: RowTree, places: _Places, reaches: np.ndarray
) -> _Places:
    """Move points from each place to their nearest partners, with an ever shorter reach."""
    ours, normals = points[:, :3], points[:, 3:]
    scales, rotations, translations = places.scales, places.rotations, places.translations
    found = None

    def nearest() -> tuple[Float[np.ndarray, "q k"], Int[np.ndarray, "q k"]]:
        turned = ours @ rotations.transpose(0, 2, 1)
        moved = scales[:, None, None] * turned + translations[:, None]
        facing = normals @ rotations.transpose(0, 2, 1)
        return tree.nearest(np.concatenate([moved, facing], axis=2), found)

    for reach in reaches:
        distances, found = nearest()
        partners = tree.rows[found, :3]
        weights = (1 + (distances / reach) ** 2) ** -2
        weights /= weights.sum(axis=1, keepdims=True)
        middles, targets = weights @ ours, np.einsum("qk,qkd->qd", weights, partners)
        scales, rotations = _best_turns(
            ours - middles[:, None], partners - targets[:, None], weights
        )
        scales = np.clip(scales, SMALLEST, LARGEST)
        translations = targets - scales[:, None] * np.einsum("qij,qj->qi", rotations, middles)
    distances = nearest()[0]
    gaps = np.mean(distances**2 / (distances**2 + ON_SURFACE**2), axis=1)
    return _Places(scales, rotations, translations, gaps)


def _best_turns(
    starts: Float[np.ndarray, "q k 3"],
    ends: Float[np.ndarray, "q k 3"],
    weights: Float[np.ndarray, "q k"],
) -> tuple[Float[np.ndarray, " q"], Float[np.ndarray, "q 3 3"]]:
    """Return factors and proper turns of least weighted squares about the middle (Umeyama 1991)."""
    products = np.einsum("qki,qkj,qk->qij", starts, ends, weights, optimize=True)
    rotations, stretches = rotations_and_stretches(products)
    extents = np.einsum("qki,qki,qk->q", starts, starts, weights)
    return stretches.sum(axis=1) / extents, rotations.transpose(0, 2, 1)
