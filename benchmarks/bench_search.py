"""Search among many shapes: ours in stages and exhaustively, with candidates of FAISS and of Qdrant beside them.

    python benchmarks/bench_search.py                       10,000 and 100,000 shapes; half an hour, 4 GB of disk
    python benchmarks/bench_search.py --quick               2,500 shapes
    python benchmarks/bench_search.py --sizes 1000000       coarse rows alone beyond 200,000 shapes: 1.2 GB
    python benchmarks/bench_search.py --entries FILE.npz    mixtures of Fisher vectors of your own
    python benchmarks/bench_search.py --markdown docs/benchmarks.md

A database shape is a mixture of three described shapes, views included, with random weights. Queries are mixtures that
are not in the database, half of them of closed shapes and half of partial scans. The file of `--entries` has `closed`
(n, 7, 3, 3, 1280) and `open` (n, 1, 3, 3, 1280), as floats; without it creatures are described.

"Same ten" is the share of queries whose best ten, by exact codes, are the ten that an exhaustive search finds, and
"farther" how much the mean distance of the ten is above that. CPU is of one thread, of the scan and of exact scores;
neither holds the description of the query, nor the verification of thirty by matched points.
"""

import importlib.util
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine import memory_now, peak_memory
from report import Report, Row, in_process, options_of

import eigenshape as es
from eigenshape.retrieval.patches.codebook import encode_patches
from eigenshape.retrieval.patches.descriptor import PatchDescriptor, round_codes
from eigenshape.retrieval.patches.distance import packed_distances
from eigenshape.retrieval.patches.packing import pack_codes
from eigenshape.retrieval.search.candidates import choose_candidates, n_compared
from eigenshape.retrieval.search.coarse import coarse_rows
from eigenshape.retrieval.search.engines import FaissEngine, QdrantEngine, supply_from

FULL, QUICK = (10_000, 100_000), (2_500,)
N_QUERIES = 40
N_MATCHES = 10
MOST_WHOLE = (
    200_000  # shapes whose views are kept, too; above, 63 rows each are more than a disk has
)
MOST_QDRANT = 10_000  # shapes in Qdrant's local mode, which compares all of them in Python
POSES = (1, 2, 3)
AT_ONCE = 200
PACKAGES = ["eigenshape", "numpy", "numba", "faiss-cpu", "qdrant-client"]
COLUMNS = (
    "shapes",
    "method",
    "CPU ms a query",
    "same ten, %",
    "farther, %",
    "first use, CPU s",
    "MiB",
)
RECIPE = es.retrieval.PatchRecipe()


@dataclass(frozen=True, eq=False)
class Source:
    """Packed rows in a file, as an index maps them."""

    folder: Path
    packed: np.ndarray
    row_checksums: np.ndarray

    @property
    def n_shapes(self) -> int:
        """Return the number of shapes."""
        return len(self.packed)

    def rows(self, place: int) -> np.ndarray:
        """Return the packed rows of a shape."""
        return self.packed[place]

    def beside(self, name: str) -> Path:
        """Return where the scan keeps its rows."""
        return self.folder / name


def entries(path: Path | None) -> tuple[np.ndarray, np.ndarray]:
    """Return Fisher vectors of closed shapes with their views, and of partial scans."""
    if path is not None:
        with np.load(path) as arrays:
            return arrays["closed"], arrays["open"]
    rng = np.random.default_rng(0)
    closed, parts = [], []
    for kind in es.shapes.CREATURES:
        for pose in POSES:
            mesh = es.make_creature(kind, pose, n_vertices=1500)
            scan = es.partial_scan(mesh, rng).mesh
            for shape, kept in ((mesh, closed), (scan, parts)):
                patches = es.retrieval.extract_patches(shape)
                kept.append([encode_patches(each, RECIPE.codebook) for each in patches])
    return np.array(closed), np.array(parts)


def mixtures(vectors: np.ndarray, rng: np.random.Generator, count: int) -> np.ndarray:
    """Return codes of mixtures of three entries each."""
    found = np.empty((count, *vectors.shape[1:]), dtype=np.int8)
    for codes in found:
        chosen = rng.integers(len(vectors), size=3)
        mixed = np.tensordot(rng.dirichlet((1, 1, 1)).astype(np.float32), vectors[chosen], axes=1)
        codes[:] = round_codes(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True), RECIPE.clip)
    return found


def make_source(folder: Path, vectors: np.ndarray, n_shapes: int) -> Source:
    """Write the packed rows of a database of mixtures."""
    kept = vectors if n_shapes <= MOST_WHOLE else vectors[:, :1]
    n_rows, width = int(np.prod(kept.shape[1:4])), kept.shape[-1] // 2
    path, rng = folder / "rows.bin", np.random.default_rng(1)
    packed = np.memmap(path, np.uint8, "w+", shape=(n_shapes, n_rows, width))
    for first in range(0, n_shapes, AT_ONCE):
        some = mixtures(kept, rng, min(AT_ONCE, n_shapes - first))
        rows = pack_codes(some.reshape(-1, some.shape[-1]))
        packed[first : first + len(some)] = rows.reshape(len(some), n_rows, width)
    packed.flush()
    mapped = np.memmap(path, np.uint8, "r", shape=packed.shape)
    return Source(folder, mapped, np.arange(n_shapes))


def measure(folder: str, method: str) -> Row:
    """Ask all queries by one method; run in a process of its own."""
    place = Path(folder)
    shape = np.load(place / "shape.npy")
    packed = np.memmap(place / "rows.bin", np.uint8, "r", shape=tuple(shape))
    source = Source(place, packed, np.arange(len(packed)))
    queries = [
        PatchDescriptor(codes, (), RECIPE)
        for name in ("closed", "open")
        for codes in np.load(place / f"queries-{name}.npy")
    ]
    packed_distances(queries[0].codes, [source.rows(0)])  # load the compiled loops
    start, before = time.process_time(), memory_now()
    coarse = coarse_rows(source, RECIPE) if method != "exhaustive" else None
    supplier = None
    if coarse is not None and method in {"FAISS", "Qdrant"}:
        engine = FaissEngine(coarse) if method == "FAISS" else qdrant(coarse)
        supplier = supply_from(engine, coarse)
    first_use = time.process_time() - start
    allowed = np.ones(source.n_shapes, dtype=bool)
    found, seconds = [], []
    for query in queries:
        start = time.process_time()
        places = choose_candidates(
            query,
            lambda: coarse,
            allowed,
            n_matches=N_MATCHES,
            exact=coarse is None,
            supplier=supplier,
        ).places
        distances = packed_distances(query.codes, [source.rows(k) for k in places.tolist()])
        best = np.argsort(distances, kind="stable")[:N_MATCHES]
        seconds.append(time.process_time() - start)
        found.append((places[best].tolist(), distances[best].tolist()))
    cpu = float(np.median(seconds[1:]))
    return {"cpu": cpu, "first": first_use, "memory": peak_memory() - before, "found": found}


def qdrant(coarse: object) -> QdrantEngine:
    """Return a collection in Qdrant's local mode."""
    client = importlib.import_module("qdrant_client").QdrantClient(":memory:")
    engine = QdrantEngine(client, "coarse")
    engine.fill(coarse)
    return engine


def compare(row: Row, truth: list[tuple[list[int], list[float]]]) -> Row:
    """Add how the best ten compare with those of an exhaustive search."""
    pairs = list(zip(row.pop("found"), truth, strict=True))
    same = [set(ours[0]) == set(true[0]) for ours, true in pairs]
    farther = [np.mean(ours[1]) / np.mean(true[1]) - 1 for ours, true in pairs]
    return row | {"same": 100 * float(np.mean(same)), "farther": 100 * float(np.mean(farther))}


def measure_all(sizes: tuple[int, ...], report: Report) -> None:
    """Measure all methods at all sizes."""
    vectors = entries(report.options.entries)
    for n_shapes in sizes:
        with tempfile.TemporaryDirectory(dir=report.options.folder) as folder:
            source = make_source(Path(folder), vectors[0], n_shapes)
            np.save(Path(folder) / "shape.npy", source.packed.shape)
            rng = np.random.default_rng(2)
            for name, some in zip(("closed", "open"), vectors, strict=True):
                queries = mixtures(some, rng, N_QUERIES // 2)
                np.save(Path(folder) / f"queries-{name}.npy", queries)
            truth = in_process(measure, folder, "exhaustive")
            row: Row = {"shapes": n_shapes, "compared": n_shapes, "method": "exhaustive"}
            report.add(row | compare(dict(truth), truth["found"]))
            for method in methods(n_shapes):
                figures = in_process(measure, folder, method)
                row = {"shapes": n_shapes, "compared": n_compared(n_shapes, N_MATCHES)}
                report.add(row | {"method": method} | compare(figures, truth["found"]))


def methods(n_shapes: int) -> list[str]:
    """Return the methods beside the exhaustive one that can be measured here."""
    found = ["staged"]
    if importlib.util.find_spec("faiss"):
        found.append("FAISS")
    if importlib.util.find_spec("qdrant_client") and n_shapes <= MOST_QDRANT:
        found.append("Qdrant")
    return found


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    return [
        f"{row['shapes']:,}",
        f"{row['method']}, {row['compared']:,} compared",
        f"{1000 * row['cpu']:.3g}",
        f"{row['same']:.1f}",
        f"{row['farther']:.3f}",
        f"{row['first']:.3g}",
        f"{row['memory']:.0f}",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", help="numbers of shapes")
    parser.add_argument("--entries", type=Path, help="Fisher vectors of shapes of your own")
    parser.add_argument("--folder", type=Path, help="where temporary rows are written")
    options = parser.parse_args()
    report = Report(__file__, PACKAGES, options, COLUMNS, cells)
    measure_all(tuple(options.sizes or (QUICK if options.quick else FULL)), report)
    report.write()


if __name__ == "__main__":
    main()
