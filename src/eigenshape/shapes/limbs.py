"""A body made of limbs: smooth tubes that melt into each other, as a function that is zero on the skin."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import CubicHermiteSpline

from eigenshape.shapes.creature_plans import Limb, Swing

BLEND = 0.1  # difference of distances below which limbs melt into each other
FINE = 4  # straight pieces between two nodes
TINY = 1e-12  # keeps a distance of zero apart from a division by it
VARIATION = 0.1  # of lengths and widths between individuals


@dataclass(frozen=True, eq=False)
class PlacedLimb:
    """A limb in space: nodes and the pieces between them as rows of x, y, z and radius; parent is -1 for none."""

    nodes: Float[np.ndarray, "k 4"]
    pieces: Float[np.ndarray, "s 4"]
    squash: Float[np.ndarray, "3"]
    power: float
    parent: int
    parent_node: int
    hub: int
    swings: tuple[Swing, ...]


@dataclass(frozen=True, eq=False)
class Body:
    """Limbs, each after the one that it hangs on."""

    limbs: tuple[PlacedLimb, ...]

    @property
    def box(self) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Corners of a box that holds the skin."""
        pieces = np.concatenate([limb.pieces for limb in self.limbs])
        reach = pieces[:, 3:] + BLEND
        return (pieces[:, :3] - reach).min(axis=0), (pieces[:, :3] + reach).max(axis=0)

    @property
    def thinnest(self) -> float:
        """Least radius of a limb, along its least side."""
        return float(min(limb.nodes[:, 3].min() * limb.squash.min() for limb in self.limbs))

    def hangs_at(self, ancestor: int) -> Float[np.ndarray, " l"]:
        """Return the node of a limb at which each other one hangs, directly or by others; NaN where it does not."""
        at = np.full(len(self.limbs), np.nan)
        for number, limb in enumerate(self.limbs):
            if limb.parent == ancestor:
                at[number] = limb.parent_node
            elif limb.parent >= 0:
                at[number] = at[limb.parent]
        return at


def body_of(plan: Sequence[Limb], individual: int = 0) -> Body:
    """Place the limbs of a plan; the seed of an individual, unless it is 0, varies their lengths and widths."""
    growth = _growth(plan, individual)
    drawn = {
        _sided(limb.name, side): _mirrored(limb, side) for limb in plan for side in _sides(limb)
    }
    numbers = {name: number for number, name in enumerate(drawn)}
    placed: list[PlacedLimb] = []
    for name, limb in drawn.items():
        nodes = np.array(limb.nodes, dtype=np.float64)
        start, (parent, _, node) = nodes[0, :3], limb.parent.rpartition(" ")
        if parent:
            # What hangs on a wider limb hangs further from its middle.
            arm = start - drawn[parent].nodes[int(node)][:3]
            start = placed[numbers[parent]].nodes[int(node), :3] + growth[_group(parent)][1] * arm
        nodes = _grown(nodes, start, *growth[_group(name)])
        placed.append(_placed(limb, nodes, numbers.get(parent, -1), int(node or 0)))
    return Body(tuple(placed))


def _growth(plan: Sequence[Limb], individual: int) -> dict[str, Float[np.ndarray, "2"]]:
    """Draw how much longer and wider limbs are: those whose names begin with the same word alike."""
    rng = np.random.default_rng(individual)
    groups = dict.fromkeys(_group(limb.name) for limb in plan)
    return {
        group: np.exp(VARIATION * rng.uniform(-1, 1, 2)) if individual else np.ones(2)
        for group in groups
    }


def _group(name: str) -> str:
    return name.split(maxsplit=1)[0].rstrip("*+-")


def _sides(limb: Limb) -> tuple[int, ...]:
    return (1, -1) if limb.name.endswith("*") else (1,)


def _sided(name: str, side: int) -> str:
    return name.replace("*", "+" if side > 0 else "-")


def _mirrored(limb: Limb, side: int) -> Limb:
    """Return one of a pair: in a mirror a turn about y stays the same, and one about x or z changes its sense."""
    nodes = tuple((x, side * y, z, radius) for x, y, z, radius in limb.nodes)
    swings = tuple(
        (node, (side * x, y, side * z), low, high) for node, (x, y, z), low, high in limb.swings
    )
    return limb._replace(parent=_sided(limb.parent, side), nodes=nodes, swings=swings)


def _grown(
    nodes: Float[np.ndarray, "k 4"], start: Float[np.ndarray, "3"], longer: float, wider: float
) -> Float[np.ndarray, "k 4"]:
    return np.column_stack([start + longer * (nodes[:, :3] - nodes[0, :3]), wider * nodes[:, 3]])


def _placed(
    limb: Limb, nodes: Float[np.ndarray, "k 4"], parent: int, parent_node: int
) -> PlacedLimb:
    """Draw a smooth curve through the nodes (Catmull and Rom 1974), in straight pieces."""
    curve = CubicHermiteSpline(np.arange(len(nodes)), nodes, np.gradient(nodes, axis=0))
    pieces = curve(np.linspace(0, len(nodes) - 1, FINE * (len(nodes) - 1) + 1))
    squash = np.array(limb.squash, dtype=np.float64)
    return PlacedLimb(
        nodes, pieces, squash, float(limb.power), parent, parent_node, limb.hub, limb.swings
    )


def distance_to_body(points: Float[np.ndarray, "p 3"], body: Body) -> Float[np.ndarray, " p"]:
    """Return about the signed distance to the skin: that to the nearest limb, and less where limbs melt together.

    The minimum is smooth by a cubic in the differences, which counts only limbs that are within BLEND of the nearest.
    """
    apart = np.column_stack([distance_to_limb(points, limb)[0] for limb in body.limbs])
    nearest = apart.min(axis=1)
    melting = np.clip(1 - (apart - nearest[:, None]) / BLEND, 0, None) ** 3
    return nearest - BLEND / 6 * (melting.sum(axis=1) - 1)


def nearest_limbs(
    points: Float[np.ndarray, "p 3"], body: Body
) -> tuple[Int[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return the limb nearest to each point and the place along it, in nodes."""
    columns = [distance_to_limb(points, limb) for limb in body.limbs]
    owner = np.argmin([apart for apart, _ in columns], axis=0)
    return owner, np.array([place for _, place in columns])[owner, np.arange(len(points))]


def distance_to_limb(
    points: Float[np.ndarray, "p 3"], limb: PlacedLimb
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return about the signed distance to the skin of a limb, and the nearest place along it, in nodes.

    Further than 2 BLEND from its box, the distance to the box stands in for it.
    """
    centres, radii = limb.pieces[:, :3], limb.pieces[:, 3:]
    low, high = (centres - radii).min(axis=0), (centres + radii).max(axis=0)
    apart = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0), axis=1)
    place = np.zeros(len(points))
    close = np.flatnonzero(apart < 2 * BLEND)
    piece, share = _nearest_piece(points[close], limb)
    centre = limb.pieces[piece] + share[:, None] * (limb.pieces[piece + 1] - limb.pieces[piece])
    apart[close] = _beyond_skin(points[close] - centre[:, :3], centre[:, 3], limb)
    place[close] = (piece + share) / FINE
    return apart, place


def _nearest_piece(
    points: Float[np.ndarray, "p 3"], limb: PlacedLimb
) -> tuple[Int[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return the piece of a limb, as if it were round, whose skin is nearest, and how far along it."""
    begins, radii = limb.pieces[:-1, :3], limb.pieces[:, 3]
    along = np.diff(limb.pieces[:, :3], axis=0)
    length2 = np.square(along).sum(axis=1)
    reach = _products(points, along) - (begins * along).sum(axis=1)
    share = np.clip(reach / length2, 0, 1)
    # |p - b - s a|² with the squares taken apart: no array has both all points and all pieces and three coordinates.
    apart2 = (
        np.square(points).sum(axis=1)[:, None]
        - 2 * _products(points, begins)
        + np.square(begins).sum(axis=1)
    )
    apart2 += share * (share * length2 - 2 * reach)
    apart = np.sqrt(np.maximum(apart2, 0)) - radii[:-1] - share * np.diff(radii)
    piece = apart.argmin(axis=1)
    return piece, share[np.arange(len(points)), piece]


def _products(
    one: Float[np.ndarray, "p 3"], two: Float[np.ndarray, "s 3"]
) -> Float[np.ndarray, "p s"]:
    # Not by a matrix product: nothing promises that its last digits are free of the number of threads.
    return np.einsum("pi,si->ps", one, two)


def _beyond_skin(
    arm: Float[np.ndarray, "p 3"], radius: Float[np.ndarray, " p"], limb: PlacedLimb
) -> Float[np.ndarray, " p"]:
    """Return the distance to the squashed ball of a radius, to first order: value over slope of the norm it is of."""
    if limb.power == 2 and (limb.squash == 1).all():
        return np.sqrt(np.einsum("ij,ij->i", arm, arm)) - radius
    scaled = np.abs(arm) / limb.squash
    size = np.maximum((scaled**limb.power).sum(axis=1) ** (1 / limb.power), TINY)
    slope = np.linalg.norm((scaled / size[:, None]) ** (limb.power - 1) / limb.squash, axis=1)
    return (size - radius) / np.maximum(slope, 0.5)
