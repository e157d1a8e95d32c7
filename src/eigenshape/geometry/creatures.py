"""Made-up creatures in any number of poses: closed manifold meshes for demos and tests."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError
from eigenshape.geometry.creature_plans import PLANS, Bone
from eigenshape.geometry.isosurface import isosurface
from eigenshape.geometry.mesh import TriangleMesh

CREATURES = tuple(sorted(PLANS))

BLEND = 0.03  # width over which round cones melt into each other
REACH = 0.3  # share of a bone's radius over which its pull on the skin fades
VARIATION = 0.1  # of lengths and widths between individuals
TO_Y_UP = [1, 2, 0]  # plans face x and stand along z
CLOSE_ENOUGH = 0.04  # of the number of vertices asked for


def make_creature(kind: str, pose: int = 0, *, n_vertices: int = 2500, individual: int = 0) -> TriangleMesh:
    """Make a creature: a closed, connected, outward-facing manifold surface, in a pose drawn from a seed.

    Poses are nearly isometric: the skin of the rest pose bends around joints, and lengths change by a few per cent. All
    poses of an individual share their faces, so that equal vertices correspond.

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
    InvalidShapeError
        If the creature has limbs too thin for so few vertices; 1500 serve every kind.
    """
    if kind not in PLANS:
        raise InvalidParameterError(f"kind must be one of {', '.join(CREATURES)}; it is {kind!r}.")
    whole_number(pose, "pose", 0, 2**32 - 1)
    whole_number(n_vertices, "n_vertices", 500, 100_000)
    whole_number(individual, "individual", 0, 2**32 - 1)
    rest, bones, influence = _at_rest(kind, int(n_vertices), int(individual))
    points = _posed(rest.vertices, bones, influence, _angles(kind, bones, pose))
    return TriangleMesh(points[:, TO_Y_UP], rest.faces)


@dataclass(frozen=True, eq=False)
class _Skeleton:
    """Bones in space: parent (-1 for none), both ends, both radii, and the swings of each as (k, 5) rows."""

    parent: Int[np.ndarray, " b"]
    begins: Float[np.ndarray, "b 3"]
    ends: Float[np.ndarray, "b 3"]
    radii: Float[np.ndarray, "b 2"]
    swings: tuple[Float[np.ndarray, "_ 5"], ...]


@lru_cache(maxsize=32)
def _at_rest(kind: str, n_vertices: int, individual: int) -> tuple[TriangleMesh, _Skeleton, Float[np.ndarray, "n b"]]:
    bones = _skeleton(PLANS[kind], individual)
    mesh = _skin(bones, n_vertices)
    return mesh, bones, _influence(mesh.vertices, bones)


def _skeleton(plan: list[Bone], individual: int) -> _Skeleton:
    rng = np.random.default_rng([individual, len(plan)])
    names: list[str] = []
    parent: list[int] = []
    begins: list[np.ndarray] = []
    ends: list[np.ndarray] = []
    radii, swings = [], []
    for bone in plan:
        longer, wider = np.exp(VARIATION * rng.uniform(-1, 1, 2)) if individual else (1.0, 1.0)
        for side in (1, -1) if bone.name.endswith("*") else (0,):
            names.append(_named(bone.name, side))
            parent.append(names.index(_named(bone.parent, side)) if bone.parent else -1)
            begins.append(ends[parent[-1]] if bone.parent else np.zeros(3))
            mirror = np.array([1.0, side or 1.0, 1.0])
            ends.append(begins[-1] + longer * mirror * bone.to)
            radii.append(wider * np.array(bone.radii))
            # Mirrored, a turn about y stays and turns about x and z change their sense.
            turn = np.array([side or 1.0, 1.0, side or 1.0, 1.0, 1.0])
            swings.append(np.array(bone.swings, dtype=np.float64).reshape(-1, 5) * turn)
    return _Skeleton(np.array(parent), np.array(begins), np.array(ends), np.array(radii), tuple(swings))


def _named(name: str, side: int) -> str:
    return name.replace("*", "+" if side > 0 else "-")


def _distances(points: Float[np.ndarray, "p 3"], bones: _Skeleton) -> Float[np.ndarray, "p b"]:
    """Return the signed distance to each bone as a cone with round ends, near enough."""
    columns = []
    for begin, end, (first, last) in zip(bones.begins, bones.ends, bones.radii, strict=True):
        along = end - begin
        share = np.clip((points - begin) @ along / (along @ along), 0, 1)
        radius = first + share * (last - first)
        columns.append(np.linalg.norm(points - begin - share[:, None] * along, axis=1) - radius)
    return np.column_stack(columns)


def _skin(bones: _Skeleton, n_vertices: int) -> TriangleMesh:
    def field(points: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, " p"]:
        distances = _distances(points, bones)
        nearest = distances.min(axis=1, keepdims=True)
        return nearest[:, 0] - BLEND * np.log(np.exp((nearest - distances) / BLEND).sum(axis=1))

    widest = bones.radii.max()
    low = np.minimum(bones.begins, bones.ends).min(axis=0) - widest - 3 * BLEND
    high = np.maximum(bones.begins, bones.ends).max(axis=0) + widest + 3 * BLEND
    lengths = np.linalg.norm(bones.ends - bones.begins, axis=1)
    spacing = float(np.sqrt(1.5 * np.pi * (lengths * bones.radii.sum(axis=1)).sum() / n_vertices))
    for _ in range(3):
        mesh = isosurface(field, low, high, spacing)
        if abs(mesh.n_vertices / n_vertices - 1) < CLOSE_ENOUGH:
            break
        spacing *= float(np.sqrt(mesh.n_vertices / n_vertices))
    return mesh


def _influence(points: Float[np.ndarray, "n 3"], bones: _Skeleton) -> Float[np.ndarray, "n b"]:
    """Return how much each point follows the swing of each bone: its own pull and that of all that hangs on it."""
    relative = _distances(points, bones) / (REACH * bones.radii.mean(axis=1))
    pull = np.exp(relative.min(axis=1, keepdims=True) - relative)
    pull /= pull.sum(axis=1, keepdims=True)
    for bone in range(len(bones.parent) - 1, -1, -1):
        if bones.parent[bone] >= 0:
            pull[:, bones.parent[bone]] += pull[:, bone]
    return pull


def _angles(kind: str, bones: _Skeleton, pose: int) -> list[Float[np.ndarray, " _"]]:
    rng = np.random.default_rng([pose, CREATURES.index(kind)])
    return [
        np.radians(rng.uniform(swing[:, 3], swing[:, 4])) if pose else np.zeros(len(swing)) for swing in bones.swings
    ]


def _posed(
    points: Float[np.ndarray, "n 3"],
    bones: _Skeleton,
    influence: Float[np.ndarray, "n b"],
    angles: list[Float[np.ndarray, " _"]],
) -> Float[np.ndarray, "n 3"]:
    """Turn each point about each joint by its share of the joint's angle, the outermost joints first."""
    for bone in range(len(bones.parent) - 1, -1, -1):
        for swing, angle in zip(bones.swings[bone], angles[bone], strict=True):
            axis = swing[:3] / np.linalg.norm(swing[:3])
            points = _turned(points, bones.begins[bone], axis, angle * influence[:, bone])
    return points


def _turned(
    points: Float[np.ndarray, "n 3"],
    pivot: Float[np.ndarray, "3"],
    axis: Float[np.ndarray, "3"],
    angles: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n 3"]:
    arm = points - pivot
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return pivot + cosine * arm + sine * np.cross(axis, arm) + (1 - cosine) * (arm @ axis)[:, None] * axis
