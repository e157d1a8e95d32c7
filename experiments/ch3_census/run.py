"""How often does a sparse eigensolver return a wrong set? (thesis 3.4 and all that stands on spectra).

Thousands of solves on shapes with multiple eigenvalues, each beside a dense solve of the same matrices. One is wrong
where one of its k eigenvalues is off by more than 1e-8 of the largest of them, or where it ends in an exception.
"""

import sys
import time
import warnings
from pathlib import Path

import numpy as np
from census_shapes import Case, cases
from census_solvers import SOLVERS, always_sparse, dense, has_lapy
from rich.progress import track
from threadpoolctl import threadpool_limits

sys.path.append(str(Path(__file__).resolve().parents[1]))
from outputs import options_of, save_figures

WRONG = 1e-8  # relative to the largest of the k
ABSENT = 1e-5  # an error so large is an eigenvalue left out, not one that is inexact
EQUAL = 1e-6  # relative distance of eigenvalues that are copies of one
TARGETS = (3, 6, 10, 16, 25, 36, 50, 75, 100, 150)
OURS = "eigenshape"
COUNTS = ("solves", "wrong", "absent", "refused")


def sizes(values: np.ndarray, targets: tuple[int, ...]) -> list[int]:
    """Return numbers k near the targets that keep the last multiple eigenvalue whole, and ones that cut it; 4k < n."""
    n = len(values)
    # copies of 0 come out as rounding, which has no relative size: there the largest eigenvalue is the measure
    apart = EQUAL * np.maximum(values[1:], EQUAL * values[-1])
    ends = [0, *(np.flatnonzero(np.diff(values) > apart) + 1).tolist(), n]  # such k cut nothing
    chosen: set[int] = set()
    for target in targets:
        place = int(np.searchsorted(ends, target, side="right")) - 1
        whole, following = ends[place], ends[min(place + 1, len(ends) - 1)]
        cut = min((whole + following) // 2, (n - 1) // 4)
        chosen |= {whole, cut} if whole < cut < following else {whole}
    return sorted(k for k in chosen if k >= 2 and 4 * k < n)


def error(found: np.ndarray, values: np.ndarray) -> float:
    """Return the largest error relative to the largest eigenvalue in the list; to the first above 0 if all are 0."""
    k = len(found)
    largest = max(values[k - 1], values[values > EQUAL * values[-1]][0])
    worst = float(np.abs(np.sort(found) - values[:k]).max() / largest)
    return worst if np.isfinite(worst) else np.inf


def verdict(solve: object, case: Case, k: int, seed: int, values: np.ndarray) -> tuple[str, float]:
    """Solve once, and return "right", "wrong", "absent" or "refused", and the error."""
    try:
        worst = error(solve(case, k, seed), values)
    except Exception as err:  # noqa: BLE001  (whatever a solver raises: there are no eigenvalues)
        return f"refused: {type(err).__name__}", np.inf
    return ("right" if worst <= WRONG else "wrong" if worst <= ABSENT else "absent"), worst


def count(row: dict[str, int], what: str) -> None:
    """Add one verdict to a row; what is absent or refused is wrong as well."""
    row["solves"] += 1
    row["wrong"] += what != "right"
    row["absent"] += what == "absent"
    row["refused"] += what.startswith("refused")


def census(*, quick: bool) -> dict[str, object]:
    """Run every solver on every case and count."""
    table: dict[str, dict[str, dict[str, int]]] = {name: {} for name in SOLVERS}
    seconds = dict.fromkeys(SOLVERS, 0.0)
    every, worst, failures = list(cases(quick=quick)), 0.0, []
    for case in track(every, description="operators"):
        values = dense(case)
        solvers = {
            name: solve for name, solve in SOLVERS.items() if name != "LaPy" or has_lapy(case)
        }
        for k in sizes(values, TARGETS[::2] if quick else TARGETS):
            for name, solve in solvers.items():
                start = time.process_time()
                what, off = verdict(solve, case, k, k, values)
                seconds[name] += time.process_time() - start
                count(table[name].setdefault(case.family, dict.fromkeys(COUNTS, 0)), what)
                if name == OURS:
                    worst = max(worst, off)
                    failures += [f"{case.name}, k = {k}: {what}"] if what != "right" else []
    for rows in table.values():
        families = list(rows.values())
        rows["all"] = {what: sum(row[what] for row in families) for what in COUNTS}
    print("CPU seconds: " + ", ".join(f"{name} {spent:.0f}" for name, spent in seconds.items()))
    return {
        "operators": len(every),
        "dense": SOLVERS[OURS].dense,
        "worst error of ours": float(f"{worst:.1e}"),
        "failures of ours": failures,
        "table": table,
    }


def main() -> None:
    """Count, print, and write what was asked for."""
    parser = options_of(__doc__, quick="two shapes a family, fewer k; about a minute")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    always_sparse()
    with threadpool_limits(1, user_api="blas"):
        result = census(quick=arguments.quick)
    for name, rows in result["table"].items():
        counts = (f"{row['wrong']} of {row['solves']} {family}" for family, row in rows.items())
        print(f"{name}, wrong: {', '.join(counts)}")
    print(f"ours: {result['dense']} solved densely, worst error {result['worst error of ours']}")
    print("\n".join(result["failures of ours"]))
    save_figures(result, arguments.out)


if __name__ == "__main__":
    main()
