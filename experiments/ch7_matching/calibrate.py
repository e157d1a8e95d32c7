"""How sure is each vertex of a map? Fits the constants that turn evidence into confidence.

Tuning animals only: stretched parts, plain pairs, and parts matched to shapes of other kinds.
"""

import sys
from pathlib import Path

import numpy as np
from pairs import SETS, TUNING, Pair, draw_pairs, errors, make_pair
from rich.progress import track
from run import OURS, calibration
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import roc_auc_score

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of, output_folder
from real_shapes import DATA, require_data

STRETCHED = "stretched"
OTHER = "other kinds"
PLAIN = "plain"
# How many stretched parts of each set. Seeds are 9000 to 9008, then 9100 to 9105.
COUNTS = {"scans": 15, "small cuts": 15, "noisy scans": 15, "noisy small cuts": 7}
SEEDS = [*range(9000, 9009), *range(9100, 9106)]
POSE_SEEDS = {"scans": 15, "small cuts": 438}  # of the draw of the pose that is cut
# Few wholes are enough, and are described once.
WHOLES = {"cat": ("sumner_cat-03", "sumner_cat-08"), "horse": ("sumner_horse-06",)}
N_OTHER = 4  # scans and as many cuts, matched to shapes of these classes, where no place is right
OTHER_CLASSES = ("airplane", "hand", "teddy", "human")
N_PLAIN, PLAIN_SEED = 3, 300  # plain pairs of each set, others than those that `run.py` measures
RIGHT = 5.0  # hundredths of √area: a vertex with a smaller error is right
WRONG_EVERYWHERE = 99.0
PENALTY = 1e-3  # C of scikit-learn; 1e-2 and 1 do about as well on parts that are left out
N_FOLDS = 8
# Each row has the confidence of `match_shapes` itself, and those by other constants beside it.
WAYS = ("confidence", "fitted", "left out", "former")
# The constants before the third round
FORMER = np.array(
    [-8.01, 1.12, -32.2, 10.3, -5.01, -0.15, -61.4, 0.791, 0.0193, -2.97, 0.704, -0.51, -2.42]
)


def draw_stretched(kind: str, count: int) -> list:
    """Draw names of poses as `draw_pairs` does; noisy parts are the clean ones of a seed with noise."""
    found = []
    for seed in SEEDS[:count]:
        number = seed % 100
        animal = ("cat", "horse", "cat")[number % 3]
        whole = WHOLES[animal][number % len(WHOLES[animal])]
        rng = np.random.default_rng([seed, POSE_SEEDS[kind.removeprefix("noisy ")]])
        part = str(rng.choice([pose for pose in TUNING[animal] if pose != whole]))
        found.append((animal, (part, whole), kind, seed))
    return found


def shape_of_other_kind(number: int, like: es.TriangleMesh) -> es.TriangleMesh:
    """Return a shape of another class with the area of the whole that it replaces."""
    cls = OTHER_CLASSES[number % len(OTHER_CLASSES)]
    files = sorted((DATA / "retrieval" / cls).glob("psb*.ply"))
    mesh = es.read_mesh(files[number // len(OTHER_CLASSES)])
    mesh = es.repair(mesh, ["drop_degenerate", "largest_component"]).mesh
    ratio = es.geometry.surface_area(like) / es.geometry.surface_area(mesh)
    return es.TriangleMesh(mesh.vertices * np.sqrt(ratio), mesh.faces)


def measure(group: str, wanted: tuple, pair: Pair, whole: object) -> dict[str, object]:
    """Match a pair: evidence and errors at some vertices. On a shape of another kind all are wrong."""
    match = es.match_shapes(pair.part, whole)
    wrong = (
        np.full(len(pair.vertices), WRONG_EVERYWHERE)
        if group == OTHER
        else errors(pair, match.pull(pair.whole.vertices))
    )
    _, _, kind, seed = wanted
    return {
        "group": group,
        "kind": kind,
        "seed": seed,
        OURS: wrong,
        "confidence": match.confidence[pair.vertices],
        "evidence": match.evidence[pair.vertices],
    }


def collect(*, quick: bool) -> list[dict[str, object]]:
    """Match every part: the stretched ones, some of these to shapes of other kinds, the plain ones."""
    counts = {"small cuts": 1} if quick else COUNTS
    kinds = ("small cuts",) if quick else ("scans", "small cuts")
    sets, n_plain, n_other = (("cuts",), 1, 1) if quick else (SETS, N_PLAIN, N_OTHER)
    stretched = [one for kind, count in counts.items() for one in draw_stretched(kind, count)]
    others = [one for kind in kinds for one in draw_stretched(kind, n_other)]
    plain = [
        one for kind in sets for one in draw_pairs(TUNING, kind, n_plain, first_seed=PLAIN_SEED)
    ]
    rows, targets = [], {}
    for wanted in track(stretched, STRETCHED):
        pair, name = make_pair(*wanted, stretch=True), wanted[1][1]
        if name not in targets:
            targets[name] = es.matching.prepare_target(pair.whole)
        rows.append(measure(STRETCHED, wanted, pair, targets[name]))
    for number, wanted in enumerate(track(others, OTHER)):
        pair = make_pair(*wanted, stretch=True)
        rows.append(measure(OTHER, wanted, pair, shape_of_other_kind(number, pair.whole)))
    for wanted in track(plain, PLAIN):
        pair = make_pair(*wanted)
        rows.append(measure(PLAIN, wanted, pair, pair.whole))
    return rows


def fit(rows: list[dict[str, object]]) -> np.ndarray:
    """Return a constant and a factor of each column of evidence, by logistic regression.

    Plain pairs together weigh as much as all others.
    """
    evidence = np.concatenate([row["evidence"] for row in rows])
    right = np.concatenate([row[OURS] < RIGHT for row in rows])
    plain = np.concatenate([np.full(len(row[OURS]), row["group"] == PLAIN) for row in rows])
    weights = np.where(plain, (~plain).sum() / plain.sum(), 1.0)
    mean, spread = evidence.mean(axis=0), evidence.std(axis=0)
    model = LogisticRegression(C=PENALTY, max_iter=2000)
    model.fit((evidence - mean) / spread, right, sample_weight=weights)
    factors = model.coef_[0] / spread
    return np.concatenate([model.intercept_ - factors @ mean, factors])


def confidence_by(row: dict[str, object], constants: np.ndarray) -> np.ndarray:
    """Return the confidence of each vertex by these constants."""
    return 1 / (1 + np.exp(-constants[0] - row["evidence"] @ constants[1:]))


def judge_left_out(rows: list[dict[str, object]]) -> dict[str, object]:
    """Give each part the confidence of constants that are fitted without all parts of its fold.

    A part, the same one with noise, and the same one on another shape have one seed, hence one fold.
    Returns what `calibration` returns, and the mean errors of each set of stretched parts.
    """
    for fold in range(N_FOLDS):
        constants = fit([row for row in rows if row["seed"] % N_FOLDS != fold])
        for row in rows:
            if row["seed"] % N_FOLDS == fold:
                row["left out"] = confidence_by(row, constants)
    means = {kind: [] for kind in COUNTS}
    for row in rows:
        if row["group"] == STRETCHED:
            means[row["kind"]].append(row[OURS].mean())
    return {
        "tenths": calibration([{OURS: row[OURS], "confidence": row["left out"]} for row in rows]),
        "mean errors": {kind: float(np.mean(found)) for kind, found in means.items()},
    }


def compare(rows: list[dict[str, object]]) -> dict[str, dict[str, object]]:
    """Return how well each way tells right vertices of each group, and the share that is right.

    The Brier score is the mean square of what confidence lacks of 1 at right vertices, and of 0 at
    others. The area under the curve needs both.
    """
    table = {}
    for group in dict.fromkeys(row["group"] for row in rows):
        parts = [row for row in rows if row["group"] == group]
        right = np.concatenate([row[OURS] < RIGHT for row in parts])
        table[group] = {"right": float(right.mean())}
        for way in WAYS:
            if way not in parts[0]:
                continue
            confidence = np.concatenate([row[way] for row in parts])
            table[group][way] = {"Brier": float(np.mean((confidence - right) ** 2))}
            if 0 < right.mean() < 1:
                area = roc_auc_score(right, confidence)
                table[group][way]["area under the curve"] = float(area)
    return table


def main() -> None:
    """Match, fit, and print constants, errors and scores."""
    parser = options_of(__doc__, quick="three parts", out="ch7-calibrate.json")
    parser.add_argument(
        "--lions", type=output_folder, help="folder --db of run.py: compare on lions, too"
    )
    arguments = parser.parse_args()
    require_data()
    rows = collect(quick=arguments.quick)
    constants = fit(rows)
    results = {"constants": rounded(constants, 3)}
    if not arguments.quick:
        results |= judge_left_out(rows)
    if arguments.lions:
        files = sorted(arguments.lions.glob("*lion*.npz"))
        if not files:
            parser.error(
                f"--lions must be a folder that run.py --db filled; {arguments.lions} has no lions."
            )
        rows += [{"group": "lion", **np.load(file)} for file in files]
    for row in rows:
        row |= {"fitted": confidence_by(row, constants), "former": confidence_by(row, FORMER)}
    results["groups"] = compare(rows)
    give_out(rounded(results), arguments.out)


if __name__ == "__main__":
    main()
