"""What a shape is known by: a few feature points, each with a vector of numbers."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Recipe:
    """How a descriptor was made; two descriptors compare only if their recipes are equal.

    Parameters
    ----------
    name : str
        Preset, such as "thesis" or "scale-free".
    n_features : int
        Feature points m (the thesis' κ).
    """

    name: str
    n_features: int = 15

    @property
    def key(self) -> str:
        """A string that is equal exactly where the recipes are."""
        return repr(self)


@dataclass(frozen=True, eq=False)
class ShapeDescriptor:
    """m feature points of a shape and the q numbers that describe each.

    Parameters
    ----------
    vectors : (m, q) float
        One row a feature point.
    vertices : (m,) int
        The vertex at which each feature lies.
    recipe : Recipe
    """

    vectors: Float[np.ndarray, "m q"]
    vertices: Int[np.ndarray, " m"]
    recipe: Recipe
