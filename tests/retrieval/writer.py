"""What processes of the tests do with an index until they are killed."""

import itertools

from describers import descriptor

from eigenshape.retrieval.index import ShapeIndex


def add_shapes(folder, ready):
    index = ShapeIndex.open(folder)
    start = len(index)
    ready.send("ready")
    for number in itertools.count(start):
        index.add(f"shape-{number:05}", [descriptor(number)], digest=str(number))


def replace_a_shape(folder, ready):
    index = ShapeIndex.open(folder)
    start = int(index.records()[0].digest)
    ready.send("ready")
    for number in itertools.count(start + 1):
        index.add("one", [descriptor(number)], digest=str(number), replace=True)


def create_many(folder, ready):
    ready.send("ready")
    for number in itertools.count(len(list(folder.iterdir()))):
        ShapeIndex.create(folder / str(number))
