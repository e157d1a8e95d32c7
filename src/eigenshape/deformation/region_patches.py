"""The patches of a region: its connected parts, each of which follows the handle of the region."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from eigenshape._arrays import label_components
from eigenshape.deformation.region import Region, region_boundary, region_mask, require_boundary
from eigenshape.geometry.distances.geodesic import geodesic_distances, unchecked_waves
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import half_edges, vertex_components

# Share of the depth of a patch, or of the rest if that is less deep, up to which vertices on
# either side of the boundary are free. Of 0.3, 0.5 and 0.7, on scenes of experiments/ch6_deformation
# at 2,000 to 6,000 vertices: 0.3 changes edge errors little, 0.5 divides them by 1.3 to 1.8 on six
# of eight, 0.7 by more, but then little of a region follows its handle exactly.
FREE_DEPTH = 0.5


@dataclass(frozen=True)
class Patch:
    """A connected part of a region, with the islands in the bend around it.

    Attributes
    ----------
    members : (m,) int
        Its vertices.
    islands : (i,) int
        Those of them that lie apart from the largest part.
    extent : float
        δ, its depth over that of the rest of the component: the largest geodesic distances from its
        boundary to a vertex on either side.
    bend : (b,) int
        The vertices nearer to its boundary than `FREE_DEPTH` of the lesser depth.
    """

    members: Int[np.ndarray, " m"]
    islands: Int[np.ndarray, " i"]
    extent: float
    bend: Int[np.ndarray, " b"]


def split_region(
    mesh: TriangleMesh, mask: Bool[np.ndarray, " n"], distances: Float[np.ndarray, " n"]
) -> list[Patch]:
    """Return the patches of a region, the deepest first; whole components belong to none.

    A box cuts small islands off a rough surface, beside the large patch. They lie in the zone that
    bends around that one: if they followed exactly, they would stick out of it. So they belong to
    it, and follow as its boundary does.

    Parameters
    ----------
    mesh : TriangleMesh
    mask : (n,) bool
    distances : (n,) float
        Geodesic distance of each vertex to the boundary of the region.
    """
    one, two = half_edges(mesh).T
    inside = mask[one] & mask[two]
    _, labels = label_components(len(mask), one[inside], two[inside])
    depths = np.zeros(len(mask))
    np.maximum.at(depths, labels[mask], distances[mask])
    patches, taken = [], np.isinf(depths)
    present = np.unique(labels[mask])
    wave = unchecked_waves(mesh) if len(present) > 1 else None
    none = np.empty(0, dtype=np.int64)
    for label in present[np.argsort(-depths[present], kind="stable")]:
        if taken[label]:
            continue
        own = labels == label
        if depths[label] == 0:
            # Nothing around it is free. There may be thousands of such patches, of a vertex each.
            patches.append(Patch(np.flatnonzero(own), none, 0.0, none))
            continue
        away = distances if wave is None else wave(region_boundary(mesh, own))
        outside = away[np.isfinite(away) & ~own].max()
        zone = FREE_DEPTH * min(depths[label], outside)
        farthest = np.zeros(len(mask))
        np.maximum.at(farthest, labels[mask], away[mask])
        is_island = ~taken & (farthest < zone)
        taken |= is_island
        islands = mask & is_island[labels]
        bend = np.flatnonzero(away < zone)
        members, apart = np.flatnonzero(own | islands), np.flatnonzero(islands)
        patches.append(Patch(members, apart, float(depths[label] / outside), bend))
    return patches


def regions_of_patches(mesh: TriangleMesh, region: Region) -> list[Region]:
    """Return a region for each patch of a region, with the whole components nearest to it.

    Raise InvalidParameterError if the region has no boundary.
    """
    mask = region_mask(mesh, region)
    (distances,) = geodesic_distances(mesh, [require_boundary(mesh, mask, 0)])
    members = [patch.members for patch in split_region(mesh, mask, distances)]
    if len(members) == 1:
        return [region]
    pieces = vertex_components(mesh)[1]
    for piece in np.unique(pieces[mask & np.isinf(distances)]):
        whole = np.flatnonzero(pieces == piece)
        away = np.linalg.norm(mesh.vertices - mesh.vertices[whole].mean(axis=0), axis=1)
        nearest = np.argmin([away[patch].min() for patch in members])
        members[nearest] = np.append(members[nearest], whole)
    return list(members)
