"""How far do eigenvalues move when points or surfaces do, beside what the theorems allow? (thesis 3.1, 4.1, 4.3).

Points of a torus of area 1, each moved by δ in a random direction; independent samples of it, matched one to one; and
its mesh under a smooth motion.
"""

import sys
import warnings
from itertools import product
from pathlib import Path

import numpy as np
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from bound_pictures import DIM, columns, figure_forbidden, figure_law, figure_surfaces
from fitted_rates import bounding_rate, fit_rate
from frame import finish, parse_arguments, rounded

HERE = Path(__file__).resolve().parent
N_FUNCTIONAL = 36  # eigenvalues of the sphere: degrees 0 to 5
SHORT = 4.0  # t ≥ 4δ² is what the theorem is asked about; t ≤ δ²/4 what it forbids
FULL = {
    "points": 1000,
    "seeds": 5,
    "times": [2e-3, 6e-3, 2e-2],
    "deltas": [1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3],
    "samples": [250, 500, 1000, 2000],
    "mesh": (80, 40),
    "mesh times": [4e-4, 8e-4, 1.6e-3],
    "heights": [1e-3, 3e-3, 1e-2, 3e-2],
    "k": 100,
}
QUICK = {
    **FULL,
    "points": 300,
    "seeds": 2,
    "times": [6e-3, 2e-2],
    "deltas": [1e-3, 1e-2, 0.1, 0.3],
    "samples": [125, 250],
    "mesh": (40, 20),
    "mesh times": [2e-3, 4e-3],
    "heights": [3e-3, 3e-2],
    "k": 30,
}
OPERATORS = {
    "mesh, literal": lambda mesh, t: es.mesh_laplacian(mesh, t=t),
    "mesh, corrected": lambda mesh, t: es.mesh_laplacian(mesh, t=t, correct="log"),
    "cotangent, lumped": lambda mesh, t: es.cotangent_laplacian(mesh, "lumped"),
}


def torus_of_area_one(n_around: int, n_across: int) -> es.TriangleMesh:
    """Return the torus on whose surface everything happens."""
    return es.geometry.normalize_mesh(es.shapes.torus(n_around, n_across), "area")


def all_eigenvalues(laplacian: es.Laplacian) -> np.ndarray:
    """Return every eigenvalue of a graph Laplacian, whose mass is 1/n."""
    return np.linalg.eigvalsh(laplacian.n_points * laplacian.stiffness.toarray())


def laplacians(one: np.ndarray, two: np.ndarray, t: float) -> list[es.Laplacian]:
    """Return the graph Laplacians of two sets of points."""
    return [es.operators.gaussian_laplacian(points, t, DIM) for points in (one, two)]


def moved_points(setup: dict) -> list[dict[str, float]]:
    """Move each point of a sample by δ, and compare all n eigenvalues."""
    mesh, rows = torus_of_area_one(96, 48), []
    cases = list(product(setup["times"], setup["deltas"], range(setup["seeds"])))
    for t, delta, seed in track(cases, description="points moved"):
        rng = np.random.default_rng(seed)
        points = es.geometry.sample_surface(mesh, setup["points"], rng=rng).points
        steps = rng.standard_normal(points.shape)
        there = points + delta * steps / np.linalg.norm(steps, axis=1, keepdims=True)
        one, two = laplacians(points, there, t)
        before, after = all_eigenvalues(one), all_eigenvalues(two)
        low = slice(1, 11)
        rows.append(
            {
                "t": t,
                "delta": delta,
                "change": float(np.abs(after - before).max()),
                "lowest": float((np.abs(after - before)[low] / before[low]).mean()),
                "weyl": es.stability.weyl_bound(one, two).norm,
            }
        )
    return rows


def matched_samples(setup: dict) -> list[dict[str, float]]:
    """Compare independent samples, as Theorem 4.1.1 has them: δ is what the best one-to-one correspondence leaves."""
    mesh, t, rows = torus_of_area_one(96, 48), setup["times"][-1], []
    for n, seed in track(
        list(product(setup["samples"], range(setup["seeds"]))), description="samples matched"
    ):
        rng = np.random.default_rng(seed)
        one, two = (es.geometry.sample_surface(mesh, n, rng=rng).points for _ in range(2))
        delta = es.stability.bottleneck_matching(one, two).distance
        values = [all_eigenvalues(laplacian) for laplacian in laplacians(one, two, t)]
        change = float(np.abs(values[0] - values[1]).max())
        low = float(np.abs(values[0] - values[1])[1:11].max())
        rows.append({"n": n, "t": t, "delta": delta, "change": change, "lowest": low})
    return rows


def waved(mesh: es.TriangleMesh, height: float) -> es.TriangleMesh:
    """Move a surface along its normals by a smooth function of size `height`."""
    x, y, z = (4 * np.pi * mesh.vertices).T
    waves = np.sin(x) * np.cos(y) + np.sin(z + x) ** 2
    return es.TriangleMesh(
        mesh.vertices + height / 2 * waves[:, None] * es.geometry.vertex_normals(mesh), mesh.faces
    )


def moved_surfaces(setup: dict) -> list[dict[str, object]]:
    """Move a mesh smoothly, and compare the first k eigenvalues by each operator."""
    mesh, rows = torus_of_area_one(*setup["mesh"]), []
    cases = list(product(OPERATORS, setup["mesh times"]))
    for name, t in track(cases, description="surfaces moved"):
        if name.startswith("cotangent") and t != setup["mesh times"][0]:
            continue
        before = es.solve_spectrum(OPERATORS[name](mesh, t), setup["k"])
        for height in setup["heights"]:
            there = waved(mesh, height)
            after = es.solve_spectrum(OPERATORS[name](there, t), setup["k"])
            compared = es.spectral.compare_spectra(before, after)
            rows.append(
                {
                    "operator": name,
                    "t": t,
                    "delta": es.stability.measure_closeness(
                        es.stability.measure_perturbation(mesh, there)
                    ).delta,
                    "hausdorff": compared.hausdorff,
                    "change": compared.index_distance,
                    "relative": compared.median_relative,
                }
            )
    return rows


def exponents(rows: list[dict], measured: str = "change") -> dict[str, float]:
    """Fit powers of δ and t."""
    law = fit_rate(*columns(rows, "delta", "t", measured))
    return {"delta": law.delta, "t": law.t, "constant": law.constant}


def summarize(points: list[dict], samples: list[dict], surfaces: list[dict]) -> dict[str, object]:
    """Gather exponents and constants beside those that are proven."""
    allowed = [row for row in points if row["t"] >= SHORT * row["delta"] ** 2]
    forbidden = [row for row in points if row["t"] <= row["delta"] ** 2 / SHORT]
    law, ours, dense = (
        es.stability.theorem_rate(name, DIM) for name in ("4.3.1", "lipschitz", "dense")
    )
    told = columns(points, "delta", "t", "change")
    at_samples = columns(samples, "delta", "t")
    return {
        "points, t ≥ 4δ²": exponents(allowed),
        "proven (4.3.1)": {"delta": law.delta, "t": law.t},
        "proven (ours)": {"delta": ours.delta, "t": ours.t},
        "expected (dense)": {"delta": dense.delta, "t": dense.t},
        "constant that 4.3.1 needs": bounding_rate(
            law, *columns(allowed, "delta", "t", "change")
        ).constant,
        "largest share of our bound": float((told[2] / ours.at(*told[:2])).max()),
        "largest share of our bound for dense samples": float(
            (told[2] / dense.at(*told[:2])).max()
        ),
        "largest share of Weyl's norm": float(np.max(told[2] / columns(points, "weyl")[0])),
        "lowest ten, relative, t ≥ 4δ²": float(np.mean(columns(allowed, "lowest")[0])),
        "lowest ten, relative, t ≤ δ²/4": float(np.mean(columns(forbidden, "lowest")[0])),
        "samples": {
            str(n): _sample_row([row for row in samples if row["n"] == n])
            for n in {r["n"]: 0 for r in samples}
        },
        "samples, largest share of our bound": float(
            np.max(columns(samples, "change")[0] / ours.at(*at_samples))
        ),
        "functional": functional_errors(),
        "surfaces": {
            name: _surface_row([row for row in surfaces if row["operator"] == name])
            for name in OPERATORS
        },
    }


def _sample_row(rows: list[dict]) -> dict[str, float]:
    return {name: float(columns(rows, name)[0].mean()) for name in ("delta", "change", "lowest")}


def _surface_row(rows: list[dict]) -> dict[str, float]:
    by_number, as_sets = exponents(rows, "change"), exponents(rows, "hausdorff")
    theorem = "3.1.5" if rows[0]["operator"].startswith("cotangent") else "3.1.4"
    covering = bounding_rate(
        es.stability.theorem_rate(theorem, DIM), *columns(rows, "delta", "t", "hausdorff")
    )
    return {
        "δ, by number": by_number["delta"],
        "t, by number": by_number["t"],
        "δ, as sets": as_sets["delta"],
        "t, as sets": as_sets["t"],
        f"constant of {theorem}": covering.constant,
        "relative, most": max(row["relative"] for row in rows),
    }


def functional_errors() -> dict[str, float]:
    """Fit how far the first eigenvalues of 𝓛_t on the unit sphere are from those of Δ, where theorem 3.1.1 holds."""
    exact = es.shapes.sphere_eigenvalues(N_FUNCTIONAL)
    times = np.geomspace(1e-6, 1 / (2 * exact[-1]), 20)
    errors = np.array(
        [
            np.abs(es.shapes.sphere_functional_eigenvalues(N_FUNCTIONAL, t) - exact).max()
            for t in times
        ]
    )
    ones = np.ones(len(times))
    proven = es.stability.theorem_rate("3.1.1", DIM)
    return {
        "t": fit_rate(ones, times, errors).t,
        "t, proven": proven.t,
        "constant of 3.1.1": bounding_rate(proven, ones, times, errors).constant,
    }


def main() -> None:
    """Measure, print, draw."""
    arguments = parse_arguments(__doc__, HERE)
    warnings.simplefilter("ignore")
    setup = QUICK if arguments.quick else FULL
    points, samples, surfaces = moved_points(setup), matched_samples(setup), moved_surfaces(setup)
    pictures = {
        "law": figure_law(points, samples, setup),
        "forbidden": figure_forbidden(points, setup),
        "surfaces": figure_surfaces(surfaces, setup),
    }
    finish(rounded(summarize(points, samples, surfaces)), pictures, arguments)


if __name__ == "__main__":
    main()
