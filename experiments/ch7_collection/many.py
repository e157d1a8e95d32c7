"""A folder of large specimens from end to end, killed and begun again: time, memory, and what is lost.

    python experiments/ch7_collection/many.py --number 30     # about 13 CPU s a specimen

Specimens are hands of many individuals, each subdivided to 100,000 vertices and turned in its own way.
`eigenshape collection` is killed (SIGKILL, all of its processes) when a sixth, two sixths, ... of all
fits are kept (with five kills), and run to its end then. Fits that were kept at a kill must be there
untouched at the end.
"""

import json
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import psutil
from rich.progress import track
from scipy.spatial.transform import Rotation

import eigenshape as es

sys.path.append(str(Path(__file__).resolve().parents[1]))
from frame import rounded
from outputs import give_out, options_of, output_folder

N_KILLS = 5
MANY = 200  # specimens that the time is projected to
N_MARKS = 10
WORKERS = 2
SECONDS_BETWEEN_LOOKS = 0.25


def make_specimen(folder: Path, n_vertices: int, i: int) -> None:
    """Write the hand of an individual, and landmarks of the first one, unless it is there."""
    if (path := folder / f"hand {i:03}.ply").exists():
        return
    mesh = es.make_creature("hand", individual=i, n_vertices=n_vertices // 16)
    for _ in range(2):  # each time four times the vertices
        mesh = es.geometry.subdivide(mesh)
    turn = Rotation.random(rng=np.random.default_rng(i)).as_matrix()
    mesh = es.TriangleMesh(mesh.vertices @ turn.T, mesh.faces)
    es.write_mesh(mesh, path)
    if i == 0:
        rows = np.linspace(0, mesh.n_vertices - 1, N_MARKS).astype(int)
        names = [f"mark {row}" for row in rows]
        marks = es.morphometrics.Landmarks(names, mesh.vertices[rows])
        es.morphometrics.write_landmarks(marks, folder / "hand 000.fcsv")


def make_specimens(folder: Path, number: int, n_vertices: int) -> None:
    """Write hands of different individuals."""
    with ProcessPoolExecutor(WORKERS) as pool:
        made = pool.map(partial(make_specimen, folder, n_vertices), range(number))
        list(track(made, "specimens", total=number))


def fits_in(output: Path) -> dict[str, int]:
    """Return the fits that a folder keeps by key, with the checksums of their numbers."""
    path = output / "collection.sqlite"
    if not path.is_file():
        return {}
    with closing(sqlite3.connect(path)) as database:
        return dict(database.execute("SELECT key, checksum FROM part"))


class Run:
    """A run of the command: CPU seconds of its processes, and the most memory of all and of one."""

    def __init__(self, folder: Path, output: Path) -> None:
        command = [sys.executable, "-m", "eigenshape", "collection", str(folder)]
        command += ["-o", str(output), "--workers", str(WORKERS), "--json"]
        self.process = psutil.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        self.seconds: dict[int, float] = {}
        self.peak = self.peak_of_one = 0.0

    def processes(self) -> list[psutil.Process]:
        """Return the command and its workers, as far as they are there."""
        with suppress(psutil.Error):
            return [self.process, *self.process.children(recursive=True)]
        return []

    def look(self) -> None:
        """Measure all processes that are there."""
        sizes = []
        for each in self.processes():
            try:
                times = each.cpu_times()
                self.seconds[each.pid] = times.user + times.system
                sizes.append(each.memory_full_info().pss / 2**30)
            except psutil.Error:  # it has just ended
                continue
        self.peak = max(self.peak, sum(sizes))
        self.peak_of_one = max(self.peak_of_one, *sizes, 0.0)

    def wait(self, output: Path, n_fits: int | None) -> bool:
        """Wait for so many fits and kill it, or for its end. Return whether it was killed."""
        while self.process.poll() is None:
            self.look()
            if n_fits is not None and len(fits_in(output)) >= n_fits:
                for each in self.processes():
                    with suppress(psutil.Error):  # it has just ended
                        each.kill()
                self.process.wait()
                return True
            time.sleep(SECONDS_BETWEEN_LOOKS)
        return False


def main() -> None:
    """Make specimens, run the command with kills, and check what came out."""
    parser = options_of(__doc__, quick="three small specimens, killed once")
    parser.add_argument("--number", type=int, default=MANY, help="specimens")
    parser.add_argument("--kills", type=int, default=N_KILLS, help="how often it is killed")
    parser.add_argument("--scans", type=output_folder, help="keep specimens here, for another run")
    arguments = parser.parse_args()
    number, n_vertices, n_kills = arguments.number, 100_000, arguments.kills
    if arguments.quick:
        number, n_vertices, n_kills = 3, 8_000, 1
    with TemporaryDirectory() as place:
        folder, output = arguments.scans or Path(place, "scans"), Path(place, "out")
        folder.mkdir(exist_ok=True)
        make_specimens(folder, number, n_vertices)
        begin = time.monotonic()
        runs, kept = [], {}
        for kill in range(n_kills + 1):
            n_fits = round(2 * number * (kill + 1) / (n_kills + 1)) if kill < n_kills else None
            runs.append(run := Run(folder, output))
            killed = run.wait(output, n_fits)
            if killed:
                kept |= fits_in(output)
        wall = time.monotonic() - begin
        if runs[-1].process.returncode:
            raise SystemExit(f"The command failed: {runs[-1].process.returncode}.")
        answer = json.loads(runs[-1].process.stdout.read())
        at_end = fits_in(output)
        seconds = sum(sum(run.seconds.values()) for run in runs)
        result = {
            "specimens": number,
            "vertices": n_vertices,
            "killed": sum(run.process.returncode < 0 for run in runs),
            "fits at kills": len(kept),
            "lost": sum(at_end.get(key) != checksum for key, checksum in kept.items()),
            "in the collection": len(answer["specimens"]),
            "failed": len(answer["failures"]),
            "mirrored": sum(side == "mirrored" for side in answer["sides"].values()),
            "CPU s a specimen": seconds / number,
            "wall s a specimen": wall / number,
            "hours of two hundred": wall / number * MANY / 3600,
            "GiB of all": max(run.peak for run in runs),
            "GiB of a process": max(run.peak_of_one for run in runs),
        }
    give_out({"quick" if arguments.quick else "full": rounded(result)}, arguments.out)


if __name__ == "__main__":
    main()
