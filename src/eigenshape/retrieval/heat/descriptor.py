"""The heat descriptor of a shape: a few feature points, each with its heat at several times."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arrays import ReadOnly, freeze
from eigenshape._text import short_repr
from eigenshape.retrieval.heat.recipe import HeatRecipe


@dataclass(frozen=True, eq=False)
class HeatDescriptor(ReadOnly):
    """A shape described by m feature points with q numbers each.

    Parameters
    ----------
    vectors : (m, q) float
        One row for each feature point, without unit. Copied, then read-only.
    vertices : (m,) int
        The vertex of each feature point. Copied, then read-only.
    recipe : HeatRecipe

    See Also
    --------
    matching_score, match_features

    Examples
    --------
    >>> import eigenshape as es
    >>> mesh = es.make_creature("fish", n_vertices=500)
    >>> es.describe(mesh, es.retrieval.SCALE_FREE).vectors.shape
    (15, 15)
    """

    vectors: Float[np.ndarray, "m q"]
    vertices: Int[np.ndarray, " m"]
    recipe: HeatRecipe

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "vectors", freeze(self.vectors))
        object.__setattr__(self, "vertices", freeze(self.vertices))
