"""Bodies made of limbs: smooth tubes blended together, as a function that is zero on the skin."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy.interpolate import CubicHermiteSpline

from certeig.kit.arrays import record
from eigenshape._vectors import row_dots
from eigenshape.shapes.creature_plans import Limb, Swing
from eigenshape.shapes.limb_loops import nearest_pieces

# Limbs are blended where the difference of their distances is below this length (a creature is
# about two units long). A larger value makes joints thicker and fuses limbs that are near each
# other.
BLEND = 0.1
PIECES_PER_SEGMENT = 4  # straight pieces between two nodes of a limb; more are smoother and slower
TINY_SIZE = 1e-12  # lower bound of a size that is divided by
VARIATION = 0.1  # largest logarithm of the lengths and widths of an individual


@record
class PlacedLimb:
    """A limb in space.

    Nodes, and the ends of the pieces between them, are rows of x, y, z and radius. The parent is
    the index of another limb, or -1.
    """

    nodes: Float[np.ndarray, "k 4"]
    pieces: Float[np.ndarray, "s 4"]
    squash: Float[np.ndarray, "3"]
    power: float
    parent: int
    parent_node: int
    hub: int
    swings: tuple[Swing, ...]


@record
class Body:
    """Limbs, each after its parent."""

    limbs: tuple[PlacedLimb, ...]

    @property
    def box(self) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Lowest and highest corner of a box that contains the skin."""
        pieces = np.concatenate([limb.pieces for limb in self.limbs])
        reach = pieces[:, 3:] + BLEND
        return (pieces[:, :3] - reach).min(axis=0), (pieces[:, :3] + reach).max(axis=0)

    @property
    def thinnest(self) -> float:
        """Smallest radius of a limb, along the axis in which it is thinnest."""
        return float(min(limb.nodes[:, 3].min() * limb.squash.min() for limb in self.limbs))

    def attachment_nodes(self, ancestor: int) -> Float[np.ndarray, " l"]:
        """Return the node of limb `ancestor` at which each limb is attached, directly or not.

        NaN for limbs that are not attached to it.
        """
        at = np.full(len(self.limbs), np.nan)
        for number, limb in enumerate(self.limbs):
            if limb.parent == ancestor:
                at[number] = limb.parent_node
            elif limb.parent >= 0:
                at[number] = at[limb.parent]
        return at


def place_limbs(plan: Sequence[Limb], individual: int = 0) -> Body:
    """Place the limbs of a plan in space.

    The seed of an individual varies the lengths and widths of the limbs, unless it is 0.
    """
    # How much longer and wider limbs are. Names with the same first word vary together.
    rng = np.random.default_rng(individual)
    growth = {
        group: np.exp(VARIATION * rng.uniform(-1, 1, 2)) if individual else np.ones(2)
        for group in dict.fromkeys(_group(limb.name) for limb in plan)
    }
    drawn: dict[str, Limb] = {}
    for limb in plan:
        for side in (1, -1) if limb.name.endswith("*") else (1,):
            # In the mirror a rotation about y stays the same, and one about x or z changes its sense.
            mirrored = limb._replace(
                parent=_name_side(limb.parent, side),
                nodes=tuple((x, side * y, z, radius) for x, y, z, radius in limb.nodes),
                swings=tuple(
                    (node, (side * x, y, side * z), low, high)
                    for node, (x, y, z), low, high in limb.swings
                ),
            )
            drawn[_name_side(limb.name, side)] = mirrored
    numbers = {name: number for number, name in enumerate(drawn)}
    placed: list[PlacedLimb] = []
    for name, limb in drawn.items():
        nodes = np.array(limb.nodes, dtype=np.float64)
        start, (parent, _, node) = nodes[0, :3], limb.parent.rpartition(" ")
        if parent:
            # A limb attached to a wider one starts farther from its middle.
            arm = start - drawn[parent].nodes[int(node)][:3]
            start = placed[numbers[parent]].nodes[int(node), :3] + growth[_group(parent)][1] * arm
        longer, wider = growth[_group(name)]
        lengthened = start + longer * (nodes[:, :3] - nodes[0, :3])
        nodes = np.column_stack([lengthened, wider * nodes[:, 3]])
        # A smooth curve through the nodes (Catmull and Rom 1974).
        curve = CubicHermiteSpline(np.arange(len(nodes)), nodes, np.gradient(nodes, axis=0))
        n_pieces = PIECES_PER_SEGMENT * (len(nodes) - 1)
        placed.append(
            PlacedLimb(
                nodes=nodes,
                pieces=curve(np.linspace(0, len(nodes) - 1, n_pieces + 1)),
                squash=np.array(limb.squash, dtype=np.float64),
                power=float(limb.power),
                parent=numbers.get(parent, -1),
                parent_node=int(node or 0),
                hub=limb.hub,
                swings=limb.swings,
            )
        )
    return Body(tuple(placed))


def _group(name: str) -> str:
    return name.split(maxsplit=1)[0].rstrip("*+-")


def _name_side(name: str, side: int) -> str:
    return name.replace("*", "+" if side > 0 else "-")


def distance_to_body(points: Float[np.ndarray, "p 3"], body: Body) -> Float[np.ndarray, " p"]:
    """Return the approximate signed distance to the skin: a smooth minimum over the limbs.

    The distance to the nearest limb is reduced by a cubic in the differences to other limbs, which
    counts only limbs within BLEND of the nearest.
    """
    distances = np.stack([distance_to_limb(points, limb)[0] for limb in body.limbs])
    nearest = distances.min(axis=0)
    blended = np.clip(1 - (distances - nearest) / BLEND, 0, None) ** 3
    return nearest - BLEND / 6 * (np.ascontiguousarray(blended.T).sum(axis=1) - 1)


def nearest_limbs(
    points: Float[np.ndarray, "p 3"], body: Body
) -> tuple[Int[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return the limb nearest to each point and the position along it, in nodes."""
    columns = [distance_to_limb(points, limb) for limb in body.limbs]
    owner = np.argmin([apart for apart, _ in columns], axis=0)
    return owner, np.array([place for _, place in columns])[owner, np.arange(len(points))]


def distance_to_limb(
    points: Float[np.ndarray, "p 3"], limb: PlacedLimb
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return the approximate signed distance to a limb, and the position along it, in nodes.

    Farther than 2 BLEND from the box around the limb, the distance to that box is returned.
    """
    centers, radii = limb.pieces[:, :3], limb.pieces[:, 3:]
    box = np.stack([(centers - radii).min(axis=0), (centers + radii).max(axis=0)])
    n, place = len(points), np.zeros(len(points))
    (apart, *found), close, arm = np.empty((4, n)), np.empty(n, np.int64), np.empty((n, 3))
    points = np.ascontiguousarray(points)
    n_close = nearest_pieces(points, limb.pieces, box, 2 * BLEND, apart, close, arm, *found)
    close, arm = close[:n_close], arm[:n_close]
    radius, piece, share = (each[:n_close] for each in found)
    place[close] = (piece + share) / PIECES_PER_SEGMENT

    # The distance to the cross-section, a superellipsoid, to first order: the value of the norm
    # that defines it, minus the radius, divided by its slope.
    if limb.power == 2 and (limb.squash == 1).all():
        apart[close] = np.sqrt(row_dots(arm, arm)) - radius
        return apart, place
    scaled = np.abs(arm) / limb.squash
    size = np.maximum((scaled**limb.power).sum(axis=1) ** (1 / limb.power), TINY_SIZE)
    slope = np.linalg.norm((scaled / size[:, None]) ** (limb.power - 1) / limb.squash, axis=1)
    apart[close] = (size - radius) / np.maximum(slope, 0.5)
    return apart, place
