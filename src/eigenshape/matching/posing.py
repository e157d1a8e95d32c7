"""Bend a shape into the pose of another one, by the map between them."""

import numpy as np

from certeig.kit.arguments import require_type
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from eigenshape.deformation.pose_transfer import transfer_deformation
from eigenshape.geometry.conversion import MeshLike, as_mesh
from eigenshape.geometry.measure import surface_area
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.matching.match import match_shapes
from eigenshape.matching.shape_match import ShapeMatch


@one_blas_thread()
def take_pose(mesh: MeshLike, like: MeshLike, *, match: ShapeMatch | None = None) -> TriangleMesh:
    """Bend a shape into the pose of another shape, which it is matched to.

    The rotations from the shape to its image on the other shape are smoothed in the 50 lowest modes
    and turn its edges (`transfer_deformation`): limbs keep their lengths and details, and take the
    directions of those of the other shape.

    Parameters
    ----------
    mesh : MeshLike
        The shape to bend, with n vertices.
    like : MeshLike
        A shape in the wanted pose, of another individual or with other triangles.
    match : ShapeMatch, optional
        Of `match_shapes(mesh, like)`, or another map; by default it is computed, after both are
        scaled to one area.

    Returns
    -------
    TriangleMesh
        With the same faces as `mesh`, in the place of `like`.

    Raises
    ------
    InvalidParameterError
        If the match has another number of vertices than the mesh, or leaves some out.
    InvalidShapeError
        If a mesh cannot be matched; see `match_shapes`.

    Warns
    -----
    UserWarning
        If vertices are double along seams, where the shape would come apart.

    See Also
    --------
    match_shapes : Compute the map, and see how sure it is.
    transfer_deformation : Bend a shape in the way another one was bent, if its rest pose is known.

    Examples
    --------
    >>> import eigenshape as es
    >>> standing, walking = (es.make_creature("quadruped", pose, n_vertices=600) for pose in (0, 1))
    >>> bent = es.matching.take_pose(standing, walking)
    >>> bool((bent.faces == standing.faces).all())
    True
    """
    mesh = as_mesh(mesh)
    like = as_mesh(like, "like")
    factor = float(np.sqrt(surface_area(like) / surface_area(mesh)))
    if match is None:
        match = match_shapes(mesh, like, scale=factor)
    require_type(match, ShapeMatch, "match")
    if match.n_vertices != mesh.n_vertices:
        raise InvalidParameterError(
            f"The match must be of the mesh that is bent; it has {match.n_vertices} vertices, and "
            f"the mesh has {mesh.n_vertices}. Pass match_shapes(mesh, like)."
        )
    if not match.mapped.all():
        raise InvalidParameterError(
            f"The match must place each vertex; it leaves out {(~match.mapped).sum()} vertices, first "
            f"{match.mapped.argmin()}. Pass match_shapes(mesh, like), without an overlap."
        )
    image = TriangleMesh(match.pull(like.vertices) / factor, mesh.faces)
    return transfer_deformation(mesh, image, mesh, np.arange(mesh.n_vertices))
