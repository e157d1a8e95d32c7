"""Cortices: eigenmodes and null maps beside LaPy and neuromodes, and the calls of neuromodes on both solvers.

    python benchmarks/bench_cortex.py --quick                    the cortex of 4,002 vertices, half a minute
    python benchmarks/bench_cortex.py --repeats 1                all, half an hour
    python benchmarks/bench_cortex.py --only nulls calls         of modes, nulls and calls

The cortices are those of the wheel of neuromodes (CC BY-NC-SA; read where they are): left hemispheres of human, macaque
and marmoset, 32,492 vertices. **modes** computes 200, 500 and 1,000 modes in the consistent mass (1,000 by neuromodes,
which waits for LaPy's solver, of the human cortex alone). **nulls** draws 1,000
null maps of the myelin map with 400 modes, without medial wall, and compares their statistics: moments, power of each
group of modes and variogram; **agreement** is the largest difference of two means in its standard errors, of which 40
statistics stay below about 3. **calls** are those of neuromodes' documentation on LaPy's solver and on ours in
its place, with the largest difference of the answers.

Each library has a process of its own with one thread, of BLAS too, on the same core, and solves something small first,
which loads what it needs. For modes the libraries take turns, so that all of them see the same load: a
turn is a new process of each, and the ratio is that of their medians. There are `--repeats` turns, and at least five
for 200 modes, where the ratio is least.
"""

import time
from collections.abc import Callable
from typing import Any

import lapy
import numpy as np
from neuromodes import EigenSolver
from neuromodes.io import fetch_example_map, fetch_example_surf
from neuromodes.mesh import mask_mesh
from neuromodes.nulls import eigenstrap
from neuromodes.stats import sigmoid_rescale, zscorew
from report import Report, Row, in_process, options_of, ratio_text

import eigenshape as es

PACKAGES = ["eigenshape", "lapy", "neuromodes", "numpy", "scipy"]
COLUMNS = ("case", "library", "CPU s", "to ours", "agreement")
SPECIES, COUNTS = ("human", "macaque", "marmoset"), (200, 500, 1000)
TURNS = 5  # at least, with the fewest modes
N_PAIRS = 20_000  # of points, for the variogram


def cortex(species: str, *, small: bool, masked: bool = False) -> lapy.TriaMesh:
    """Return a left cortex, without its medial wall if it is masked."""
    density = "4k" if small else "32k"
    mesh, mask = fetch_example_surf("human" if small else species, density)
    return mask_mesh(mesh, mask) if masked else mesh


def myelin(*, small: bool) -> np.ndarray:
    """Return the map of myelin on the masked human cortex."""
    density = "4k" if small else "32k"
    _, mask = fetch_example_surf("human", density)
    return np.asarray(fetch_example_map("myelinmap", density=density)[mask])


def our_spectrum(mesh: lapy.TriaMesh, k: int) -> es.Spectrum:
    """Return k certified modes in the consistent mass."""
    return es.solve_spectrum(es.cotangent_laplacian((mesh.v, mesh.t), "consistent"), k)


SOLVERS: dict[str, Callable[[lapy.TriaMesh, int], np.ndarray]] = {
    "eigenshape": lambda mesh, k: our_spectrum(mesh, k).eigenvalues,
    "LaPy": lambda mesh, k: lapy.Solver(mesh).eigs(k)[0],
    "neuromodes": lambda mesh, k: EigenSolver(mesh).solve(k).evals,
    "neuromodes on eigenshape": lambda mesh, k: EigenSolver(mesh).solve(k).evals,
}


def cpu_seconds(call: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Return the median CPU time of a call, and its last answer."""
    runs = []
    for _ in range(repeats):
        start = time.process_time()
        answer = call()
        runs.append(time.process_time() - start)
    return float(np.median(runs)), answer


def modes(library: str, species: str, k: int, quick: bool) -> Row:
    """Solve once by one library."""
    if library == "neuromodes on eigenshape":
        es.compat.lapy.install()
    solve = SOLVERS[library]
    solve(cortex("human", small=True), 20)
    mesh = cortex(species, small=quick)
    cpu, values = cpu_seconds(lambda: solve(mesh, k), 1)
    return {"library": library, "cpu": cpu, "values": values.tolist()}


def modes_in_turns(species: str, k: int, turns: int, quick: bool) -> list[Row]:
    """Return a row for each library, with the median of its turns."""
    waits_for_lapy = species != "human" and k == max(COUNTS)
    libraries = [library for library in SOLVERS if not (waits_for_lapy and library == "neuromodes")]
    rows: dict[str, list[Row]] = {library: [] for library in libraries}
    for _ in range(turns):
        for library in libraries:
            rows[library].append(in_process(modes, library, species, k, quick))
    case = f"{species}, {k} modes" + (f", {turns} turns" if turns > 1 else "")
    medians = []
    for own in rows.values():
        runs = [row["cpu"] for row in own]
        medians.append(own[-1] | {"case": case, "cpu": float(np.median(runs)), "runs": runs})
    return medians


def statistics(nulls: np.ndarray, spectrum: es.Spectrum, mesh: lapy.TriaMesh) -> np.ndarray:
    """Return moments, power of each group of modes, and variogram of each null: a row for each statistic."""
    areas = spectrum.mass.sum(axis=1)
    centered = nulls - areas @ nulls / areas.sum()
    moments = [areas @ centered**order / areas.sum() for order in (2, 3, 4)]
    power = es.spectral.project(nulls, spectrum) ** 2
    degrees = int(len(power) ** 0.5)
    groups = [power[degree**2 : (degree + 1) ** 2].sum(axis=0) for degree in range(1, degrees)]
    first, second = np.random.default_rng(0).integers(0, len(nulls), (2, N_PAIRS))
    distances = np.linalg.norm(mesh.v[first] - mesh.v[second], axis=1)
    rows = np.digitize(distances, np.quantile(distances, np.linspace(0, 0.7, 16)[1:-1]))
    halves = (nulls[first] - nulls[second]) ** 2 / 2
    variogram = [halves[rows == row].mean(axis=0) for row in range(15)]
    return np.vstack([*moments, *groups, *variogram])


def nulls(library: str, residual: str, resample: str, repeats: int, quick: bool) -> Row:
    """Draw nulls by one library, and return the means and variances of their statistics."""
    count, k = (100, 49) if quick else (1000, 400)
    mesh, data = cortex("human", small=quick, masked=True), myelin(small=quick)
    spectrum = our_spectrum(mesh, k)
    # neuromodes means None where we mean "none".
    theirs = {
        "residual": None if residual == "none" else residual,
        "resample": None if resample == "none" else resample,
    }

    def draw(number: int) -> np.ndarray:
        if library == "eigenshape":
            rng = np.random.default_rng(0)
            return es.modes.rotation_nulls(
                data, spectrum, number, rng=rng, residual=residual, resample=resample
            )
        vectors, values = np.array(spectrum.eigenvectors), np.array(spectrum.eigenvalues)
        return eigenstrap(data, vectors, values, number, mass=mass, seed=0, checks=False, **theirs)

    mass = lapy.Solver.fem_tria_mass(mesh)
    draw(2)
    cpu, drawn = cpu_seconds(lambda: draw(count), repeats)
    found = statistics(drawn, spectrum, mesh)
    means, errors = found.mean(axis=1), found.var(axis=1) / count
    return {"library": library, "cpu": cpu, "means": means.tolist(), "errors": errors.tolist()}


def calls(on_ours: bool, repeats: int, quick: bool) -> Row:
    """Make the documented calls of neuromodes, and return their times and answers."""
    if on_ours:
        es.compat.lapy.install()
    k, n_times = (36, 20) if quick else (200, 100)
    EigenSolver(cortex("human", small=True)).solve(10)
    mesh, data = cortex("human", small=quick, masked=True), myelin(small=quick)
    solver = EigenSolver(mesh).solve(k)
    hetero = sigmoid_rescale(zscorew(data, solver.mass), lower=0, upper=2)
    recon = solver.reconstruct(data, mode_counts=[10, k])
    activity = solver.sim_nft_waves(nt=n_times, seed=1)
    documented: dict[str, Callable[[], Any]] = {
        f"solve({k})": lambda: EigenSolver(mesh).solve(k).evals,
        f"solve({k}, lump=True)": lambda: EigenSolver(mesh).solve(k, lump=True).evals,
        f"solve({k}, hetero)": lambda: EigenSolver(mesh).solve(k, hetero=hetero).evals,
        "decompose": lambda: solver.decompose(data),
        "reconstruct": lambda: solver.reconstruct(data, mode_counts=[10, k]),
        "recon_error": lambda: solver.recon_error(data, recon),
        "eigenstrap, 100 nulls": lambda: solver.eigenstrap(data, n_nulls=100, n_groups=6, seed=0),
        f"sim_nft_waves, {n_times} times": lambda: solver.sim_nft_waves(nt=n_times, seed=1),
        "balloon_model": lambda: solver.balloon_model(activity, dt=1e-4),
    }
    if quick:  # n² numbers
        documented["compute_gem"] = lambda: solver.compute_gem(k=k)
    rows = []
    for name, call in documented.items():
        cpu, answer = cpu_seconds(call, repeats)
        # Columns of a large answer are many enough to compare.
        some = np.reshape(answer, (len(answer), -1))[:, :5]
        rows.append({"call": name, "cpu": cpu, "answer": some})
    return {"rows": rows}


def compared(row: Row, ours: Row) -> Row:
    """Return a row of modes or nulls with its ratio to ours and its agreement, without the long lists."""
    shown = {"case": row["case"], "library": row["library"], "cpu": row["cpu"]}
    shown["ratio"] = row["cpu"] / max(ours["cpu"], 1e-9)
    if "values" in row:
        shown["runs"] = row["runs"]
        values, expected = np.array(row["values"]), np.array(ours["values"])
        shown["difference"] = float(np.abs(values - expected).max() / expected[-1])
        shown["agreement"] = f"{shown['difference']:.0e}"
        if row["library"].endswith("eigenshape"):
            shown["agreement"] = "certified"
    else:
        spread = np.sqrt(np.add(row["errors"], ours["errors"]))
        means = np.array(ours["means"])
        # What nulls keep exactly differs by rounding only.
        apart = np.abs(means - row["means"]) / np.maximum(spread, 1e-9 * np.abs(means))
        shown["difference"] = float(apart.max())
        shown["agreement"] = "" if row is ours else f"{shown['difference']:.1f} standard errors"
    return shown


def cells(row: Row) -> list[str]:
    """Return the texts of one row."""
    ratio = ratio_text(row["ratio"])
    return [row["case"], row["library"], f"{row['cpu']:.3g}", ratio, row["agreement"]]


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = options_of(__doc__)
    parts = ("modes", "nulls", "calls")
    parser.add_argument("--only", nargs="+", choices=parts, default=list(parts))
    options = parser.parse_args()
    repeats, quick = options.repeats, options.quick
    report = Report(PACKAGES, options, COLUMNS, cells)

    def add(case: str, measure: Callable[..., Row], libraries: list[str], *arguments: Any) -> None:
        ours: Row = {}
        for library in libraries:
            row = in_process(measure, library, *arguments, repeats, quick) | {"case": case}
            ours = ours or row
            report.add(compared(row, ours))

    if "modes" in options.only:
        for species in SPECIES[: 1 if quick else 3]:
            for k in (20, 50) if quick else COUNTS:
                turns = max(repeats, TURNS) if k == COUNTS[0] else repeats
                rows = modes_in_turns(species, k, turns, quick)
                for row in rows:
                    report.add(compared(row, rows[0]))
    if "nulls" in options.only:
        for residual, resample in (("none", "none"), ("permute", "exact")):
            case = "nulls" if resample == "none" else "nulls, residual permuted, values kept"
            add(case, nulls, ["eigenshape", "neuromodes"], residual, resample)
    if "calls" in options.only:
        on_ours, on_lapy = (in_process(calls, here, repeats, quick) for here in (True, False))
        for ours, theirs in zip(on_ours["rows"], on_lapy["rows"], strict=True):
            difference = np.abs(ours["answer"] - theirs["answer"]).max()
            difference = float(difference / np.abs(theirs["answer"]).max())
            for solver, row in (("on eigenshape", ours), ("on LaPy", theirs)):
                shown = {"case": f"neuromodes: {row['call']}", "library": solver, "cpu": row["cpu"]}
                shown |= {"ratio": row["cpu"] / max(ours["cpu"], 1e-9), "difference": difference}
                shown["agreement"] = "" if row is ours else f"{difference:.0e}"
                report.add(shown)


if __name__ == "__main__":
    main()
