"""Kernel of `label_components`: groups of linked things."""

import numpy as np
from jaxtyping import Int64

from certeig.kit.kernels import Out, kernel


@kernel("k", "n")
def number_groups(
    one: Int64[np.ndarray, " k"], two: Int64[np.ndarray, " k"], group: Out[Int64[np.ndarray, " n"]]
) -> int:
    """Write the group of each thing, by its lowest number, and return how many groups there are."""
