"""Made-up creatures in any number of poses: closed manifold meshes for demos and tests."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.shapes.creature_plans import PLANS
from eigenshape.shapes.isosurface import isosurface, relaxed, spacing_for
from eigenshape.shapes.limbs import Body, body_of, distance_to_body, nearest_limbs
from eigenshape.shapes.skinning import Joints, diffused, turned
from eigenshape.shapes.thinning import thinned

CREATURES = tuple(sorted(PLANS))

SPARE = 1.06  # times as many vertices as asked for, of which the surplus is thinned out
SOFTNESS = 2.2  # standard deviation of a bend along the skin, in thicknesses of the limb
TO_Y_UP = [1, 2, 0]  # plans face x and stand along z


def make_creature(
    kind: str, pose: int = 0, *, n_vertices: int = 2500, individual: int = 0
) -> TriangleMesh:
    """Make a creature: a closed, connected, outward-facing manifold surface, in a pose drawn from a seed.

    Poses are nearly isometric: the skin of the rest pose bends around joints, and most lengths change by a few per
    cent at most. All poses of an individual share their faces, so that equal vertices correspond.

    Parameters
    ----------
    kind : str
        One of `CREATURES`.
    pose : int
        Seed of the pose; 0 is at rest.
    n_vertices : int
        About how many vertices, 500 to 100000.
    individual : int
        Seed of its proportions; 0 has those of the plan.

    Returns
    -------
    TriangleMesh
        Upright along +y and facing +z, as in glTF; about two units long.

    Raises
    ------
    InvalidParameterError
        If the kind is unknown or a number is out of range.
    """
    if kind not in PLANS:
        raise InvalidParameterError(f"kind must be one of {', '.join(CREATURES)}; it is {kind!r}.")
    seed = whole_number(pose, "pose", 0, 2**32 - 1)
    about = whole_number(n_vertices, "n_vertices", 500, 100_000)
    rest, joints = _at_rest(kind, about, whole_number(individual, "individual", 0, 2**32 - 1))
    points = (
        turned(rest.vertices, joints, _angles(joints, [seed, CREATURES.index(kind)]))
        if seed
        else rest.vertices
    )
    return TriangleMesh(points[:, TO_Y_UP], rest.faces)


@lru_cache(maxsize=32)
def _at_rest(kind: str, n_vertices: int, individual: int) -> tuple[TriangleMesh, Joints]:
    body = body_of(PLANS[kind], individual)
    mesh = _skin(body, n_vertices)
    return mesh, _joints(mesh, body)


def _skin(body: Body, n_vertices: int) -> TriangleMesh:
    """Mesh the skin on a grid fine enough for the thinnest limb, then let the shortest edges collapse."""

    def field(points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, " p"]:
        return distance_to_body(points, body)

    spacing = min(spacing_for(field, *body.box, round(SPARE * n_vertices)), body.thinnest)
    return relaxed(field, thinned(isosurface(field, *body.box, spacing), n_vertices), spacing)


def _joints(mesh: TriangleMesh, body: Body) -> Joints:
    """List the joints, the outermost first, and how much each vertex follows each of them."""
    owner, place = nearest_limbs(mesh.vertices, body)
    rows, beyond, widths = [], [], []
    for number in range(len(body.limbs) - 1, -1, -1):
        limb = body.limbs[number]
        along = np.where(owner == number, place, body.hangs_at(number)[owner])
        for node, axis, low, high in sorted(
            limb.swings, key=lambda swing: -abs(swing[0] - limb.hub)
        ):
            rows.append([*limb.nodes[node, :3], *axis, low, high])
            beyond.append(along > node if node >= limb.hub else along < node)
            widths.append(SOFTNESS * limb.nodes[node, 3] * limb.squash.mean())
    table = np.array(rows)
    follows = diffused(mesh, np.column_stack(beyond).astype(np.float64), np.array(widths))
    return Joints(table[:, :3], table[:, 3:6], np.radians(table[:, 6:]), follows)


def _angles(joints: Joints, seed: list[int]) -> Float[np.ndarray, " j"]:
    """Draw the angle of each joint, more often near its limits than between them, so that poses differ clearly."""
    low, high = joints.limits.T
    share = (1 - np.cos(np.pi * np.random.default_rng(seed).uniform(size=len(low)))) / 2
    return low + share * (high - low)
