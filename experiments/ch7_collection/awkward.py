"""Awkward specimens among skulls, all in one collection: what is said of each, and how good its landmarks are."""

import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from run import LABELLED, TEMPLATE, read_skull, strains, truth
from scipy.spatial.transform import Rotation

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of
from real_shapes import require_data

JUDGED = slice(0, 15, 5)  # three of the reporting strains
KEPT = 0.6  # share of the area that cuts leave
N_HOLES, HOLE = 400, 1.5  # holes at most, and their radius in mm
KNOWN = slice(0, 51, 9)  # landmarks that tell a mirror image
ON_PART = 0.3  # mm from what is left of a surface, up to which a landmark is not lost
MIRROR = np.array([-1.0, 1, 1])
METERS = 0.001  # of a millimeter
BESIDE = np.array([9.0, 4, 0])  # mm from a skull to the piece of another one
CREATURES = {"another species: a head": "horse", "another thing: a hand": "hand"}
# Words of the note that must be made on each kind
NOTES = {
    "in meters": "unit of length",
    "left half": "no counterpart in it",
    "front half": "no counterpart in it",
    "a plane cuts 40 % off": "no counterpart in it",
    "holes take 40 %": "no counterpart in it",
    "half of another attached": "no counterpart in the mean",
}
KNOWN_BY_LANDMARKS = "mirrored, six landmarks known"


def part(mesh: es.TriangleMesh, keep: np.ndarray) -> es.TriangleMesh:
    """Return the faces that are kept."""
    kept = es.TriangleMesh(mesh.vertices, mesh.faces[keep])
    return es.repair(kept, ["drop_unreferenced"]).mesh


def variants(mesh: es.TriangleMesh, other: es.TriangleMesh) -> Iterator[tuple[str, es.TriangleMesh, np.ndarray]]:
    """Yield the kinds of awkward specimens of a skull, with the factors of its coordinates."""
    none = np.ones(3)
    yield "as it is", mesh, none
    mirrored = es.TriangleMesh(mesh.vertices * MIRROR, mesh.faces[:, ::-1])
    yield "mirrored", mirrored, MIRROR
    yield KNOWN_BY_LANDMARKS, mirrored, MIRROR
    yield "in meters", es.TriangleMesh(METERS * mesh.vertices, mesh.faces), METERS * none
    x, y, _ = centers = mesh.vertices[mesh.faces].mean(axis=1).T
    yield "left half", part(mesh, x > np.median(mesh.vertices[:, 0])), none
    yield "front half", part(mesh, y < np.median(mesh.vertices[:, 1])), none
    draw = np.random.default_rng(mesh.n_vertices)
    heights = draw.normal(size=3) @ centers
    areas = es.geometry.face_areas(mesh)
    order = np.argsort(heights)
    below = order[np.cumsum(areas[order]) < KEPT * areas.sum()]
    yield "a plane cuts 40 % off", part(mesh, below), none
    keep = np.ones(mesh.n_faces, dtype=bool)
    for place in draw.choice(centers.T, N_HOLES):
        if areas[keep].sum() < KEPT * areas.sum():
            break
        keep &= np.linalg.norm(centers.T - place, axis=1) > HOLE
    yield "holes take 40 %", part(mesh, keep), none
    half = part(other, other.vertices[other.faces].mean(axis=1)[:, 1] < np.median(other.vertices[:, 1]))
    half = es.TriangleMesh(half.vertices + BESIDE, half.faces)
    yield "half of another attached", es.geometry.disjoint_union(mesh, half), none


def head(kind: str) -> es.TriangleMesh:
    """Return a creature's head or hand, as large as a skull."""
    mesh = es.make_creature(kind, n_vertices=8000)
    if kind != "hand":
        length = np.argmax(np.ptp(mesh.vertices, axis=0))
        places = mesh.vertices[mesh.faces].mean(axis=1)[:, length]
        mesh = part(mesh, places > np.quantile(places, 0.75))
    return es.TriangleMesh(24 * mesh.vertices / np.ptp(mesh.vertices, axis=0).max(), mesh.faces)


def main() -> None:
    """Build one collection of all, and say what became of each kind."""
    arguments = options_of(__doc__, quick="one skull, three kinds of it").parse_args()
    require_data()
    labelled, judged = strains("tuning")[LABELLED], strains("reporting")[JUDGED]
    if arguments.quick:
        labelled, judged = [TEMPLATE, labelled[0]], judged[:1]
    chosen = ["as it is", "mirrored", KNOWN_BY_LANDMARKS] if arguments.quick else None

    skulls: dict[str, es.TriangleMesh] = {name: read_skull(name) for name in labelled}
    known = {name: truth(name) for name in labelled}
    places: dict[str, np.ndarray] = {}
    is_left: dict[str, np.ndarray] = {}
    kinds: dict[str, list[str]] = {}
    for number, name in enumerate(judged):
        landmarks = truth(name)
        other = read_skull(judged[number - 1])
        for kind, mesh, factors in variants(read_skull(name), other):
            if chosen is not None and kind not in chosen:
                continue
            specimen = f"{name}, {kind}"
            turn = Rotation.random(rng=np.random.default_rng(len(places))).as_matrix()
            points = landmarks.points * factors
            nearest = es.geometry.closest_points(mesh, points).points
            away = np.linalg.norm(nearest - points, axis=1)
            is_left[specimen] = away < ON_PART * abs(factors[0])
            skulls[specimen] = es.TriangleMesh(mesh.vertices @ turn.T, mesh.faces)
            places[specimen] = points @ turn.T
            kinds.setdefault(kind, []).append(specimen)
            if kind == KNOWN_BY_LANDMARKS:
                few = np.full_like(points, np.nan)
                few[KNOWN] = places[specimen][KNOWN]
                known[specimen] = es.morphometrics.Landmarks(landmarks.names, few)
    for kind, creature in CREATURES.items():
        kinds[kind] = [kind]
        skulls[kind] = head(creature)

    with TemporaryDirectory() as folder:
        collection = es.collections.build_collection(
            skulls, folder, template=TEMPLATE, landmarks=known
        )
        carried = es.collections.carry_landmarks(
            collection, {name: known[name] for name in labelled}
        )
    results: dict[str, dict[str, object]] = {}
    for kind, specimens in kinds.items():
        rows = [collection.number(name) for name in specimens if name not in collection.failures]
        sides = [collection.sides[row] for row in rows]
        word = NOTES.get(kind)
        result: dict[str, object] = {
            "specimens": len(specimens),
            "refused": len(specimens) - len(rows),
            "same": sides.count("same"),
            "mirrored": sides.count("mirrored"),
            "cannot be told": sides.count("cannot be told"),
            "noted": sum(
                word is not None and any(word in note for note in collection.notes[collection.names[row]])
                for row in rows
            ),
        }
        errors, found, lost = [], [], []
        for row in rows:
            name = collection.names[row]
            if name not in places:
                continue
            unit = METERS if kind == "in meters" else 1.0
            away = np.linalg.norm(carried.points[row] - places[name], axis=1) / unit
            errors.append(away[is_left[name]])
            found.append(carried.doubtful[row, is_left[name]])
            lost.append(carried.doubtful[row, ~is_left[name]])
        if errors:
            all_lost = np.concatenate(lost)
            result |= {
                "mean": float(np.concatenate(errors).mean()),
                "median": float(np.median(np.concatenate(errors))),
                "doubtful": float(np.concatenate(found).mean()),
                "lost": len(all_lost),
            }
            result |= {"lost and doubtful": float(all_lost.mean())} if len(all_lost) else {}
        results[kind] = result
    for result in results.values():
        if "mean" in result:
            result["times"] = result["mean"] / results["as it is"]["mean"]
    failures = {name: collection.failures[name] for name in sorted(collection.failures)}
    notes = {name: notes for name, notes in collection.notes.items() if notes}
    give_out(rounded({"kinds": results, "failures": failures, "notes": notes}), arguments.out)


if __name__ == "__main__":
    main()
