"""Kill processes that change an index, and flip bits of its files, as often as is asked.

    python tests/store_trials.py --kills 1000 --flips 1000

A killed process must leave the state before its change or after it, whole. A flipped bit must change no answer, or be
named; what is answered about shapes that are not named must be right.
"""

import argparse
import shutil
import sys
import tempfile
import time
import warnings
from collections import Counter
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import writer
from describers import descriptor, keep

import eigenshape as es
from eigenshape.retrieval import DescribedShape
from eigenshape.retrieval.kinds import describe_to_store

PATCHES = es.retrieval.PatchRecipe()
N_LINES = 2500  # of the store that the four kinds of steps run through, about
MOST_STEPS = 200  # of one index, so that a check stays quick
LONGEST = 0.15  # seconds in which a process takes all of its steps, about
LOST = "changes that were committed are lost"
SHARED = "index.sqlite-shm"  # made anew by whoever opens the database first
FILES = ("index.sqlite", "index.sqlite-wal", SHARED, "changes.txt")
RESERVE = "index.sqlite-reserve"  # whose bytes nobody reads
LONG = " " + 20 * "n"  # of names, so that the tables have some pages


# ---- kills


def killed(folder, start, line, seconds):
    """Run steps in a process that dies, at a line or after a time; return the last step that it called done."""
    process, ours = writer.begin(writer.change_in_all_ways, folder, start, line)
    step = ours.recv()
    if line is None:
        time.sleep(seconds)
        process.kill()
    with suppress(EOFError, OSError):  # the last message may be cut short
        while True:
            step = ours.recv()
    process.join()
    ours.close()
    return step


def check_state(folder, step):
    """Check that an index is as after a step or the one under way; return which."""
    index = es.ShapeIndex.open(folder)
    records = [record.name for record in index.records()]
    states = [
        number for number in (step, step + 1) if records == sorted(writer.names_after(number))
    ]
    assert states, f"after step {step} the index holds {records}"
    report = index.verify()
    assert (report.n_shapes, report.damages) == (len(records), ()), report
    with index.reader() as reader:
        for name, seed in writer.names_after(states[0]).items():
            seeds = {seed}
            if name == "merged":  # which of two steps it is of, its name does not say
                seeds |= {writer.names_after(each).get("merged", seed) for each in (step, step + 1)}
            assert 0 in {reader.query(descriptor(each))[0].score for each in seeds}
    return states[0]


def try_kills(folder, count, seed=0):
    """Kill a writer at random lines of the store and at random times; each goes on where the one before died."""
    rng = np.random.default_rng(seed)
    es.ShapeIndex.create(folder)
    step = -1
    for number in range(count):
        if step > MOST_STEPS:
            shutil.rmtree(folder)
            es.ShapeIndex.create(folder)
            step = -1
        line = int(rng.integers(1, N_LINES)) if number % 2 else None
        done = killed(folder, step + 1, line, rng.uniform(0, LONGEST))
        step = check_state(folder, done)
        # What is not changed by a step cannot tell whether it was done.
        if step % writer.N_KINDS == 2 and done == step:
            step = done
    return count


# ---- flips


def make_sound(folder):
    """Make an index of two recipes with changes in its log, and return a copy of its files."""
    index = es.ShapeIndex.create(folder / "index")
    hand = es.make_creature("hand", 1, n_vertices=500)
    picture = es.retrieval.draw_thumbnail(hand)
    index.add_many(
        DescribedShape(
            f"shape {seed}{LONG}",
            [descriptor(seed)],
            label=f"class {seed % 3}",
            source=f"/meshes/{seed}.ply",
            digest=64 * "d",
            attributes={"seed": seed},
            thumbnail=picture,
        )
        for seed in range(40)
    )
    keep(index, "hand", describe_to_store(hand, PATCHES, 0), label="hand")
    with index.reader():  # changes stay in the log as long as somebody reads
        keep(index, "late", [descriptor(99)])
        index.remove(f"shape 7{LONG}")
        return Path(shutil.copytree(index.folder, folder / "with log"))


def answers(folder):
    """Return by name what an index says of each shape: its record, match, codes and picture."""
    index = es.ShapeIndex.open(folder)
    found = {record.name: [repr(vars(record))] for record in index.records()}
    for match in index.query(descriptor(3), n_matches=100):
        facts = vars(match) | {"correspondences": match.correspondences.tolist()}
        text = repr(facts | {"vertices": match.vertices.tolist()})
        found.setdefault(match.name, []).append(text)
    third = f"shape 3{LONG}"
    with named_damage():
        (codes,) = index.descriptors("hand", PATCHES)
        found["hand"].append(codes.codes.tobytes() + repr(codes.points[0].vertices).encode())
    with named_damage():
        found[third].append(index.thumbnail(third))
    with named_damage():
        found["hand"].append([match.name for match in index.query(codes, without="late")])
    with named_damage():
        found[third].append(len(index.records(where={"label": "class 0", "seed": (0, 20)})))
    return found


@contextmanager
def named_damage():
    """Take an error about one shape as a warning: what is asked of the others is answered."""
    try:
        yield
    except (es.StoreError, es.InvalidParameterError, KeyError, NameError) as err:
        warnings.warn(str(err), es.retrieval.StoreWarning, stacklevel=1)


def outcome(folder):
    """Return the answers, or None; and what was said about damage."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            found = answers(folder)
        except es.StoreError as err:
            return None, str(err)
    assert all(issubclass(each.category, es.retrieval.StoreWarning) for each in caught)
    return found, "; ".join(str(each.message) for each in caught)


def share_served(sound, expected, folder, name, data, where):
    """Ask an index with one damaged file; return the share that is served, or None if nothing is wrong."""
    shutil.copytree(sound, folder)
    (folder / name).write_bytes(data)
    found, said = outcome(folder)
    all_damage = ""
    if found is not None and found != expected:
        with suppress(es.StoreError):
            all_damage = "\n".join(map(str, es.ShapeIndex(folder).verify().damages))
    shutil.rmtree(folder)
    if found == expected and not said:
        return None
    assert said, f"{where} of {name} changes an answer, and nothing is named"
    if found is None:
        return 0.0
    if LOST in said:  # then the state before those changes is served
        return 1.0
    served = 0
    for shape, facts in found.items():
        for fact in facts:
            right = fact in expected.get(shape, ()) or f"shape {shape!r}" in all_damage
            assert right or isinstance(fact, int | list), f"{where} of {name} changes {shape}"
        served += len(facts) == len(expected[shape])
    return served / len(expected)


def flip(data, bit):
    """Return bytes with one bit turned."""
    damaged = bytearray(data)
    damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


def try_flips(sound, expected, place, name, count, seed=0):
    """Flip bits of a file one at a time; return what share is served for each that is noticed.

    Two of three are in bytes that are not 0: pages are empty for the most part.
    """
    data = (sound / name).read_bytes()
    used = np.flatnonzero(np.frombuffer(data, np.uint8))
    rng = np.random.default_rng([seed, len(name)])
    shares = []
    for number in range(count):
        byte = rng.choice(used) if number % 3 else rng.integers(len(data))
        bit = 8 * int(byte) + int(rng.integers(8))
        args = (sound, expected, place / "spoilt", name, flip(data, bit), f"bit {bit}")
        shares.append(share_served(*args))
    return [share for share in shares if share is not None]


def main():
    """Do as many trials as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument(
        "--flips", type=int, default=0, help="of the database; a tenth of each other file"
    )
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        start = time.monotonic()
        n_kills = try_kills(folder / "killed", options.kills, options.seed)
        sys.stdout.write(
            f"{n_kills} kills: no change lost, none by half; {time.monotonic() - start:.0f} s\n"
        )
        start, counts = time.monotonic(), Counter()
        if options.flips:
            sound = make_sound(folder)
            expected, said = outcome(shutil.copytree(sound, folder / "expected"))
            assert not said, said
            for file in FILES:
                n_flips = options.flips if file == "index.sqlite" else options.flips // 10
                shares = try_flips(sound, expected, folder, file, n_flips, options.seed)
                row = {"flips": n_flips, "named": len(shares), "closed": shares.count(0.0)}
                counts += Counter(row)
                sys.stdout.write(f"{file}: {row}\n")
        seconds = time.monotonic() - start
        sys.stdout.write(f"{dict(counts)}; no wrong answer; {seconds:.0f} s\n")


if __name__ == "__main__":
    main()
