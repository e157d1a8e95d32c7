"""Kill writers at random moments, turn single bits, and see what a store says then.

    python benchmarks/kills.py --store collection --kills 300 --flips 334

After each kill (SIGKILL) the store must open, and every number must be that of the last finished state
or of an undisturbed run. What was stopped is done again until it ends, and must leave what an undisturbed
run leaves, and no other file. After each turned bit of a file every answer is the same, or one error of
eigenshape names the damage and doing the last change again mends it, where a store says so.

Collections are built by the verb `eigenshape collection`, of small shapes that are fitted roughly;
`--command` starts the command as it is, with its worker processes, which takes some seconds a kill.
"""

import argparse
import contextlib
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

import numpy as np

import eigenshape as es
from eigenshape.cli import app, steps
from eigenshape.collections import alignment, building, surface_fit

BUMPS = np.array([[1.0, 0.2, 0.1], [-0.3, 0.9, 0.3], [0.1, -0.5, 0.8]])
WIDTHS = np.array([0.3, 0.15, 0.2])
NOTHING = "nothing yet"  # what a store says before its first finished state
LOGS = ("-wal", "-shm")  # of SQLite, which go with the last process that has a file open


def make_ball(number):
    """Return a ball with three bumps of its own, of 162 vertices."""
    ball, draw = es.icosphere(2), np.random.default_rng(number)
    heights = [0.9, 0.5, 0.35] * (1 + 0.2 * draw.standard_normal(3))
    squares = np.sum((ball.vertices[:, None] - BUMPS) ** 2, axis=2)
    return es.TriangleMesh(
        ball.vertices * (1 + np.exp(-squares / WIDTHS) @ heights)[:, None], ball.faces
    )


def digest(*parts):
    """Return a short digest of texts and arrays."""
    found = hashlib.sha256()
    for part in parts:
        found.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
    return found.hexdigest()[:12]


# ---- stores: a folder, changes one after the other, and what is asked of it


class Collection:
    """A folder that the verb `eigenshape collection` builds: first, anew, with one more, with one less."""

    CHANGES = (("abc", "a"), ("abc", "b"), ("abcd", "b"), ("abc", "b"), ("bcd", "c"))
    MENDS = True  # an error says: build it again

    def __init__(self, place, *, command=False):
        self.place, self.command = place, command
        for names, _ in self.CHANGES:
            (place / names).mkdir(exist_ok=True)
            for name in names:
                es.write_mesh(make_ball(ord(name)), place / names / f"{name}.ply")
        if not command:
            make_quick()

    def arguments(self, folder, number):
        """Return the words of the command that makes a change."""
        names, template = self.CHANGES[number]
        return [
            "collection",
            str(self.place / names),
            "-o",
            str(folder),
            f"--template={template}",
            "--unmirrored",
        ]

    def change(self, folder, number):
        """Make a change in this process."""
        app(self.arguments(folder, number))

    def begin(self, folder, number):
        """Begin a change in a process of its own, and return it."""
        if not self.command:
            return forked(self.change, folder, number)
        line = [sys.executable, "-m", "eigenshape", *self.arguments(folder, number), "--workers=2"]
        return subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).pid

    def answers(self, folder):
        """Return all that a collection holds."""
        try:
            found = es.collections.open_collection(folder)
        except es.StoreError as err:
            if "A finished collection must be in the folder" in str(err):
                return NOTHING
            raise
        words = (found.names, found.template, found.sides, found.methods, found.sources)
        notes = (found.notes, found.failures, found.digests)
        return digest(
            words,
            notes,
            found.mean.vertices,
            found.mean.faces,
            found.points,
            found.gaps,
            found.confidence,
        )


class Index:
    """An index with shapes that are added, merged, removed and changed, and whose space is given back."""

    CHANGES = ("add", "merge", "remove", "replace", "compact", "add more")
    MENDS = False  # an index that is damaged is merged into a new one

    def __init__(self, place):
        recipe = es.retrieval.SCALE_FREE
        self.shapes = [
            es.retrieval.DescribedShape(
                f"ball {i}", [es.describe(make_ball(i), recipe)], label=f"{i % 3}"
            )
            for i in range(24)
        ]
        self.other = es.ShapeIndex.create(place / "other")
        self.other.add_many(self.shapes[8:16])

    def change(self, folder, number):
        """Make a change in this process."""
        index = es.ShapeIndex.open_or_create(folder)
        if number == 0:
            index.add_many(self.shapes[:8], replace=True)
        elif number == 1:
            index.merge([self.other], replace=True)
        elif number == 2:
            names = {record.name for record in index.records()}
            index.remove(*names & {"ball 3", "ball 9"})
        elif number == 3:
            index.add("ball 5", make_ball(77), recipe=es.retrieval.SCALE_FREE, replace=True)
        elif number == 4:
            index.compact()
        else:
            index.add_many(self.shapes[16:], replace=True)

    def begin(self, folder, number):
        """Begin a change in a process of its own, and return it."""
        return forked(self.change, folder, number)

    def answers(self, folder):
        """Return what an index says of each shape."""
        if not (folder / "index.sqlite").is_file():
            return NOTHING
        index = es.ShapeIndex.open(folder)
        records = [(record.name, record.label) for record in index.records()]
        if not records:
            return NOTHING
        matches = index.query(self.shapes[2].descriptors[0], n_matches=100)
        return digest(records, [(match.name, match.score) for match in matches])


STORES = {"collection": Collection, "index": Index}


def make_quick():
    """Make fits of collections rough and quick; in the command itself they are as they are."""
    levels = [level._replace(n_rounds=1, n_points=200) for level in surface_fit.LEVELS[:2]]
    surface_fit.LEVELS, building.SECOND_LEVELS = tuple(levels), tuple(levels)
    alignment.N_POINTS, alignment.N_ROUGH = 120, 40
    surface_fit.POSES_DIFFER = surface_fit.STRAINED = np.inf  # no other start is tried
    steps.worker_processes = lambda *_: contextlib.nullcontext()  # all in one process
    steps.write_collection_report = lambda *_: None  # it only reads what is kept


def forked(change, folder, number):
    """Begin a change in a copy of this process, and return its number."""
    pid = os.fork()
    if pid == 0:
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        code = 1
        try:
            change(folder, number)
            code = 0
        except SystemExit as err:
            code = err.code or 0
        finally:
            os._exit(code)
    return pid


# ---- kills


def undisturbed(store, folder):
    """Return the answers after each change, how long it took, and the files that are left."""
    states, seconds = [NOTHING], []
    for number in range(len(store.CHANGES)):
        begun = time.monotonic()
        ended(store.begin(folder, number))
        seconds.append(time.monotonic() - begun)
        states.append(store.answers(folder))
    return states, seconds, files_in(folder)


def ended(pid):
    """Wait for a process, and return whether it was killed; an error of its own ends everything."""
    _, status = os.waitpid(pid, 0)
    if os.WIFSIGNALED(status):
        return True
    if os.WEXITSTATUS(status):
        raise SystemExit(f"A change failed with exit code {os.WEXITSTATUS(status)}.")
    return False


def files_in(folder):
    """Return the names of all files, without the logs of an open database."""
    return {path.name for path in folder.rglob("*") if not path.name.endswith(LOGS)}


def try_kills(store, place, count, rng):
    """Kill changes at random moments, and do each again until it ends; return what was seen."""
    states, seconds, files = undisturbed(store, place / "undisturbed")
    folder, seen, number = place / "killed", Counter(), 0
    while seen["kills"] < count:
        pid = store.begin(folder, number)
        time.sleep(rng.uniform(0, 1.2 * seconds[number]))
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        killed = ended(pid)
        found = store.answers(folder)
        where = f"change {number}, after {seen['kills']} kills"
        if killed:
            seen["kills"] += 1
            seen["as before" if found == states[number] else "as after"] += 1
            seen["files left at a kill"] += bool(files_in(folder) - files)
            if found not in states[number : number + 2]:
                raise SystemExit(f"Neither the state before nor after: {where}.")
            continue
        if found != states[number + 1]:
            raise SystemExit(f"Another state than that of an undisturbed run: {where}.")
        if strays := files_in(folder) - files:
            raise SystemExit(f"Files are left: {strays}; {where}.")
        seen["ended"] += 1
        number = (number + 1) % len(store.CHANGES)
        if number == 0:
            shutil.rmtree(folder)
    return seen


# ---- flips


def try_flips(store, place, count, rng):
    """Turn one bit at a time of the files of a store; return what was seen.

    Two of three are in bytes that are not 0, since pages are empty for the most part.
    """
    sound, folder, seen = place / "sound", place / "turned", Counter()
    last = len(store.CHANGES) - 1
    for number in range(last + 1):
        ended(store.begin(sound, number))
    expected = store.answers(sound)
    files = [path for path in sorted(sound.rglob("*")) if path.is_file()]
    sizes = np.array([path.stat().st_size for path in files])
    for number in range(count):
        path = files[rng.choice(len(files), p=sizes / sizes.sum())]
        data = np.fromfile(path, np.uint8)
        places = np.flatnonzero(data) if number % 3 else np.arange(len(data))
        byte, bit = rng.choice(places), rng.integers(8)
        data[byte] ^= 1 << bit
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(sound, folder)
        data.tofile(folder / path.relative_to(sound))
        where = f"bit {bit} of byte {byte} of {path.name}"
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", es.retrieval.StoreWarning)
                found = store.answers(folder)
        except (es.EigenshapeError, es.retrieval.StoreWarning) as err:
            seen["named"] += 1
            if store.MENDS:
                seen[mended(store, folder, last, expected, f"{where}: {err}")] += 1
        except Exception as err:  # noqa: BLE001 - what is looked for
            seen["bare"] += 1
            sys.stderr.write(f"{where}: {err!r}\n")
        else:
            seen["equal" if found == expected else "silent"] += 1
            if found != expected:
                sys.stderr.write(f"{where}: silent\n")
    return seen


def mended(store, folder, number, expected, where):
    """Do the last change again, and say what came of it."""
    os.waitpid(store.begin(folder, number), 0)
    try:
        if store.answers(folder) == expected:
            return "mended"
    except es.EigenshapeError as err:
        where += f"; again: {err}"
    sys.stderr.write(f"{where}: not mended in place\n")
    return "not mended in place"


def main():
    """Do as many trials as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--store", choices=STORES, default="collection")
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--flips", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--command", action="store_true", help="kill the command and its workers")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        more = {"command": True} if options.command else {}
        store = STORES[options.store](place, **more)
        for trial, count in ((try_kills, options.kills), (try_flips, options.flips)):
            if count:
                begun = time.monotonic()
                seen = trial(store, place, count, rng)
                took = time.monotonic() - begun
                sys.stdout.write(f"{options.store}, {trial.__name__}: {dict(seen)}; {took:.0f} s\n")
                if seen["silent"] or seen["bare"]:
                    raise SystemExit("A turned bit was not named.")


if __name__ == "__main__":
    main()
