"""What the scripts of this folder ask: their options, and the shapes and draws that these choose."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from describing import Store
from draws import HALVES, Draw, Shape, draw, half_of, shapes
from outputs import options_of, output_folder
from real_shapes import require_data

SEEDS = (0, 1, 2)
NUMBERS = (18, 32)  # of complete queries and others, in a draw (thesis 5.4)
QUICK_CLASSES, QUICK_NUMBERS = ("glasses", "octopus", "teddy"), (2, 4)


@dataclass(frozen=True)
class Setting:
    """The shapes of the chosen half, those of the other half, from which methods learn, draws, and descriptors."""

    some: list[Shape]
    others: list[Shape]
    draws: list[Draw]
    store: Store


def draw_options(text: str | None, out: str) -> argparse.ArgumentParser:
    """Return a parser with the options that choose shapes and draws."""
    parser = options_of(text, quick=f"classes {', '.join(QUICK_CLASSES)}, one draw", out=out)
    parser.add_argument("--half", choices=HALVES, default="reporting")
    parser.add_argument(
        "--source",
        default="",
        help="how the names of files must begin: psb for shapes of one source",
    )
    parser.add_argument("--draws", type=int, nargs="*", default=SEEDS, help="seeds of the draws")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--cache", type=output_folder, default="ch5-descriptors", help="folder of descriptors, kept"
    )
    return parser


def setting(chosen: argparse.Namespace) -> Setting:
    """Return what the options choose; end where there are no real shapes."""
    require_data()
    everything = [shape for shape in shapes() if not chosen.quick or shape.label in QUICK_CLASSES]
    some = [
        shape
        for shape in half_of(everything, chosen.half)
        if Path(shape.path).stem.startswith(chosen.source)
    ]
    others = half_of(everything, HALVES[1 - HALVES.index(chosen.half)])
    seeds, numbers = (chosen.draws[:1], QUICK_NUMBERS) if chosen.quick else (chosen.draws, NUMBERS)
    draws = [draw(some, seed, *numbers) for seed in seeds]
    return Setting(some, others, draws, Store(chosen.cache))
