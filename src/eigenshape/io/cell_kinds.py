"""The kinds of cells that a file can be asked for. The command line reads them, so this module is light."""

from typing import Literal

CellKind = Literal["triangles", "quads", "tetrahedra"]
