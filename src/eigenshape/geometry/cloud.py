"""Point clouds: points that sample a manifold of known dimension."""

import numpy as np
from jaxtyping import Float
from typing_extensions import TypeAliasType

from certeig.kit.arrays import ReadOnly, freeze, record, whole_number
from certeig.kit.typing import ArrayLike, Integer
from eigenshape._arrays import finite_rows
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.simplicial import Mesh


@record
class PointCloud(ReadOnly):
    """Points in R^d that sample a manifold of dimension m.

    Parameters
    ----------
    points : (n, d) float
        Coordinates, in any length unit. They are copied, and the copy is read-only.
    dim : int
        Dimension m of the manifold, 1 to d; 2 for the scan of a surface.

    Raises
    ------
    InvalidShapeError
        If there is no point, or a coordinate is not finite.
    InvalidParameterError
        If `dim` is not in 1..d.

    See Also
    --------
    point_cloud_laplacian : The Laplacian of a point cloud.
    read_points : Read a point cloud from a file.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.PointCloud([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dim=2)
    PointCloud(4 points in R^3, dim=2)
    """

    points: Float[np.ndarray, "n d"]
    dim: int

    def __init__(self, points: ArrayLike, dim: Integer = 2) -> None:
        coordinates = finite_rows(points, "points")
        if not coordinates.size:
            raise InvalidShapeError("A point cloud must have points; it has none.")
        vars(self).update(
            dim=whole_number(dim, "dim", 1, coordinates.shape[1]), points=freeze(coordinates)
        )

    @property
    def n_points(self) -> int:
        """Number of points, n."""
        return len(self.points)

    def __repr__(self) -> str:
        return f"PointCloud({self.n_points} points in R^{self.points.shape[1]}, dim={self.dim})"


Shape = TypeAliasType("Shape", Mesh | PointCloud)
