"""What processes of the tests do with an index until they are killed, telling the number of each step that is done."""

import itertools

from describers import descriptor

from eigenshape._errors import StoreError
from eigenshape.retrieval.store.index import ShapeIndex


def add_shapes(folder, done):
    index = ShapeIndex.open(folder)
    start = len(index)
    done.send(start - 1)
    for number in itertools.count(start):
        index.add_descriptors(f"shape-{number:05}", [descriptor(number)], digest=str(number))
        done.send(number)


def replace_a_shape(folder, done):
    index = ShapeIndex.open(folder)
    start = int(index.records()[0].digest)
    done.send(start)
    for number in itertools.count(start + 1):
        index.add_descriptors("one", [descriptor(number)], digest=str(number), replace=True)
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
        ShapeIndex.open_or_create(folder).add_descriptors(name, [descriptor(1)])
    except StoreError as err:
        done.send(str(err))
    else:
        done.send("added")
