"""Place one scan of a rigid shape beside another: by patches first, then point to plane."""

from dataclasses import replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from certeig.kit.arguments import require_type
from certeig.kit.arrays import ReadOnly, record
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import ArrayLike
from eigenshape._arrays import finite_rows
from eigenshape._corners import mean_normals
from eigenshape._vectors import nearest_rotations, row_dots
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.operators.smoothing import denoise
from eigenshape.retrieval.patches.descriptor import PatchRecipe, patch_descriptor
from eigenshape.retrieval.patches.matching import PatchPoints, squared_distances
from eigenshape.retrieval.patches.patches import RADII, extract_patches

# Lengths below are in sides of the larger box of the two scans. All numbers were chosen on the
# tuning half of experiments/ch5_retrieval.
N_SAMPLES = 600  # points of a scan whose fit is measured
N_CANDIDATES = 5  # partners of each patch, in both directions
MOST_CANDIDATES = 400  # most similar pairs of patches; memory grows with their square
N_SEEDS, N_PARTNERS = 150, 12  # pairs from which a motion is computed, and pairs that support each
N_RATED, N_REFINED = 60, 12  # motions that are rated, and those of them that are refined
# Two pairs agree if their distance differs by at most LENGTH_SLACK, is at least LEAST_LENGTH, and
# the angles between normals, and between normals and the line, differ by at most ANGLE_SLACK.
LENGTH_SLACK, LEAST_LENGTH = 0.03, 0.08
ANGLE_SLACK = 0.35  # radians
FACING_COSINE = 0.6  # least cosine of two normals of one place
PAIR_REACH = 0.05  # distance of the two ends of a pair that a motion explains
# Distance at which points lie on each other: for a rough motion, and for a refined one. The noise
# of a depth camera is about 0.003.
ROUGH, PRECISE = 0.02, 0.008
# A point this far in front of what the other camera saw, in the middle of its picture, contradicts
# the motion: that camera would have seen it.
IN_FRONT = 0.04
SAME_PIXEL = 1.5  # edges in the picture between such a point and what was seen
N_STEPS, FIRST_REACH, LAST_REACH, SHRINK = 25, 0.08, 0.012, 0.85  # of point to plane
FEWEST_POINTS = 20  # that determine a motion
# Motions closer than this count as one before they are refined.
SAME_TURN, SAME_PLACE = 0.2, 0.1  # radians, and sides of the box


@record
class Registration(ReadOnly):
    """A motion that places one scan on another: x ↦ R x + t.

    Attributes
    ----------
    rotation : (3, 3) float
    translation : (3,) float
    score : float
        Mean share of both scans that lies on the other one, within 0.008 of the box, less the
        shares that contradict the motion because the other camera would have seen them. Of 60 pairs
        of frames, 17 of 19 with more than 0.3 were right.

    See Also
    --------
    register_scans, fuse_scans

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=2000)
    >>> scan = es.partial_scan(fish, [0, 0, 1]).mesh
    >>> found = es.matching.register_scans(scan, scan)
    >>> bool(np.allclose(found.rotation, np.eye(3), atol=1e-3))
    True
    """

    rotation: Float[np.ndarray, "3 3"]
    translation: Float[np.ndarray, " 3"]
    score: float

    def move(self, points: ArrayLike) -> Float[np.ndarray, "n 3"]:
        """Return points of the first scan, placed on the second.

        Parameters
        ----------
        points : (n, 3) float
        """
        return finite_rows(points, "points", 3) @ self.rotation.T + self.translation

    def inverse(self) -> "Registration":
        """Return the motion that places the second scan on the first."""
        back = self.rotation.T
        return Registration(back.copy(), -back @ self.translation, self.score)

    def after(self, first: "Registration") -> "Registration":
        """Return the motion that does another one first; its score is the lower of the two.

        Parameters
        ----------
        first : Registration
            The motion that is done before this one.
        """
        require_type(first, Registration, "first")
        place = self.rotation @ first.translation + self.translation
        return Registration(self.rotation @ first.rotation, place, min(self.score, first.score))


NO_MOTION = Registration(np.eye(3), np.zeros(3), -1.0)


@record
class Scan:
    """A scan without noise, moved to its middle, with what its registration needs."""

    mesh: TriangleMesh
    middle: Float[np.ndarray, " 3"]
    normals: Float[np.ndarray, "n 3"]
    points: PatchPoints

    @property
    def size(self) -> float:
        """Largest side of the box."""
        return float(np.ptp(self.mesh.vertices, axis=0).max())

    @cached_property
    def samples(self) -> Int[np.ndarray, " s"]:
        """Vertices in even steps, which of a frame are in all of its rows."""
        n = self.mesh.n_vertices
        return np.linspace(0, n - 1, min(n, N_SAMPLES)).astype(np.int64)

    @cached_property
    def tree(self) -> cKDTree:
        """Vertices in space."""
        return cKDTree(self.mesh.vertices)

    @cached_property
    def towards_camera(self) -> Float[np.ndarray, " 3"]:
        """Direction of the mean normal; of a closed surface, whose mean is 0, any."""
        areas = dual_volumes(self.mesh)
        mean = areas @ self.normals / areas.sum()
        return mean / (np.linalg.norm(mean) or 1.0)

    @cached_property
    def picture(self) -> tuple[Float[np.ndarray, "3 2"], cKDTree, float]:
        """Axes of the picture, vertices in it, and the typical distance of neighbors."""
        axes = np.linalg.svd(self.towards_camera[None])[2][1:].T
        spacing = float(np.sqrt(dual_volumes(self.mesh).mean()))
        return axes, cKDTree(self.mesh.vertices @ axes), spacing


def describe_scan(mesh: TriangleMesh) -> Scan:
    """Turn a scan outward, and describe it."""
    clean = denoise(orient_outward(mesh))
    patches = extract_patches(clean, n_views=0, clean=False)
    points = patch_descriptor(patches, PatchRecipe()).points[0]
    middle = clean.vertices.mean(axis=0)
    return Scan(
        TriangleMesh(clean.vertices - middle, clean.faces), middle, mean_normals(clean), points
    )


@one_blas_thread()
def register_scans(first: MeshLike, second: MeshLike) -> Registration:
    """Find the rigid motion that places one scan of a shape on another.

    Patches of the two scans that are alike are paired. Pairs agree if the distance between their
    points and the angles of their normals are the same on both; groups of pairs that agree give
    motions (Besl and McKay, "A method for registration of 3-D shapes", 1992, for the closed form).
    The motions that lay most of one scan on the other, and nothing in front of what the other
    camera saw, are refined point to plane (Chen and Medioni, "Object modelling by registration of
    multiple range images", 1992).

    Parameters
    ----------
    first, second : MeshLike
        Scans of the same rigid shape in one length unit, each from one side, that overlap.

    Returns
    -------
    Registration
        The motion of the first scan. A score below 0.3 means that no motion is known: the scans
        overlap too little. Symmetric shapes fit in several ways.

    Raises
    ------
    InvalidShapeError
        As `extract_patches`.

    See Also
    --------
    fuse_scans : Join several scans to one surface.
    match_shapes : Map a scan of a bent pose to a whole shape.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> fish = es.make_creature("fish", n_vertices=2000)
    >>> scan = es.partial_scan(fish, [0, 0, 1]).mesh
    >>> turned = es.TriangleMesh(scan.vertices @ np.diag([-1.0, -1.0, 1.0]), scan.faces)
    >>> found = es.matching.register_scans(turned, scan)
    >>> bool(np.abs(found.move(turned.vertices) - scan.vertices).max() < 0.01)
    True
    """
    one, two = as_mesh(first, "first"), as_mesh(second, "second")
    return register_described(describe_scan(one), describe_scan(two))


def register_described(first: Scan, second: Scan) -> Registration:
    """Return the motion of the first scan on the second; a score of -1 if no pairs agree."""
    unit = max(first.size, second.size)
    motions = _find_motions(first, second, unit)
    motions.sort(key=lambda motion: -_rate(first, second, motion, unit, ROUGH))
    # Refinement takes most of the time, so motions that lead to one place are refined once.
    different: list[Registration] = []
    for motion in motions:
        is_new = True
        for one in different:
            turn = Rotation.from_matrix(motion.rotation @ one.rotation.T).magnitude()
            gap = np.linalg.norm(motion.translation - one.translation)
            is_new &= bool(turn >= SAME_TURN or gap >= SAME_PLACE * unit)
        if is_new:
            different.append(motion)
        if len(different) == N_REFINED:
            break
    best = NO_MOTION
    for motion in different:
        refined = _refine(first, second, motion, unit)
        score = _rate(first, second, refined, unit, PRECISE)
        if score > best.score:
            best = replace(refined, score=score)
    # Both scans lie with their middles at the origin: the motion goes from middle to middle.
    away = best.translation + second.middle - best.rotation @ first.middle
    return replace(best, translation=away)


def _find_motions(first: Scan, second: Scan, unit: float) -> list[Registration]:
    """Return motions that groups of agreeing pairs of patches give, the best supported first."""
    # Pair each patch of either scan with those that are most like it, the most similar first. Radii
    # of patches are shares of the box, and lengths are the same on both scans.
    size_step = np.log(first.size / second.size) / np.log(RADII[1] / RADII[0])
    costs = squared_distances(first.points, second.points, int(np.clip(np.rint(size_step), -2, 2)))
    m, n = costs.shape
    columns = np.argsort(costs, axis=1, kind="stable")[:, :N_CANDIDATES]
    rows = np.argsort(costs, axis=0, kind="stable")[:N_CANDIDATES]
    forth = np.column_stack([np.repeat(np.arange(m), columns.shape[1]), columns.ravel()])
    back = np.column_stack([rows.T.ravel(), np.repeat(np.arange(n), len(rows))])
    pairs = np.unique(np.concatenate([forth, back]), axis=0)
    order = np.argsort(costs[pairs[:, 0], pairs[:, 1]], kind="stable")
    pairs = pairs[order[:MOST_CANDIDATES]]
    ours, theirs = first.points.vertices[pairs[:, 0]], second.points.vertices[pairs[:, 1]]
    starts, ends = first.mesh.vertices[ours], second.mesh.vertices[theirs]
    start_normals, end_normals = first.normals[ours], second.normals[theirs]

    # Point pair features (Drost et al. 2010) tell which pairs may belong to one motion: distances,
    # angles between normals, and angles of each normal with each line.
    features = []
    for points, normals in ((starts, start_normals), (ends, end_normals)):
        lines = points[:, None] - points[None]
        sizes = np.linalg.norm(lines, axis=2)
        along = np.einsum("pi,pqi->pq", normals, lines) / np.where(sizes > 0, sizes, 1)
        between = np.arccos(np.clip(normals @ normals.T, -1, 1))
        features.append((sizes, between, np.arccos(np.clip(along, -1, 1))))
    (sizes, between, tilts), (their_sizes, their_between, their_tilts) = features
    agrees = np.abs(sizes - their_sizes) < LENGTH_SLACK * unit
    agrees &= np.minimum(sizes, their_sizes) > LEAST_LENGTH * unit
    agrees &= np.abs(between - their_between) < ANGLE_SLACK
    to_line = np.abs(tilts - their_tilts) < ANGLE_SLACK
    agrees &= to_line & to_line.T

    found = []
    counts = agrees.sum(axis=1)
    for seed in np.argsort(-counts, kind="stable")[:N_SEEDS].tolist():
        partners = np.flatnonzero(agrees[seed])
        if len(partners) < 3:
            break
        # Of the pairs that agree with the seed, those that agree with most others of them
        support = agrees[np.ix_(partners, partners)].sum(axis=1)
        partners = partners[np.argsort(-support, kind="stable")[:N_PARTNERS]]
        members = np.append(seed, partners)
        # The motion of the group explains further pairs, which determine it better.
        for _ in range(4):
            motion = fit_motion(starts[members], ends[members])
            near = np.linalg.norm(motion.move(starts) - ends, axis=1) < PAIR_REACH * unit
            turned = start_normals @ motion.rotation.T
            near &= row_dots(turned, end_normals) > FACING_COSINE
            if near.sum() < 4:
                break
            members = np.flatnonzero(near)
        found.append((len(members), motion))
    found.sort(key=lambda each: -each[0])
    return [motion for _, motion in found[:N_RATED]]


def fit_motion(starts: Float[np.ndarray, "p 3"], ends: Float[np.ndarray, "p 3"]) -> Registration:
    """Return the motion with the least squares of distances (Kabsch 1976)."""
    middle, target = starts.mean(axis=0), ends.mean(axis=0)
    products = (starts - middle).T @ (ends - target)
    rotation = nearest_rotations(products[None])[0].T
    return Registration(rotation.copy(), target - rotation @ middle, 0.0)


def _rate(first: Scan, second: Scan, motion: Registration, unit: float, reach: float) -> float:
    """Return the mean share that lies on the other scan, less what contradicts the motion."""
    lying, contradicting = [], []
    for one, other, way in ((first, second, motion), (second, first, motion.inverse())):
        points = way.move(one.mesh.vertices[one.samples])
        normals = one.normals[one.samples] @ way.rotation.T
        distances, nearest = other.tree.query(points)
        facing = row_dots(normals, other.normals[nearest]) > FACING_COSINE
        lying.append(((distances < reach * unit) & facing).mean())
        # What the other camera saw behind a point, it could not have seen through it.
        axes, tree, spacing = other.picture
        aside, behind = tree.query(points @ axes)
        seen = other.mesh.vertices[behind] @ other.towards_camera
        in_front = points @ other.towards_camera > seen + IN_FRONT * unit
        contradicting.append((in_front & (aside < SAME_PIXEL * spacing)).mean())
    return float(np.mean(lying) - sum(contradicting))


def _refine(first: Scan, second: Scan, motion: Registration, unit: float) -> Registration:
    """Minimize the distances to the tangent planes of the nearest points, ever nearer ones."""
    points, normals = first.mesh.vertices[first.samples], first.normals[first.samples]
    # What the planes leave free, such as a ball turning in its socket, stays as it is.
    weights = 1e-3 * np.concatenate([np.full(3, unit**2), np.ones(3)])
    for number in range(N_STEPS):
        # Far points come first, to find the way; later ones are partners that are known.
        reach = max(FIRST_REACH * SHRINK**number, LAST_REACH) * unit
        moved, turned = motion.move(points), normals @ motion.rotation.T
        distances, nearest = second.tree.query(moved)
        planes = second.normals[nearest]
        near = (distances < reach) & (row_dots(turned, planes) > FACING_COSINE)
        if near.sum() < FEWEST_POINTS:
            return motion
        # One step of Gauss and Newton: a small turn and a shift that close the gaps to the planes
        places, planes = moved[near], planes[near]
        gaps = row_dots(second.mesh.vertices[nearest[near]] - places, planes)
        rows = np.hstack([np.cross(places, planes), planes])
        system = rows.T @ rows + np.diag(weights * len(rows))
        change = np.linalg.solve(system, rows.T @ gaps)
        turn = Rotation.from_rotvec(change[:3]).as_matrix()
        place = turn @ motion.translation + change[3:]
        motion = Registration(turn @ motion.rotation, place, motion.score)
    return motion
