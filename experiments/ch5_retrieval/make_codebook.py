"""Learn the codebook of patches that comes with the library, from synthetic creatures alone, and write it there."""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

from rich.progress import track
from threadpoolctl import threadpool_limits

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import output_file

PLACE = (
    Path(__file__).resolve().parents[2]
    / "src"
    / "eigenshape"
    / "retrieval"
    / "patches"
    / "default_codebook.npz"
)
INDIVIDUALS, SIZES, VIEWS = 6, (2000, 5000), 3


def lesson(what: tuple[str, int]) -> list[es.retrieval.Patches]:
    """Return the patches of one creature, in a pose of its own, and of views of it."""
    kind, number = what
    mesh = es.make_creature(kind, number, individual=number, n_vertices=SIZES[number % len(SIZES)])
    return es.retrieval.extract_patches(mesh, n_views=VIEWS, clean=False)


def main() -> None:
    """Learn and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=output_file, default=str(PLACE))
    chosen = parser.parse_args()
    everyone = list(product(es.shapes.CREATURES, range(INDIVIDUALS)))
    with ProcessPoolExecutor(2, initializer=threadpool_limits, initargs=(1,)) as pool:
        lessons = list(track(pool.map(lesson, everyone), "describing", total=len(everyone)))
    book = es.retrieval.train_codebook([patches for some in lessons for patches in some])
    chosen.out.write_bytes(es.retrieval.write_codebook(book))
    print(f"{chosen.out}: {book}")


if __name__ == "__main__":
    main()
