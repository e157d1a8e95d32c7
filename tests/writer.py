"""What processes of the tests do with an index until they are killed, telling the number of each step that is done."""

import itertools
import multiprocessing
import os
import signal
import sys
from pathlib import Path

from describers import descriptor, keep

from eigenshape._errors import StoreError
from eigenshape.retrieval.index import ShapeIndex
from eigenshape.retrieval.store import database
from eigenshape.retrieval.store.writing import DescribedShape


def begin(work, *args):
    """Start a process that works on an index; return it and our end of a pipe to it.

    A server that has everything imported forks it, so that twenty start in a second. A fork of a
    test's own process, which has threads, could wait forever for a lock that one of them holds.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["eigenshape.retrieval.index"])
    ours, theirs = context.Pipe()
    process = context.Process(target=work, args=(*args, theirs))
    process.start()
    theirs.close()
    return process, ours


def add_shapes(folder, done):
    index = ShapeIndex.open(folder)
    start = len(index)
    done.send(start - 1)
    for number in itertools.count(start):
        keep(index, f"shape-{number:05}", [descriptor(number)], digest=str(number))
        done.send(number)


def replace_a_shape(folder, done):
    index = ShapeIndex.open(folder)
    start = int(index.records()[0].digest)
    done.send(start)
    for number in itertools.count(start + 1):
        keep(index, "one", [descriptor(number)], digest=str(number), replace=True)
        done.send(number)


def create_many(folder, done):
    done.send(-1)  # of the folders that are there, the last may be another's half
    for number in itertools.count(len(list(folder.iterdir()))):
        ShapeIndex.create(folder / str(number))
        done.send(number)


def open_and_add(folder, done):
    done.send("ready")
    name = done.recv()
    try:
        keep(ShapeIndex.open_or_create(folder), name, [descriptor(1)])
    except StoreError as err:
        done.send(str(err))
    else:
        done.send("added")


STORE = str(Path(database.__file__).parent)
N_STEPS = 12  # that a process takes unless it dies before
N_KINDS = 4  # of steps: add two, remove one, merge, compact


def names_after(step):
    """Return what an index holds after a step of `change_in_all_ways`, -1 for before the first: name and seed."""
    names = {}
    for number in range(step + 1):
        if number % N_KINDS == 0:
            names |= {f"s{number}a": number, f"s{number}b": number + 1}
        elif number % N_KINDS == 1:
            del names[f"s{number - 1}a"]
        elif number % N_KINDS == 2:
            names["merged"] = number
    return names


def change_in_all_ways(folder, start, line, done):
    """Take steps from `start` on; die at a line of the store if one is given, counted from now on."""
    index = ShapeIndex.open(folder)
    parts = {}
    for number in range(start, start + N_STEPS):
        if number % N_KINDS == 2:
            parts[number] = ShapeIndex.create(None)
            keep(parts[number], "merged", [descriptor(number)], digest=str(number))
    done.send(start - 1)
    if line is not None:
        die_at(line)
    for number in range(start, start + N_STEPS):
        if number % N_KINDS == 0:
            index.add_many(
                DescribedShape(f"s{number}{letter}", [descriptor(number + place)], thumbnail=b"p")
                for place, letter in enumerate("ab")
            )
        elif number % N_KINDS == 1:
            index.remove(f"s{number - 1}a")
        elif number % N_KINDS == 2:
            index.merge([parts[number]], replace=True)
        else:
            index.compact()
        done.send(number)


def die_at(line):
    """Kill this process at the so manieth line of the store that it runs."""
    left = line

    def trace(frame, event, _):
        nonlocal left
        if not frame.f_code.co_filename.startswith(STORE):
            return None
        if event == "line":
            left -= 1
            if left <= 0:
                os.kill(os.getpid(), signal.SIGKILL)
        return trace

    sys.settrace(trace)
