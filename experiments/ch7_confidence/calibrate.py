"""Is confidence a probability on every kind of shape? Fits its constants on one half, reports both.

Pairs of six kinds whose maps are known, and pairs that do not belong together; the halves share no
individual.
"""

import sys
from pathlib import Path

import numpy as np
from kinds import HALVES, Drawn, draw
from rich.progress import track
from scipy.optimize import minimize
from scipy.special import expit
from sklearn.metrics import roc_auc_score

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
sys.path.append(str(Path(__file__).resolve().parents[1] / "ch7_matching"))
from frame import rounded
from outputs import give_out, options_of
from pairs import errors
from real_shapes import require_data

RIGHT = 5.0  # hundredths of √area: a vertex with a smaller error is right
PENALTY = 5e-3  # on squares of factors of columns of spread 1: few pairs, 13 columns
N_BINS = 10


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


def judge(measured: list[dict[str, object]]) -> dict[str, float]:
    """Return the share that is right, mean confidence, calibration error, and area under the curve."""
    sure = np.concatenate([row["confidence"] for row in measured])
    right = np.concatenate([row["right"] for row in measured])
    bins = np.minimum((sure * N_BINS).astype(int), N_BINS - 1)
    gaps = [
        abs(sure[bins == number].sum() - right[bins == number].sum()) for number in range(N_BINS)
    ]
    found = {
        "pairs": len(measured),
        "right": float(right.mean()),
        "confidence": float(sure.mean()),
        "calibration error": float(np.sum(gaps) / len(sure)),
    }
    if 0 < right.mean() < 1:
        found["area under the curve"] = float(roc_auc_score(right, sure))
    return found


def main() -> None:
    """Match, fit, and print constants and tables."""
    parser = options_of(__doc__, quick="few pairs", out="ch7-confidence.json")
    arguments = parser.parse_args()
    require_data()
    measured = [measure(drawn) for drawn in track(list(draw(quick=arguments.quick)))]
    results: dict[str, object] = {}
    for half in HALVES:
        ours = [row for row in measured if row["half"] == half]
        kinds = dict.fromkeys(row["kind"] for row in ours)
        results[half] = {
            kind: judge([row for row in ours if row["kind"] == kind]) for kind in kinds
        }
    if not arguments.quick:
        results["constants"] = fit([row for row in measured if row["half"] == HALVES[0]])
    give_out(rounded(results, 3), arguments.out)


if __name__ == "__main__":
    main()
