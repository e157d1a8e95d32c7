"""Bound regions: by how much each vertex follows each handle, found once for many positions of the handles."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import SupportsIndex

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._arguments import named_value, require_type
from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape._threads import one_blas_thread
from eigenshape.deformation.region import Region, region_mask, require_boundary
from eigenshape.deformation.rig import EigenRig
from eigenshape.deformation.rigidity import FreePart, free_part, require_held
from eigenshape.geometry.geodesic import geodesic_distance_to_set

RULE = (
    (0.75, 8),
    (0.1, 50),
    (0.0, 300),
)  # least size of a region over that of the rest, and its modes (thesis 6.3.2)
CLIPPED = 0.02  # of the best fit at either end: what follows less, or all but this, follows not at all, or wholly
FLAT = 1e-9  # share of the best fit; modes that tell less of a region tell nothing of it
SMOOTHNESS = 1e-3  # of the untold part, against the fit of what is told


@dataclass(frozen=True, eq=False)
class Binding:
    """Regions of a rig that handles can move.

    Attributes
    ----------
    rig : EigenRig
    regions : (r, n) bool
    n_modes : (r,) int
        Modes that spread the motion of each region.
    distances : (r, n) float
        Of each vertex from the boundary of each region, in length.
    shares : (r, n) float
        0 to 1: by how much of each handle's motion a vertex goes.
    part : FreePart
        What is free: where shares are neither 0 nor 1.
    """

    rig: EigenRig
    regions: Bool[np.ndarray, "r n"]
    n_modes: Int[np.ndarray, " r"]
    distances: Float[np.ndarray, "r n"]
    shares: Float[np.ndarray, "r n"]
    part: FreePart


@one_blas_thread()
def bind(
    rig: EigenRig,
    regions: Sequence[Region],
    *,
    fixed: Region | None = None,
    n_modes: SupportsIndex | None = None,
) -> Binding:
    """Find by how much each vertex follows the handles of some regions.

    A region's indicator, fitted by the low modes, falls smoothly from 1 to 0 across its boundary: few modes spread the
    bend far, many keep it near. Without `fixed`, all that is in no region stays as far as the fit lets it. With it,
    the rest is free to follow: the fit knows the regions and what is fixed, and is smooth in between.

    Parameters
    ----------
    rig : EigenRig
    regions : sequence of regions
        Disjoint; see `region_mask`.
    fixed : region, optional
        What must stay; if it holds no vertex, as if it were not given.
    n_modes : int, optional
        By default, with δ the extent of a region over that of the rest, both measured from its boundary: 8 if
        δ ≥ .75, 50 if δ ≥ .1, else 300 (thesis 6.3.2); one more for each component beyond the first.

    Returns
    -------
    Binding

    Raises
    ------
    InvalidParameterError
        If a region has no boundary, two share a vertex, a component has none that is in a region or fixed (where
        anything is), `n_modes` is not in 1..k, or so few modes tell no region from the rest.
    """
    require_type(rig, EigenRig, "rig")
    if not isinstance(regions, Sequence) or isinstance(regions, str):
        raise InvalidParameterError(
            f"regions must be a list of regions; it is {named_value(regions)}. Pass [region]."
        )
    masks = np.array([region_mask(rig.mesh, region) for region in regions]).reshape(
        -1, rig.mesh.n_vertices
    )
    if not len(masks):
        raise InvalidParameterError("There must be a region; none was given.")
    still = (
        np.zeros(rig.mesh.n_vertices, dtype=bool) if fixed is None else region_mask(rig.mesh, fixed)
    )
    _require_disjoint(np.vstack([masks, still]))
    told = masks.any(axis=0) | still if still.any() else np.ones_like(still)
    require_held(rig.edges, told)  # else nothing tells the modes that are constant there
    rims = [require_boundary(rig.mesh, mask, number) for number, mask in enumerate(masks)]
    distances = np.array([geodesic_distance_to_set(rig.mesh, rim) for rim in rims])
    numbers = [
        _modes(rig, mask, away, n_modes) for mask, away in zip(masks, distances, strict=True)
    ]
    shares = np.array(
        [_share(rig, mask, told, wanted) for mask, wanted in zip(masks, numbers, strict=True)]
    )
    shares /= np.maximum(shares.sum(axis=0), 1)
    held = told & ((shares == 0).all(axis=0) | (shares == 1).any(axis=0))
    part = free_part(rig.edges, held)
    return Binding(rig, masks, np.array(numbers), distances, shares, part)


def pulled(binding: Binding, strength: float) -> Binding:
    """Return a binding whose free vertices are pulled to where their shares take them.

    Each by `strength` times its share of the area. At some hundreds no limb is free to fold away; folds of single edges
    take as much as there are vertices.
    """
    rig, held = binding.rig, np.ones(binding.rig.mesh.n_vertices, dtype=bool)
    held[binding.part.free] = False
    return replace(binding, part=free_part(rig.edges, held, strength * rig.areas / rig.areas.sum()))


def _require_disjoint(masks: Bool[np.ndarray, "r n"]) -> None:
    twice = np.flatnonzero(masks.sum(axis=0) > 1)
    if twice.size:
        raise InvalidParameterError(
            f"Regions, and what is fixed, must not overlap; vertex {twice[0]} is in two of them ({twice.size} such)."
        )


def _modes(
    rig: EigenRig,
    mask: Bool[np.ndarray, " n"],
    away: Float[np.ndarray, " n"],
    wanted: SupportsIndex | None,
) -> int:
    if wanted is not None:
        return whole_number(wanted, "n_modes", 1, rig.n_modes)
    inside, outside = (
        np.max(away[part & np.isfinite(away)], initial=0.0) for part in (mask, ~mask)
    )
    by_rule = next(number for least, number in RULE if inside >= least * outside)
    return min(by_rule + int(rig.components.max()), rig.n_modes)


def _share(
    rig: EigenRig, mask: Bool[np.ndarray, " n"], told: Bool[np.ndarray, " n"], n_modes: int
) -> Float[np.ndarray, " n"]:
    fit = _fit(rig, mask, told, n_modes)
    best, rest = fit[mask].max(), fit[told & ~mask].min()
    if not best - rest > FLAT * abs(best):
        raise InvalidParameterError(
            f"Modes must tell a region from the rest; the lowest {n_modes} are constant there. Ask for more n_modes."
        )
    low, high = max(CLIPPED * min(best, 1), rest), min(1 - CLIPPED, best)
    return np.clip((fit - low) / (high - low), 0, 1)


def _fit(
    rig: EigenRig, mask: Bool[np.ndarray, " n"], told: Bool[np.ndarray, " n"], n_modes: int
) -> Float[np.ndarray, " n"]:
    """Return a region's indicator by the lowest modes: least squares by area where it is told, smooth elsewhere."""
    modes, values = rig.eigenvectors[:, :n_modes], rig.eigenvalues[:n_modes]
    goal = modes[mask].T @ rig.areas[mask]
    if told.all():
        return modes @ goal
    gram = (modes[told] * rig.areas[told, None]).T @ modes[told]
    stiff = (
        SMOOTHNESS
        * rig.areas[told].sum()
        / rig.areas.sum()
        * (values / max(values[-1], np.finfo(float).tiny)) ** 2
    )
    return modes @ np.linalg.solve(gram + np.diag(stiff), goal)
