"""Annotations for the signatures of your own functions.

`MeshLike` is what every public function takes for a mesh, and `ShapeLike` also includes point
clouds. `help(es.types.MeshLike)` says what an annotation stands for.
"""

from contextlib import suppress

from certeig.kit.progress import Progress
from eigenshape.deformation.handles import Handle
from eigenshape.deformation.region import Region
from eigenshape.geometry.cloud import Shape
from eigenshape.geometry.conversion import MeshLike, ShapeLike
from eigenshape.geometry.simplicial import Mesh
from eigenshape.operators.choices import Condition
from eigenshape.spectral.laws.outcomes import Promise

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

_TEXTS = {
    "Condition": """The condition at the boundary of a shape.

    "neumann" leaves the boundary free, "dirichlet" fixes it at zero.
    """,
    "Handle": """A motion of a region: `es.Rotation`, `es.Translation` or `es.deformation.Scaling`.""",
    "Mesh": """A mesh of any dimension: an `es.TriangleMesh` or an `es.SimplicialMesh`.""",
    "MeshLike": """A mesh, or an object from which `es.as_mesh` makes one.

    An `es.TriangleMesh` or `es.SimplicialMesh`; an object with vertices and faces, such as a
    `trimesh.Trimesh`; a `pyvista.PolyData` of triangles; or a pair of arrays (vertices, faces).
    """,
    "Progress": """A function that is called with the fraction done, in 0..1, and a short message.""",
    "Promise": """The name of a law of Laplace operators, for `es.check_operator`.

    "constants": the stiffness annihilates the constants of each component, and nothing else.
    "components": nothing joins components of the shape.
    "definite": nothing is annihilated, as where every component has a fixed point.
    "volume": the mass adds up to the volume of the shape.
    "nonnegative_weights": no weight is negative, which gives the maximum principle.
    "rigid_motion", "reflection", "orientation": moving, reflecting the shape or turning its faces
    over changes nothing. "scaling": eigenvalues scale by 1/length². "union": the operator of two
    shapes is that of each.
    """,
    "Region": """The vertices that are moved or held.

    An `es.deformation.BoxRegion` or `es.deformation.BrushRegion`, a boolean mask (n,), or indices.
    """,
    "Shape": """A mesh or a point cloud: an `es.types.Mesh` or an `es.PointCloud`.""",
    "ShapeLike": """A mesh, an object from which `es.as_mesh` makes one, or an `es.PointCloud`.""",
}
for _name, _text in _TEXTS.items():
    # An alias is no class with a docstring of its own, and refuses to set an attribute; `help`
    # reads this one. Aliases of Python 3.14 have no place for it, and say less.
    with suppress(AttributeError):
        object.__setattr__(globals()[_name], "__doc__", _text)
