"""Is confidence a probability on every kind of shape? Fits its constants on one half, reports both.

Pairs of six kinds whose maps are known, and pairs that do not belong together; the halves share no
individual.
"""

import sys
from pathlib import Path

import numpy as np
from kinds import HALVES, KINDS, Drawn, draw
from rich.progress import track
from scipy.optimize import minimize
from scipy.special import expit
from sklearn.metrics import roc_auc_score

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
sys.path.append(str(Path(__file__).resolve().parents[1] / "ch7_matching"))
from frame import rounded
from outputs import give_out, options_of, output_folder
from pairs import errors
from real_shapes import require_data

RIGHT = 5.0  # hundredths of √area: a vertex with a smaller error is right
PENALTY = 5e-3  # on squares of factors of columns of spread 1: few pairs, 13 columns
N_BINS, N_DRAWS = 10, 200


def measure(drawn: Drawn) -> dict[str, object]:
    """Match a pair: evidence, confidence, the number of places, and whether vertices are right."""
    pair = drawn.pair
    match = es.match_shapes(pair.part, pair.whole)
    chosen = pair.vertices
    right = np.zeros(len(chosen), dtype=bool)
    if drawn.belongs:
        right = errors(pair, match.pull(pair.whole.vertices)) < RIGHT
    evidence, confidence = match.evidence[chosen], match.confidence[chosen]
    return {
        "kind": drawn.kind,
        "half": drawn.half,
        "evidence": evidence,
        "confidence": confidence,
        "right": right,
        "places": match.n_equally_good,
    }


def kept(folder: Path, drawn: Drawn) -> dict[str, object]:
    """Measure a pair, or read what was measured before."""
    file = folder / f"{drawn.half}-{drawn.kind}-{drawn.name.replace('/', '-')}.npz"
    if not file.exists():
        np.savez_compressed(file, **measure(drawn))
    found = dict(np.load(file))
    return {name: values if values.ndim else values.item() for name, values in found.items()}


def fit(measured: list[dict[str, object]]) -> np.ndarray:
    """Return a constant and a factor of each column of evidence, with as much weight for each pair of a kind.

    The likelihood is that of the confidence itself, which is divided by the number of places.
    """
    kinds = [row["kind"] for row in measured]
    evidence = np.concatenate([row["evidence"] for row in measured])
    right = np.concatenate([row["right"] for row in measured]).astype(float)
    places = np.repeat(
        [row["places"] or 1 for row in measured], [len(row["right"]) for row in measured]
    )
    weights = np.concatenate(
        [
            np.full(len(row["right"]), 1 / len(row["right"]) / kinds.count(row["kind"]))
            for row in measured
        ]
    )
    mean, spread = evidence.mean(axis=0), evidence.std(axis=0) + 1e-9
    columns = np.column_stack([np.ones(len(evidence)), (evidence - mean) / spread])

    def loss(factors: np.ndarray) -> float:
        sure = np.clip(expit(columns @ factors) / places, 1e-6, 1 - 1e-6)
        likelihood = right * np.log(sure) + (1 - right) * np.log(1 - sure)
        return float(-weights @ likelihood / weights.sum() + PENALTY * (factors[1:] ** 2).sum())

    found = minimize(loss, np.zeros(columns.shape[1])).x
    factors = found[1:] / spread
    return np.concatenate([[found[0] - factors @ mean], factors])


def judge(measured: list[dict[str, object]], way: str = "confidence") -> dict[str, object]:
    """Return the share that is right, mean confidence, calibration error, and area under the curve.

    Errors come with the interval in which 90 % of drawings of as many pairs, with replacement, have them.
    """
    found: dict[str, object] = {
        "pairs": len(measured),
        "vertices": sum(len(row["right"]) for row in measured),
        **rates(measured, way),
    }
    rng = np.random.default_rng(0)
    drawn = [
        rates([measured[n] for n in rng.integers(len(measured), size=len(measured))], way)
        for _ in range(N_DRAWS)
    ]
    errors_drawn = [each["calibration error"] for each in drawn]
    found["interval"] = np.quantile(errors_drawn, [0.05, 0.95])
    return found


def rates(measured: list[dict[str, object]], way: str) -> dict[str, float]:
    """Return the share that is right, mean confidence, calibration error, and area under the curve."""
    sure = np.concatenate([row[way] for row in measured])
    right = np.concatenate([row["right"] for row in measured])
    bins = np.minimum((sure * N_BINS).astype(int), N_BINS - 1)
    gaps = np.bincount(bins, weights=sure - right, minlength=N_BINS)
    found = {
        "right": float(right.mean()),
        "confidence": float(sure.mean()),
        "calibration error": float(np.abs(gaps).sum() / len(sure)),
        "Brier": float(np.mean((sure - right) ** 2)),
    }
    if 0 < right.mean() < 1:
        found["area under the curve"] = float(roc_auc_score(right, sure))
    return found


def main() -> None:
    """Match, fit, and print constants and tables."""
    parser = options_of(__doc__, quick="few pairs", out="ch7-confidence.json")
    parser.add_argument(
        "--db", type=output_folder, default="ch7-confidence", help="folder of what is done, kept"
    )
    arguments = parser.parse_args()
    require_data()
    drawn = list(draw(quick=arguments.quick))
    measured = [kept(arguments.db, one) for one in track(drawn)]
    ways = ["confidence"]
    results: dict[str, object] = {}
    if not arguments.quick:
        constants = fit([row for row in measured if row["half"] == HALVES[0]])
        results["constants"] = constants
        ways.append("fitted")
        for row in measured:
            row["fitted"] = expit(constants[0] + row["evidence"] @ constants[1:]) / row["places"]
    for half in HALVES:
        ours = [row for row in measured if row["half"] == half]
        kinds = {kind: [row for row in ours if row["kind"] == kind] for kind in KINDS}
        results[half] = {
            way: {kind: judge(rows, way) for kind, rows in kinds.items() if rows} for way in ways
        }
    give_out(rounded(results, 3), arguments.out)


if __name__ == "__main__":
    main()
