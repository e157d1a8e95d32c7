"""Where does each point of a part lie on a whole? Errors of dense correspondences, without training.

What is done is kept in a folder, so that a stopped run goes on where it was.
"""

import sys
import time
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pairs import REPORTING, RIGID, SETS, TUNING, Pair, draw_pairs, errors, make_pair
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import chart, label, rounded
from outputs import give_out, options_of, output_folder
from real_shapes import require_data

HERE = Path(__file__).parent
COUNTS = {"cuts": 12, "holes": 8, "scans": 12, "noise": 8, "wholes": 6}  # pairs of lions
N_RIGID = 3  # pairs of dogs, centaurs and people of each set, of one pose
N_QUICK = 1
SEEDS = {"lion": 500, "rigid": 700, "tuning": 100}  # of the first pair of each group
N_TUNING = 3
OURS, TODAY = "match_shapes", "nearest pair of match_patches"
MIRRORED = "mirrored"  # errors if each true place were its mirror image
WRONG = 20.0  # hundredths of √area: a map with a larger mean error has failed
BINS = np.linspace(0, 1, 11)


def groups(*, quick: bool) -> dict[str, list]:
    """Return the pairs of each group, as `make_pair` takes them."""
    if quick:
        kinds = ("cuts", "holes")
        drawn = [draw_pairs(REPORTING, kind, N_QUICK, first_seed=SEEDS["lion"]) for kind in kinds]
        return {"lion": list(chain(*drawn))}
    lions = [draw_pairs(REPORTING, k, COUNTS[k], first_seed=SEEDS["lion"]) for k in SETS]
    rigid = [draw_pairs(RIGID, k, N_RIGID, first_seed=SEEDS["rigid"]) for k in SETS[:4]]
    tuning = [draw_pairs(TUNING, k, N_TUNING, first_seed=SEEDS["tuning"]) for k in SETS]
    return {
        "lion": list(chain(*lions)),
        "rigid": list(chain(*rigid)),
        "tuning": list(chain(*tuning)),
    }


def copied_pairs(pair: Pair, whole: es.retrieval.PatchPoints) -> np.ndarray:
    """Return the image of each vertex as that of the nearest pair of `match_patches`."""
    found = es.retrieval.match_patches(es.describe(pair.part).points[0], whole).vertices
    if not len(found):
        return np.repeat(pair.whole.vertices[:1], pair.part.n_vertices, axis=0)
    rows = es.geometry.geodesic_distances(pair.part, found[:, 0])
    return pair.whole.vertices[found[rows.argmin(axis=0), 1]]


def measure(pair: Pair, targets: dict[str, tuple]) -> dict[str, np.ndarray]:
    """Match a pair in both ways: errors at some vertices, confidence there, scores and seconds."""
    key = pair.name.split(" on ")[1]
    if key not in targets:
        begin = time.process_time()
        target = es.matching.prepare_target(pair.whole)
        seconds = time.process_time() - begin
        targets[key] = target, seconds, es.describe(pair.whole).points[0]
    target, seconds, points = targets[key]
    begin = time.process_time()
    match = es.match_shapes(pair.part, target)
    done = time.process_time()
    image = match.pull(pair.whole.vertices)
    mirrored = {} if pair.mirrored is None else {MIRRORED: errors(pair, image, mirrored=True)}
    return {
        OURS: errors(pair, image),
        **mirrored,
        TODAY: errors(pair, copied_pairs(pair, points)),
        "confidence": match.confidence[pair.vertices],
        "evidence": match.evidence[pair.vertices],
        "seconds": np.array([seconds, done - begin]),
        "score": np.array([match.score, match.orientation, match.coverage]),
    }


def kept(folder: Path, wanted: tuple, targets: dict) -> dict[str, np.ndarray]:
    """Measure a pair, or read what was measured before."""
    _, poses, kind, seed = wanted
    file = folder / f"{kind}-{seed}-{poses[0]}-{poses[1]}.npz"
    if not file.exists():
        np.savez_compressed(file, **measure(make_pair(*wanted), targets))
    return dict(np.load(file))


def summary(rows: list[dict[str, np.ndarray]], way: str) -> dict[str, float]:
    """Return mean and median error, shares under 5 and 10, and the share of failed maps.

    Of symmetric animals, also the mean if each part may be placed on its mirror image.
    """
    every = np.concatenate([row[way] for row in rows])
    means = np.array([row[way].mean() for row in rows])
    found = {
        "mean": float(means.mean()),
        "median": float(np.median(every)),
        "under 5": float((every < 5).mean()),
        "under 10": float((every < 10).mean()),
        "over 20": float((means > WRONG).mean()),
    }
    if way == OURS and MIRRORED in rows[0]:
        mirrored = np.array([row[MIRRORED].mean() for row in rows])
        found["mean of the better mirror image"] = float(np.minimum(means, mirrored).mean())
    return found


def calibration(rows: list[dict[str, np.ndarray]]) -> list[list[float]]:
    """Return, for each tenth of confidence, its mean, the share that is right, and the count."""
    sure = np.concatenate([row["confidence"] for row in rows])
    right = np.concatenate([row[OURS] < 5 for row in rows])
    places = np.clip(np.digitize(sure, BINS) - 1, 0, len(BINS) - 2)
    return [
        [float(sure[inside].mean()), float(right[inside].mean()), int(inside.sum())]
        for inside in (places == number for number in range(len(BINS) - 1))
        if inside.any()
    ]


def figure_curves(found: dict[str, dict[str, list]]) -> Figure:
    """Draw the share of vertices under each error, and confidence beside the share that is right."""
    figure, (left, right) = chart(11, 4.4, columns=2)
    limits = np.linspace(0, 25, 101)
    for kind, rows in found["lion"].items():
        every = np.concatenate([row[OURS] for row in rows])
        left.plot(limits, [(every < limit).mean() for limit in limits], label=kind)
    every = np.concatenate([row[TODAY] for rows in found["lion"].values() for row in rows])
    shares = [(every < limit).mean() for limit in limits]
    left.plot(limits, shares, color="gray", linestyle=":", label=TODAY)
    label(left, "error, hundredths of √area", "share of vertices", "lions, by set")
    for group in ("tuning", "lion", "rigid"):
        points = np.array(calibration(list(chain(*found[group].values()))))
        right.plot(points[:, 0], points[:, 1], marker="o", label=group)
    right.plot([0, 1], [0, 1], color="gray", linewidth=0.8)
    label(right, "confidence", "share with an error under 5", "calibration")
    return figure


def draw_examples(found: dict[str, list], wanted: list[tuple], folder: Path) -> None:
    """Draw the best, the median and the worst map of each set of lions."""
    for kind, rows in found.items():
        pairs = [one for one in wanted if one[2] == kind]
        order = np.argsort([row[OURS].mean() for row in rows])
        for name, place in (("best", 0), ("median", len(order) // 2), ("worst", -1)):
            pair = make_pair(*pairs[order[place]])
            match = es.match_shapes(pair.part, pair.whole)
            figure = es.plot.figure_match(pair.part, pair.whole, match)
            es.save_figure(figure, folder / f"{kind}_{name}.png")


def main() -> None:
    """Measure every pair, print and save the table."""
    parser = options_of(__doc__, quick="two parts of lions", out="ch7-matching.json")
    parser.add_argument(
        "--db", type=output_folder, default="ch7-matching", help="folder of what is done, kept"
    )
    parser.add_argument("--figures", type=output_folder, help="draw pictures into this folder")
    arguments = parser.parse_args()
    require_data()
    found, targets = {}, {}
    wanted = groups(quick=arguments.quick)
    for group, pairs in wanted.items():
        found[group] = {}
        for one in track(pairs, group):
            found[group].setdefault(one[2], []).append(kept(arguments.db, one, targets))
    results = {
        group: {
            way: {kind: summary(rows, way) for kind, rows in sets.items()} for way in (OURS, TODAY)
        }
        for group, sets in found.items()
    }
    if arguments.quick:
        means = {kind: row["mean"] for kind, row in results["lion"][OURS].items()}
        give_out({"mean error": rounded(means)}, arguments.out)
        return
    every = [row for sets in found.values() for rows in sets.values() for row in rows]
    results["calibration"] = {
        group: calibration(list(chain(*sets.values()))) for group, sets in found.items()
    }
    results["seconds a part"] = float(np.median([row["seconds"][1] for row in every]))
    results["seconds a whole"] = float(np.median([row["seconds"][0] for row in every]))
    give_out(rounded(results), arguments.out)
    if arguments.figures:
        es.save_figure(figure_curves(found), arguments.figures / "curves.png")
        draw_examples(found["lion"], wanted["lion"], arguments.figures)


if __name__ == "__main__":
    main()
