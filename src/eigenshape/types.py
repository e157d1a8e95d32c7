"""Annotations for the signatures of your own functions.

`MeshLike` is what every public function takes for a mesh, and `ShapeLike` also includes point
clouds.
"""

from eigenshape._progress import Progress
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.region import Region
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.conversion import MeshLike, ShapeLike
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.choices import Condition
from eigenshape.spectral.laws.report import Promise

__all__ = [
    "Condition",
    "Handle",
    "Mesh",
    "MeshLike",
    "Progress",
    "Promise",
    "Region",
    "Shape",
    "ShapeLike",
]
