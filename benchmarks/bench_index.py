"""What it costs to open an index, and to see the changes of others, beside the number of its shapes.

    python benchmarks/bench_index.py                        10,000 and 100,000 shapes
    python benchmarks/bench_index.py --sizes 1000000        6 GB of disk, half an hour
    python benchmarks/bench_index.py --quick                1,000 shapes

Shapes are described by patches without views, with random codes and the points of one creature, so that a shape takes
6 KB of rows; all else is as in any index. A reader is opened in a process of its own. "Memory" is what that process
holds for itself after it was opened and asked once. What it has mapped of files besides, the short rows of the scan and
pages of the database, the system may take back at any time. A query is described already; it is scanned, scored and
verified.
"""

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from machine import file_memory, own_memory
from report import Report, Row, in_process, options_of

import eigenshape as es
from eigenshape.retrieval.patches.matching import PatchPoints

FULL, QUICK = (10_000, 100_000), (1_000,)
AT_ONCE = 20_000  # shapes that are added in one step
N_CHANGED = 10  # shapes that are added, removed or changed before a refresh
N_POINTS = 10  # of each shape, so that an index of a million fits on a disk
PACKAGES = ["eigenshape", "numpy"]
COLUMNS = ("shapes", "what", "wall-clock ms", "CPU ms", "CPU µs a shape")
RECIPE = es.retrieval.PatchRecipe()


def shapes(count: int, first: int, points: PatchPoints) -> Iterator[es.retrieval.DescribedShape]:
    """Yield shapes with random codes."""
    rng = np.random.default_rng(first)
    for number in range(first, first + count):
        codes = rng.integers(-7, 8, (1, *RECIPE.codebook.code_shape), dtype=np.int8)
        yield es.retrieval.DescribedShape(
            f"collection/class {number % 100}/shape {number}.ply",
            [es.retrieval.PatchDescriptor(codes, (points,), RECIPE)],
            label=f"class {number % 100}",
            source=f"collection/class {number % 100}/shape {number}.ply",
            digest=f"{number:064x}",
            attributes={"height": number / 7},
        )


def few_points() -> PatchPoints:
    """Return the first points of a creature."""
    fish = es.make_creature("fish", n_vertices=500)
    points = es.describe(fish, RECIPE).points[0]
    some = slice(N_POINTS)
    return PatchPoints(
        points.numbers[some],
        points.weights[some],
        points.distances[some, some],
        points.vertices[some],
        points.places[some],
        points.normals[some],
    )


def make_index(folder: Path, n_shapes: int) -> es.ShapeIndex:
    """Write an index."""
    index, points = es.ShapeIndex.create(folder), few_points()
    for first in range(0, n_shapes, AT_ONCE):
        index.add_many(shapes(min(AT_ONCE, n_shapes - first), first, points))
    return index


def measure(folder: str) -> Row:
    """Open an index, ask it, and change it; run in a process of its own."""
    index, rows = es.ShapeIndex.open(folder), list[Row]()

    def timed(what: str, work: Callable[[], object]) -> object:
        start, spent = time.perf_counter(), time.process_time()
        result = work()
        spent = time.process_time() - spent
        rows.append({"what": what, "wall": time.perf_counter() - start, "cpu": spent})
        return result

    points = few_points()
    ours, files = own_memory(), file_memory()
    (query,) = next(shapes(1, 10**8, points)).descriptors
    reader = timed("open a reader", index.reader)
    timed("first query: short rows are made", lambda: reader.query(query))
    timed("second query", lambda: reader.query(query))
    reader.close()
    for path in Path(folder).iterdir():
        with path.open("rb") as file:
            os.fsync(file.fileno())
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    reader = timed("open a reader, cold", index.reader)
    timed("first query, cold", lambda: reader.query(query))
    rows.append({"memory": own_memory() - ours, "files": file_memory() - files})
    n_shapes = len(reader)
    index.add_many(shapes(N_CHANGED, n_shapes, points))
    timed(f"refresh after {N_CHANGED} were added", reader.refresh)
    timed("query after adding", lambda: reader.query(query))
    names = [match.name for match in reader.query(query, n_matches=N_CHANGED)]
    index.remove(*names)
    timed(f"refresh after {N_CHANGED} were removed", reader.refresh)
    timed("query after removing", lambda: reader.query(query))
    name = reader.query(query)[0].name
    timed("descriptors of one shape", lambda: index.descriptors(name, RECIPE))
    timed("picture of one shape", lambda: index.thumbnail(name))
    index.update([es.retrieval.Record(name, label="new")])
    timed("refresh after 1 was changed", reader.refresh)
    return {"rows": rows}


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    shapes_text = f"{row['shapes']:,}"
    if "memory" in row:
        held = f"{row['memory']:.0f} MiB, {row['files']:.0f} MiB of files"
        return [shapes_text, f"memory: {held}", "", "", ""]
    a_shape = 1e6 * row["cpu"] / row["shapes"]
    times = (f"{1000 * row[key]:.3g}" for key in ("wall", "cpu"))
    return [shapes_text, row["what"], *times, f"{a_shape:.2g}"]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", help="numbers of shapes")
    parser.add_argument("--folder", type=Path, help="where indexes are written")
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    for n_shapes in options.sizes or (QUICK if options.quick else FULL):
        with tempfile.TemporaryDirectory(dir=options.folder) as folder:
            make_index(Path(folder), n_shapes)
            for row in in_process(measure, folder)["rows"]:
                report.add({"shapes": n_shapes} | row)


if __name__ == "__main__":
    main()
