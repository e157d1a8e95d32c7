"""Awkward specimens among skulls, all in one collection: what is said of each, and how good its landmarks are."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from run import LABELLED, TEMPLATE, read_skull, strains, truth
from scipy.spatial.transform import Rotation

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of
from real_shapes import DATA, require_data

JUDGED = slice(0, 15, 8)  # two of the reporting strains
KEPT = 0.6  # share of the area that cuts leave
N_HOLES, HOLE = 400, 1.5  # holes at most, and their radius in mm
KNOWN = slice(0, 51, 9)  # landmarks that tell a mirror image
ON_PART = 0.3  # mm from what is left of a surface, up to which a landmark is not lost
MIRROR = np.array([-1.0, 1, 1])
METERS = 0.001  # of a millimeter
BESIDE = np.array([9.0, 4, 0])  # mm from a skull to the piece of another one
# The data have no lower jaws. The lowest millimeters of another skull, a sixth of its area, are about
# as large; they are placed below.
JAW, BELOW = 2.5, np.array([0, 0, -3.5])  # mm
LENGTH = 24.0  # mm, of a skull
# Words of the note that must be made on each kind
NOTES = {
    "in meters": "unit of length",
    "left half": "no counterpart in it",
    "front half": "no counterpart in it",
    "a plane cuts 40 % off": "no counterpart in it",
    "holes take 40 %": "no counterpart in it",
    "half of another attached": "no counterpart in the mean",
    "a piece like a lower jaw": "no counterpart in the mean",
}
AS_IT_IS, KNOWN_BY_LANDMARKS = "as it is", "mirrored, six landmarks known"
KINDS = (AS_IT_IS, "mirrored", KNOWN_BY_LANDMARKS, *NOTES)
QUICK = KINDS[:3]


def part(mesh: es.TriangleMesh, keep: np.ndarray) -> es.TriangleMesh:
    """Return the faces that are kept."""
    kept = es.TriangleMesh(mesh.vertices, mesh.faces[keep])
    return es.repair(kept, ["drop_unreferenced"]).mesh


def variants(
    mesh: es.TriangleMesh, other: es.TriangleMesh
) -> Iterator[tuple[str, es.TriangleMesh, np.ndarray]]:
    """Yield the kinds of awkward specimens of a skull, with the factors of its coordinates."""
    none = np.ones(3)
    yield AS_IT_IS, mesh, none
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
    middles = other.vertices[other.faces].mean(axis=1)
    half = part(other, middles[:, 1] < np.median(other.vertices[:, 1]))
    yield "half of another attached", with_piece(mesh, half, BESIDE), none
    jaw = part(other, middles[:, 2] < other.vertices[:, 2].min() + JAW)
    yield "a piece like a lower jaw", with_piece(mesh, jaw, BELOW), none


def with_piece(mesh: es.TriangleMesh, piece: es.TriangleMesh, shift: np.ndarray) -> es.TriangleMesh:
    """Return a mesh together with a piece that is moved."""
    moved = es.TriangleMesh(piece.vertices + shift, piece.faces)
    return es.geometry.disjoint_union(mesh, moved)


def other_things() -> dict[str, es.TriangleMesh]:
    """Return what is no skull of a mouse, as large as one."""
    horse = es.read_mesh(DATA / "retrieval" / "horse" / "sumner_horse-01.ply")
    low, high = horse.vertices.min(axis=0), horse.vertices.max(axis=0)
    _, y, z = (horse.vertices[horse.faces].mean(axis=1) - low).T / (high - low)[:, None]
    found = {"a horse's head": part(horse, (y > 0.65) & (z > 0.78))}
    found |= {f"a {kind}": es.make_creature(kind, n_vertices=8000) for kind in ("fish", "hand")}
    return {
        name: es.TriangleMesh(
            LENGTH * mesh.vertices / np.ptp(mesh.vertices, axis=0).max(), mesh.faces
        )
        for name, mesh in found.items()
    }


@dataclass
class Specimen:
    """An awkward specimen of a skull: its surface, true landmarks, and which of them it still has."""

    kind: str
    mesh: es.TriangleMesh
    landmarks: es.morphometrics.Landmarks
    is_left: np.ndarray
    unit: float  # mm of the specimen's unit


def specimens_of(name: str, other: str) -> Iterator[Specimen]:
    """Yield the awkward specimens of a skull, each turned in its own way."""
    given = truth(name)
    for number, (kind, mesh, factors) in enumerate(variants(read_skull(name), read_skull(other))):
        points = given.points * factors
        away = np.linalg.norm(es.geometry.closest_points(mesh, points).points - points, axis=1)
        turn = Rotation.random(rng=np.random.default_rng(number)).as_matrix()
        turned = es.TriangleMesh(mesh.vertices @ turn.T, mesh.faces)
        unit = 1 / abs(factors[0])
        landmarks = es.morphometrics.Landmarks(given.names, points @ turn.T)
        yield Specimen(kind, turned, landmarks, unit * away < ON_PART, unit)


def outcome(
    kind: str,
    awkward: dict[str, Specimen],
    collection: es.collections.Collection,
    carried: es.collections.CarriedLandmarks,
) -> dict[str, object]:
    """Return what was said of the specimens of a kind, and the errors of their landmarks in mm."""
    of_kind = [name for name, each in awkward.items() if each.kind == kind]
    rows = [collection.number(name) for name in of_kind if name in collection.names]
    sides = [collection.sides[row] for row in rows]
    notes = [" ".join(collection.notes[collection.names[row]]) for row in rows]
    result: dict[str, object] = {
        "specimens": len(of_kind),
        "refused": len(of_kind) - len(rows),
        "same": sides.count("same"),
        "mirrored": sides.count("mirrored"),
        "cannot be told": sides.count("cannot be told"),
        "noted": sum(NOTES[kind] in note for note in notes) if kind in NOTES else 0,
    }
    if not rows:
        return result
    errors, of_left, of_lost = [], [], []
    for row in rows:
        each = awkward[collection.names[row]]
        away = each.unit * np.linalg.norm(carried.points[row] - each.landmarks.points, axis=1)
        errors.append(away[each.is_left])
        of_left.append(carried.doubtful[row, each.is_left])
        of_lost.append(carried.doubtful[row, ~each.is_left])
    lost = np.concatenate(of_lost)
    return result | {
        "mean": float(np.concatenate(errors).mean()),
        "median": float(np.median(np.concatenate(errors))),
        "doubtful": float(np.concatenate(of_left).mean()),
        "lost": len(lost),
        "lost and doubtful": float(lost.mean()) if len(lost) else None,
    }


def main() -> None:
    """Build one collection of all, and say what became of each kind."""
    parser = options_of(__doc__, quick="one skull, three kinds of it")
    parser.add_argument(
        "--kinds", nargs="+", choices=KINDS, help="only these, without other things"
    )
    arguments = parser.parse_args()
    require_data()
    chosen = QUICK if arguments.quick else arguments.kinds or KINDS
    labelled, judged = strains("tuning")[LABELLED], strains("reporting")[JUDGED]
    if arguments.quick:
        labelled, judged = [TEMPLATE, labelled[0]], judged[:1]
    others = {} if arguments.quick or arguments.kinds else other_things()
    awkward = {
        f"{name}, {each.kind}": each
        for number, name in enumerate(judged)
        for each in specimens_of(name, judged[number - 1])
        if each.kind in chosen
    }
    given = {name: truth(name) for name in labelled}
    known = dict(given)
    for name, each in awkward.items():
        if each.kind == KNOWN_BY_LANDMARKS:
            few = np.full_like(each.landmarks.points, np.nan)
            few[KNOWN] = each.landmarks.points[KNOWN]
            known[name] = es.morphometrics.Landmarks(each.landmarks.names, few)
    skulls = {name: read_skull(name) for name in labelled}
    skulls |= {name: each.mesh for name, each in awkward.items()} | others
    with TemporaryDirectory() as folder:
        collection = es.collections.build_collection(
            skulls, folder, template=TEMPLATE, mirrored=known
        )
        carried = es.collections.carry_landmarks(collection, given)
    kinds = dict.fromkeys(each.kind for each in awkward.values())
    results = {kind: outcome(kind, awkward, collection, carried) for kind in kinds}
    if AS_IT_IS in results:
        plain = results[AS_IT_IS]["mean"]
        for result in results.values():
            if "mean" in result:
                result["times"] = result["mean"] / plain
    found = {
        "kinds": results,
        "other things": {name: {"refused": int(name in collection.failures)} for name in others},
        "failures": collection.failures,
        "notes": {name: notes for name, notes in collection.notes.items() if notes},
    }
    give_out({"quick" if arguments.quick else "full": rounded(found)}, arguments.out)


if __name__ == "__main__":
    main()
