"""Bind regions to handles: by how much each vertex follows each handle."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._arguments import describe_value, require_type
from eigenshape._arrays import ReadOnly, record, whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape._typing import Integer
from eigenshape.deformation.region import Region, region_mask, require_boundary
from eigenshape.deformation.rig import EigenRig
from eigenshape.deformation.rigidity import (
    FreePart,
    free_part,
    pull_part,
    require_fixed_vertices,
)
from eigenshape.geometry.distances.geodesic import geodesic_distances

# (least extent of a region over that of the rest, number of modes): the rule of thesis 6.3.2.
MODE_RULE = ((0.75, 8), (0.1, 50), (0.0, 300))
# A vertex with a share below this, or above 1 minus this, stays exactly or follows exactly. Edge
# errors were 3 to 18 % higher with 0.05 and 16 to 30 % higher with 0.1
# (experiments/ch6_deformation).
CLIP = 0.02
# The fit must vary by more than this share of its best value between the region and the rest. Less
# is rounding: the modes are constant there.
LEAST_CONTRAST = 1e-9
# Weight of smoothness where the fit has no data, against the fit where it has. A larger value blurs
# the regions.
SMOOTHNESS = 1e-3
# Share of the depth of a region, or of the rest if that is less deep, up to which vertices on
# either side of the boundary are free. Of 0.3, 0.5 and 0.7, on scenes of experiments/ch6_deformation
# at 2,000 to 6,000 vertices: 0.3 changes edge errors little, 0.5 divides them by 1.3 to 1.8 on six
# of eight, 0.7 by more, but then little of a region follows its handle exactly.
FREE_DEPTH = 0.5


@record
class Binding(ReadOnly):
    """Regions of a rig that handles can move.

    Attributes
    ----------
    rig : EigenRig
    regions : (r, n) bool
        The vertices of each region.
    n_modes : (r,) int
        Number of modes that spread the motion of each region.
    distances : (r, n) float
        Geodesic distance of each vertex to the boundary of each region, in length.
    shares : (r, n) float
        By how much each vertex follows each handle, 0 to 1.
    part : FreePart
        The free vertices and their equations. The others stay or follow a handle exactly (`held`).

    See Also
    --------
    bind : Compute a binding.
    bend : Move the bound regions.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> binding = es.deformation.bind(es.rig_shape(mesh), [mesh.vertices[:, 2] > 0.2])
    >>> float(binding.shares.min()), float(binding.shares.max())
    (0.0, 1.0)
    """

    rig: EigenRig
    regions: Bool[np.ndarray, "r n"]
    n_modes: Int[np.ndarray, " r"]
    distances: Float[np.ndarray, "r n"]
    shares: Float[np.ndarray, "r n"]
    part: FreePart

    @property
    def held(self) -> Bool[np.ndarray, " n"]:
        """Whether each vertex stays, at a share of 0, or follows a handle exactly, at a share of 1."""
        held = np.ones(self.rig.mesh.n_vertices, dtype=bool)
        held[self.part.free] = False
        return held


@one_blas_thread()
def bind(
    rig: EigenRig,
    regions: Sequence[Region],
    *,
    fixed: Region | None = None,
    n_modes: Integer | None = None,
) -> Binding:
    """Compute by how much each vertex follows the handles of some regions.

    The indicator function of a region is fitted by the lowest modes. The fit falls smoothly from 1
    to 0 across the boundary of the region: few modes spread the bend over a wide band, many modes
    over a narrow one. Without `fixed`, all vertices outside the regions are fitted to 0. With
    `fixed`, only the fixed vertices are, and the others follow smoothly.

    Vertices of a share between 0 and 1 are free: `bend` places them so that edges change little.
    Without `fixed`, so are all vertices that are nearer to the boundary of a region than half of
    the region's depth, or of that of the rest if it is less deep: the more vertices are free, the
    less edges change. All other vertices are held (`Binding.held`): they stay, or follow exactly.

    Parameters
    ----------
    rig : EigenRig
    regions : sequence of regions
        Disjoint regions; see `region_mask` for what a region can be.
    fixed : region, optional
        The vertices that must stay. A region without vertices has no effect.
    n_modes : int, optional
        Number of modes of each fit, 1 to k. By default, with δ the extent of a region divided by
        that of the rest, both measured from the region's boundary: 8 if δ ≥ 0.75, 50 if δ ≥ 0.1,
        and 300 otherwise (thesis 6.3.2); one more for each component beyond the first.

    Returns
    -------
    Binding

    Raises
    ------
    InvalidParameterError
        If a region has no boundary; if regions overlap; if `fixed` is given and a component has no
        vertex that is fixed or in a region; if `n_modes` is not in 1..k; or if the modes are
        constant on a region and the rest.

    See Also
    --------
    bend : Move the bound regions by their handles.
    deform : Bind and bend one region in one call.

    Examples
    --------
    Bind the upper half of a sphere once, and move it twice:

    >>> import eigenshape as es
    >>> mesh = es.icosphere(2)
    >>> rig = es.rig_shape(mesh)
    >>> binding = es.deformation.bind(rig, [mesh.vertices[:, 2] > 0.2])
    >>> up = es.deformation.bend(binding, [es.Translation([0, 0, 1])])
    >>> aside = es.deformation.bend(binding, [es.Translation([1, 0, 0])])
    >>> float(up.vertices[:, 2].max().round(3)), float(aside.vertices[:, 2].max().round(3))
    (2.0, 1.0)
    """
    require_type(rig, EigenRig, "rig")
    if not isinstance(regions, Sequence) or isinstance(regions, str):
        raise InvalidParameterError(
            f"regions must be a list of regions; it is {describe_value(regions)}. Pass [region]."
        )
    n = rig.mesh.n_vertices
    masks = np.array([region_mask(rig.mesh, region) for region in regions]).reshape(-1, n)
    if not len(masks):
        raise InvalidParameterError("There must be at least one region; none was given.")
    still = np.zeros(n, dtype=bool) if fixed is None else region_mask(rig.mesh, fixed)
    twice = np.flatnonzero(masks.sum(axis=0) + still > 1)
    if twice.size:
        raise InvalidParameterError(
            "Regions and fixed vertices must not overlap; "
            f"vertex {twice[0]} is in two of them ({twice.size} such)."
        )
    # The vertices at which the fit has data. Without data in some component, nothing would
    # determine the modes that are constant on that component.
    known = masks.any(axis=0) | still if still.any() else np.ones_like(still)
    require_fixed_vertices(rig.edges, known)

    rims = [require_boundary(rig.mesh, mask, number) for number, mask in enumerate(masks)]
    distances = geodesic_distances(rig.mesh, rims)
    counts = []
    for mask, distance in zip(masks, distances, strict=True):
        reached = np.isfinite(distance)
        inside = np.max(distance[mask & reached], initial=0.0)
        outside = np.max(distance[~mask & reached], initial=0.0)
        by_rule = next(count for least, count in MODE_RULE if inside >= least * outside)
        # One more for each further component, whose indicator is a mode of eigenvalue 0
        counts.append(min(by_rule + int(rig.components.max()), rig.n_modes))
    if n_modes is not None:
        counts = [whole_number(n_modes, "n_modes", 1, rig.n_modes)] * len(masks)
    pairs = zip(masks, counts, strict=True)
    shares = np.array([_fit_shares(rig, mask, known, count) for mask, count in pairs])
    shares /= np.maximum(shares.sum(axis=0), 1)

    placed = known & ((shares == 0).all(axis=0) | (shares == 1).any(axis=0))
    if not still.any():
        placed = _placed_beyond_rims(rig, masks, distances, placed)
    part = free_part(rig.edges, placed)
    return Binding(rig, masks, np.array(counts), distances, shares, part)


def pull_binding(binding: Binding, strength: float) -> Binding:
    """Return a binding whose free vertices are pulled to where their shares take them.

    The pull on a vertex is `strength` times its share of the area. At a strength of some hundreds
    no limb can fold away; folds of single edges take a strength of about the number of vertices.
    """
    areas = binding.rig.areas
    return replace(binding, part=pull_part(binding.part, strength * areas / areas.sum()))


def _placed_beyond_rims(
    rig: EigenRig,
    masks: Bool[np.ndarray, "r n"],
    distances: Float[np.ndarray, "r n"],
    placed: Bool[np.ndarray, " n"],
) -> Bool[np.ndarray, " n"]:
    """Return the placed vertices that are not near the boundary of a region.

    Depths are measured in each component. Where a region or the rest of a component would have no
    placed vertex left, all stay placed.
    """
    owner = np.where(masks.any(axis=0), 1 + masks.argmax(axis=0), 0)
    near = np.zeros_like(placed)
    for number, distance in enumerate(distances):
        reached = np.isfinite(distance)
        sides = (reached & (owner == number + 1), reached & (owner != number + 1))
        depths = np.zeros((2, rig.components.max() + 1))
        for depth, side in zip(depths, sides, strict=True):
            np.maximum.at(depth, rig.components[side], distance[side])
        # Vertices of other regions are free near their own boundaries alone.
        nearby = reached & (distance < FREE_DEPTH * depths.min(axis=0)[rig.components])
        near |= nearby & ((owner == 0) | (owner == number + 1))
    group = rig.components * (len(masks) + 1) + owner
    n_left = np.bincount(group[placed & ~near], minlength=group.max() + 1)
    return placed & (~near | (n_left[group] == 0))


def _fit_shares(
    rig: EigenRig, mask: Bool[np.ndarray, " n"], known: Bool[np.ndarray, " n"], n_modes: int
) -> Float[np.ndarray, " n"]:
    """Fit a region's indicator by the lowest modes, and scale and clip the fit to 0..1."""
    modes, values = rig.eigenvectors[:, :n_modes], rig.eigenvalues[:n_modes]
    goal = modes[mask].T @ rig.areas[mask]
    if known.all():
        # The modes are orthonormal with respect to the areas.
        fit = modes @ goal
    else:
        # Least squares where the indicator is known, and smooth elsewhere
        gram = (modes[known] * rig.areas[known, None]).T @ modes[known]
        relative_values = values / max(values[-1], np.finfo(float).tiny)
        stiff = SMOOTHNESS * rig.areas[known].sum() / rig.areas.sum() * relative_values**2
        fit = modes @ np.linalg.solve(gram + np.diag(stiff), goal)
    best, rest = fit[mask].max(), fit[known & ~mask].min()
    if not best - rest > LEAST_CONTRAST * abs(best):
        raise InvalidParameterError(
            "Modes must differ between a region and the rest; "
            f"the lowest {n_modes} are constant there. Increase n_modes."
        )
    low, high = max(CLIP * min(best, 1), rest), min(1 - CLIP, best)
    return np.clip((fit - low) / (high - low), 0, 1)
