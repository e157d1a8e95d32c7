"""Several meshes as one."""

import numpy as np

from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.mesh import TriangleMesh


def disjoint_union(*meshes: MeshLike) -> TriangleMesh:
    """Combine meshes into one mesh, in which they are separate components.

    Coordinates do not change, and no vertices are joined.

    Parameters
    ----------
    *meshes : MeshLike
        At least one mesh.

    Returns
    -------
    TriangleMesh
        The vertices and faces of the first mesh, then those of the second, and so on.

    Raises
    ------
    InvalidParameterError
        If there is no mesh.

    See Also
    --------
    repair : "weld" joins vertices at the same place.

    Examples
    --------
    >>> import eigenshape as es
    >>> es.geometry.disjoint_union(es.icosphere(0), es.shapes.grid(1, 1))
    TriangleMesh(16 vertices, 22 faces)
    """
    if not meshes:
        raise InvalidParameterError(
            "disjoint_union must be given at least one mesh; it was given none."
        )
    parts = [as_mesh(mesh, f"meshes[{index}]") for index, mesh in enumerate(meshes)]
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in parts)])[:-1]
    faces = [mesh.faces + start for mesh, start in zip(parts, starts, strict=True)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in parts]), np.concatenate(faces))
