"""Bind regions to handles: by how much each vertex follows each handle."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

import numpy as np
from jaxtyping import Bool, Float, Int

from certeig.kit.arguments import describe_value, require_type
from certeig.kit.arrays import TINY, ReadOnly, record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from certeig.kit.typing import Integer
from eigenshape._errors import count_nouns
from eigenshape.deformation.region import Region, region_mask, require_boundary
from eigenshape.deformation.region_patches import Patch, split_region
from eigenshape.deformation.rig import EigenRig
from eigenshape.deformation.rigidity import (
    FreePart,
    free_part,
    pull_part,
    require_fixed_vertices,
    spread_harmonically,
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
# A vertex of an island in the bend beside a patch that follows by less than this is named.
FOLLOWS = 0.95


@record
class Binding(ReadOnly):
    """Regions of a rig that handles can move.

    Attributes
    ----------
    rig : EigenRig
    regions : (r, n) bool
        The vertices of each region.
    n_modes : (r,) int
        Number of modes that spread the motion of each region: the most that a patch has.
    distances : (r, n) float
        Geodesic distance of each vertex to the boundary of each region, in length.
    shares : (r, n) float
        By how much each vertex follows each handle, 0 to 1.
    fixed : (n,) bool
        The vertices that were given as `fixed`; without any, none.
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
    fixed: Bool[np.ndarray, " n"]
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
    `fixed`, only the fixed vertices are, and the others follow smoothly. Fixed vertices never move:
    their shares are set to 0. If they lie close to a region, edges between are stretched.

    A region may consist of several connected patches, down to single vertices. The depth and the
    number of modes are those of each patch, and each follows the handle. Only small patches that
    lie entirely in the bend beside a large one follow as its boundary does, in part. All patches of
    a region have the one pivot of its handle: a region for each lets them turn about their own.

    Vertices of a share between 0 and 1 are free: `bend` places them so that edges change little.
    Without `fixed`, so are all vertices that are nearer to the boundary of a patch than half of
    the patch's depth, or of that of the rest if it is less deep: the more vertices are free, the
    less edges change. All other vertices are held (`Binding.held`): they stay, or follow exactly.

    Parameters
    ----------
    rig : EigenRig
    regions : sequence of regions
        Disjoint regions; see `region_mask` for what a region can be.
    fixed : region, optional
        The vertices that must stay. A region without vertices has no effect.
    n_modes : int, optional
        Number of modes of each fit, 1 to k. By default, with δ the extent of a patch divided by
        that of the rest, both measured from the patch's boundary: 8 if δ ≥ 0.75, 50 if δ ≥ 0.1,
        and 300 otherwise (thesis 6.3.2). Of a shape in several components, modes count that are on
        the component of the patch.

    Returns
    -------
    Binding

    Raises
    ------
    InvalidParameterError
        If a region has no boundary; if regions overlap; if `fixed` is given and a component has no
        vertex that is fixed or in a region; if `n_modes` is not in 1..k; or if the modes are
        constant on a region and the rest.

    Warns
    -----
    UserWarning
        If small patches beside a large one follow in part, with the first of them.

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
    patches = [split_region(rig.mesh, *pair) for pair in zip(masks, distances, strict=True)]
    wanted = None if n_modes is None else whole_number(n_modes, "n_modes", 1, rig.n_modes)
    counts = [[wanted or _count_modes(rig, patch) for patch in group] for group in patches]
    shares = np.array(
        [_fit_shares(rig, *pair, known) for pair in zip(patches, counts, strict=True)]
    )
    # A whole component in a region has no boundary at which it could bend.
    shares[masks & np.isinf(distances)] = 1
    # What follows its own handle exactly follows no other one.
    exact = masks & (shares == 1)
    shares = np.where(exact.any(axis=0), exact, shares / np.maximum(shares.sum(axis=0), 1))
    islands = np.concatenate([patch.islands for patch in chain.from_iterable(patches)])
    late = islands[shares[:, islands].sum(axis=0) < FOLLOWS]
    if late.size:
        warnings.warn(
            "Small patches of a region that lie in the bend beside a large one follow in part: "
            f"{count_nouns(late.size, 'vertex')}, of which vertex {late[0]} follows by "
            f"{shares[:, late[0]].sum():.2f}. Leave them out, or add what lies between.",
            stacklevel=3,
        )

    placed = known & ((shares == 0).all(axis=0) | (shares == 1).any(axis=0))
    if not still.any():
        placed = _placed_beyond_rims(rig, patches, placed)
    part = free_part(rig.edges, placed | still)
    if still.any():
        # Near a region the fit is above 0 on fixed vertices, too. There it is set to 0, and around
        # them lowered smoothly: a preview by shares would tear at the border otherwise.
        excess = np.where(still, shares, 0)
        shares = np.maximum(shares - spread_harmonically(part, excess.T).T, 0)
    most = np.array([max(group) for group in counts])
    return Binding(rig, masks, most, distances, shares, still, part)


def pull_binding(binding: Binding, strength: float) -> Binding:
    """Return a binding whose free vertices are pulled to where their shares take them.

    The pull on a vertex is `strength` times its share of the area. At a strength of some hundreds
    no limb can fold away; folds of single edges take a strength of about the number of vertices.
    """
    areas = binding.rig.areas
    return replace(binding, part=pull_part(binding.part, strength * areas / areas.sum()))


def _placed_beyond_rims(
    rig: EigenRig, patches: Sequence[Sequence[Patch]], placed: Bool[np.ndarray, " n"]
) -> Bool[np.ndarray, " n"]:
    """Return the placed vertices that are not in the bend of a patch.

    Where a patch or the rest of a component would have no placed vertex left, all stay placed.
    """
    # The number of the patch of each vertex; below 0, that of the component
    owner = -1 - rig.components
    numbered = list(enumerate(chain.from_iterable(patches)))
    for number, patch in numbered:
        owner[patch.members] = number
    near = np.zeros_like(placed)
    for number, patch in numbered:
        # Vertices of other patches are free near their own boundaries alone.
        near[patch.bend] |= (owner[patch.bend] < 0) | (owner[patch.bend] == number)
    groups = np.unique(owner, return_inverse=True)[1]
    n_left = np.bincount(groups[placed & ~near], minlength=groups.max() + 1)
    return placed & (~near | (n_left[groups] == 0))


def _count_modes(rig: EigenRig, patch: Patch) -> int:
    """Return the number of modes for a patch: as many on its component as the rule says."""
    by_rule = next(count for least, count in MODE_RULE if patch.extent >= least)
    if not rig.components.any():
        return min(by_rule, rig.n_modes)
    # Modes of other components are zero here; those of eigenvalue 0 may be mixed.
    here = rig.components == rig.components[patch.members[0]]
    weights = rig.areas[here] @ rig.eigenvectors[here] ** 2
    enough = 1 + int(np.searchsorted(weights.cumsum(), by_rule - 0.5))
    return min(enough, rig.n_modes)


def _fit_shares(
    rig: EigenRig, patches: Sequence[Patch], counts: Sequence[int], known: Bool[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Fit the indicators of patches by the lowest modes, scale each fit to 0..1, and add them.

    Each patch has its own scale: in a common fit, that of a small one would be too low everywhere.
    """
    shares, most = np.zeros(len(known)), max(counts)
    if not known.all():
        weighted = rig.eigenvectors[known, :most] * rig.areas[known, None]
        gram = weighted.T @ rig.eigenvectors[known, :most]
        stiffness = SMOOTHNESS * rig.areas[known].sum() / rig.areas.sum()
    for patch, n_modes in zip(patches, counts, strict=True):
        modes, values = rig.eigenvectors[:, :n_modes], rig.eigenvalues[:n_modes]
        members = patch.members
        goal = modes[members].T @ rig.areas[members]
        if not known.all():
            # Least squares where the indicator is known, and smooth elsewhere. Where it is known
            # everywhere, the modes are orthonormal with respect to the areas.
            relative_values = values / max(values[-1], TINY)
            stiff = np.diag(stiffness * relative_values**2)
            goal = np.linalg.solve(gram[:n_modes, :n_modes] + stiff, goal)
        fit = modes @ goal
        here = rig.components == rig.components[members[0]]
        rest = here.copy()
        rest[members] = False
        best, least = fit[members].max(), fit[rest].min()
        if best - least > LEAST_CONTRAST * abs(best):
            low, high = max(CLIP * min(best, 1), least), min(1 - CLIP, best)
            shares[here] += np.clip((fit[here] - low) / (high - low), 0, 1)
        elif rig.components.any():
            # The modes of a rig may all be too coarse for a small component.
            shares[members] = 1
        else:
            raise InvalidParameterError(
                "Modes must differ between a region and the rest; "
                f"the lowest {n_modes} are constant there. Increase n_modes."
            )
    return np.minimum(shares, 1)
