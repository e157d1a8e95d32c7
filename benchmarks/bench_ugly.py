"""How many ugly files each verb answers, and whether the remedy that a refusal names works.

    python benchmarks/bench_ugly.py                           all files: an hour
    python benchmarks/bench_ugly.py --classes 2               variants of two shapes, ten minutes
    python benchmarks/bench_ugly.py --quick                   the variants of one shape, a minute or two
    python benchmarks/bench_ugly.py --more FOLDER             files of your own, too
    python benchmarks/bench_ugly.py --only soup               one kind of damage
    python benchmarks/bench_ugly.py --only nasty --limit 600
                                                              the files of other projects, on a busy machine

The files are those of `nasty` among the real shapes, and twelve kinds of damage to the smallest shape of each of 17
classes. Each verb runs once with `--repair auto`, as a user would type it, in a process that is given up after 60
seconds. `match` maps a file to itself. A file counts for all verbs if it holds a face with an area; the others
(points, curves, empty files) are listed apart. Where a verb refuses, the repairs that its message names are applied,
and the verb runs again.
"""

import csv
import json
import multiprocessing
import os
import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import TimeoutError as TookTooLong
from pathlib import Path
from typing import Any

import numpy as np
from pebble import ProcessExpired, ProcessPool
from report import Report, Row, dump, options_of
from typer.testing import CliRunner
from ugly_shapes import broken_variants

import eigenshape as es
from eigenshape.cli import app
from eigenshape.geometry.repairs.repair import REPAIRS

ROOT = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("EIGENSHAPE_DATA", ROOT.parent / "shared" / "data"))
VERBS = ("spectrum", "features", "index", "query", "match")
COLUMNS = ("damage", "files", *VERBS, "slowest CPU s")
N_CLASSES = 17
TIME_LIMIT = 60.0
NO_REMEDY = re.compile(r"no repair|cannot be repaired", re.IGNORECASE)


def sound_meshes(n_classes: int) -> dict[str, es.TriangleMesh]:
    """Read the smallest shape of each of the first classes."""
    with (DATA / "retrieval" / "manifest.csv").open() as file:
        rows = sorted(csv.DictReader(file), key=lambda row: (row["cls"], int(row["vertices"])))
    smallest = {row["cls"]: row["path"] for row in reversed(rows)}
    chosen = sorted(smallest.items())[:n_classes]
    return {name: es.read_mesh(DATA / path) for name, path in chosen}


def write_off(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Write arrays that the library's own types might refuse."""
    lines = [f"OFF\n{len(vertices)} {len(faces)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    path.write_text("\n".join(lines) + "\n")


def ugly_files(folder: Path, options: Any) -> Iterator[tuple[str, Path]]:
    """Write the broken variants, and list them and the files found elsewhere with the name of their damage."""
    for name, (vertices, faces) in broken_variants(
        sound_meshes(1 if options.quick else options.classes)
    ):
        shape, damage = name.rsplit("-", 1)
        path = folder / damage / f"{shape}.off"
        path.parent.mkdir(exist_ok=True)
        write_off(path, vertices, faces)
        yield damage, path
    if not options.quick:
        found = (path for path in sorted((DATA / "nasty").rglob("*")) if path.is_file())
        yield from ((f"nasty/{path.parent.name}", path) for path in found)
    for more in options.more:
        yield from ((more.name, path) for path in sorted(more.rglob("*")) if path.is_file())


def holds_a_surface(path: Path) -> bool:
    """Whether a file can be read and has a face with an area."""
    try:
        return es.repair(es.read_mesh(path), ["drop_degenerate"]).mesh.n_faces > 0
    except (es.EigenshapeError, OSError):
        return False


def arguments_of(verb: str, path: Path, repairs: str, index: Path) -> list[str]:
    """Write the command line of a verb."""
    options = ["--repair", repairs, "--json"]
    if verb == "spectrum":
        return ["spectrum", str(path), *options]  # 20 eigenpairs, or all if there are fewer
    if verb == "features":
        return ["features", str(path), *options]
    if verb == "match":
        return ["match", str(path), str(path), *options]
    if verb == "index":
        return ["index", "add", tempfile.mkdtemp(dir=index.parent), str(path), *options]
    return ["query", str(index), str(path), *options]


def cpu_seconds() -> float:
    """Return the CPU time of this process and of the workers that it waited for."""
    return sum(os.times()[:4])


def run_verb(verb: str, path: Path, repairs: str, index: Path) -> Row:
    """Run a verb in this process: its exit code, its last words, what it printed, and its CPU seconds."""
    began = cpu_seconds()
    done = CliRunner().invoke(app, arguments_of(verb, path, repairs, index))
    words = done.stderr.strip()
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        words = f"{type(done.exception).__name__} escaped: {done.exception}"
    row = {"verb": verb, "path": str(path), "code": done.exit_code, "words": words[-600:]}
    return row | {"printed": done.stdout, "seconds": cpu_seconds() - began}


def named_repairs(words: str) -> list[str]:
    """List the repairs that a message names, in the order of the message."""
    known = "|".join([*REPAIRS, "auto"])
    return list(dict.fromkeys(re.findall(rf"\b({known})\b", words)))


def try_file(verb: str, path: Path, index: Path) -> Row:
    """Run a verb with --repair auto, and once more with the remedy that it names."""
    return with_remedy(run_verb(verb, path, "auto", index), path, index)


def with_remedy(row: Row, path: Path, index: Path) -> Row:
    """Where a verb refused, look for the remedy in its words, and apply it."""
    del row["printed"]
    if row["code"]:
        error = row["words"].rsplit("error:", 1)[-1]
        remedy = [name for name in named_repairs(error) if name != "auto"]
        row["remedy"] = remedy or ("none, it says" if NO_REMEDY.search(error) else "not named")
        if remedy:
            again = run_verb(row["verb"], path, ",".join(["auto", *remedy]), index)
            row["remedy works"] = again["code"] == 0
    return row


def index_all(paths: list[Path], index: Path) -> dict[Path, Row]:
    """Index files of one damage in one call, as a user would a folder, and then those alone that it refused."""
    folder = Path(tempfile.mkdtemp(dir=index.parent))
    links = {f"{number}-{path.stem}": path for number, path in enumerate(paths)}
    for name, path in links.items():
        (folder / f"{name}{path.suffix}").symlink_to(path)
    done = run_verb("index", folder, "auto", index)
    share = done["seconds"] / len(paths)
    row: Row = {"verb": "index", "code": 0, "seconds": share, "printed": ""}
    answers = {path: row | {"path": str(path)} for path in paths}
    failed = (
        json.loads(done["printed"])["failed"]
        if done["printed"]
        else [[name, done["words"]] for name in links]
    )
    for name, words in failed:
        answers[links[name]] |= {"code": 3, "words": words}
    return {path: with_remedy(dict(answer), path, index) for path, answer in answers.items()}


def cells(row: Row) -> list[str]:
    """Show the answers to one kind of damage."""
    shown = []
    for verb in VERBS:
        by_remedy = row[f"{verb} by its remedy"]
        more = f", {by_remedy} more by the remedy" if by_remedy else ""
        shown.append(f"{row[verb]}{more}")
    return [row["damage"], str(row["files"]), *shown, f"{row['slowest']:.1f}"]


def main() -> None:
    """Try all files, print the table, and name what was refused."""
    parser = options_of(__doc__)
    parser.add_argument("--more", type=Path, nargs="*", default=[], help="folders of further files")
    parser.add_argument(
        "--classes", type=int, default=N_CLASSES, help="classes whose smallest shape is broken"
    )
    parser.add_argument("--only", help="only damages whose name holds this")
    parser.add_argument(
        "--limit", type=float, default=TIME_LIMIT, help="seconds after which a verb is given up"
    )
    parser.set_defaults(repeats=1)  # each verb runs once
    options = parser.parse_args()
    report = Report(["numpy", "scipy"], options, COLUMNS, cells, threads="all threads")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        index = make_index(folder)
        files = [pair for pair in ugly_files(folder, options) if (options.only or "") in pair[0]]
        answers = try_all(files, index, options.limit)
        refused = summarize(files, answers, report)
    for row in refused:
        print(
            f"{row['verb']:9} {row['path']}: {row.get('remedy')} {row.get('remedy works', '')}\n    {row['words']}"
        )
    # Without the folders of this machine
    report.figures["refused"] = [
        {
            key: value.replace(f"{DATA}/", "").replace(f"{folder}/", "")
            if isinstance(value, str)
            else value
            for key, value in row.items()
        }
        for row in refused
    ]
    if options.json:
        dump(options.json, report.figures)


def make_index(folder: Path) -> Path:
    """Index the sound shapes that queries are compared with."""
    index, source = folder / "sound", folder / "shapes"
    source.mkdir()
    for name, mesh in sound_meshes(N_CLASSES).items():
        es.write_mesh(mesh, source / f"{name}.ply")
    done = CliRunner().invoke(app, ["index", "add", str(index), str(source), "--views", "0"])
    if done.exit_code:
        raise SystemExit(done.output)
    return index


def try_all(
    files: list[tuple[str, Path]], index: Path, limit: float
) -> dict[tuple[str, Path], Row]:
    """Try each verb on each file in two processes; what takes too long or dies is an answer as well."""
    answers: dict[tuple[str, Path], Row] = {}
    for damage in dict.fromkeys(damage for damage, _ in files):
        paths = [path for kind, path in files if kind == damage]
        answers |= {("index", path): row for path, row in index_all(paths, index).items()}
        print(".", end="", flush=True)
    with ProcessPool(max_workers=2, context=multiprocessing.get_context("spawn")) as pool:
        tasks = {
            (verb, path): pool.schedule(try_file, args=[verb, path, index], timeout=2 * limit)
            for _, path in files
            for verb in VERBS
            if verb != "index"
        }
        for (verb, path), future in tasks.items():
            row = {"verb": verb, "path": str(path), "code": -1, "seconds": limit}
            try:
                answers[verb, path] = future.result()
            except (TookTooLong, ProcessExpired) as error:
                answers[verb, path] = row | {"words": type(error).__name__}
            print(".", end="", flush=True)
    print()
    return answers


def summarize(
    files: list[tuple[str, Path]], answers: dict[tuple[str, Path], Row], report: Report
) -> list[Row]:
    """Count answers by damage, of files that hold a surface, and return all refusals."""
    surfaces = {path: holds_a_surface(path) for _, path in files}
    totals: Counter[str] = Counter()
    for damage in dict.fromkeys(damage for damage, _ in files):
        paths = [path for kind, path in files if kind == damage and surfaces[path]]
        row: Row = {"damage": damage, "files": len(paths)}
        for verb in VERBS:
            row[verb] = sum(answers[verb, path]["code"] == 0 for path in paths)
            row[f"{verb} by its remedy"] = sum(
                answers[verb, path].get("remedy works", False) for path in paths
            )
        row["slowest"] = max(
            (answers[verb, path]["seconds"] for path in paths for verb in VERBS), default=0
        )
        totals.update({name: n for name, n in row.items() if name not in ("damage", "slowest")})
        totals["slowest"] = max(totals["slowest"], row["slowest"])
        report.add(row)
    report.add({"damage": "all", **totals})
    refused = [
        row | {"surface": surfaces[Path(row["path"])]} for row in answers.values() if row["code"]
    ]
    print(f"{sum(not held for held in surfaces.values())} files hold no face with an area.")
    return refused


if __name__ == "__main__":
    main()
