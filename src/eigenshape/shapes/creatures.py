"""Synthetic creatures in any number of poses: closed manifold meshes for demos and tests."""

import heapq
import math
from functools import lru_cache, partial

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.linalg import splu

from certeig.kit.arrays import record, whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.threads import one_blas_thread
from eigenshape._arrays import adjacency_matrix
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import edge_table
from eigenshape.shapes.creature_plans import CREATURES, PLANS
from eigenshape.shapes.isosurface import find_spacing, isosurface, relax
from eigenshape.shapes.limbs import distance_to_body, nearest_limbs, place_limbs

# The first mesh has this multiple of the requested number of vertices. The surplus lets `collapse_shortest_edges`
# remove the shortest edges; a larger surplus takes longer.
SURPLUS = 1.06
# Standard deviation of a bend along the skin, in radii of the limb. Smaller values fold the skin at
# joints, larger ones bend whole limbs.
SOFTNESS = 2.2
# Order of the axes that turns plans, which face +x and stand along +z, to face +z and stand along
# +y.
TO_Y_UP = [1, 2, 0]
# Implicit diffusion steps of the narrowest bend; wider bends take more steps of the same length.
# Three steps are close to a Gaussian profile.
STEPS = 3
# Numbers of neighbors that a collapse may leave a vertex with. Outside this range triangles become
# slivers; in a regular mesh every vertex has 6.
FEWEST_NEIGHBORS, MOST_NEIGHBORS = 4, 8


@record
class Joints:
    """The joints of a creature, the outermost first.

    Attributes
    ----------
    pivots, axes : (j, 3) float
        A point and the unit direction of the axis of each joint.
    limits : (j, 2) float
        Smallest and largest angle of each joint, in radians.
    follows : (n, j) float
        Share of the angle by which each vertex turns: 1 beyond the joint, 0 before it.
    """

    pivots: Float[np.ndarray, "j 3"]
    axes: Float[np.ndarray, "j 3"]
    limits: Float[np.ndarray, "j 2"]
    follows: Float[np.ndarray, "n j"]


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
    >>> import numpy as np
    >>> import eigenshape as es
    >>> rest = es.make_creature("snake", n_vertices=500)
    >>> posed = es.make_creature("snake", pose=3, n_vertices=500)
    >>> np.array_equal(rest.faces, posed.faces), es.geometry.is_closed(posed)
    (True, True)
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
    field = partial(distance_to_body, body=body)
    # Mesh the skin on a grid fine enough for the thinnest limb, then remove surplus vertices.
    wanted = find_spacing(field, *body.box, round(SURPLUS * n_vertices))
    spacing = min(wanted, body.thinnest)
    mesh = collapse_shortest_edges(_fine_skin(kind, individual, spacing), n_vertices)
    mesh = relax(field, mesh, spacing)
    # The joints, the outermost first, and how much each vertex turns with each of them
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
    joints = Joints(table[:, :3], table[:, 3:6], np.radians(table[:, 6:]), follows)
    return mesh, joints


@lru_cache(maxsize=len(CREATURES))
def _fine_skin(kind: str, individual: int, spacing: float) -> TriangleMesh:
    """Return the skin, which creatures of few vertices share: their thinnest limb chooses the spacing."""
    body = place_limbs(PLANS[kind], individual)
    return isosurface(partial(distance_to_body, body=body), *body.box, spacing)


def diffuse(
    mesh: TriangleMesh, values: Float[np.ndarray, "n j"], widths: Float[np.ndarray, " j"]
) -> Float[np.ndarray, "n j"]:
    """Diffuse functions on a mesh of even triangles, each by a given standard deviation in length.

    Diffusion stays on the skin, so nothing leaks to another limb that is only near in space.
    """
    edges = edge_table(mesh).edges
    ends = mesh.vertices[edges]
    length2 = np.square(ends[:, 0] - ends[:, 1]).sum(axis=1).mean()
    links = adjacency_matrix(edges, np.ones(len(edges)), mesh.n_vertices)
    step = widths.min() ** 2 / STEPS
    # With six neighbors at equal distance the sum of differences is 3/2 length² times the
    # Laplacian, and the variance of diffused heat is twice the time.
    pencil = sp.eye_array(mesh.n_vertices) + step / (3 * length2) * (
        sp.diags_array(links.sum(axis=1)) - links
    )
    spread, n_steps = values.copy(), np.rint(widths**2 / step)
    with one_blas_thread():
        factor = splu(pencil.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        for step_number in range(int(n_steps.max())):
            unfinished = n_steps > step_number
            spread[:, unfinished] = factor.solve(spread[:, unfinished])
    return spread


def bend_at_joints(
    points: Float[np.ndarray, "n 3"], joints: Joints, angles: Float[np.ndarray, " j"]
) -> Float[np.ndarray, "n 3"]:
    """Rotate each point about each joint by its share of the angle (Rodrigues' formula)."""
    for pivot, axis, angle, share in zip(
        joints.pivots, joints.axes, angles, joints.follows.T, strict=True
    ):
        arm = points - pivot
        cosine, sine = np.cos(angle * share)[:, None], np.sin(angle * share)[:, None]
        points = (
            pivot
            + cosine * arm
            + sine * np.cross(axis, arm)
            + (1 - cosine) * np.einsum("ni,i->n", arm, axis)[:, None] * axis
        )
    return points


def collapse_shortest_edges(mesh: TriangleMesh, n_vertices: int) -> TriangleMesh:
    """Collapse the shortest edges of a closed manifold until it has at most `n_vertices` vertices.

    An edge collapses to its midpoint if its ends have exactly two neighbors in common, so that the
    surface stays a manifold of the same genus (the link condition: Dey, Edelsbrunner, Guha and
    Nekhayev 1999), and if no vertex gets too few or too many neighbors. If no edge may collapse,
    more vertices remain.
    """
    points, edges = mesh.vertices.tolist(), edge_table(mesh).edges.tolist()
    around: list[set[int]] = [set() for _ in points]
    for one, two in edges:
        around[one].add(two)
        around[two].add(one)
    shortest = [(math.dist(points[one], points[two]), one, two) for one, two in edges]
    heapq.heapify(shortest)
    target = list(range(mesh.n_vertices))
    surplus = mesh.n_vertices - n_vertices
    while surplus > 0 and shortest:
        length, kept, gone = heapq.heappop(shortest)
        # The heap still holds edges that have collapsed or changed their length since.
        out_of_date = gone not in around[kept] or length != math.dist(points[kept], points[gone])
        if out_of_date:
            continue
        common = around[kept] & around[gone]
        n_left = len(around[kept]) + len(around[gone]) - 4
        if (
            len(common) != 2
            or not FEWEST_NEIGHBORS <= n_left <= MOST_NEIGHBORS
            or any(len(around[other]) <= FEWEST_NEIGHBORS for other in common)
        ):
            continue
        points[kept] = [(x + y) / 2 for x, y in zip(points[kept], points[gone], strict=True)]
        target[gone] = kept
        for other in around[gone]:
            around[other].remove(gone)
            if other != kept:
                around[other].add(kept)
                around[kept].add(other)
        around[gone] = set()
        for other in sorted(around[kept]):
            heapq.heappush(shortest, (math.dist(points[kept], points[other]), kept, other))
        surplus -= 1
    # Replace the corners of faces by what they have collapsed to, and leave out collapsed faces.
    into = np.array(target)
    while (into[into] != into).any():
        into = into[into]
    stays, number = np.unique(into, return_inverse=True)
    corners = number[mesh.faces]
    alive = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return TriangleMesh(np.array(points)[stays], corners[alive])
