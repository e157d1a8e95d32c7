"""Which part of a surface splits from which."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, eq=False)
class PartTree:
    """Which part splits from which, and how much of a difference between them outlives diffusion.

    Parts stand in the order of falling persistence, so that any first few of them are what a cut leaves. `segment` cuts
    it like a `MergeTree`.

    Attributes
    ----------
    maxima : (m,) int
        Vertex of each part that keeps the most heat.
    values : (m,) float
        Heat there, in 1/length².
    persistence : (m,) float
        What is left of the difference between a part and that which it splits from, as a share, 0..1: nothing where
        heat flows freely, all where they are cut off. Infinite once in each component.
    parent : (m,) int
        The part that it splits from, which has the higher maximum; -1 where there is none.
    basins : (f,) int
        For each face the smallest part that holds it.
    """

    maxima: Int[np.ndarray, " m"]
    values: Float[np.ndarray, " m"]
    persistence: Float[np.ndarray, " m"]
    parent: Int[np.ndarray, " m"]
    basins: Int[np.ndarray, " f"]
