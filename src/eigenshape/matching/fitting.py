"""A part bent onto a whole: from the map, then to nearest points. What is left tells good from bad.

The part is carried by rigid frames at its points (embedded deformation, Sumner, Schmid and Pauly
2007) that stay alike between neighbors (Sorkine and Alexa 2007), and is drawn to the nearest points
of the whole that face the same way (non-rigid registration, compare Li, Sumner and Pauly 2008).
A wrong map needs strong bending and stays far from the whole, so that few wrong ones pass.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int

from certeig.kit.arrays import TINY, record
from eigenshape._vectors import nearest_rotations
from eigenshape.matching.fitting_loops import Carried, Edges, bend_frames, carry_vertices
from eigenshape.matching.match_loops import nearest_rows
from eigenshape.matching.surface import NORMAL_LENGTH, Surface

N_LINKS = 6  # nearest points that a frame stays alike to
N_CARRIERS = 4  # frames that carry a vertex
MOST_SAMPLES = 600  # vertices that are drawn to the whole; all are carried
N_ROUGH_FRAMES, N_ROUGH_SAMPLES = 100, 200  # of a rough bend
# How much neighboring frames resist, beside a pull of 1 in all: ever less, so that large moves come
# first. Three times more or less changed no error by more than 0.2.
STIFFNESS = (1.0, 0.3, 0.1, 0.05, 0.03, 0.02, 0.02, 0.02, 0.02, 0.02)
# Of the best map, the part slides at last: hardly held along the surface, in more and stiffer steps.
# On 36 hard pairs of the tuning half mean errors fall from 9.3 to 9.0, and from 4.3 to 3.9 where maps
# are about right. Maps are not compared after that: wrong ones slide into less misfit than right ones
# (mean error of scans 12 in place of 9).
SLIDING_STIFFNESS = (
    (1.0,) * 6 + (0.5,) * 4 + (0.3,) * 4 + (0.1,) * 4 + (0.05, 0.03, 0.02, 0.02, 0.02)
)
# Share of a step along the surface; the rest is towards its plane
ALONG, SLIDING_ALONG = 0.5, 0.1
LARGEST_GAP = 0.2  # units: longer gaps say no more


@record
class FitPlan:
    """What fits of one part on one whole share: samples and frames.

    `frames` are vertices of the part, its first points, which turn and move; `samples` are vertices
    that are pulled onto the whole, each by its share `pull` of their area. Row v of `carriers` holds the frames that
    carry vertex v, and `portions` how far; `arms` go from frames to the samples that they carry. `edges` are
    the frames at both ends of each edge, by which frames hold each other, both ways; the way from the first
    to the second; and the Laplacian of this graph. All ways are those before bending.
    Gaps are measured at the vertices `compared`, each of which stands for a share of the area.
    Only the vertices `inner` of the whole draw samples.
    """

    part: Surface
    whole: Surface
    frames: Int[np.ndarray, " m"]
    samples: Int[np.ndarray, " s"]
    pull: Float[np.ndarray, " s"]
    carriers: Int[np.ndarray, "n c"]
    portions: Float[np.ndarray, "n c"]
    arms: Float[np.ndarray, "s c 3"]
    edges: Edges
    compared: Int[np.ndarray, " v"]
    shares: Float[np.ndarray, " v"]
    inner: Bool[np.ndarray, " k"]

    @property
    def carried(self) -> Carried:
        """All vertices of the part and their normals, the frames, and how these carry vertices."""
        return (
            self.part.mesh.vertices,
            self.part.normals,
            self.frames,
            self.carriers,
            self.portions,
        )

    def nearest(
        self,
        points: Float[np.ndarray, "k 3"],
        normals: Float[np.ndarray, "k 3"],
        guess: Int[np.ndarray, " k"] | None = None,
    ) -> tuple[Float[np.ndarray, " k"], Int[np.ndarray, " k"]]:
        """Return how far the nearest vertex of the whole that faces the same way is, and which."""
        return self.whole.tree().nearest(np.hstack([points, NORMAL_LENGTH * normals]), guess)


@record
class Fit:
    """A part bent onto a whole.

    `points` are where the compared vertices of the part come to lie, `places` the vertices of the
    whole that are nearest to them, `gaps` how far they stay from there, in units, with their
    normals. `misfit` is the mean gap times the root of the strain.
    """

    points: Float[np.ndarray, "v 3"]
    places: Int[np.ndarray, " v"]
    gaps: Float[np.ndarray, " v"]
    misfit: float

    def select(self, chosen: Int[np.ndarray, " k"]) -> "Fit":
        """Return the same fit at some of its vertices."""
        return Fit(self.points[chosen], self.places[chosen], self.gaps[chosen], self.misfit)


def plan_fit(part: Surface, whole: Surface) -> FitPlan:
    """Prepare to bend a part onto a whole, with a frame at each of its points."""
    n = part.mesh.n_vertices
    return _plan(part, whole, len(part.points), MOST_SAMPLES, np.arange(n), part.areas)


def plan_rough_fit(part: Surface, whole: Surface) -> FitPlan:
    """Prepare to bend a part with few frames, and to compare its points alone."""
    cells = np.bincount(part.nearest, weights=part.areas, minlength=len(part.points))
    return _plan(part, whole, N_ROUGH_FRAMES, N_ROUGH_SAMPLES, part.points, cells)


def _plan(
    part: Surface,
    whole: Surface,
    n_frames: int,
    n_samples: int,
    compared: Int[np.ndarray, " v"],
    areas_compared: Float[np.ndarray, " v"],
) -> FitPlan:
    frames = part.points[:n_frames]
    n, m = part.mesh.n_vertices, len(frames)
    samples = np.unique(np.linspace(0, n - 1, min(n, n_samples)).astype(np.int64))
    # The nearest frames carry a vertex. A frame lets go of a vertex that is as far from it as from
    # the next frame.
    nearest = nearest_rows(part.distances[:m], min(N_CARRIERS, m - 1) + 1)
    lengths = np.take_along_axis(part.distances[:m].T, nearest, axis=1).astype(np.float64)
    portions = np.maximum(1 - lengths[:, :-1] / np.maximum(lengths[:, -1:], TINY), 1e-4) ** 2
    portions /= portions.sum(axis=1, keepdims=True)
    carriers = np.ascontiguousarray(nearest[:, :-1])
    near = np.argsort(part.between[:m, :m], axis=1, kind="stable")[:, 1 : N_LINKS + 1]
    starts, ends = np.repeat(np.arange(m), near.shape[1]), near.ravel()
    one, two = np.concatenate([starts, ends]), np.concatenate([ends, starts])
    ones = np.full(len(one), 2 / len(one))  # each edge is there both ways
    weights = sp.coo_array((ones, (one, two)), shape=(m, m)).toarray()
    areas = part.areas[samples]
    vertices, centers = part.mesh.vertices, part.mesh.vertices[frames]
    return FitPlan(
        part,
        whole,
        frames,
        samples,
        areas / areas.sum(),
        carriers,
        portions,
        vertices[samples][:, None] - centers[carriers[samples]],
        (one, two, centers[two] - centers[one], np.diag(weights.sum(axis=1)) - weights),
        compared,
        areas_compared / areas_compared.sum(),
        np.ones(whole.mesh.n_vertices, dtype=bool),
    )


def fit_part(plan: FitPlan, ends: Int[np.ndarray, " m"]) -> Fit:
    """Bend a part, given the vertices of the whole where its frames lie by a map."""
    return bend_part(plan, ends, STIFFNESS, ALONG)


def slide_part(plan: FitPlan, fit: Fit) -> Fit:
    """Bend a part anew from where a fit of all its vertices places it, nearly free to slide.

    The misfit stays that of the given fit, so that it compares with those of other maps.
    """
    slid = bend_part(plan, fit.places[plan.frames], SLIDING_STIFFNESS, SLIDING_ALONG)
    return replace(slid, misfit=fit.misfit)


def bend_part(
    plan: FitPlan, ends: Int[np.ndarray, " m"], stiffnesses: tuple[float, ...], along: float
) -> Fit:
    """Bend a part step by step, ever less stiff."""
    part, whole, pull = plan.part, plan.whole, plan.pull
    # Each sample goes where the frames that carry it go.
    carriers, portions = plan.carriers[plan.samples], plan.portions[plan.samples]
    targets = np.einsum("sc,scd->sd", portions, whole.mesh.vertices[ends[carriers]])

    # Start with the rigid motion that brings samples nearest to their targets (Kabsch 1976).
    samples, frames = part.mesh.vertices[plan.samples], part.mesh.vertices[plan.frames]
    middle, target = pull @ samples, pull @ targets
    products = ((targets - target) * pull[:, None]).T @ (samples - middle)
    turn = nearest_rotations(products[None])[0]
    turns = np.repeat(turn[None], len(frames), axis=0)
    places = target + (frames - middle) @ turn.T
    bend_frames(
        plan.carried,
        (plan.samples, plan.pull, plan.arms),
        plan.edges,
        (whole.mesh.vertices, whole.normals, plan.inner),
        whole.tree(),
        NORMAL_LENGTH,
        np.array(stiffnesses),
        along,
        targets,
        turns,
        places,
    )

    points, normals = np.empty((2, len(plan.compared), 3))
    carry_vertices(turns, places, plan.carried, plan.compared, points, normals)
    gaps, found = plan.nearest(points, normals)
    gaps = np.minimum(gaps, LARGEST_GAP)
    # Strain: how far edges are from what their frames make of them, as a share of squares
    one, two, links, _ = plan.edges
    wrong = np.einsum("eij,ej->ei", turns[one], links) - (places[two] - places[one])
    strain = float((wrong**2).sum() / max(float((links**2).sum()), TINY))
    return Fit(points, found, gaps, float(plan.shares @ gaps * np.sqrt(strain)))
