"""Rigid turns of a part on a whole: they decide what bending leaves open.

Bending forgives a roll about a long axis, and another place on a smooth surface. A rigid turn does
not: how far points and normals stay from the whole tells turns and places apart.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from certeig.kit.arrays import record
from eigenshape._vectors import nearest_rotations
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.matching.fitting import LARGEST_GAP, Fit, FitPlan
from eigenshape.matching.spectral_refinement import places_in_faces

N_ROLLS = 12  # about the long axis, each also with the ends exchanged
N_ROLLED = 80  # samples by which rolls are compared
# Steps of nearest points: a roll of 15 degrees settles in six, a slip along a bone in 20.
N_ROLL_STEPS, N_STEPS, N_EXACT_STEPS = 6, 20, 6
# Mean distance from the surface up to which a turn is the whole answer, in roots of the part's area. Copies
# with other triangles have 1e-4 to 1e-3; other poses, other bones and mirror images have 7e-3 and more.
RIGID = 0.003
# Up to this distance the corners of long thin triangles, as of an export, may be what keeps a turn away
PERHAPS_RIGID = 4 * RIGID
# Mean distance, in units, up to which rolls are tried: two metacarpals have 0.014, two poses of an animal 0.03.
NEARLY_RIGID = 0.025
# Places farther apart than this, in units, are different ones: 0.05 √area, as in the confidence. Two turns
# differ if they place samples so far apart on average.
OTHER_PLACE = 0.06


@record
class Turn:
    """A rigid motion x ↦ R x + t of a part, and how far it leaves points from the surface, in units.

    `nearest` is the vertex of the whole that is nearest to each of these points, by normals, too. `exact`
    says that nearest points were sought on all faces, not only at that vertex.
    """

    rotation: Float[np.ndarray, "3 3"]
    shift: Float[np.ndarray, " 3"]
    nearest: Int[np.ndarray, " v"]
    gap: float = np.inf
    exact: bool = False

    def move(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Return where points go."""
        return points @ self.rotation.T + self.shift


def settle(
    plan: FitPlan,
    ends: Float[np.ndarray, "v 3"],
    vertices: Int[np.ndarray, " v"],
    steps: int,
    *,
    exact: bool = False,
) -> Turn:
    """Turn vertices of a part to given places, then by nearest points that face the same way.

    That is Kabsch 1976 in each step of Besl and McKay 1992.
    """
    part, whole = plan.part, plan.whole.mesh
    starts, weights = part.mesh.vertices[vertices], part.areas[vertices]
    weights = weights / weights.sum()
    middle, nearest = weights @ starts, np.zeros(len(starts), dtype=np.int64)
    for step in range(steps):
        target = weights @ ends
        products = ((ends - target) * weights[:, None]).T @ (starts - middle)
        rotation = nearest_rotations(products[None])[0]
        points = target + (starts - middle) @ rotation.T
        normals = part.normals[vertices] @ rotation.T
        nearest = plan.nearest(points, normals, nearest)[1]
        ends = whole.vertices[nearest]
        # Vertices show the way; on a coarse whole, the surface between them ends it.
        if exact:
            ends = closest_points(whole, points).points
        elif 2 * step + 1 >= steps:
            faces, shares = places_in_faces(whole, whole.vertices, points, nearest)
            ends = np.einsum("vc,vcd->vd", shares, whole.vertices[whole.faces[faces]])
    gap = float(weights @ np.linalg.norm(points - ends, axis=1))
    return Turn(rotation, target - rotation @ middle, nearest, gap, exact)


def settle_map(plan: FitPlan, places: Int[np.ndarray, " n"]) -> Turn:
    """Return the turn in which a map settles."""
    turn = settle(plan, plan.whole.mesh.vertices[places[plan.samples]], plan.samples, N_STEPS)
    if is_rigid(plan, turn) or not is_rigid(plan, turn, PERHAPS_RIGID):
        return turn
    samples = turn.move(plan.part.mesh.vertices[plan.samples])
    exact = settle(plan, samples, plan.samples, N_EXACT_STEPS, exact=True)
    return exact if is_rigid(plan, exact) else turn


def is_rigid(plan: FitPlan, turn: Turn, most: float = RIGID) -> bool:
    """Return whether a turn alone places the part as well as can be expected."""
    return turn.gap < most * float(np.sqrt(plan.part.area))


def turned_fit(plan: FitPlan, turn: Turn) -> Fit:
    """Return a turn of all vertices as a fit without strain, whose misfit is the gap."""
    vertices = np.arange(plan.part.mesh.n_vertices)
    final = settle(plan, turn.move(plan.part.mesh.vertices), vertices, 1, exact=turn.exact)
    points = final.move(plan.part.mesh.vertices)
    gaps = np.linalg.norm(points - plan.whole.mesh.vertices[final.nearest], axis=1)
    return Fit(points, final.nearest, np.minimum(gaps, LARGEST_GAP), final.gap)


def rolled_turns(plan: FitPlan, turn: Turn) -> list[Turn]:
    """Return turns that differ, settled from rolls of one about the long axis, the best first."""
    vertices = plan.samples[:: max(len(plan.samples) // N_ROLLED, 1)]
    points = plan.part.mesh.vertices[vertices]
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    found = []
    for flip in (0.0, np.pi):
        for angle in 2 * np.pi * np.arange(N_ROLLS) / N_ROLLS:
            roll = Rotation.from_rotvec(flip * axes[1]) * Rotation.from_rotvec(angle * axes[0])
            rolled = middle + (points - middle) @ roll.as_matrix().T
            found.append(settle(plan, turn.move(rolled), vertices, N_ROLL_STEPS))
    kept: list[Turn] = []
    for one in sorted(found, key=lambda one: one.gap):
        moved = one.move(points)
        away = [np.linalg.norm(moved - other.move(points), axis=1).mean() for other in kept]
        if min(away, default=np.inf) > OTHER_PLACE:
            kept.append(one)
    return kept
