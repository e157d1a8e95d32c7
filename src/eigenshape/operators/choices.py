"""The names that operators and their options take. The command line reads them, so this module is light."""

from typing import Literal

OPERATOR_NAMES = (
    "cotangent",
    "p2",
    "p3",
    "robust",
    "mesh",
    "point-cloud",
    "combinatorial",
    "weighted",
    "normalized",
)
Mass = Literal["lumped", "consistent", "averaged"]  # mass matrix of linear elements
Condition = Literal["neumann", "dirichlet"]  # at the boundary
Correction = Literal["log"]  # of the bias of a kernel
Form = Literal["literal", "random-walk"]  # mass matrix of a kernel operator
Distance = Literal["euclidean", "geodesic"]  # in a kernel
