"""Landmarks of a few skulls carried to others, and how far they are from those of an expert.

Constants were chosen on the tuning strains alone; the errors are those of the reporting strains.
"""

import csv
import sys
import time
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from drift import drifted_landmarks
from matplotlib.figure import Figure
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import chart, finish, label, parse_arguments, rounded
from real_shapes import DATA, require_data

HERE = Path(__file__).parent
MICE = DATA / "mice"
LABELLED = slice(0, 13, 2)  # seven of the tuning strains
TEMPLATE = "C3D2F1"  # one of them, with the median area of the tuning strains
# Of the labelled and of the judged ones, those for coherent point drift, which takes five seconds a pair
TEMPLATES, DRIFTED = slice(0, 7, 3), slice(0, 15, 3)
N_BINS = 5  # of spread
N_QUICK_FACES = 3000


def strains(half: str) -> list[str]:
    """Return the names of the skulls of a half."""
    with (MICE / "manifest.csv").open() as file:
        return [row["name"] for row in csv.DictReader(file) if row["half"] == half]


def truth(name: str) -> es.morphometrics.Landmarks:
    """Return the landmarks that an expert put on a skull."""
    return es.morphometrics.read_landmarks(MICE / f"{name}.mrk.json")


def read_skull(name: str) -> es.TriangleMesh:
    """Return a skull without what its file lacks."""
    return es.io.read_surface(MICE / f"{name}.ply").mesh


def errors(points: np.ndarray, names: list[str]) -> np.ndarray:
    """Return the distance of each landmark of some skulls from its place, in mm."""
    return np.linalg.norm(points - [truth(name).points for name in names], axis=2)


def summary(distances: np.ndarray) -> dict[str, float]:
    """Return mean and median error, and the mean and the largest root of the mean square of a skull."""
    each = np.sqrt(np.mean(distances**2, axis=1))
    return {
        "mean": float(distances.mean()),
        "median": float(np.median(distances)),
        "RMS of a skull": float(each.mean()),
        "worst skull": float(each.max()),
    }


def judge(
    collection: es.collections.Collection, labelled: list[str], judged: list[str]
) -> tuple[np.ndarray, es.collections.CarriedLandmarks, list[int]]:
    """Carry landmarks of some skulls: errors on others, what was carried, and their rows."""
    carried = es.collections.carry_landmarks(collection, {name: truth(name) for name in labelled})
    rows = [collection.number(name) for name in judged]
    return errors(carried.points[rows], judged), carried, rows


def calibration(spread: np.ndarray, distances: np.ndarray) -> list[dict[str, float]]:
    """Return, for fifths by spread, the root mean squares of the spread and of the errors."""
    order = np.argsort(spread.ravel(), kind="stable")
    parts = np.array_split(order, N_BINS)
    return [
        {
            "spread": float(np.sqrt(np.mean(spread.ravel()[part] ** 2))),
            "error": float(np.sqrt(np.mean(distances.ravel()[part] ** 2))),
        }
        for part in parts
    ]


def statistics(points: np.ndarray, names: list[str]) -> dict[str, float]:
    """Correlate sizes, distances and components of points with those from the expert's landmarks."""
    expert = es.morphometrics.fit_procrustes([truth(name).points for name in names])
    ours = es.morphometrics.fit_procrustes(points)

    def correlation(one: np.ndarray, two: np.ndarray) -> float:
        return float(abs(np.corrcoef(one, two)[0, 1]))

    pairs = np.array(list(combinations(range(len(names)), 2))).T
    scores, scores_of_ours = (
        es.morphometrics.principal_components(fit.shapes).scores for fit in (expert, ours)
    )
    return {
        "centroid size": correlation(expert.sizes, ours.sizes),
        "Procrustes distances": correlation(expert.distances()[*pairs], ours.distances()[*pairs]),
    } | {f"component {i + 1}": correlation(scores[:, i], scores_of_ours[:, i]) for i in range(3)}


def drifted(labelled: list[str], judged: list[str]) -> tuple[dict[str, dict[str, float]], float]:
    """Carry landmarks by coherent point drift: errors of one template and of the median of all, CPU s."""
    begin = time.process_time()
    templates = [(read_skull(name), truth(name).points) for name in labelled]
    found = []
    for name in track(judged, "coherent point drift"):
        target = read_skull(name)
        found.append([drifted_landmarks(mesh, points, target) for mesh, points in templates])
    points = np.array(found).transpose(1, 0, 2, 3)
    one = np.concatenate([errors(each, judged) for each in points])
    seconds = (time.process_time() - begin) / (len(judged) * len(templates))
    several = errors(np.median(points, axis=0), judged)
    return {
        "drift from one template": summary(one),
        "median of three drifts": summary(several),
    }, seconds


def figure_errors(found: dict[str, np.ndarray], bins: list[dict[str, float]]) -> Figure:
    """Draw the share of landmarks under each error, and errors beside the spread that is said."""
    figure, (left, right) = chart(11, 4.4, columns=2)
    limits = np.linspace(0, 0.8, 161)
    for name, distances in found.items():
        left.plot(limits, [(distances < limit).mean() for limit in limits], label=name)
    label(left, "error, mm", "share of landmarks", "15 skulls of the reporting strains")
    points = np.array([[part["spread"], part["error"]] for part in bins])
    right.plot(points[:, 0], points[:, 1], marker="o", label="fifths of all landmarks")
    right.plot([0, points.max()], [0, points.max()], color="gray", linewidth=0.8)
    label(right, "spread, mm", "root of the mean squared error, mm", "seven labelled skulls")
    return figure


def main() -> None:
    """Build the collection, and judge what is carried."""
    arguments = parse_arguments(__doc__, HERE)
    require_data()
    tuning, reporting = strains("tuning"), strains("reporting")
    if arguments.quick:
        labelled, judged = tuning[:2], reporting[:2]
        skulls = {}
        for name in labelled + judged:
            sound = es.repair(read_skull(name), ["auto"]).mesh
            skulls[name] = es.geometry.decimate(sound, N_QUICK_FACES).mesh
    else:
        labelled, judged = tuning[LABELLED], reporting
        skulls = {name: MICE / f"{name}.ply" for name in labelled + judged}

    with TemporaryDirectory() as folder:
        begin = time.process_time()
        template = None if arguments.quick else TEMPLATE
        collection = es.collections.build_collection(skulls, folder, template=template)
        seconds = (time.process_time() - begin) / len(skulls)
        several, carried, rows = judge(collection, labelled, judged)
        one = np.concatenate([judge(collection, [name], judged)[0] for name in labelled])
    found = {
        "one labelled skull": summary(one),
        f"{len(labelled)} labelled skulls": summary(several),
        "failed": len(collection.failures),
        "doubtful": int(carried.doubtful[rows].sum()),
        "spread": dict(enumerate(calibration(carried.spread[rows], several), start=1)),
    }
    if arguments.quick:
        finish(rounded(found), {}, arguments)
        return
    found["statistics"] = {
        "landmarks": statistics(carried.points[rows], judged),
        "surface": statistics(collection.points[rows], judged),
    }
    found["CPU s of a skull"] = seconds
    some = np.arange(len(judged))[DRIFTED]
    drifts, found["CPU s of a drift"] = drifted(labelled[TEMPLATES], judged[DRIFTED])
    found["some skulls"] = drifts | {
        "one labelled skull": summary(
            one.reshape(len(labelled), *several.shape)[:, some].reshape(-1, several.shape[1])
        ),
        f"{len(labelled)} labelled skulls": summary(several[some]),
    }
    curves = {"one labelled skull": one, f"{len(labelled)} labelled skulls": several}
    pictures = {"errors": figure_errors(curves, calibration(carried.spread[rows], several))}
    finish(rounded(found), pictures, arguments)


if __name__ == "__main__":
    main()
