"""Annotations that `help` shows by their names, where it would show unions of a dozen types."""

import numpy.typing as npt
from typing_extensions import TypeAliasType

ArrayLike = TypeAliasType("ArrayLike", npt.ArrayLike)
