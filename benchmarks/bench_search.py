"""Search among many shapes: ours in stages and exhaustively, with candidates of FAISS and of Qdrant beside them.

    python benchmarks/bench_search.py                       10,000 and 100,000 shapes; 20 minutes, 5 GB of disk
    python benchmarks/bench_search.py --quick               2,500 shapes
    python benchmarks/bench_search.py --sizes 1000000 --queries 20 40 minutes, 1.3 GB of disk
    python benchmarks/bench_search.py --entries FILE.npz --meshes FOLDER    mixtures of real shapes, described first

A database shape is a mixture of three described shapes, views included, with random weights. Queries are mixtures that
are not in the database, half of them of closed shapes and half of partial scans. `--meshes` describes the first closed
meshes (PLY) of each folder inside a folder, and keeps their Fisher vectors in `--entries`; else creatures are
described. Above 200,000 shapes the packed rows (40 KB each) are not written to disk: those of the candidates are made
again from their seed, outside the measured time.

"Same ten" is the share of queries whose best ten, by exact codes, are the ten that an exhaustive search finds, "of
the ten" the share of those ten that is found, and "farther" how much the mean distance of the ten is above theirs. CPU
is of one thread, of the choice of candidates and of exact scores; neither holds the description of the query, nor the
verification of thirty by matched points. The limit is how long the memory needs for the bytes that are compared, at the
speed at which this process sums up an array of 256 MB. "Cold" is wall-clock time from no file in the page cache to the
first answer, by the file of short rows. MiB are those that the process holds for itself after all queries; pages of
mapped files, which the system may take back at any time, are not counted.
"""

import argparse
import importlib.util
import mmap
import os
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
from machine import own_memory
from numba import njit
from report import Report, Row, in_process, options_of

import eigenshape as es
from eigenshape.retrieval.patches.codebook import encode_patches
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.distance import packed_distances
from eigenshape.retrieval.patches.packing import unpack_codes
from eigenshape.retrieval.search.candidates import Supplier, choose_candidates, n_compared
from eigenshape.retrieval.search.coarse import CoarseRows, coarse_rows
from eigenshape.retrieval.search.engines import FaissEngine, QdrantEngine, supply_from
from eigenshape.retrieval.store.state import ask_ahead

FULL, QUICK = (10_000, 100_000), (2_500,)
N_QUERIES = 40
N_MATCHES = 10
MOST_ON_DISK = 200_000  # shapes whose packed rows are written: 8 GB
# Shapes in the local mode of Qdrant, which is written in Python: for 100,000 it took 5 GB
MOST_QDRANT = 10_000
MOST_FAISS = 200_000  # training for a million takes 20 minutes
POSES = (1, 2, 3)  # of the creatures that are described if there are no meshes
MESHES_OF_FOLDER = 5
AT_ONCE = 200
SUMMED = 2**28  # bytes of the array by which the speed of the memory is measured
ARRAYS, ROWS = ("vectors", "chosen", "weights"), "rows.bin"
PACKAGES = ["eigenshape", "numpy", "numba", "faiss-cpu", "qdrant-client"]
COLUMNS = (
    "shapes",
    "method",
    "CPU ms a query",
    "of it candidates",
    "limit, ms",
    "same ten, %",
    "of the ten, %",
    "farther, %",
    "first use, CPU s",
    "cold, s",
    "MiB",
)
RECIPE = es.retrieval.PatchRecipe()


@dataclass(frozen=True, eq=False)
class Source:
    """Packed rows of mixtures of entries, as an index maps them, or made when they are needed."""

    folder: Path
    vectors: np.ndarray  # (e, 63, 1280) float32, of the entries
    chosen: np.ndarray  # (n, 3), of which entries each shape is a mixture
    weights: np.ndarray  # (n, 3) float32
    packed: memoryview | None  # 63 rows of 640 bytes for each shape, mapped, if they are on disk

    @property
    def n_shapes(self) -> int:
        """Return the number of shapes."""
        return len(self.chosen)

    @property
    def row_checksums(self) -> np.ndarray:
        """Return a number for the rows of each shape."""
        return np.arange(len(self.chosen))

    @property
    def row_shape(self) -> tuple[int, int]:
        """Return how many packed rows a shape has, and the bytes of each."""
        return self.vectors.shape[1], self.vectors.shape[2] // 2

    def rows(self, place: int) -> np.ndarray:
        """Return the packed rows of a shape."""
        if self.packed is None:
            return self.make(place)
        n_rows, width = self.row_shape
        size = n_rows * width
        return np.frombuffer(self.packed, np.uint8, size, place * size).reshape(n_rows, width)

    def make(self, place: int) -> np.ndarray:
        """Make the packed rows of a shape."""
        packed = np.empty(self.row_shape, dtype=np.uint8)
        mix(self.vectors, self.chosen[place], self.weights[place], np.float32(RECIPE.clip), packed)
        return packed

    def read_ahead(self, places: np.ndarray) -> None:
        """Let the system read the rows of some shapes from disk."""
        size = self.rows(0).nbytes
        for place in places.tolist():
            ask_ahead(self.packed, place * size, size)

    def beside(self, name: str) -> Path:
        """Return where the scan keeps its rows."""
        return self.folder / name


@njit(cache=True, fastmath=True)
def mix(vectors, chosen, weights, clip, packed):
    """Write the packed rows of one mixture: each of unit length, in steps from -7 to 7."""
    n_rows, half = packed.shape
    mixed = np.empty(2 * half, dtype=np.float32)
    for row in range(n_rows):
        squares = np.float32(0)
        for place in range(2 * half):
            number = np.float32(0)
            for part in range(len(chosen)):
                number += weights[part] * vectors[chosen[part], row, place]
            mixed[place] = number
            squares += number * number
        step = np.float32(7) / (clip * np.sqrt(squares))
        for place in range(half):
            low = np.rint(min(max(step * mixed[place], np.float32(-7)), np.float32(7)))
            high = np.rint(min(max(step * mixed[half + place], np.float32(-7)), np.float32(7)))
            packed[row, place] = np.uint8(low + 8) | np.uint8(high + 8) << 4


def entries(path: Path | None, folder: Path | None) -> tuple[np.ndarray, np.ndarray]:
    """Return Fisher vectors of closed shapes with their views, and of partial scans."""
    if path is not None and path.exists():
        with np.load(path) as arrays:
            return arrays["closed"], arrays["open"]
    rng = np.random.default_rng(0)
    closed, parts = [], []
    for mesh in creatures() if folder is None else closed_meshes(folder):
        shapes = (mesh, es.partial_scan(mesh, rng).mesh)
        try:
            patches = [es.retrieval.extract_patches(shape) for shape in shapes]
        except es.InvalidShapeError as err:  # a real mesh may need a repair first
            print(f"left out: {err}", flush=True)
            continue
        for some, kept in zip(patches, (closed, parts), strict=True):
            kept.append([encode_patches(each, RECIPE.codebook) for each in some])
    if path is not None:
        np.savez(path, closed=np.array(closed), open=np.array(parts))
    return np.array(closed), np.array(parts)


def creatures() -> Iterator[es.TriangleMesh]:
    """Yield shapes that need no files."""
    for kind in es.shapes.CREATURES:
        for pose in POSES:
            yield es.make_creature(kind, pose, n_vertices=1500)


def closed_meshes(folder: Path) -> Iterator[es.TriangleMesh]:
    """Yield the first closed meshes of each folder inside a folder."""
    for kind in sorted(path for path in folder.iterdir() if path.is_dir()):
        meshes = map(es.read_mesh, sorted(kind.glob("*.ply")))
        whole = (mesh for mesh in meshes if es.geometry.is_closed(mesh))
        yield from islice(whole, MESHES_OF_FOLDER)


def mixtures(folder: Path, vectors: np.ndarray, seed: int, n_shapes: int) -> Source:
    """Return mixtures of three entries each, with random weights."""
    rng = np.random.default_rng(seed)
    chosen = rng.integers(len(vectors), size=(n_shapes, 3))
    weights = rng.dirichlet((1, 1, 1), n_shapes).astype(np.float32)
    flat = vectors.reshape(len(vectors), -1, vectors.shape[-1])
    return Source(folder, flat, chosen, weights, None)


def make_queries(vectors: np.ndarray, seed: int, n_shapes: int) -> list[np.ndarray]:
    """Return codes of mixtures."""
    source = mixtures(Path(), vectors, seed, n_shapes)
    codes = [unpack_codes(source.make(place)) for place in range(n_shapes)]
    return [each.reshape(vectors.shape[1:]) for each in codes]


def write_source(source: Source) -> None:
    """Write what the processes that search need."""
    for name in ARRAYS:
        np.save(source.folder / f"{name}.npy", getattr(source, name))
    if source.n_shapes <= MOST_ON_DISK:
        with (source.folder / ROWS).open("wb") as file:
            for place in range(source.n_shapes):
                file.write(source.make(place).data)


def read_source(folder: Path) -> Source:
    """Return what was written."""
    vectors, chosen, weights = (np.load(folder / f"{name}.npy") for name in ARRAYS)
    packed = None
    if (folder / ROWS).exists():
        with (folder / ROWS).open("rb") as file:
            packed = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    return Source(folder, vectors, chosen, weights, packed)


def measure_exhaustive(folder: str) -> Row:
    """Compare all queries with all shapes."""
    source, queries = open_folder(folder)
    seconds, found = np.zeros(len(queries)), np.empty((len(queries), source.n_shapes))
    for first in range(0, source.n_shapes, AT_ONCE):
        places = range(first, min(first + AT_ONCE, source.n_shapes))
        rows = [source.rows(place) for place in places]
        for number, query in enumerate(queries):
            start = time.process_time()
            found[number, first : places.stop] = packed_distances(query.codes, rows)
            seconds[number] += time.process_time() - start
    best = np.argsort(found, axis=1, kind="stable")[:, :N_MATCHES]
    n_bytes = source.n_shapes * source.rows(0).nbytes
    return {
        "cpu": float(np.median(seconds)),
        "limit": n_bytes / memory_speed(),
        "found": [
            (row.tolist(), all_of[row].tolist()) for row, all_of in zip(best, found, strict=True)
        ],
    }


def measure(folder: str, method: str) -> Row:
    """Ask all queries by one method in stages; run in a process of its own."""
    source, queries = open_folder(folder)
    wholes = source
    if source.packed is None:  # views are not made, since a scan has none
        n_bases, n_sizes, _ = RECIPE.codebook.code_shape
        wholes = replace(source, vectors=source.vectors[:, : n_bases * n_sizes])
    start, before = time.process_time(), own_memory()
    coarse = coarse_rows(wholes, RECIPE)
    supplier = None
    if method != "staged":
        engine = FaissEngine(coarse) if method == "FAISS" else qdrant(coarse)
        supplier = supply_from(engine, coarse)
    first_use = time.process_time() - start
    found, seconds = [], []
    for query in queries:
        places, best, distances, *spent = ask(source, coarse, query, supplier)
        seconds.append(spent)
        found.append((places[best].tolist(), distances[best].tolist()))
    choosing, comparing = np.median(seconds[1:], axis=0).tolist()
    row: Row = {
        "cpu": choosing + comparing,
        "choosing": choosing,
        "first": first_use,
        "memory": own_memory() - before,
        "found": found,
    }
    if method == "staged":
        n_bytes = coarse.numbers.nbytes + len(places) * source.rows(0).nbytes
        row |= {"limit": n_bytes / memory_speed()}
    return row


def measure_cold(folder: str) -> Row:
    """Measure the first answer of a process, after the files have left the page cache."""
    for path in Path(folder).glob("*.bin"):
        with path.open("rb") as file:
            os.fsync(file.fileno())
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    source, queries = open_folder(folder)
    start = time.perf_counter()
    ask(source, coarse_rows(source, RECIPE), queries[0], None)
    return {"cold": time.perf_counter() - start}


def open_folder(folder: str) -> tuple[Source, list[PatchDescriptor]]:
    """Return the shapes and the queries of a folder, with all loops compiled."""
    source = read_source(Path(folder))
    with np.load(Path(folder) / "queries.npz") as arrays:
        queries = [PatchDescriptor(arrays[name], (), RECIPE) for name in arrays.files]
    packed_distances(queries[0].codes, [source.make(0)])
    return source, queries


def ask(
    source: Source, coarse: CoarseRows, query: PatchDescriptor, supplier: Supplier | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Return the candidates, the best of them, all distances, and the seconds of both steps."""
    start = time.process_time()
    allowed = np.ones(source.n_shapes, dtype=bool)
    places = choose_candidates(
        query, lambda: coarse, allowed, n_matches=N_MATCHES, supplier=supplier
    ).places
    choosing = time.process_time() - start
    if source.packed is not None:  # reading them is a part of the work; making them is not
        start = time.process_time()
        source.read_ahead(places)
    rows = [source.rows(place) for place in places.tolist()]
    if source.packed is None:
        start = time.process_time()
    distances = packed_distances(query.codes, rows)
    best = np.argsort(distances, kind="stable")[:N_MATCHES]
    return places, best, distances, choosing, time.process_time() - start


def qdrant(coarse: CoarseRows) -> QdrantEngine:
    """Return a collection in Qdrant's local mode."""
    client = importlib.import_module("qdrant_client").QdrantClient(":memory:")
    engine = QdrantEngine(client, "coarse")
    engine.fill(coarse)
    return engine


def memory_speed() -> float:
    """Return how many bytes this process reads from memory in a second."""
    numbers = np.ones(SUMMED // 8, dtype=np.int64)
    seconds = []
    for _ in range(5):
        start = time.process_time()
        numbers.sum()
        seconds.append(time.process_time() - start)
    return SUMMED / min(seconds)


def compare(row: Row, truth: list[tuple[list[int], list[float]]]) -> Row:
    """Add how the best ten compare with those of an exhaustive search."""
    pairs = list(zip(row.pop("found"), truth, strict=True))
    shared = [len(set(ours[0]) & set(true[0])) / N_MATCHES for ours, true in pairs]
    farther = [np.mean(ours[1]) / np.mean(true[1]) - 1 for ours, true in pairs]
    return row | {
        "same": 100 * float(np.mean(np.array(shared) == 1)),
        "shared": 100 * float(np.mean(shared)),
        "farther": 100 * float(np.mean(farther)),
    }


def measure_all(sizes: tuple[int, ...], report: Report) -> None:
    """Measure all methods at all sizes."""
    options = report.options
    vectors = entries(options.entries, options.meshes)
    for n_shapes in sizes:
        with tempfile.TemporaryDirectory(dir=options.folder) as folder:
            write_source(mixtures(Path(folder), vectors[0], 1, n_shapes))
            queries = [make_queries(some, 2, options.queries // 2) for some in vectors]
            np.savez(Path(folder) / "queries.npz", *queries[0], *queries[1])
            truth = in_process(measure_exhaustive, folder)
            row: Row = {"shapes": n_shapes, "compared": n_shapes, "method": "exhaustive"}
            report.add(row | compare(dict(truth), truth["found"]))
            for method in methods(n_shapes, options):
                row = {"shapes": n_shapes, "compared": n_compared(n_shapes, N_MATCHES)}
                row |= {"method": method} | in_process(measure, folder, method)
                if method == "staged":
                    row |= in_process(measure_cold, folder)
                report.add(compare(row, truth["found"]))


def methods(n_shapes: int, options: argparse.Namespace) -> list[str]:
    """Return the methods beside the exhaustive one that are measured."""
    found = ["staged"]
    if importlib.util.find_spec("faiss") and n_shapes <= options.faiss:
        found.append("FAISS")
    if importlib.util.find_spec("qdrant_client") and n_shapes <= options.qdrant:
        found.append("Qdrant")
    return found


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [
        f"{row['shapes']:,}",
        f"{row['method']}, {row['compared']:,} compared",
        f"{1000 * row['cpu']:.3g}",
        f"{1000 * row['choosing']:.3g}" if "choosing" in row else "",
        f"{1000 * row['limit']:.3g}" if "limit" in row else "",
        f"{row['same']:.1f}",
        f"{row['shared']:.1f}",
        f"{row['farther']:.3f}",
        f"{row['first']:.3g}" if "first" in row else "",
        f"{row['cold']:.2f}" if "cold" in row else "",
        f"{row['memory']:.0f}" if "memory" in row else "",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", help="numbers of shapes")
    parser.add_argument("--queries", type=int, default=N_QUERIES, help="queries at each size")
    parser.add_argument("--faiss", type=int, default=MOST_FAISS, help="most shapes for FAISS")
    parser.add_argument("--qdrant", type=int, default=MOST_QDRANT, help="most shapes for Qdrant")
    parser.add_argument("--entries", type=Path, help="Fisher vectors of shapes of your own")
    parser.add_argument("--meshes", type=Path, help="folder of folders of meshes to describe")
    parser.add_argument("--folder", type=Path, help="where temporary rows are written")
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    measure_all(tuple(options.sizes or (QUICK if options.quick else FULL)), report)


if __name__ == "__main__":
    main()
