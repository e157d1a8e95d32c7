"""The kinds of cells that can be requested from a file.

The command line imports this module for its help, so it imports little.
"""

from typing import Literal

CellKind = Literal["triangles", "quads", "tetrahedra"]
