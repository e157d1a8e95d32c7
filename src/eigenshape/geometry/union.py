"""Several meshes as one."""

import numpy as np

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh


def disjoint_union(*meshes: MeshLike) -> TriangleMesh:
    """Put meshes into one, as separate components with their coordinates unchanged."""
    if not meshes:
        raise InvalidParameterError("disjoint_union must be given a mesh; it was given none.")
    parts = [as_mesh(mesh, f"meshes[{index}]") for index, mesh in enumerate(meshes)]
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in parts)])[:-1]
    faces = [mesh.faces + start for mesh, start in zip(parts, starts, strict=True)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in parts]), np.concatenate(faces))
