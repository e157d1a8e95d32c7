"""Leave-one-out retrieval over real, complete shapes, and over partial scans of them.

The index is kept in a folder, so that a second run measures without describing anything again.
"""

import argparse
import sys
from functools import partial
from pathlib import Path

import numpy as np
from rich.progress import Progress, TaskID, track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from real_shapes import DATA, give_out, manifest, require_data

FOUR_LEGGED = frozenset({"fourleg", "horse", "dog", "cat", "wolf", "lion"})
QUICK = ("ant", "chair", "fish", "glasses", "hand", "octopus", "teddy")
TOPS = (1, 3, 5)
N_VIEWS = 4


def describe_file(path: Path, recipe: es.Recipe, n_views: int) -> list[es.ShapeDescriptor]:
    """Read a mesh and describe it, whole and from some sides."""
    mesh = es.read_mesh(path)
    return [es.describe_mesh(mesh, recipe).descriptor, *es.describe_views(mesh, recipe, n_views=n_views)]


def shapes(quick: bool) -> list[es.Item]:
    """List the shapes of all classes with at least three members, or half of a few classes."""
    rows = manifest()
    sizes = {row["cls"]: sum(other["cls"] == row["cls"] for other in rows) for row in rows}
    kept = [row for row in rows if sizes[row["cls"]] >= 3]
    if quick:
        kept = [row for row in kept if row["cls"] in QUICK][::2]
    return [es.Item(f"{row['cls']}/{Path(row['path']).stem}", DATA / row["path"], row["cls"]) for row in kept]


def ranking(index: es.ShapeIndex, item: es.Item, query: es.ShapeDescriptor) -> list[str]:
    """Return the classes of the first answers, the shape itself left out."""
    matches = index.query(query, n_matches=TOPS[-1] + 1)
    return [match.label for match in matches if match.name != item.name][: TOPS[-1]]


def merged(label: str) -> str:
    """Call all four-legged animals by one name."""
    return "four-legged" if label in FOUR_LEGGED else label


def hit_rates(labels: list[str], rankings: list[list[str]]) -> list[float]:
    """Return the share of queries, in per cent, with a hit among the first 1, 3 and 5."""
    pairs = list(zip(labels, rankings, strict=True))
    return [round(100 * float(np.mean([label in ranked[:top] for label, ranked in pairs])), 1) for top in TOPS]


def table(items: list[es.Item], rankings: list[list[str]]) -> dict[str, list[float]]:
    """Score rankings strictly, without the mixed class among the queries, and with the four-legged classes as one."""
    labels = [item.label or "" for item in items]
    plain = [place for place, label in enumerate(labels) if label != "fourleg"]
    return {
        "strict, fourleg not asked for": hit_rates([labels[i] for i in plain], [rankings[i] for i in plain]),
        "strict": hit_rates(labels, rankings),
        "four-legged as one class": hit_rates(
            [merged(label) for label in labels], [[merged(label) for label in ranked] for ranked in rankings]
        ),
    }


def partial_scan(item: es.Item, place: int) -> es.TriangleMesh:
    """Scan a shape from a random side, which depends on its place in the list alone."""
    return es.partial_scan(es.read_mesh(item.path), np.random.default_rng([1, place])).mesh


def measure(items: list[es.Item], recipe: es.Recipe, n_views: int, folder: Path) -> dict[str, object]:
    """Index all shapes, ask for each of them, and for a partial scan of every third."""
    index = es.ShapeIndex.open(folder) if folder.exists() else es.ShapeIndex.create(folder)
    describe = partial(describe_file, recipe=recipe, n_views=n_views)
    with Progress() as bar:
        task = bar.add_task(recipe.name, total=len(items))
        told = partial(tell, bar, task)
        report = es.build_index(index, items, describe, recipes=(recipe,), told=told)
    taken = [item for item in items if item.name not in dict(report.failed)]
    complete = [ranking(index, item, index.descriptor(item.name, recipe)) for item in track(taken, "whole shapes")]
    scanned = [(place, item) for place, item in enumerate(taken) if place % 3 == 0]
    partials = [
        ranking(index, item, es.describe_mesh(partial_scan(item, place), recipe).descriptor)
        for place, item in track(scanned, "partial scans")
    ]
    return {
        "not taken": dict(report.failed),
        "complete": table(taken, complete),
        "partial scans": table([item for _, item in scanned], partials),
    }


def tell(bar: Progress, task: TaskID, n_done: int, n_items: int, name: str, error: str | None) -> None:
    """Move the bar, and name what cannot be taken."""
    bar.update(task, completed=n_done)
    if error:
        bar.print(f"not taken: {name}: {error}")


def main() -> None:
    """Build the index, ask for everything, print and save the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help=f"half of the classes {', '.join(QUICK)}")
    parser.add_argument("--db", type=Path, default=Path("ch5-index"), help="folder of the indexes, kept")
    parser.add_argument("--out", type=Path, default=Path("ch5-results.json"))
    arguments = parser.parse_args()
    require_data()
    items = shapes(arguments.quick)
    results = {}
    for recipe, n_views in ((es.SCALE_FREE, N_VIEWS), (es.THESIS, 0)):
        folder = arguments.db / f"{recipe.name}-{len(items)}"
        results[recipe.name] = measure(items, recipe, n_views, folder)
    give_out(results, arguments.out)


if __name__ == "__main__":
    main()
