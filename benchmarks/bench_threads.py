"""What several threads gain: wall seconds of one thread over those of two, and of all cores.

    python benchmarks/bench_threads.py               all cases, some minutes
    python benchmarks/bench_threads.py --quick       small ones, seconds
    python benchmarks/bench_threads.py --only patches heat

Each case runs in this process, with one thread, then with two, in turn, and the median of each is
taken; first small cases load what all need. Results are compared to the last bit. Two
bounds say what the machine allows: a large product of matrices, which needs the cores alone, and
the sum of a large array, which needs the memory that they share; both by two threads at once.
"""

import hashlib
import statistics
import time
from collections.abc import Callable, Sequence

import numpy as np
from report import Report, Row, options_of

import eigenshape as es
from certeig.kit.threads import map_in_threads, one_blas_thread, usable_cores
from certeig.sparse.elimination import analyze_pattern
from certeig.sparse.symmetric_factor import SymmetricFactor

COLUMNS = ("case", "one thread s", "two threads s", "one / two", "all cores s", "one / all")
Work = Callable[[], Sequence[np.ndarray]]  # what is timed; the arrays are compared


def spectrum(quick: bool) -> Work:
    """Return a certified solve."""
    laplacian = es.cotangent_laplacian(es.icosphere(4 if quick else 6))

    def work() -> Sequence[np.ndarray]:
        found = es.solve_spectrum(laplacian, 40 if quick else 300)
        return found.eigenvalues, found.eigenvectors

    return work


def factored(quick: bool) -> tuple[Callable[[], SymmetricFactor], int]:
    """Return the factorization of a sphere's operator, and its points."""
    laplacian = es.cotangent_laplacian(es.shapes.fibonacci_sphere(5_000 if quick else 160_000))
    matrix = (laplacian.stiffness + laplacian.mass).tocsc()
    matrix.sort_indices()
    elimination = analyze_pattern(matrix)
    return lambda: SymmetricFactor.of_entries(elimination, matrix.data), matrix.shape[0]


def factor(quick: bool) -> Work:
    """Return a factorization whose analysis is done."""
    work, _ = factored(quick)
    return lambda: [work().panels]


def solves(quick: bool) -> Work:
    """Return solves of 32 right-hand sides."""
    work, n = factored(quick)
    ready, right = work(), np.random.default_rng(0).standard_normal((n, 32))
    return lambda: [ready.solve(right)]


def patches(quick: bool) -> Work:
    """Return a description with six views."""
    mesh = es.make_creature("quadruped", n_vertices=600 if quick else 5_000)
    return lambda: [each.numbers for each in es.retrieval.extract_patches(mesh, n_views=6)]


def waves(quick: bool) -> Work:
    """Return geodesic balls around all points."""
    mesh = es.shapes.fibonacci_sphere(1_000 if quick else 20_000)
    return lambda: [es.geometry.geodesic_balls(mesh, 0.1).data]


def heat(quick: bool) -> Work:
    """Return the heat of a large shape."""
    laplacian = es.cotangent_laplacian(es.shapes.fibonacci_sphere(5_000 if quick else 300_000))
    return lambda: [es.spectral.approximate_heat_signature(laplacian, 50, [0.01, 0.1]).values]


def target(quick: bool) -> Work:
    """Return the preparation of a whole that parts are matched to."""
    whole = es.make_creature("quadruped", 1, n_vertices=600 if quick else 5_000)

    def work() -> Sequence[np.ndarray]:
        surface = es.matching.prepare_target(whole).pieces[0].surface
        return surface.distances, surface.ways, surface.numbers

    return work


def match(quick: bool) -> Work:
    """Return the match of what a scanner sees to a prepared whole in another pose."""
    n = 600 if quick else 5_000
    whole = es.matching.prepare_target(es.make_creature("quadruped", 1, n_vertices=n))
    scan = es.partial_scan(es.make_creature("quadruped", 2, n_vertices=n), [0.9, 0.25, 0.45])

    def work() -> Sequence[np.ndarray]:
        found = es.match_shapes(scan.mesh, whole)
        return found.faces, found.weights, found.confidence

    return work


def products(quick: bool) -> Work:
    """Return two large products of matrices: what the cores allow."""
    square = np.ones((200, 200) if quick else (2_000, 2_000))
    return lambda: map_in_threads(lambda _: square @ square, range(2))


def sums(quick: bool) -> Work:
    """Return two sums of large arrays: what the memory allows."""
    long = [np.ones(10_000 if quick else 60_000_000) for _ in range(2)]
    return lambda: map_in_threads(np.sum, long)


CASES: dict[str, Callable[[bool], Work]] = {
    "bound: products": products,
    "bound: memory": sums,
    "spectrum": spectrum,
    "factor": factor,
    "solves": solves,
    "patches": patches,
    "waves": waves,
    "heat": heat,
    "target": target,
    "match": match,
}


def seconds(work: Work, n_threads: int) -> tuple[float, str]:
    """Return wall seconds with so many threads, and a hash of the result."""
    es.set_threads(n_threads)
    start = time.perf_counter()
    with one_blas_thread():
        found = work()
    took = time.perf_counter() - start
    return took, hashlib.sha256(b"".join(np.asarray(each).tobytes() for each in found)).hexdigest()


def measured(name: str, quick: bool, repeats: int) -> Row:
    """Time one case with each number of threads in turn."""
    work, numbers = CASES[name](quick), sorted({1, 2, usable_cores()})
    runs: dict[int, list[float]] = {number: [] for number in numbers}
    hashes = set()
    for _ in range(repeats + 1):
        for number in numbers:
            took, found = seconds(work, number)
            runs[number].append(took)
            hashes.add(found)
    if len(hashes) > 1:
        raise RuntimeError(f"{name}: digits depend on the number of threads")
    medians = {number: statistics.median(runs[number][1:]) for number in numbers}
    return {"case": name, "seconds": medians, "cores": numbers[-1]}


def cells(row: Row) -> list[str]:
    """Return the texts of a row."""
    one, two, every = (row["seconds"][number] for number in (1, 2, row["cores"]))
    return [
        row["case"],
        f"{one:.3f}",
        f"{two:.3f}",
        f"{one / two:.2f}",
        f"{every:.3f} ({row['cores']})",
        f"{one / every:.2f}",
    ]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    options = parser.parse_args()
    report = Report(
        ["eigenshape", "numpy", "scipy"],
        options,
        COLUMNS,
        cells,
        threads="one and two threads",
    )
    for name in options.only:
        report.add(measured(name, options.quick, options.repeats))


if __name__ == "__main__":
    main()
