"""How far points of a sample lie apart."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from eigenshape._errors import InvalidShapeError
from eigenshape._vectors import size_one


def neighbor_distance(points: Float[np.ndarray, "n d"], dim: int) -> float:
    """Return the mean distance to the m(m+1) nearest points: as many as touch a point of the lattice A_m.

    Raise InvalidShapeError if there are not so many points, or all are equal.
    """
    near = dim * (dim + 1)
    if len(points) <= near:
        raise InvalidShapeError(
            f"A sample of dimension {dim} must have over {near} points; it has {len(points)}."
        )
    scaled, scale = size_one(points)
    distance = float(cKDTree(scaled).query(scaled, near + 1)[0][:, 1:].mean() * scale)
    if not distance > 0:
        raise InvalidShapeError(
            f"The points of a sample must differ; all {len(points)} are {points[0].tolist()}."
        )
    return distance
