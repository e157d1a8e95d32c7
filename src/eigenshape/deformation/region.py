"""Regions of a shape: vertices given by a mask, indices, a box or a brush."""

from collections.abc import Iterable

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree
from typing_extensions import TypeAliasType

from certeig.kit.arguments import describe_value
from certeig.kit.arrays import (
    ReadOnly,
    as_array,
    freeze,
    positive_number,
    real_numbers,
    record,
    require_no_mask,
    whole_numbers,
)
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import ArrayLike
from eigenshape.deformation.handles import as_vector
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.distances.geodesic import geodesic_distances
from eigenshape.geometry.mesh import TriangleMesh


@record
class BoxRegion(ReadOnly):
    """The vertices inside a box with sides parallel to the axes.

    Parameters
    ----------
    low, high : (3,) float
        Opposite corners, in length. Infinite coordinates leave a side open.

    Raises
    ------
    InvalidParameterError
        If a corner is not three numbers, or `low` is above `high` along an axis.

    See Also
    --------
    BrushRegion : The vertices near a point.
    region_mask : Select the vertices of a region.

    Examples
    --------
    >>> import numpy as np
    >>> import eigenshape as es
    >>> left = es.deformation.BoxRegion([-np.inf, -np.inf, -np.inf], [0.3, np.inf, np.inf])
    >>> es.deformation.region_mask(es.shapes.grid(4, 1), left).nonzero()[0]
    array([0, 1, 2, 3])
    """

    low: Float[np.ndarray, " 3"]
    high: Float[np.ndarray, " 3"]

    def __init__(self, low: ArrayLike, high: ArrayLike) -> None:
        corners = [
            real_numbers(corner, "A corner of a box").astype(np.float64) for corner in (low, high)
        ]
        for corner, name in zip(corners, ("low", "high"), strict=True):
            if corner.shape != (3,) or np.isnan(corner).any():
                raise InvalidParameterError(
                    f"{name} must be three numbers; it is {corner.tolist()}."
                )
        axis = np.flatnonzero(corners[0] > corners[1])
        if axis.size:
            below, above = (corner[axis[0]] for corner in corners)
            raise InvalidParameterError(
                f"low must lie below high; along axis {axis[0]} they are {below} and {above}."
            )
        vars(self).update(low=freeze(corners[0]), high=freeze(corners[1]))


@record
class BrushRegion(ReadOnly):
    """The vertices within a geodesic distance of the vertex nearest to a point.

    Parameters
    ----------
    center : (3,) float
        A point on the surface or near it, in length.
    radius : float
        Largest geodesic distance, in length.

    Raises
    ------
    InvalidParameterError
        If `center` is not three finite numbers, or `radius` is not positive.

    See Also
    --------
    BoxRegion : The vertices inside a box.
    region_mask : Select the vertices of a region.

    Examples
    --------
    >>> import eigenshape as es
    >>> cap = es.deformation.BrushRegion(center=[0, 0, 1], radius=0.5)
    >>> int(es.deformation.region_mask(es.icosphere(2), cap).sum())
    7
    """

    center: Float[np.ndarray, " 3"]
    radius: float

    def __init__(self, center: ArrayLike, radius: float) -> None:
        vars(self).update(
            center=freeze(as_vector(center, "center")), radius=positive_number(radius, "radius")
        )


Region = TypeAliasType("Region", BoxRegion | BrushRegion | np.ndarray | Iterable[int])


def copy_region(region: Region) -> Region:
    """Return a region that can be used many times, and that the caller cannot change."""
    if isinstance(region, BoxRegion | BrushRegion):
        return region
    return freeze(_entries(region))


def _entries(region: np.ndarray | Iterable[int]) -> np.ndarray:
    """Return a mask or a list of indices as an array."""
    try:
        if isinstance(region, Iterable) and not isinstance(region, str) and not sp.issparse(region):
            return as_array(region if isinstance(region, np.ndarray) else list(region), "A region")
    except InvalidParameterError:
        raise
    except ValueError:  # the rows differ in length; the message below says what a region can be
        pass
    raise InvalidParameterError(
        "A region must be a BoxRegion, a BrushRegion, a mask, or a list of vertices; "
        f"it is {describe_value(region)}. Pass region_mask(mesh, region)."
    )


def region_mask(mesh: MeshLike, region: Region) -> Bool[np.ndarray, " n"]:
    """Select the vertices of a region.

    Parameters
    ----------
    mesh : MeshLike
    region : (n,) bool, (k,) int, BoxRegion or BrushRegion
        A mask, indices of vertices, a box, or a disc on the surface.

    Returns
    -------
    (n,) bool
        Whether each vertex is in the region.

    Raises
    ------
    InvalidParameterError
        If a mask does not have length n, or an index is not in 0..n - 1.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> es.deformation.region_mask(mesh, [0, 3]).nonzero()[0]
    array([0, 3])
    >>> brush = es.deformation.BrushRegion(center=[0, 0, 0], radius=0.3)
    >>> es.deformation.region_mask(mesh, brush).nonzero()[0]
    array([0, 2])
    """
    mesh = as_mesh(mesh)
    if isinstance(region, BoxRegion):
        inside = (mesh.vertices >= region.low) & (mesh.vertices <= region.high)
        return np.asarray(inside.all(axis=1))
    if isinstance(region, BrushRegion):
        nearest = int(cKDTree(mesh.vertices).query(region.center)[1])
        distances = geodesic_distances(mesh, [nearest], reach=region.radius)[0]
        return distances <= region.radius
    chosen = _entries(region)
    if chosen.dtype == bool:
        if chosen.shape != (mesh.n_vertices,):
            raise InvalidParameterError(
                f"A mask must have one entry per vertex, shape ({mesh.n_vertices},); "
                f"the shape is {chosen.shape}."
            )
        return chosen
    numbers = whole_numbers(chosen, "A vertex of a region", 0, mesh.n_vertices - 1)
    require_no_mask(numbers, "A region", mesh.n_vertices)
    mask = np.zeros(mesh.n_vertices, dtype=bool)
    mask[numbers] = True
    return mask


def region_boundary(mesh: MeshLike, mask: Bool[np.ndarray, " n"]) -> Int[np.ndarray, " b"]:
    """List the vertices of a region that have a neighbor outside it (thesis 6.3.1).

    Parameters
    ----------
    mesh : MeshLike
    mask : (n,) bool
        Whether each vertex is in the region; see `region_mask`.

    Returns
    -------
    (b,) int
        Indices of the boundary vertices, ascending.

    Raises
    ------
    InvalidParameterError
        If the mask does not have length n.

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.shapes.grid(4, 1)
    >>> es.deformation.region_boundary(mesh, mesh.vertices[:, 0] < 0.3)
    array([2, 3])
    """
    mesh = as_mesh(mesh)
    mask, faces = region_mask(mesh, mask), mesh.faces
    # All corners of a face are neighbors. A table of the edges would take 20 times as long.
    inside = mask[faces]
    outside = ~inside.all(axis=1)
    return np.unique(faces[outside][inside[outside]])


def require_boundary(
    mesh: TriangleMesh, mask: Bool[np.ndarray, " n"], number: int
) -> Int[np.ndarray, " b"]:
    """Return the boundary of a region; raise an error if it has none."""
    rim = region_boundary(mesh, mask)
    if len(rim):
        return rim
    what = f"holds {mask.sum()} of {len(mask)} vertices, whole components"
    if not mask.any():
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        spans = zip("xyz", low, high, strict=True)
        where = ", ".join(f"{start:.4g} to {end:.4g} in {axis}" for axis, start, end in spans)
        what = f"holds no vertex, and the shape lies from {where}"
    raise InvalidParameterError(
        f"A region must have a boundary on the shape, where it bends; region {number} {what}. "
        "To move a whole component, transform its vertices."
    )
