"""Raw files to dense correspondences: skulls as they were published, and small awkward files."""

import json
import re
import sys
import tempfile
import time
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
from pairs import TUNING
from rich.progress import track

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of
from real_shapes import DATA, require_data

# A turn, so that awkward files are not matched to themselves in place
TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
N_HOLES, HOLE = 5, 0.05  # holes of a part, and their radius in roots of the area
LEFT_OUT = 0.2  # share of the vertices of a part that a plane removes
REMEDY = re.compile(r"--repair (?:auto,)?(\w+)")  # as messages name it
GAP = 0.55, 0.58  # the share of the vertices below the two planes between which a part is torn


def prepare(path: Path, *remedies: str) -> es.TriangleMesh:
    """Read a file as `eigenshape match` does, with these repairs after the usual ones."""
    return es.repair(es.io.read_surface(path).mesh, ["auto", *remedies]).mesh


def landmarks(path: Path) -> dict[str, list[float]]:
    """Return the places of the landmarks of a skull by name."""
    points = json.loads(path.read_text())["markups"][0]["controlPoints"]
    return {point["label"]: point["position"] for point in points}


def skulls(names: list[str]) -> dict[str, dict[str, object]]:
    """Match each two skulls, and measure the error at landmarks in mm."""
    folder = DATA / "mice"
    meshes = {name: prepare(folder / "full" / f"{name}.ply") for name in names}
    marks = {name: landmarks(folder / f"{name}.mrk.json") for name in names}
    rows: dict[str, dict[str, object]] = {}
    for one, two in track(list(combinations(names, 2)), "skulls"):
        start = time.process_time()
        match = es.match_shapes(meshes[one], meshes[two])
        seconds = time.process_time() - start
        both = [name for name in marks[one] if name in marks[two]]
        starts, ends = (np.array([marks[name][key] for key in both]) for name in (one, two))
        on_part = es.geometry.closest_points(meshes[one], starts)
        images = match.pull(meshes[two].vertices)[meshes[one].faces[on_part.simplices]]
        gaps = np.linalg.norm(np.einsum("pc,pcd->pd", on_part.weights, images) - ends, axis=1)
        rows[f"{one} on {two}"] = {
            "vertices": [meshes[one].n_vertices, meshes[two].n_vertices],
            "landmarks": len(both),
            "mean": float(gaps.mean()),
            "median": float(np.median(gaps)),
            "worst": float(gaps.max()),
            "confidence": float(match.confidence.mean()),
            "seconds": seconds,
            "report": list(match.report),
        }
    return rows


def awkward(paths: list[Path]) -> list[dict[str, object]]:
    """Match each file to itself, turned, by the remedy of a refusal if it names one."""
    rows: list[dict[str, object]] = []
    for path in track(paths, "awkward files"):
        row: dict[str, object] = {"file": str(path.relative_to(DATA / "nasty"))}
        try:
            rows.append(row | match_to_itself(prepare(path)))
        except es.EigenshapeError as err:
            row |= {"refused": str(err).replace(str(path), path.name)}
            if remedy := REMEDY.search(str(err)):
                row |= {"remedy": remedy[1]} | match_to_itself(prepare(path, remedy[1]))
            rows.append(row)
    return rows


def match_to_itself(mesh: es.TriangleMesh) -> dict[str, object]:
    """Match a mesh to itself, turned: the error in hundredths of √area, and how sure it is."""
    match = es.match_shapes(es.TriangleMesh(mesh.vertices @ TURN.T, mesh.faces), mesh)
    gaps = np.linalg.norm(match.pull(mesh.vertices) - mesh.vertices, axis=1)
    return {
        "vertices": mesh.n_vertices,
        "mean error": float(100 * gaps.mean() / np.sqrt(es.geometry.surface_area(mesh))),
        "mean confidence": float(match.confidence.mean()),
        "equally good": match.n_equally_good,
        "report": list(match.report),
    }


def summary(rows: list[dict[str, object]]) -> dict[str, dict[str, object]]:
    """Count what became of files: matched, by the remedy that is named if not as they are, or refused."""
    of_refusal = {
        "no surface of 100 points or more": "A cloud must|must have points|it is empty",
        "no triangles": "must hold triangles|holds no triangles|segments",
        "against the format": "must have three|must hold the|must declare",
    }
    names = ("matched", "too few points", "by the remedy", *of_refusal, "refused otherwise")
    groups: dict[str, list[dict[str, object]]] = {name: [] for name in names}
    for row in rows:
        if "mean error" in row:
            as_it_is = "matched" if row["mean confidence"] else "too few points"
            name = "by the remedy" if "remedy" in row else as_it_is
        else:
            text = str(row["refused"])
            fitting = [name for name, words in of_refusal.items() if re.search(words, text)]
            name = (*fitting, "refused otherwise")[0]
        groups[name].append(row)
    return {name: {"files": len(found)} for name, found in groups.items()}


def torn_part(mesh: es.TriangleMesh, rng: np.random.Generator) -> es.TriangleMesh:
    """Return what planes and holes leave, torn into pieces, with all that a raw file may have.

    Faces are removed without a look at what is left, so that there are vertices with two fans and
    loose pieces, vertices without a face, and one face that stands twice.
    """
    direction = rng.normal(size=3)
    heights = mesh.vertices @ direction
    cut, low, high = np.quantile(heights, (LEFT_OUT, *GAP))
    unit = np.sqrt(es.geometry.surface_area(mesh))
    centers = mesh.vertices[mesh.faces].mean(axis=1)
    keep = centers @ direction > cut
    keep &= (centers @ direction < low) | (centers @ direction > high)
    for center in centers[rng.integers(len(centers), size=N_HOLES)]:
        keep &= np.linalg.norm(centers - center, axis=1) > HOLE * unit
    faces = mesh.faces[keep]
    return es.TriangleMesh(mesh.vertices @ TURN.T, np.vstack([faces, faces[:1]]))


def torn(names: list[str], folder: Path) -> dict[str, dict[str, object]]:
    """Match torn parts of animals, read from files, to the next pose with the same vertices."""
    rows: dict[str, dict[str, object]] = {}
    for number, (one, two) in enumerate(pairwise(names)):
        if one.split("-")[0] != two.split("-")[0]:
            continue
        kind = one.split("-")[0].removeprefix("sumner_")
        folder_of_kind = DATA / "retrieval" / kind
        source, whole = (es.read_mesh(folder_of_kind / f"{name}.ply") for name in (one, two))
        raw = torn_part(source, np.random.default_rng(number))
        path = folder / f"{one}.ply"
        es.write_mesh(raw, path)
        done = es.repair(es.io.read_surface(path).mesh, ["auto"])
        match = es.match_shapes(done.mesh, whole)
        truth = whole.vertices[done.source_vertices]
        gaps = np.linalg.norm(match.pull(whole.vertices) - truth, axis=1)
        errors = 100 * gaps / np.sqrt(es.geometry.surface_area(whole))
        n_pieces, piece = es.geometry.vertex_components(done.mesh)
        areas = np.bincount(piece, weights=es.geometry.dual_volumes(done.mesh))
        large = piece == areas.argmax()
        rows[f"{one} on {two}"] = {
            "pieces": n_pieces,
            "error of the largest piece": float(errors[large].mean()),
            "confidence of the largest piece": float(match.confidence[large].mean()),
            "error of the others": float(errors[~large].mean()),
            "confidence of the others": float(match.confidence[~large].mean()),
            "repairs": list(done.report),
            "report": list(match.report),
        }
    return rows


def main() -> None:
    """Match all, print and save the tables."""
    parser = options_of(
        __doc__, quick="three awkward files and one torn part", out="ch7-awkward.json"
    )
    parser.add_argument("--skulls", action="store_true", help="the skulls instead of the files")
    arguments = parser.parse_args()
    require_data()
    files = sorted(path for path in (DATA / "nasty").glob("*/*") if path.is_file())
    names = [*TUNING["cat"][:5], *TUNING["horse"][:5]]
    with tempfile.TemporaryDirectory() as folder:
        if arguments.quick:
            few = [path for path in files if path.stem in ("fox", "moebius", "cylinder")]
            give_out(
                {"awkward": awkward(few), "torn": torn(names[:2], Path(folder))}, arguments.out
            )
            return
        results: dict[str, object] = {}
        if arguments.skulls:
            full = (DATA / "mice" / "full").glob("*.ply")
            results["skulls"] = skulls(sorted(path.stem for path in full))
        else:
            results["awkward"] = rows = awkward(files)
            results["awkward files"] = summary(rows)
            results["torn"] = torn(names, Path(folder))
    give_out(rounded(results), arguments.out)


if __name__ == "__main__":
    main()
