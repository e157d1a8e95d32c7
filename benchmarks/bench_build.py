"""Building an index: corrupt and misbehaving files, two workers, 64 parts, and readers beside a writer.

    python benchmarks/bench_build.py --quick                         half a minute
    python benchmarks/bench_build.py --only workers                  of bad, workers, parts and readers

**bad** indexes 500 meshes of 60 to 160 vertices by the command line. A hundred of them are bad: 97 are corrupt in
one of ten ways, one kills the process that reads it, one hangs, and one eats memory. **workers** describes creatures of
3,000 vertices by patches with one worker and with two. CPU is that of all processes. **parts** indexes the meshes of
each of 64 parts, merges them, and compares what is found, with all scores, to an index that was built at
once. **readers** has 16 threads in four processes ask an index in which a writer replaces two shapes at a time, adds
and removes others, and compacts it: a reader that sees one of the two replaced alone is an error, like any warning.
"""

import json
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import numpy as np
from report import Report, Row, options_of

import eigenshape as es

PACKAGES = ["eigenshape", "pebble", "numpy"]
COLUMNS = ("case", "figure", "measured", "aim")
MISBEHAVING = Path(__file__).with_name("misbehaving.py")
LIGHT = ("--method", "scale-free", "--views", "0")
RECIPE = es.retrieval.SCALE_FREE
PAIR = ("left", "right")  # shapes that the writer replaces together


@dataclass(frozen=True)
class Sizes:
    """How much of everything."""

    n_files: int = 500
    n_corrupt: int = 97
    timeout: int = 60  # seconds after which a file that hangs is given up
    n_creatures: int = 20
    n_creature_vertices: int = 3000
    n_parts: int = 64
    n_shapes_of_parts: int = 320
    n_processes: int = 4
    seconds: float = 20.0


QUICK = Sizes(60, 20, 10, 4, 500, 2, 24, 1, 5.0)
N_THREADS = 4  # of each process of readers; in the quick form one process has all 16
Figure = tuple[str, float, str, str]  # what, how much, its unit, and the aim


def varied_mesh(number: int) -> es.TriangleMesh:
    """Return a closed mesh of 60 to 160 vertices, of its own form for each number."""
    rng = np.random.default_rng(number)
    ring = es.shapes.torus(int(rng.integers(10, 16)), int(rng.integers(6, 11)))
    waves = rng.normal(0, 2, (3, 3))
    vertices = ring.vertices + 0.1 * np.sin(ring.vertices @ waves + rng.random(3))
    return es.TriangleMesh(vertices * rng.uniform(0.4, 1.6, 3), ring.faces)


def corrupt_files(mesh: es.TriangleMesh, path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield ten kinds of files that hold no surface: suffix and content."""
    es.write_mesh(mesh, path)
    whole = path.read_bytes()
    path.unlink()
    yield ".ply", b""
    yield ".ply", b"this is no mesh\n"
    yield ".ply", whole[: len(whole) // 2]
    yield ".ply", whole.replace(b"element vertex ", b"element vertex 99999")
    yield ".off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n"
    yield ".off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"
    yield ".off", b"OFF\n3 1 0\n1 1 1\n1 1 1\n1 1 1\n3 0 1 2\n"
    yield ".xyz", b"0 0 0\n1 0 0\n0 1 0\n"
    yield ".obj", b"v 0 0 0\nv 1 0 0\nl 1 2\n"
    yield ".glb", np.random.default_rng(0).bytes(2000)


def run_cli(*arguments: object, code: int = 0) -> Row:
    """Run the command line; return what it printed as JSON."""
    command = [sys.executable, MISBEHAVING, *arguments, "--json"]
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, check=False)
    if done.returncode != code:
        raise RuntimeError(f"exit code {done.returncode} in place of {code}: {command}")
    return dict(json.loads(done.stdout))


def cpu_of_children() -> float:
    """Return the CPU seconds of all processes that this one started, and those that they did."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def index_bad_files(folder: Path, sizes: Sizes) -> list[Figure]:
    """Index a folder of which some files are corrupt or misbehave."""
    (folder / "meshes").mkdir()
    n_good = sizes.n_files - sizes.n_corrupt - 3
    good, bad = [f"good{number:05}" for number in range(n_good)], []
    for number, name in enumerate(good):
        es.write_mesh(varied_mesh(number), folder / "meshes" / f"{name}.ply")
    kinds = list(corrupt_files(varied_mesh(0), folder / "meshes" / "whole.ply"))
    for number in range(sizes.n_corrupt):
        suffix, content = kinds[number % len(kinds)]
        bad.append(f"corrupt{number:03}")
        (folder / "meshes" / f"{bad[-1]}{suffix}").write_bytes(content)
    for word in ("die", "hang", "eat"):
        bad.append(word)
        text = f"ply\nformat ascii 1.0\ncomment {word}\nelement vertex 0\nend_header\n"
        (folder / "meshes" / f"{word}.ply").write_text(text)
    limits = ("--timeout", sizes.timeout, "--memory", 1)
    before, begun = cpu_of_children(), monotonic()
    report = run_cli("index", "add", folder / "bad", folder / "meshes", *LIGHT, *limits, code=3)
    took, cpu = monotonic() - begun, cpu_of_children() - before
    failed = dict(report["failed"])
    return [
        ("good files", n_good, "", ""),
        ("good files that are not indexed", len(set(good) - set(report["added"])), "", "none"),
        ("bad files", len(bad), "", ""),
        ("bad files that are not named", len(set(bad) - set(failed)), "", "none"),
        ("reasons that are given", len({_kind(reason) for reason in failed.values()}), "", ""),
        ("exit code", 3, "", "3, some failed"),
        ("CPU", 1000 * cpu / n_good, "ms a shape", ""),
        ("time", took, "s", ""),
    ]


def _kind(reason: str) -> str:
    """Return a reason without the path of its file."""
    return reason.rsplit("/", 1)[-1].partition(" ")[2]


def compare_workers(folder: Path, sizes: Sizes) -> list[Figure]:
    """Index the same meshes with one worker and with two."""
    (folder / "creatures").mkdir()
    kinds = ("fish", "bird", "biped", "quadruped")
    for number in range(sizes.n_creatures):
        mesh = es.make_creature(kinds[number % 4], number, n_vertices=sizes.n_creature_vertices)
        es.write_mesh(mesh, folder / "creatures" / f"{number}.ply")
    learned = folder / "codebook.npz"
    learned.write_bytes(es.retrieval.write_codebook(es.retrieval.default_codebook()))
    options = ("--views", 0, "--codebook", learned)
    times, figures = {}, list[Figure]()
    for count in (1, 2):
        load, before, begun = os.getloadavg()[0], cpu_of_children(), monotonic()
        run_cli(
            "index",
            "add",
            folder / f"by{count}",
            folder / "creatures",
            *options,
            "--workers",
            count,
        )
        times[count] = monotonic() - begun
        cpu = cpu_of_children() - before
        figures += [
            (f"time, {count} at work", times[count], "s", ""),
            (f"CPU, {count} at work", cpu, "s", ""),
            (f"cores in use, {count} at work", cpu / times[count], "", ""),
            (f"load before, {count} at work", load, "", ""),
        ]
    return [*figures, ("two beside one", times[1] / times[2], "times", "1.8 times")]


def merge_parts(folder: Path, sizes: Sizes) -> list[Figure]:
    """Compare the answers of merged parts with those of an index that was built at once."""
    (folder / "shapes").mkdir()
    for number in range(sizes.n_shapes_of_parts):
        es.write_mesh(varied_mesh(number), folder / "shapes" / f"{number}.ply")
    whole = es.ShapeIndex.create(folder / "whole")
    items = es.io.find_items(folder / "shapes")
    es.retrieval.build_index(whole, items, es.read_mesh, recipes=[RECIPE], n_views=0)
    parts = [add_part(folder, part, sizes.n_parts) for part in range(1, sizes.n_parts + 1)]
    merged = es.ShapeIndex.create(folder / "merged")
    merged.merge(parts)
    queries = [
        es.describe(varied_mesh(number), RECIPE)
        for number in range(0, 2 * sizes.n_shapes_of_parts, 32)
    ]
    n_shapes = sizes.n_shapes_of_parts
    right, ours = (_answers(index, queries, n_shapes) for index in (whole, merged))
    return [
        ("shapes", sizes.n_shapes_of_parts, "", ""),
        ("parts", sizes.n_parts, "", ""),
        ("queries, each of all shapes", len(queries), "", ""),
        ("answers of the merged parts that differ", _n_different(right, ours), "", "none"),
    ]


def add_part(folder: Path, part: int, n_parts: int) -> es.ShapeIndex:
    """Build the index of one part of many, in this process: a worker takes two seconds to start."""
    index = es.ShapeIndex.create(folder / f"part{part}")
    for item in es.io.find_items(folder / "shapes", part=(part, n_parts)):
        index.add(item.name, es.read_mesh(item.path), recipe=RECIPE, n_views=0)
    return index


def _answers(
    index: es.ShapeIndex, queries: list[es.retrieval.HeatDescriptor], n_matches: int
) -> list[object]:
    """Return for each query the names and the exact scores of all shapes."""
    with index.reader() as reader:
        return [
            [
                (match.name, match.score.hex(), match.correspondences.tobytes())
                for match in reader.query(query, n_matches=n_matches, exact=True)
            ]
            for query in queries
        ]


def _n_different(one: list[object], two: list[object]) -> int:
    return sum(a != b for a, b in zip(one, two, strict=True))


def small_descriptor(number: int) -> es.retrieval.HeatDescriptor:
    """Return a descriptor of two features by numbers drawn."""
    vectors = np.random.default_rng(number).random((2, len(RECIPE.scales)))
    return es.retrieval.HeatDescriptor(vectors, np.arange(2), RECIPE)


def read_beside_writer(folder: Path, sizes: Sizes) -> list[Figure]:
    """Ask an index in many threads while it is changed; count what is no whole state."""
    index = es.ShapeIndex.create(folder / "changing")
    fixed = [es.retrieval.DescribedShape(f"s{n}", [small_descriptor(n)]) for n in range(50)]
    index.add_many(fixed)
    replace_pair(index, 0)
    n_threads = N_THREADS if sizes.n_processes > 1 else 16
    end = multiprocessing.get_context("spawn").Event()
    context = multiprocessing.get_context("spawn")
    ready, answers = context.Barrier(sizes.n_processes + 1), context.SimpleQueue()
    arguments = (index.folder, n_threads, ready, end, answers)
    readers = [context.Process(target=ask, args=arguments) for _ in range(sizes.n_processes)]
    for reader in readers:
        reader.start()
    ready.wait(300)
    begun, n_changes = monotonic(), 0
    while monotonic() - begun < sizes.seconds:
        n_changes += 1
        replace_pair(index, n_changes)
        if n_changes % 3 == 0:
            passing = es.retrieval.DescribedShape("passing", [small_descriptor(n_changes)])
            index.add_many([passing])
            index.remove("passing")
        if n_changes % 10 == 0:
            index.compact()
    end.set()
    found = [answers.get() for _ in readers]
    for reader in readers:
        reader.join()
    errors = [error for _, some in found for error in some]
    for error in errors[:10]:
        print(error)
    return [
        ("readers", sizes.n_processes * n_threads, "", ""),
        ("time", sizes.seconds, "s", ""),
        ("changes", n_changes, "", ""),
        ("queries", sum(count for count, _ in found), "", ""),
        ("errors and states that are not whole", len(errors), "", "none"),
        ("damages at the end", len(index.verify().damages), "", "none"),
    ]


def replace_pair(index: es.ShapeIndex, number: int) -> None:
    """Replace two shapes in one step."""
    index.add_many(
        [
            es.retrieval.DescribedShape(
                name, [small_descriptor(number)], label=str(number), digest=str(number)
            )
            for name in PAIR
        ],
        replace=True,
    )


def ask(folder: Path, n_threads: int, ready, end, answers) -> None:  # type: ignore[no-untyped-def]
    """Ask an index in several threads until it is told to stop; half of them share a reader."""
    warnings.simplefilter("error")
    index, query = es.ShapeIndex.open(folder), small_descriptor(1)
    errors, counts = list[str](), [0] * n_threads
    with index.reader() as shared:
        shared.query(query)
        ready.wait(300)

        def work(number: int) -> None:
            while not end.is_set():
                try:
                    errors.extend(faults_of_answer(index, shared if number % 2 else None, query))
                except (es.EigenshapeError, OSError, ValueError, Warning) as error:
                    errors.append(f"{type(error).__name__}: {error}")
                counts[number] += 1

        threads = [threading.Thread(target=work, args=[number]) for number in range(n_threads)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    answers.put((sum(counts), errors))


def faults_of_answer(
    index: es.ShapeIndex,
    reader: es.retrieval.IndexReader | None,
    query: es.retrieval.HeatDescriptor,
) -> list[str]:
    """Ask once; return what shows that the answer is of no whole state."""
    if reader is None:
        found = index.query(query, n_matches=100)
    else:
        reader.refresh()
        found = reader.query(query, n_matches=100)
    labels = {match.name: match.label for match in found if match.name in PAIR}
    names = [match.name for match in found if match.name != "passing"]
    if len(names) != 52 or len(set(names)) != 52:
        return [f"{len(names)} shapes"]
    return [f"labels {labels}"] if labels["left"] != labels["right"] else []


CASES: dict[str, Callable[[Path, Sizes], list[Figure]]] = {
    "bad": index_bad_files,
    "workers": compare_workers,
    "parts": merge_parts,
    "readers": read_beside_writer,
}


def cells(row: Row) -> list[str]:
    """Return a row as text."""
    return [
        row["case"],
        row["figure"],
        f"{row['value']:.4g} {row['unit']}".rstrip(),
        row["aim"],
    ]


def main() -> None:
    """Measure, print, and write what the options ask for."""
    parser = options_of(__doc__)
    parser.add_argument("--only", nargs="*", choices=CASES, default=list(CASES))
    parser.set_defaults(repeats=1)
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells, threads="all threads")
    sizes = QUICK if options.quick else Sizes()
    for name in options.only:
        with tempfile.TemporaryDirectory() as folder:
            for figure, value, unit, aim in CASES[name](Path(folder), sizes):
                row = {"case": name, "figure": figure, "value": value, "unit": unit}
                report.add(row | {"aim": aim})


if __name__ == "__main__":
    main()
