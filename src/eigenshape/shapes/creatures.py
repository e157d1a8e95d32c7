"""Synthetic creatures in any number of poses: closed manifold meshes for demos and tests."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.creature_plans import CREATURES, PLANS
from eigenshape.shapes.isosurface import find_spacing, isosurface, relax
from eigenshape.shapes.limbs import Body, distance_to_body, nearest_limbs, place_limbs
from eigenshape.shapes.skinning import Joints, bend_at_joints, diffuse
from eigenshape.shapes.thinning import collapse_shortest_edges

# The first mesh has this multiple of the requested number of vertices. The surplus lets `collapse_shortest_edges`
# remove the shortest edges; a larger surplus takes longer.
SURPLUS = 1.06
# Standard deviation of a bend along the skin, in radii of the limb. Smaller values fold the skin at
# joints, larger ones bend whole limbs.
SOFTNESS = 2.2
# Order of the axes that turns plans, which face +x and stand along +z, to face +z and stand along
# +y.
TO_Y_UP = [1, 2, 0]


def make_creature(
    kind: str, pose: int = 0, *, n_vertices: int = 2500, individual: int = 0
) -> TriangleMesh:
    """Make a synthetic creature in a random pose.

    The mesh is a closed, connected manifold that faces outward. Poses are nearly isometric: the
    skin of the rest pose bends around joints, and most lengths change by a few percent at most.

    Parameters
    ----------
    kind : str
        One of `es.shapes.CREATURES`.
    pose : int
        Seed of the pose; 0 is the rest pose.
    n_vertices : int
        Approximate number of vertices, 500 to 100,000.
    individual : int
        Seed of the proportions; 0 gives the standard ones.

    Returns
    -------
    TriangleMesh
        Upright along +y and facing +z, as in glTF; about two units long. All poses of an individual
        have the same faces, so equal vertex indices correspond.

    Raises
    ------
    InvalidParameterError
        If the kind is unknown or a number is out of range.

    See Also
    --------
    icosphere : A sphere.
    partial_scan : The part of a shape that is visible from one side.

    Examples
    --------
    >>> import eigenshape as es
    >>> rest = es.make_creature("snake", n_vertices=500)
    >>> posed = es.make_creature("snake", pose=3, n_vertices=500)
    >>> (rest.faces == posed.faces).all(), es.geometry.is_closed(posed)
    (np.True_, True)
    """
    if kind not in PLANS:
        raise InvalidParameterError(f"kind must be one of {', '.join(CREATURES)}; it is {kind!r}.")
    seed = whole_number(pose, "pose", 0, 2**32 - 1)
    about = whole_number(n_vertices, "n_vertices", 500, 100_000)
    rest, joints = _rest_pose(kind, about, whole_number(individual, "individual", 0, 2**32 - 1))
    points = rest.vertices
    if seed:
        # Angles near the limits are more likely than those between, so that poses differ clearly.
        low, high = joints.limits.T
        rng = np.random.default_rng([seed, CREATURES.index(kind)])
        share = (1 - np.cos(np.pi * rng.uniform(size=len(low)))) / 2
        points = bend_at_joints(points, joints, low + share * (high - low))
    return TriangleMesh(points[:, TO_Y_UP], rest.faces)


@lru_cache(maxsize=32)
def _rest_pose(kind: str, n_vertices: int, individual: int) -> tuple[TriangleMesh, Joints]:
    body = place_limbs(PLANS[kind], individual)

    def field(points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, " p"]:
        return distance_to_body(points, body)

    # Mesh the skin on a grid fine enough for the thinnest limb, then remove surplus vertices.
    wanted = find_spacing(field, *body.box, round(SURPLUS * n_vertices))
    spacing = min(wanted, body.thinnest)
    mesh = collapse_shortest_edges(isosurface(field, *body.box, spacing), n_vertices)
    mesh = relax(field, mesh, spacing)
    return mesh, _joints(mesh, body)


def _joints(mesh: TriangleMesh, body: Body) -> Joints:
    """Return the joints, the outermost first, and how much each vertex turns with each of them."""
    owner, place = nearest_limbs(mesh.vertices, body)
    rows, beyond, widths = [], [], []
    for number in range(len(body.limbs) - 1, -1, -1):
        limb = body.limbs[number]
        along = np.where(owner == number, place, body.attachment_nodes(number)[owner])
        for node, axis, low, high in sorted(
            limb.swings, key=lambda swing: -abs(swing[0] - limb.hub)
        ):
            rows.append([*limb.nodes[node, :3], *axis, low, high])
            # Vertices beyond the node, as seen from the hub of the limb, turn with the joint.
            beyond.append(along > node if node >= limb.hub else along < node)
            widths.append(SOFTNESS * limb.nodes[node, 3] * limb.squash.mean())
    table = np.array(rows)
    follows = diffuse(mesh, np.column_stack(beyond).astype(np.float64), np.array(widths))
    return Joints(table[:, :3], table[:, 3:6], np.radians(table[:, 6:]), follows)
