"""Tell a shape from its mirror image by the points of two descriptors."""

import numpy as np
from jaxtyping import Complex64, Int

from certeig.kit.threads import one_blas_thread
from eigenshape._vectors import frames_across, unit_vectors
from eigenshape.retrieval.patches.matching import (
    SIZE_STEP,
    PatchPoints,
    best_start,
    best_supported,
    squared_distances,
    squared_strains,
)

N_POINTS = 150  # that are asked, at most: the first samples of a surface, which lie apart
# Partners that are tried for each point; of 8, more support a wrong side
N_PARTNERS = 5
ROUNDS = 12  # of the iteration that chooses among them; 30 tell no more
# Nothing is said of shapes that agree by less; unrelated ones agree by 0.05, two octopuses by 0.11.
LEAST_AGREEMENT = 0.12
# How many times the support of the other side one side must have: so much where points are the same, and
# so much more where nothing agrees. Of 49 shapes with other triangles (bones, stones, machine parts, scans,
# creatures in two poses), a lumbar vertebra, whose halves are alike, had 1.18 on the wrong side at an
# agreement of 0.2; rods and hands have less on the right side, and nothing is said of them.
CLEAR, DOUBT = 1.02, 0.28
# A surface whose mean normal is longer than this is a sheet: it may be turned over.
SHEET = 0.95


@one_blas_thread()
def is_mirror_image(first: PatchPoints, second: PatchPoints) -> bool | None:
    """Say whether a shape is rather like the mirror image of another one.

    Patches and distances are the same in a mirror; directions on the surface, seen from outside, turn
    the other way round. Pairs of points support each other as far as their distances agree and one turn
    at each point takes its directions to those on the other shape, or to those of its mirror image.

    Returns
    -------
    bool or None
        None if it cannot be told: both sides are alike, as of an animal, hardly anything agrees, or the
        surface is a sheet.
    """
    start = best_start(first, second)
    if start.agreement < LEAST_AGREEMENT or _is_sheet(first) or _is_sheet(second):
        return None
    costs = squared_distances(first, second, start.step)[:N_POINTS, :N_POINTS]
    n_partners = min(N_PARTNERS, costs.shape[1])
    partners = np.argsort(costs, axis=1, kind="stable")[:, :n_partners].ravel()
    points = np.repeat(np.arange(len(costs)), n_partners)
    one, two = np.ix_(points, points), np.ix_(partners, partners)
    lengths = np.float32(SIZE_STEP**start.step) * first.distances[one], second.distances[two]
    apart = (points[:, None] != points) & (partners[:, None] != partners)
    agreeing = apart * (1 - squared_strains(*lengths))
    ours, theirs = _directions(first)[one], _directions(second)[two]
    same, mirrored = (
        _support(agreeing * turned * theirs, points) for turned in (np.conj(ours), ours)
    )
    clear = CLEAR + DOUBT * (1 - start.agreement)
    if max(same, mirrored) <= clear * min(same, mirrored):
        return None
    return mirrored > same


def _is_sheet(points: PatchPoints) -> bool:
    return bool(np.linalg.norm(points.normals.mean(axis=0)) > SHEET)


def _directions(points: PatchPoints) -> Complex64[np.ndarray, "m m"]:
    """Return the direction at each point towards each other one, in the plane across its normal.

    It is shorter the more steeply the other point lies above or below.
    """
    firsts, seconds = frames_across(unit_vectors(points.normals)).transpose(1, 0, 2)
    arms = points.places[None] - points.places[:, None]
    flat = np.einsum("ijk,ik->ij", arms, firsts) + 1j * np.einsum("ijk,ik->ij", arms, seconds)
    lengths = np.linalg.norm(arms, axis=2)
    return np.asarray(flat / np.where(lengths > 0, lengths, 1), dtype=np.complex64)


def _support(coupling: Complex64[np.ndarray, "c c"], points: Int[np.ndarray, " c"]) -> float:
    """Return the support that the best pair of each point gets from those of the others."""
    _, chosen = best_supported(coupling, points, ROUNDS)
    return float(np.abs(coupling[np.ix_(chosen, chosen)].sum(axis=1)).sum())
