"""The names that options of operators take. The command line reads them, so this module is light."""

from typing import Literal

Mass = Literal["lumped", "consistent", "averaged"]  # mass matrix of linear elements
Condition = Literal["neumann", "dirichlet"]  # at the boundary
Correction = Literal["log"]  # of the bias of a kernel
Form = Literal["literal", "random-walk"]  # mass matrix of a kernel operator
Distance = Literal["euclidean", "geodesic"]  # in a kernel
