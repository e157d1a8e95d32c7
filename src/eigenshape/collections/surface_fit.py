"""One surface bent onto another by stiff, smooth displacements, from coarse to fine."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve
from scipy.linalg.blas import dsyrk

from certeig.kit.arrays import ReadOnly, record
from certeig.kit.errors import CerteigError
from certeig.kit.threads import one_blas_thread
from eigenshape._corners import mean_normals
from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import area_vectors, mean_radius, row_dots, sum_rows, unit_vectors
from eigenshape.collections.alignment import (
    MIRROR,
    ON_SURFACE,
    Side,
    Similarity,
    align_surfaces,
)
from eigenshape.collections.spread_points import (
    Pairing,
    join_normals,
    spread_points,
)
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.closest import closest_points
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import dual_volumes
from eigenshape.geometry.topology import boundary_vertices, edge_table
from eigenshape.matching.match import match_shapes
from eigenshape.matching.target import prepare_target


# Lengths are in units of the root mean square distance of the placed source from its middle. All
# numbers were chosen on the tuning half of experiments/ch7_collection.
class Level(NamedTuple):
    """One step from coarse to fine."""

    width: float  # of the displacements
    reach: float  # distance at which a pair counts a quarter
    stiffness: float  # per pair; a looser surface falls into pores and onto inner walls
    n_rounds: int = 6  # of pairs and displacements
    n_points: int = 6000  # of each surface


Levels: TypeAlias = tuple[Level, ...]
LEVELS: Levels = (
    Level(0.90, 0.45, 0.0042),
    Level(0.60, 0.30, 0.0021),
    Level(0.37, 0.18, 0.00125),
    Level(0.24, 0.12, 0.00125),
)
# Share of a gap along the surface that counts: nearest points slide wrongly more often than rightly.
SLIDE = 0.2
SPACING = 0.7  # of centers of displacements, in widths
POINTS_AT_ONCE = 250  # whose kernels are computed; more leave the cache, and take longer
FAR = 0.05  # gap at which the confidence is at most a quarter
ON_RIM = 1e-9  # weight of inner vertices below which a point lies on the boundary of a surface
UNMATCHED = 0.1  # distance from which a point has no counterpart
# Root mean square of the logarithms by which edges at a vertex became longer, from which it has no
# counterpart: skulls and creatures in other poses have at most 0.2 (0.26 if 40 % are cut off), a side
# that is folded onto the other one, since it is missing, 0.34 in the median.
FOLDED = 0.3
# Misfit after bending from which the poses may differ, so that another start is tried, and from
# which a form is of another kind: skulls of mice have 0.01 to 0.02, creatures in another pose 0.01
# to 0.04, other kinds 0.25 to 0.55.
POSES_DIFFER, NOT_ALIKE = 0.03, 0.15
# Strain from which they may differ, too. Bipeds in another pose, placed back to front and bent until
# they lay on the other one, had a misfit of 0.02 and a strain of 0.09 to 0.13; whole skulls have at
# most 0.06, hands of other individuals 0.09. Too low a number only costs time.
STRAINED = 0.09
MOST_MISSING = 0.75  # of the source's area: front halves of skulls lack 0.64, misplaced skulls 0.9
# Misfit of one side in another pose, as a share of that of the other one, that tells which it is
CLEAR_MISFIT = 0.7


@record
class SurfaceFit(ReadOnly):
    """A surface that was bent onto another.

    Attributes
    ----------
    vertices : (n, 3) float
        The vertices of the source on or near the target.
    gaps : (n,) float
        Distance of each to the target, in length of the target.
    confidence : (n,) float
        From 1, on the target and facing the same way, to 0: min(2 cos⁺, 1) / (1 + (gap / 0.05 r)²)²,
        with the angle of the normals there and the root mean square radius r. 0 beyond a boundary of the
        target, or where the source is folded.
    gap : float
        0 to 1: the mean of d² / (d² + (0.1 r)²), with the distance d of the target's points to the
        bent source.
    strain : float
        Standard deviation of the logarithms by which edges became longer, where nothing is missing.
    missing : float
        Share of the source's area that is beyond a boundary of the target, more than 0.1 r away, or
        folded: lengths changed by a third.
    excess : float
        Share of the target's area that is more than 0.1 r from the source.
    side : "same", "mirrored" or "cannot be told"
        Whether the target is a mirror image of the source's kind. It cannot be told if both sides
        of the form are alike; the source is not mirrored then.
    method : "position" or "intrinsic"
        Whether a similarity was the start, or `match_shapes`, since the poses differ.
    n_ways : float
        How many fits are equally good, since the source or the target can be turned into itself, as
        of `Similarity`: the points that correspond are those of one of these fits.

    See Also
    --------
    fit_surface

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> ball = es.icosphere(3)
    >>> egg = es.TriangleMesh(ball.vertices * [1, 1.3, 1], ball.faces)
    >>> fit = es.collections.fit_surface(ball, egg)
    >>> bool(np.median(fit.gaps) < 0.05), fit.missing
    (True, 0.0)
    """

    vertices: Float[np.ndarray, "n 3"]
    gaps: Float[np.ndarray, " n"]
    confidence: Float[np.ndarray, " n"]
    gap: float
    strain: float
    missing: float
    excess: float
    side: Side
    method: Literal["position", "intrinsic"]
    n_ways: float = 1.0

    @property
    def misfit(self) -> float:
        """The gap and the square of the strain: 0.01 to 0.02 between skulls of mice, 0.25 to a hand."""
        return self.gap + self.strain**2

    @property
    def reflected(self) -> bool:
        """Whether the source was reflected first."""
        return self.side == "mirrored"


@one_blas_thread()
def fit_surface(source: MeshLike, target: MeshLike, *, mirrored: bool | None = None) -> SurfaceFit:
    """Bend a surface onto another of nearly its form, as a bone onto that of another animal.

    1. `align_surfaces` places the target on the source: any unit, any turn, mirror images too.
    2. Points of both surfaces are paired with the nearest ones of the other that face the same way.
       The displacement is a sum of Gaussian kernels that closes the gaps along the normals of the
       target, with a penalty on its energy (the regularization of coherent point drift, Myronenko
       and Song 2010). Kernels become narrower in four levels. Pairs count less with their distance
       and with the angle of their normals, so that what has no partner hardly acts: loose pieces,
       pores, what is missing.
    3. If parts of the target are not reached or the source is strained, the poses may differ:
       `match_shapes` gives another start, for the mirror image, too. The result with the smaller
       `misfit` is returned; `method` and `side` say which.

    Parameters
    ----------
    source : MeshLike
        Complete, of about 2,000 to 20,000 vertices; `es.geometry.decimate` makes a smaller one.
    target : MeshLike
        Of any number of faces and any topology. Parts may be missing. Faces of both look outward.
    mirrored : bool, optional
        Whether the target is a mirror image, where that is known. By default both are tried.

    Returns
    -------
    SurfaceFit

    Raises
    ------
    InvalidShapeError
        If a surface has no area, or the target is of another form.

    See Also
    --------
    build_collection : Fit many surfaces, and fit them again from their mean.
    es.match_shapes : Maps between poses alone.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> one, other = (
    ...     es.make_creature("hand", individual=i, n_vertices=1000) for i in (0, 1)
    ... )
    >>> fit = es.collections.fit_surface(one, other)
    >>> bool(np.median(fit.gaps) < 0.01), fit.method, fit.side
    (True, 'position', 'same')
    """
    source, target = as_mesh(source, "source"), as_mesh(target, "target")
    placing = align_surfaces(target, source, mirrored=mirrored)
    fit = replace(bend_placed(source, placing, target, LEVELS), side=placing.side)
    # No placing of a form of revolution is back to front, and its strain is that of the forms.
    doubtful = fit.misfit > POSES_DIFFER or fit.strain > STRAINED
    if np.isinf(placing.n_ways):
        doubtful = fit.gap > POSES_DIFFER
    if doubtful:
        # The mirror image of a form that can be turned into itself and into it is the form again.
        is_even = placing.n_ways > 1 and placing.side == "cannot be told"
        sides = (False, True) if mirrored is None and not is_even else (bool(mirrored),)
        posed = _posed_fits(source, target, sides)
        if len(posed) == 2:
            upright, reflected = (each.misfit for each in posed)
            is_clear = min(upright, reflected) < CLEAR_MISFIT * max(upright, reflected)
            # Of two that fit as well, the one that is not mirrored
            posed = [min(posed, key=lambda each: each.misfit)] if is_clear else posed[:1]
            is_even = not is_clear
        if is_even and mirrored is None:
            posed = [replace(each, side="cannot be told") for each in posed]
        fit = min([fit, *posed], key=lambda each: each.misfit)
    if fit.misfit > NOT_ALIKE or fit.missing > MOST_MISSING:
        raise InvalidShapeError(
            "The target must have about the form of the source, which is the template in a "
            "collection, and half of it at least; after "
            f"bending the misfit is {fit.misfit:.3f}, the most is {NOT_ALIKE}, and {fit.missing:.0%} "
            f"of the source is missing, the most is {MOST_MISSING:.0%}."
        )
    return replace(fit, n_ways=placing.n_ways)


def _posed_fits(
    source: TriangleMesh, target: TriangleMesh, sides: Sequence[bool]
) -> list[SurfaceFit]:
    """Bend a source, or its mirror image, onto a target in another pose, from where `match_shapes` puts it."""
    fits = []
    with suppress(CerteigError):  # what it refuses, such as needles, is no fault here
        whole = prepare_target(target)
        for mirrored in sides:
            if mirrored:
                source = TriangleMesh(source.vertices @ MIRROR, source.faces[:, ::-1])
            image = match_shapes(source, whole, mirrored=False).pull(target.vertices)
            fit = bend_onto(source, image, target, LEVELS)
            side: Side = "mirrored" if mirrored else "same"
            fits.append(replace(fit, method="intrinsic", side=side))
    return fits


def bend_placed(
    source: TriangleMesh, found: Similarity, target: TriangleMesh, levels: Levels
) -> SurfaceFit:
    """Bend a source onto a target that a similarity places on it."""
    start = found.inverse().move(source.vertices)
    # A reflected surface faces outward if its faces are turned.
    faces = source.faces[:, ::-1] if found.reflected else source.faces
    return bend_onto(TriangleMesh(source.vertices, faces), start, target, levels)


def bend_onto(
    source: TriangleMesh, start: Float[np.ndarray, "n 3"], target: TriangleMesh, levels: Levels
) -> SurfaceFit:
    """Bend a source onto a target, from where its vertices lie nearly on it."""
    placed = TriangleMesh(start, source.faces)
    samples = {
        n: (spread_points(placed, n).places, spread_points(target, n))
        for n in {level.n_points for level in levels}
    }
    rough = samples[levels[0].n_points][0].points
    middle, size = rough.mean(axis=0), mean_radius(rough)
    vertices = (placed.vertices - middle) / size
    for width, reach, stiffness, n_rounds, n_points in levels:
        places, theirs = samples[n_points]
        faces, shares = placed.faces[places.simplices], places.weights
        ends = (theirs.points - middle) / size
        points = np.einsum("pc,pcd->pd", shares, vertices[faces])
        # One center in each cell of a grid, at the first of the points in it
        cells = np.floor(points / (SPACING * width)).astype(np.int64)
        centers = points[np.unique(cells, axis=0, return_index=True)[1]]
        pairing = None
        for _ in range(n_rounds):
            normals = unit_vectors(area_vectors(vertices[faces]))
            with_normals = join_normals(points, normals)
            pairing = pairing or Pairing(with_normals, join_normals(ends, theirs.normals))
            start, end, distances = pairing.pair(with_normals)
            facing = theirs.normals[end]
            weights = (1 + (distances / reach) ** 2) ** -2
            weights *= np.clip(row_dots(normals[start], facing), 0, 1)
            gaps = ends[end] - points[start]
            along = row_dots(gaps, facing)[:, None] * facing
            wanted = weights[:, None] * (along + SLIDE * (gaps - along))
            # Pairs of one point are summed before the kernels are multiplied.
            pull = sum_rows(start, np.column_stack([weights, wanted]), n_points)
            at_centers = _kernel(centers, centers, width)
            energy = stiffness * len(start) * at_centers
            shifts = _solve_shifts(points, centers, width, energy, pull)
            for some in _blocks(len(vertices)):
                vertices[some] += _kernel(vertices[some], centers, width) @ shifts
            points = np.einsum("pc,pcd->pd", shares, vertices[faces])
            centers = centers + at_centers @ shifts

    bent = TriangleMesh(vertices, placed.faces)
    far = np.linalg.norm(closest_points(bent, ends).points - ends, axis=1)
    moved = middle + size * vertices
    nearest = closest_points(target, moved)
    gaps = np.linalg.norm(nearest.points - moved, axis=1)
    normals = unit_vectors(area_vectors(target.vertices[target.faces[nearest.simplices]]))
    cosines = row_dots(mean_normals(bent), normals)
    # What is nearest to a boundary is beyond it.
    inside = ~np.isin(np.arange(target.n_vertices), boundary_vertices(target))
    beyond = np.sum(nearest.weights * inside[target.faces[nearest.simplices]], axis=1) < ON_RIM
    confidence = np.clip(2 * cosines, 0, 1) * (1 + (gaps / (FAR * size)) ** 2) ** -2
    edges, stretch, strains = _stretches(source, vertices)
    folded = strains > FOLDED
    unreached = beyond | (gaps > UNMATCHED * size)
    areas = dual_volumes(placed)
    # Folds count: most of a form of another kind would be one.
    stretch = stretch[~unreached[edges].any(axis=1)]
    return SurfaceFit(
        vertices=moved,
        gaps=gaps,
        confidence=np.where(beyond | folded, 0, confidence),
        gap=float(np.mean(far**2 / (far**2 + ON_SURFACE**2))),
        strain=float(np.std(stretch)) if len(stretch) else 1.0,
        missing=float(areas @ (unreached | folded) / areas.sum()),
        excess=float(np.mean(far > UNMATCHED)),
        side="same",
        method="position",
    )


def _stretches(
    source: TriangleMesh, vertices: Float[np.ndarray, "n 3"]
) -> tuple[Int[np.ndarray, "e 2"], Float[np.ndarray, " e"], Float[np.ndarray, " n"]]:
    """Return edges, the logarithms by which they became longer, and these in the mean at vertices.

    They are less their median. The means are roots of mean squares.
    """
    edges = edge_table(source).edges
    before, after = (
        np.linalg.norm(np.subtract(*points[edges.T]), axis=1)
        for points in (source.vertices, vertices)
    )
    known = (before > 0) & (after > 0)
    stretch = np.log(after[known] / before[known])
    stretch -= np.median(stretch) if len(stretch) else 0.0
    edges = edges[known]
    degrees = np.bincount(edges.ravel(), minlength=len(vertices))
    squares = np.bincount(edges.ravel(), np.repeat(stretch**2, 2), len(vertices))
    return edges, stretch, np.sqrt(squares / np.maximum(degrees, 1))


def _solve_shifts(
    points: Float[np.ndarray, "k 3"],
    centers: Float[np.ndarray, "m 3"],
    width: float,
    energy: Float[np.ndarray, "m m"],
    pull: Float[np.ndarray, "k 4"],
) -> Float[np.ndarray, "m 3"]:
    """Return the shifts of centers, given the weight of each point and the weighted pull on it."""
    system, sides = energy.T, np.zeros_like(centers)  # columns in a row, as BLAS has them
    for some in _blocks(len(points)):
        near = _kernel(points[some], centers, width)
        sides += near.T @ pull[some, 1:]
        near *= np.sqrt(pull[some, :1])
        system = dsyrk(1.0, near.T, 1.0, system, overwrite_c=True)  # the upper half
    system[np.diag_indices_from(system)] += 1e-6
    return solve(system, sides, assume_a="pos", overwrite_a=True)


def _blocks(count: int) -> list[Int[np.ndarray, " b"]]:
    """Divide points into blocks whose kernels stay in the cache."""
    return np.array_split(np.arange(count), count // POINTS_AT_ONCE + 1)


def _kernel(
    points: Float[np.ndarray, "k 3"], centers: Float[np.ndarray, "m 3"], width: float
) -> Float[np.ndarray, "k m"]:
    # All exponents by one product: (2 p·c - |p|² - |c|²) / 2 width²
    ones = [np.ones((len(each), 1)) for each in (points, centers)]
    squares = [np.sum(each**2, axis=1, keepdims=True) for each in (points, centers)]
    left = np.hstack([2 * points, -squares[0], ones[0]]) / (2 * width**2)
    exponents = left @ np.hstack([centers, ones[1], -squares[1]]).T
    np.minimum(exponents, 0, out=exponents)
    return np.exp(exponents, out=exponents)
