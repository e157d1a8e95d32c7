"""Table 5.1 and figure 5.4 of the thesis for our draws: queries with their first answers, and queries that failed.

Green answers are of the query's class, orange ones of another. Reads what run.py has kept, and describes the rest.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

sys.path.append(str(Path(__file__).resolve().parents[1]))
from describing import Store, describe_all
from draws import Draw, Version, draw, half_of, make, shapes
from methods import METHODS, Method
from outputs import output_folder
from real_shapes import require_data
from rich.progress import track
from run import answers, ready

import eigenshape as es

RIGHT, WRONG, QUERY = 2, 1, -1  # green, orange, gray
N_ANSWERS = 5


@dataclass(frozen=True)
class Asked:
    """A query, its answers, best first, and what answered."""

    method: str
    query: Version
    answers: tuple[Version, ...]

    @property
    def hits(self) -> int:
        """Return how many of the first answers are of the query's class."""
        return sum(answer.shape.label == self.query.shape.label for answer in self.answers)


def ask(
    method: Method, store: Store, queries: Sequence[Version], database: Sequence[Version]
) -> list[Asked]:
    """Return the first answers to queries."""
    ranked = answers(method, store, queries, database)
    return [
        Asked(method.name, query, found[:N_ANSWERS])
        for query, found in zip(queries, ranked, strict=True)
    ]


def panel(version: Version, title: str, color: int) -> es.plot.Panel:
    """Return a shape in one color, as it stood before it was turned."""
    mesh = make(version, turned=False)
    return es.plot.Panel(mesh, title, np.full(mesh.n_faces, color), np.empty(0, dtype=np.int64))


def sheet(asked: Asked) -> Figure:
    """Draw a query and its answers."""
    query = panel(asked.query, f"query: {asked.query.shape.label},\n{asked.query.kind}", QUERY)
    answers = [
        panel(
            version,
            f"{place}: {version.shape.label},\n{version.kind}",
            right_or_wrong(version, asked),
        )
        for place, version in enumerate(asked.answers, 1)
    ]
    return es.plot.figure_contact_sheet(query, answers, caption=asked.method)


def right_or_wrong(version: Version, asked: Asked) -> int:
    """Return the color of an answer."""
    return RIGHT if version.shape.label == asked.query.shape.label else WRONG


def save_stack(some: Sequence[Asked], path: Path) -> None:
    """Draw sheets and put them on one picture, two beside each other."""
    images = []
    for asked in track(some, path.stem):
        es.save_figure(sheet(asked), path)
        images.append(mpl.image.imread(path))
    rows = -(-len(images) // 2)
    height, width = (max(image.shape[axis] for image in images) for axis in (0, 1))
    figure = Figure(figsize=(2 * width / 100, rows * height / 100), dpi=100)
    for place, image in enumerate(images):
        axes = figure.add_axes((place % 2 / 2, 1 - (place // 2 + 1) / rows, 1 / 2, 1 / rows))
        axes.imshow(image)
        axes.set_axis_off()
    es.save_figure(figure, path)


def one_a_class(some: Sequence[Asked], count: int) -> list[Asked]:
    """Keep the first query of each class, up to a number."""
    first = {asked.query.shape.label: asked for asked in reversed(some)}
    return [asked for asked in some if first[asked.query.shape.label] is asked][:count]


def main() -> None:
    """Ask, and draw three pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--method", choices=sorted(METHODS), default="patches", help="of table 5.1 and the failures"
    )
    parser.add_argument(
        "--methods", nargs="*", choices=sorted(METHODS), default=["thesis, cotangent", "EVD", "LFD"]
    )
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--cache", type=output_folder, default="ch5-descriptors")
    parser.add_argument("--folder", type=output_folder, default="ch5-pictures")
    chosen = parser.parse_args()
    require_data()
    some, others = (half_of(shapes(), half) for half in ("reporting", "tuning"))
    drawn, store = draw(some, chosen.seed), Store(chosen.cache)
    methods = [
        ready(METHODS[name], others, store)
        for name in dict.fromkeys([chosen.method, *chosen.methods])
    ]
    describe_all(store, methods, [*drawn.queries, *drawn.mixed], chosen.workers)
    all_pictures(drawn, store, methods, chosen.folder)


def all_pictures(drawn: Draw, store: Store, methods: Sequence[Method], folder: Path) -> None:
    """Draw queries of seven classes, an octopus by all methods, and queries without a hit."""
    found = ask(methods[0], store, drawn.queries, drawn.mixed)
    save_stack(one_a_class([asked for asked in found if asked.hits], 7), folder / "table_5_1.png")
    octopuses = [
        version for version in (*drawn.queries, *drawn.mixed) if version.shape.label == "octopus"
    ]
    cut = max(octopuses, key=lambda version: version.kind == "incomplete")
    rest = [version for version in drawn.mixed if version != cut]
    save_stack(
        [one for method in methods for one in ask(method, store, [cut], rest)],
        folder / "figure_5_4.png",
    )
    save_stack(
        one_a_class([asked for asked in found if not asked.hits], 8), folder / "failures.png"
    )


if __name__ == "__main__":
    main()
