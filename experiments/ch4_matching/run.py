"""When do samples of two close surfaces correspond one to one, and how near are partners? (thesis 4.2, Theorem 4.2.1).

A sphere and the same with twelve handles are thrown points on; for each number of points the matching of the theorem is
looked for, with less and less reach, and the one whose longest move is shortest.
"""

import sys
from argparse import Namespace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.progress import track

import eigenshape as es

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))
from frame import COLORS, chart, finish, label, parse_arguments, rounded  # noqa: E402
from handled_sphere import MU, make_pair  # noqa: E402

RHO = es.stability.matching_reach(MU)
STEPS = 6  # of the search for the least reach
FULL = Namespace(level=6, region=0.0098, stretch=0.003, deltas=(0.04, 0.02, 0.01), shown=(0.04, 2000),
                 counts=(31, 125, 250, 500, 1000, 2000, 4000, 8000), samples=20, searches=40_000)  # fmt: skip
QUICK = Namespace(level=5, region=0.02, stretch=0.006, deltas=(0.08, 0.04), shown=(0.08, 250),
                  counts=(31, 125, 500), samples=10, searches=5000)  # fmt: skip
HANDLE = 0.07
LAW = "(log n)^(3/4) / √n"


def throw(
    pair: es.stability.Perturbation, n: int, seed: int
) -> tuple[es.geometry.SurfacePoints, es.geometry.SurfacePoints, es.geometry.SurfacePoints]:
    """Throw n points on the sphere, on the one with handles, and again on the sphere."""
    streams = np.random.default_rng([n, seed]).spawn(3)
    shapes = (pair.one, pair.two, pair.one)
    one, two, again = (
        es.geometry.sample_surface(shape, n, rng=rng)
        for shape, rng in zip(shapes, streams, strict=True)
    )
    return one, two, again


def least_reach(
    pair: es.stability.Perturbation,
    points: tuple[es.geometry.SurfacePoints, es.geometry.SurfacePoints],
    nodes: np.ndarray,
    ends: tuple,
) -> float:
    """Search for the reach (ρ+1)δ of witness regions from which on the graph has a perfect matching, to 1/64 of ends.

    The lower end does not suffice, or is 0; the upper one does.
    """

    def suffices(reach: float) -> bool:
        # Reach is all that counts of δ and ρ once nodes are chosen.
        graph = es.stability.correspondence_graph(
            pair, *points, nodes=nodes, delta=reach / 2, rho=1.0
        )
        return es.stability.maximum_matching(graph).is_perfect

    low, high = ends
    for _ in range(STEPS):
        middle = (low + high) / 2
        low, high = (low, middle) if suffices(middle) else (middle, high)
    return high


def measure(
    pair: es.stability.Perturbation,
    nodes: dict[float, es.stability.AnchorNodes],
    n: int,
    plan: Namespace,
) -> dict[str, object]:
    """Return bottleneck distances of samples, and the least reach for each δ: of fewer where that is dear."""
    closeness = es.stability.measure_closeness(pair)
    changed, same = [], []
    reaches = {delta: [] for delta in nodes}
    for seed in track(range(plan.samples), description=f"{n} points"):
        one, two, again = throw(pair, n, seed)
        changed.append(es.stability.bottleneck_matching(one.points, two.points).distance)
        same.append(es.stability.bottleneck_matching(one.points, again.points).distance)
        for delta, chosen in nodes.items() if seed < plan.searches // n else ():
            # A point is near its node, and near its partner's place before the change.
            margin = chosen.cover + closeness.displacement.max() + 2 * closeness.radii.max()
            ends = max(0.0, changed[-1] - margin), changed[-1] + margin
            reaches[delta].append(least_reach(pair, (one, two), chosen.points, ends))
    return {"bottleneck": changed, "bottleneck, unchanged": same, "reach": reaches}


def summary(found: dict[str, object]) -> dict[str, object]:
    """Return medians, and the share of samples with a perfect matching at the reach of the theorem."""
    row = {"samples": len(found["bottleneck"]), "searches": min(map(len, found["reach"].values()))}
    for name in ("bottleneck", "bottleneck, unchanged"):
        row[name] = np.quantile(found[name], [0.5, 0.05, 0.95])
    for delta, values in found["reach"].items():
        reaches = np.array(values)
        row[f"δ = {delta}"] = {
            "probability": float(np.mean(reaches <= (RHO + 1) * delta)),
            "least reach / δ": float(np.median(reaches) / delta),
        }
    return row


def rates(rows: dict[int, dict[str, object]]) -> dict[str, object]:
    """Fit laws to the median bottleneck distance: of each the constant, and how unequal it is from n to n."""
    counts = np.array([n for n in rows if n >= 100], dtype=float)
    medians = np.array([rows[int(n)]["bottleneck"][0] for n in counts])
    laws = {LAW: 0.75, "(log n)^(1/2) / √n": 0.5, "1 / √n": 0.0}
    fits = {}
    for name, power in laws.items():
        constants = medians * np.sqrt(counts) / np.log(counts) ** power
        fits[name] = {
            "constant": float(np.median(constants)),
            "unequal": float(constants.max() / constants.min() - 1),
        }
    fits["slope"] = float(np.polyfit(np.log(counts), np.log(medians), 1)[0])
    return fits


def check(
    pair: es.stability.Perturbation, nodes: es.stability.AnchorNodes, delta: float, n: int
) -> dict[str, float]:
    """Build the theorem's graph once, match it, and return the longest edge and move over δ."""
    one, two, _ = throw(pair, n, 0)
    graph = es.stability.correspondence_graph(
        pair, one, two, nodes=nodes.points, delta=delta, rho=RHO
    )
    found, ends = es.stability.maximum_matching(graph), graph.tocoo()
    edges = np.linalg.norm(one.points[ends.row] - two.points[ends.col], axis=1)
    moves = np.linalg.norm(one.points - two.points[found.partners], axis=1)
    best = es.stability.bottleneck_matching(one.points, two.points).distance
    return {
        "δ": delta, "n": n, "unmatched": n - found.n_matched, "longest edge / δ": float(edges.max() / delta),
        "longest move / δ": float(moves.max() / delta), "bottleneck / δ": best / delta,
    }  # fmt: skip


def run(plan: Namespace) -> tuple[dict[str, object], es.stability.Perturbation]:
    """Measure everything."""
    pair = make_pair(plan.level, region=plan.region, handle=HANDLE, stretch=plan.stretch)
    closeness = es.stability.measure_closeness(pair)
    nodes = {delta: es.stability.anchor_nodes(pair.one, delta) for delta in plan.deltas}
    rows = {}
    for n in plan.counts:
        rows[n] = summary(measure(pair, nodes, n, plan))
    return {
        "δ of the pair": closeness.delta,
        "decided by": closeness.limited_by,
        "genus": 1 - es.geometry.euler_characteristic(pair.two) // 2,
        "ρ": RHO,
        "nodes": {
            delta: {"number": len(some.vertices), "cover": some.cover}
            for delta, some in nodes.items()
        },
        "points": rows,
        "rate": rates(rows),
        "the graph itself": check(pair, nodes[plan.shown[0]], *plan.shown),
    }, pair


def plain_ticks(axes: Axes, counts: list[int]) -> None:
    """Write the numbers of points as they are."""
    axes.set_xticks(counts, [str(n) for n in counts], fontsize=8)
    axes.minorticks_off()


def draw_probability(results: dict[str, object]) -> Figure:
    """Draw how often the theorem's graph has a perfect matching, and the least reach with which half of them have."""
    figure, (left, right) = chart(11, 4.4, columns=2)
    rows = results["points"]
    counts = list(rows)
    for color, delta in zip(COLORS, results["nodes"], strict=False):
        cells = [rows[n][f"δ = {delta}"] for n in counts]
        left.semilogx(
            counts, [cell["probability"] for cell in cells], "o-", color=color, label=f"δ = {delta}"
        )
        right.loglog(
            counts,
            [cell["least reach / δ"] for cell in cells],
            "o-",
            color=color,
            label=f"δ = {delta}",
        )
    right.axhline(
        RHO + 1, color="black", linestyle="--", label=f"the theorem's reach, ρ + 1 = {RHO + 1:.2f}"
    )
    left.set_ylim(-0.03, 1.03)
    samples = [row["searches"] for row in rows.values()]
    for panel in (left, right):
        plain_ticks(panel, counts)
    right.set_yticks([0.5, 1, 2, 5, 10, 20], ["0.5", "1", "2", "5", "10", "20"])
    right.minorticks_off()
    label(left, "points n on each surface", "share of samples with a perfect matching",
          f"Matching of Theorem 4.2.1, ρ = {RHO:.2f}\n({max(samples)} to {min(samples)} samples each)")  # fmt: skip
    label(right, "points n on each surface", "least reach of witness regions / δ",
          "Least reach with which half of the samples match")  # fmt: skip
    return figure


def draw_bottleneck(results: dict[str, object]) -> Figure:
    """Draw the bottleneck distance against n, with the known rate and what the theorem guarantees."""
    figure, (axes,) = chart(8, 5)
    rows, counts = results["points"], np.array(list(results["points"]), dtype=float)
    for color, name, text in (
        (COLORS[0], "bottleneck", "sphere to sphere with twelve handles"),
        (COLORS[1], "bottleneck, unchanged", "sphere to sphere"),
    ):
        middle, low, high = np.array([row[name] for row in rows.values()]).T
        axes.loglog(counts, middle, "o-", color=color, label=f"{text}: median")
        axes.fill_between(counts, low, high, color=color, alpha=0.15, label="5 to 95 % of samples")
    fit = results["rate"][LAW]["constant"]
    axes.loglog(
        counts,
        fit * np.log(counts) ** 0.75 / np.sqrt(counts),
        "k:",
        label=f"{fit:.2f} · {LAW} (Leighton, Shor)",
    )
    for color, delta in zip(COLORS[2:], results["nodes"], strict=False):
        axes.axhline(
            (RHO + 3) * delta, color=color, linestyle="--", label=f"(ρ + 3) δ for δ = {delta}"
        )
    plain_ticks(axes, list(results["points"]))
    axes.set_yticks([0.02, 0.05, 0.1, 0.2, 0.5], ["0.02", "0.05", "0.1", "0.2", "0.5"])
    axes.minorticks_off()
    label(axes, "points n on each surface", "bottleneck distance (surface area 1)",
          f"Longest move of the best one-to-one correspondence (ρ = {RHO:.2f})")  # fmt: skip
    return figure


def region_of(mesh: es.TriangleMesh, labels: np.ndarray) -> es.TriangleMesh:
    """Return the faces of region 0 with its middle at the origin and z up, in units of 0.01."""
    used, numbers = np.unique(mesh.faces[labels == 0], return_inverse=True)
    points = 100 * mesh.vertices[used]
    center = np.array(es.geometry.enclosing_ball(points).center)
    up = center / np.linalg.norm(center)
    across = np.cross(up, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    return es.TriangleMesh(
        (points - center) @ np.column_stack([np.cross(across, up), across, up]),
        numbers.reshape(-1, 3),
    )


def draw_shapes(pair: es.stability.Perturbation) -> Figure:
    """Draw one region before and after, and the middle of it after, large."""
    before, after = region_of(pair.one, pair.regions_one), region_of(pair.two, pair.regions_two)
    top = after.vertices[after.vertices[:, 2].argmax()]
    width = 2.5 * (top[2] - before.vertices[:, 2].max())
    figure = Figure(figsize=(11, 3.6), layout="constrained", dpi=110)
    arch = after.vertices[after.vertices[:, 2] > (top[2] + before.vertices[:, 2].max()) / 2][:, :2]
    along = np.linalg.svd(arch - arch.mean(axis=0))[2][0]
    side = np.degrees(np.arctan2(along[1], along[0])) - 90
    for place, (title, mesh, middle, reach) in enumerate(
        (
            ("One of twelve regions X of the sphere", before, np.zeros(3), 1.0),
            ("Y in its place, with a handle", after, np.zeros(3), 1.0),
            ("The handle of Y", after, top, width),
        )
    ):
        axes = figure.add_subplot(1, 3, place + 1, projection="3d", computed_zorder=False)
        near = (
            np.linalg.norm((mesh.vertices - middle)[mesh.faces].mean(axis=1)[:, :2], axis=1)
            <= reach
        )
        axes.plot_trisurf(
            *mesh.vertices.T,
            triangles=mesh.faces[near],
            color="#9ecae1",
            edgecolor="#1f4e79",
            linewidth=0.2,
        )
        axes.set_box_aspect((1, 1, 0.45), zoom=1.35)
        axes.set(
            xlim=middle[0] + np.array([-reach, reach]), ylim=middle[1] + np.array([-reach, reach])
        )
        axes.set_zlim(middle[2] + 0.45 * np.array([-reach, reach]))
        axes.view_init(elev=32, azim=side + 20)
        axes.set_axis_off()
        axes.set_title(f"{title}\n({2 * reach / 100:.3g} wide, in √area)", fontsize=10)
    return figure


def main() -> None:
    """Measure, print the figures and draw."""
    arguments = parse_arguments(__doc__, HERE)
    results, pair = run(QUICK if arguments.quick else FULL)
    pictures = {}
    if arguments.figures:
        pictures = {
            "probability": draw_probability(results),
            "bottleneck": draw_bottleneck(results),
            "region": draw_shapes(pair),
        }
    finish(rounded(results), pictures, arguments)


if __name__ == "__main__":
    main()
