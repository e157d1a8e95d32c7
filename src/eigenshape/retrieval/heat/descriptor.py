"""What a shape is known by: a few feature points, each with the heat that it keeps at several times."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arrays import frozen
from eigenshape._errors import InvalidParameterError

EVEN = 1e-9  # steps between logarithms of scales that differ less are equal


@dataclass(frozen=True)
class Recipe:
    """How a descriptor is made; two descriptors compare only if their recipes are equal.

    A time is a scale times `time_unit`, in units of the shape's own area or of its squared box, never of length.
    The defaults are those of the scale-free preset.

    Parameters
    ----------
    name : str
        Of the preset.
    unit : "area" or "box"
        What a time of 1 means: the area of the surface, or the square of the longest side of its box.
    time_unit : float
        The thesis' τ.
    feature_scale : float
        Features are the persistent maxima of the heat at feature_scale × time_unit.
    scales : tuple of float
        The thesis' α, one a column of the descriptor.
    logarithmic : bool
        Whether vectors hold the logarithm of the heat, so that a ratio counts the same at every scale.
    n_features : int
        Feature points at most (the thesis' κ).
    n_modes : int
        Eigenpairs of the spectrum at most.
    reflections : bool
        Whether a boundary may throw heat back. Without, heat is the mean of the Neumann and the Dirichlet kernel.
    n_shifts : int
        Steps along the scales by which two shapes may differ in size: a part has less area than the whole. The scales
        must then be a geometric sequence and the vectors logarithmic.
    """

    name: str = "scale-free"
    unit: Literal["area", "box"] = "area"
    time_unit: float = 1e-3
    feature_scale: float = 4.0
    scales: tuple[float, ...] = tuple(4.0 * 1.4**step for step in range(15))
    logarithmic: bool = True
    n_features: int = 15
    n_modes: int = 150
    reflections: bool = False
    n_shifts: int = 5

    def __post_init__(self) -> None:
        if self.n_shifts and not (self.logarithmic and np.ptp(np.diff(np.log(self.scales))) < EVEN):
            raise InvalidParameterError(
                f"Shifts need logarithmic vectors at scales in geometric sequence; recipe {self.name!r} has "
                f"logarithmic {self.logarithmic} and scales {self.scales}."
            )


SCALE_FREE = Recipe()
THESIS = Recipe(
    name="thesis",
    unit="box",
    time_unit=2e-4,
    feature_scale=5.0,
    scales=(5.0, 20.0, 40.0, 60.0, 100.0, 150.0, *(100.0 * hundred for hundred in range(2, 11))),
    logarithmic=False,
    n_modes=300,
    reflections=True,
    n_shifts=0,
)
PRESETS = {recipe.name: recipe for recipe in (SCALE_FREE, THESIS)}


@dataclass(frozen=True, eq=False)
class ShapeDescriptor:
    """m feature points of a shape and the q numbers that describe each.

    Parameters
    ----------
    vectors : (m, q) float
        One row a feature point, without unit. Copied, then read-only.
    vertices : (m,) int
        The vertex at which each feature lies. Copied, then read-only.
    recipe : Recipe
    """

    vectors: Float[np.ndarray, "m q"]
    vertices: Int[np.ndarray, " m"]
    recipe: Recipe

    def __post_init__(self) -> None:
        object.__setattr__(self, "vectors", frozen(self.vectors))
        object.__setattr__(self, "vertices", frozen(self.vertices))
