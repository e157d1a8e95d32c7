"""Search among many shapes: ours in stages and exhaustively, with candidates of FAISS and of Qdrant beside them.

    python benchmarks/bench_search.py                       10,000 and 100,000 shapes; 20 minutes, 7 GB of disk
    python benchmarks/bench_search.py --quick               2,500 shapes
    python benchmarks/bench_search.py --sizes 1000000 --queries 10     an hour, 65 GB of disk
    python benchmarks/bench_search.py --entries FILE --meshes FOLDER   mixtures of real shapes, described first

An index is built on disk and opened by a new process for each method. A shape of it is a mixture of three described
shapes, views included, with random weights, and has the points and the picture of the first. Queries are mixtures that
are not in the index, half of them of closed shapes and half of partial scans. `--meshes` describes the first closed
meshes (PLY) of each folder inside a folder, and keeps them in `--entries`; else creatures are described.

"Same ten" is the share of queries whose best ten, by exact codes, are the ten that an exhaustive search finds, "of
the ten" the share of those ten that is found, and "farther" how much the mean distance of the ten is above theirs. CPU
is of one thread, of the choice of candidates and of reading and comparing them. "With 30 verified" is a whole query but
for its description: thirty shapes are verified by matched points. The limit is how long the memory needs for the bytes
that are compared, at the speed at which this process sums up an array of 256 MB. "First use" makes the short rows and
measures how isolated each shape is, which is kept in files. "Cold" is wall-clock time from no file in the page cache to
the first answer, with these files. MiB are those that the process holds for itself after all queries, and those that it
has mapped of files, which the system may take back at any time.
"""

import argparse
import importlib.util
import os
import pickle
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from machine import file_memory, own_memory
from report import Report, Row, in_process, options_of

import eigenshape as es
from eigenshape.retrieval.patches.codebook import encode_patches
from eigenshape.retrieval.patches.distance import packed_distances, scale_distances
from eigenshape.retrieval.patches.matching import PatchPoints
from eigenshape.retrieval.search.candidates import choose_candidates, n_compared
from eigenshape.retrieval.search.coarse import CoarseRows
from eigenshape.retrieval.search.engines import FaissEngine, QdrantEngine
from eigenshape.retrieval.search.options import QueryOptions

FULL, QUICK = (10_000, 100_000), (2_500,)
N_QUERIES = 40
N_MATCHES = 10
# Shapes in the local mode of Qdrant, which is written in Python: for 100,000 it took 5 GB
MOST_QDRANT = 10_000
MOST_FAISS = 200_000  # training for a million takes 20 minutes
POSES = (1, 2, 3)  # of the creatures that are described if there are no meshes
MESHES_OF_FOLDER = 5
AT_ONCE = 1000  # shapes that are added, or compared, in one step
SUMMED = 2**28  # bytes of the array by which the speed of the memory is measured
PACKAGES = ["eigenshape", "numpy", "faiss-cpu", "qdrant-client"]
COLUMNS = (
    "shapes",
    "method",
    "CPU ms a query",
    "of it candidates",
    "with 30 verified",
    "limit, ms",
    "same ten, %",
    "of the ten, %",
    "farther, %",
    "open, CPU s",
    "first use, CPU s",
    "cold, s",
    "MiB",
    "KB a shape",
)
RECIPE = es.retrieval.PatchRecipe()


@dataclass(frozen=True, eq=False)
class Entry:
    """A described shape: Fisher vectors of the whole and of its views, points of each, and a picture."""

    vectors: np.ndarray  # (u, b, s, v) float32
    points: tuple[PatchPoints, ...]
    picture: bytes


def entries(path: Path | None, folder: Path | None) -> tuple[list[Entry], list[Entry]]:
    """Return closed shapes with their views, and partial scans."""
    if path is not None and path.exists():
        with path.open("rb") as file:
            found: tuple[list[Entry], list[Entry]] = pickle.load(file)
            return found
    rng = np.random.default_rng(0)
    closed, parts = list[Entry](), list[Entry]()
    for mesh in creatures() if folder is None else closed_meshes(folder):
        shapes = (mesh, es.partial_scan(mesh, rng).mesh)
        try:
            patches = [es.retrieval.extract_patches(shape) for shape in shapes]
        except es.InvalidShapeError as err:  # a real mesh may need a repair first
            print(f"left out: {err}", flush=True)
            continue
        for shape, some, kept in zip(shapes, patches, (closed, parts), strict=True):
            vectors = np.array([encode_patches(each, RECIPE.codebook) for each in some])
            points = es.retrieval.patch_descriptor(some, RECIPE).points
            kept.append(Entry(vectors, points, es.retrieval.draw_thumbnail(shape)))
    if path is not None:
        with path.open("wb") as file:
            pickle.dump((closed, parts), file)
    return closed, parts


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


def mixtures(
    some: list[Entry], seed: int, first: int, count: int
) -> Iterator[tuple[Entry, es.retrieval.PatchDescriptor]]:
    """Yield the first of three entries each, and a mixture of them with random weights."""
    vectors = np.array([entry.vectors for entry in some])
    for number in range(first, first + count):
        rng = np.random.default_rng([seed, number])
        chosen = rng.integers(len(some), size=3)
        weights = rng.dirichlet((1, 1, 1)).astype(np.float32)
        mixed = np.tensordot(weights, vectors[chosen], 1)
        steps = 7 / (RECIPE.clip * np.linalg.norm(mixed, axis=-1, keepdims=True))
        codes = np.rint(np.clip(steps * mixed, -7, 7)).astype(np.int8)
        entry = some[chosen[0]]
        descriptor = es.retrieval.PatchDescriptor(codes, entry.points, RECIPE)
        yield entry, descriptor


def build(folder: str, some: list[Entry], n_shapes: int) -> Row:
    """Build an index on disk; run in a process of its own, for the time alone."""
    index, start = es.ShapeIndex.create(folder), time.process_time()
    for first in range(0, n_shapes, AT_ONCE):
        count = min(AT_ONCE, n_shapes - first)
        index.add_many(
            es.retrieval.DescribedShape(
                f"collection/class {number % 100}/shape {number}.ply",
                [descriptor],
                label=f"class {number % 100}",
                source=f"collection/class {number % 100}/shape {number}.ply",
                digest=f"{number:064x}",
                thumbnail=entry.picture,
            )
            for number, (entry, descriptor) in enumerate(mixtures(some, 1, first, count), first)
        )
    n_bytes = sum(path.stat().st_size for path in Path(folder).iterdir())
    return {"bytes": n_bytes, "building": time.process_time() - start}


def queries_of(both: tuple[list[Entry], list[Entry]], count: int) -> list[bytes]:
    """Return pickled descriptors that are not in the index, half of them of closed shapes."""
    found = [each for some in both for _, each in mixtures(some, 2, 0, count // 2)]
    return [pickle.dumps(each) for each in found]


def measure_exhaustive(folder: str, pickled: list[bytes]) -> Row:
    """Compare all queries with all shapes."""
    queries = [pickle.loads(each) for each in pickled]
    with es.ShapeIndex.open(folder).reader() as reader:
        snapshot = reader.snapshot(RECIPE)
        isolations = reader._scan(reader.state, RECIPE).isolations()
        n_shapes, n_bytes = snapshot.n_shapes, 0
        seconds, found = np.zeros(len(queries)), np.empty((len(queries), n_shapes))
        for first in range(0, n_shapes, AT_ONCE):
            places = np.arange(first, min(first + AT_ONCE, n_shapes))
            start = time.process_time()
            rows = snapshot.rows_of(places)
            seconds += time.process_time() - start
            n_bytes += sum(each.nbytes for each in rows)
            for number, query in enumerate(queries):
                start = time.process_time()
                distances = packed_distances(query.codes, rows)
                found[number, places] = scale_distances(query.codes, distances, isolations[places])
                seconds[number] += time.process_time() - start
    best = np.argsort(found, axis=1, kind="stable")[:, :N_MATCHES]
    return {
        "cpu": float(np.median(seconds)),
        "limit": n_bytes / memory_speed(),
        "found": [
            (row.tolist(), all_of[row].tolist()) for row, all_of in zip(best, found, strict=True)
        ],
    }


def measure(folder: str, pickled: list[bytes], method: str) -> Row:
    """Ask all queries by one method in stages; run in a process of its own."""
    queries = [pickle.loads(each) for each in pickled]
    before, start = own_memory(), time.process_time()
    engine = {"staged": None, "FAISS": FaissEngine, "Qdrant": qdrant}[method]
    with es.ShapeIndex.open(folder).reader(engine) as reader:
        opening = time.process_time() - start
        start = time.process_time()
        reader.query(queries[0], n_matches=N_MATCHES)
        first_use = time.process_time() - start
        seconds = []
        for query in queries:
            start = time.process_time()
            reader.query(query, n_matches=N_MATCHES)
            seconds.append(time.process_time() - start)
        memory, files = own_memory() - before, file_memory()
        snapshot, scan = reader.snapshot(RECIPE), reader._scan(reader.state, RECIPE)
        coarse, isolations = scan.coarse(RECIPE), scan.isolations()
        allowed, choosing, found = np.ones(snapshot.n_shapes, dtype=bool), [], []
        comparing = []
        for query in queries:
            start = time.process_time()
            supplier = scan.supplier if method != "staged" else None
            places = choose_candidates(
                query,
                lambda: coarse,
                allowed,
                isolations,
                QueryOptions(N_MATCHES),
                supplier,
            ).places
            choosing.append(time.process_time() - start)
            start = time.process_time()
            rows = snapshot.rows_of(places)
            distances = packed_distances(query.codes, rows)
            distances = scale_distances(query.codes, distances, isolations[places])
            best = np.argsort(distances, kind="stable")[:N_MATCHES]
            comparing.append(time.process_time() - start)
            found.append((places[best].tolist(), distances[best].tolist()))
    row: Row = {
        "cpu": float(np.median(np.array(choosing) + comparing)),
        "choosing": float(np.median(choosing)),
        "whole": float(np.median(seconds)),
        "opening": opening,
        "first": first_use,
        "memory": memory,
        "files": files,
        "found": found,
    }
    if method == "staged":
        n_bytes = coarse.numbers.nbytes + sum(each.nbytes for each in rows)
        row |= {"limit": n_bytes / memory_speed()}
    return row


def measure_cold(folder: str, pickled: list[bytes]) -> Row:
    """Measure the first answer of a process, after the files have left the page cache."""
    for path in Path(folder).iterdir():
        with path.open("rb") as file:
            os.fsync(file.fileno())
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    query = pickle.loads(pickled[-1])
    packed_distances(query.codes, [])  # loads the kernels
    start = time.perf_counter()
    with es.ShapeIndex.open(folder).reader() as reader:
        reader.query(query, n_matches=N_MATCHES)
    return {"cold": time.perf_counter() - start}


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
    both = entries(options.entries, options.meshes)
    queries = queries_of(both, options.queries)
    for n_shapes in sizes:
        with tempfile.TemporaryDirectory(dir=options.folder) as name:
            folder = str(Path(name) / "index")
            built = in_process(build, folder, both[0], n_shapes)
            print(f"{n_shapes:,} shapes were added in {built['building']:.0f} CPU s", flush=True)
            rows = []
            for method in methods(n_shapes, options):
                row: Row = {"shapes": n_shapes, "compared": n_compared(n_shapes, N_MATCHES)}
                row |= {"method": method} | in_process(measure, folder, queries, method)
                if method == "staged":
                    row |= in_process(measure_cold, folder, queries)
                    row |= {"each": built["bytes"] / n_shapes / 1000}
                rows.append(row)
            truth = in_process(measure_exhaustive, folder, queries)
            row = {"shapes": n_shapes, "compared": n_shapes, "method": "exhaustive"}
            for each in (row | dict(truth), *rows):
                report.add(compare(each, truth["found"]))


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
    memory = f"{row['memory']:.0f} and {row['files']:.0f} of files" if "memory" in row else ""
    return [
        f"{row['shapes']:,}",
        f"{row['method']}, {row['compared']:,} compared",
        f"{1000 * row['cpu']:.3g}",
        f"{1000 * row['choosing']:.3g}" if "choosing" in row else "",
        f"{1000 * row['whole']:.3g}" if "whole" in row else "",
        f"{1000 * row['limit']:.3g}" if "limit" in row else "",
        f"{row['same']:.1f}",
        f"{row['shared']:.1f}",
        f"{row['farther']:.3f}",
        f"{row['opening']:.2g}" if "opening" in row else "",
        f"{row['first']:.3g}" if "first" in row else "",
        f"{row['cold']:.2f}" if "cold" in row else "",
        memory,
        f"{row['each']:.1f}" if "each" in row else "",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", help="numbers of shapes")
    parser.add_argument("--queries", type=int, default=N_QUERIES, help="queries at each size")
    parser.add_argument("--faiss", type=int, default=MOST_FAISS, help="most shapes for FAISS")
    parser.add_argument("--qdrant", type=int, default=MOST_QDRANT, help="most shapes for Qdrant")
    parser.add_argument("--entries", type=Path, help="descriptions of shapes of your own")
    parser.add_argument("--meshes", type=Path, help="folder of folders of meshes to describe")
    parser.add_argument("--folder", type=Path, help="where indexes are written")
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    measure_all(tuple(options.sizes or (QUICK if options.quick else FULL)), report)


if __name__ == "__main__":
    main()
