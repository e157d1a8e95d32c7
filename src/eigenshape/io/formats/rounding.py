"""What a shape loses when the coordinates in a file are rounded."""

import numpy as np
from jaxtyping import Float

from certeig.kit.errors import FileFormatError
from eigenshape._errors import count_nouns
from eigenshape._vectors import size_one, triangle_areas
from eigenshape.geometry.mesh import TriangleMesh

# Largest share of the shortest side of a face by which its corners may move without a word, and
# shares of the size and the area by which corners and the whole may change at all.
ROUNDING, MOST_CHANGE = 0.01, 0.01


def loss_in_single(mesh: TriangleMesh) -> list[str]:
    """Name what is lost if a file holds coordinates in single precision; see `rounding_loss`."""
    return rounding_loss(mesh, mesh.vertices.astype(np.float32)[mesh.faces].astype(np.float64))


def rounding_loss(mesh: TriangleMesh, found: Float[np.ndarray, "f 3 3"]) -> list[str]:
    """Name what is lost if a file gives the corners of faces back as they are found, if that is anything.

    Raise FileFormatError if the area or a corner changes by more than `MOST_CHANGE`.
    """
    first = mesh.vertices[0]
    corners, scale = size_one(mesh.vertices[mesh.faces] - first)
    found = (found - first) / scale
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    moves = np.linalg.norm(found - corners, axis=2)
    before, after = triangle_areas(corners), triangle_areas(found)
    # What is not finite is damaged, too.
    damaged = ~(moves.max(axis=1) <= ROUNDING * sides.min(axis=1)) & (before > 0)
    if not damaged.any():
        return []
    change = abs(after.sum() - before.sum()) / before.sum()
    if not max(change, moves.max()) <= MOST_CHANGE:
        raise FileFormatError(
            f"A file must keep the area and the places of vertices to {MOST_CHANGE:.0%}; rounding, or a "
            f"node that flattens, changes the area by {change:.2g} and a place by {moves.max():.2g} of the size. "
            "Write .ply, which keeps all digits."
        )
    n_flat = int(((after == 0) & (before > 0)).sum())
    return [
        f"the exact shape of {count_nouns(int(damaged.sum()), 'face')}, of which {n_flat} lose their area, "
        "since coordinates are rounded to single precision (.ply keeps all digits)"
    ]
