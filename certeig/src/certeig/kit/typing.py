"""Annotations that `help` shows by their names, where it would show unions or protocols."""

from typing import SupportsIndex

import numpy.typing as npt
from typing_extensions import TypeAliasType

ArrayLike = TypeAliasType("ArrayLike", npt.ArrayLike)
# int and the integers of NumPy.
Integer = TypeAliasType("Integer", SupportsIndex)
