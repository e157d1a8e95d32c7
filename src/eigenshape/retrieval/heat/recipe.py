"""Recipes of heat descriptors. The command line reads their names for its help, so this module is light."""

from dataclasses import dataclass
from itertools import pairwise
from math import log
from typing import Literal

from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import html_repr, repr_of_changes

# Scales are a geometric sequence if the steps of their logarithms differ by less than this.
EQUAL_STEPS = 1e-9


@dataclass(frozen=True)
class HeatRecipe:
    """Describe a shape by feature points and the heat that they keep at several times.

    Two descriptors compare only if their recipes are equal. Times are scale × `time_unit`, in units
    of the area of the shape or of its squared box, so none depends on its size. The defaults are
    the preset ``SCALE_FREE``; the other preset is ``THESIS``.

    Parameters
    ----------
    name : str
        For messages and tables.
    unit : "area" or "box"
        What a time of 1 means: the area of the surface, or the square of the longest side of its
        bounding box.
    time_unit : float
        τ in the thesis.
    feature_scale : float
        Features are the persistent maxima of heat at time feature_scale × time_unit.
    scales : tuple of q floats
        α in the thesis; one for each number of a feature.
    logarithmic : bool
        Whether the numbers are logarithms of heat, so that a ratio counts the same at every scale.
    n_features : int
        Feature points at most; κ in the thesis.
    n_modes : int
        Eigenpairs at most.
    reflections : bool
        Whether heat is reflected at a boundary. If False, heat is the mean of those with a free and
        with a fixed boundary, in which reflections cancel.
    n_shifts : int
        Steps along the scales by which two shapes may differ in size, since a part has less area
        than the whole. Shifts require logarithms, and scales in geometric sequence.

    Raises
    ------
    InvalidParameterError
        If there are shifts without logarithms or without a geometric sequence of scales.

    See Also
    --------
    PatchRecipe, describe, find_heat_features

    Examples
    --------
    >>> import eigenshape as es
    >>> recipe = es.retrieval.HeatRecipe("few", n_features=5)
    >>> es.describe(es.make_creature("fish", n_vertices=500), recipe).vectors.shape
    (5, 15)
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

    __repr__ = repr_of_changes
    _repr_html_ = html_repr

    def __post_init__(self) -> None:
        geometric = False
        if min(self.scales) > 0:
            steps = [log(after) - log(before) for before, after in pairwise(self.scales)]
            geometric = max(steps, default=0.0) - min(steps, default=0.0) < EQUAL_STEPS
        if self.n_shifts and not (self.logarithmic and geometric):
            raise InvalidParameterError(
                "Shifts need logarithmic vectors at scales in geometric sequence; recipe "
                f"{self.name!r} has logarithmic={self.logarithmic} and scales {self.scales}. "
                "Pass n_shifts=0."
            )


SCALE_FREE = HeatRecipe()
THESIS = HeatRecipe(
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
