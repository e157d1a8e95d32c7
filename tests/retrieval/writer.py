"""A process that adds shapes to an index for as long as it lives; the tests kill it."""

import sys

from describers import descriptor

from eigenshape.retrieval.index import ShapeIndex

if __name__ == "__main__":
    index = ShapeIndex.open(sys.argv[1])
    start = len(index)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    for number in range(start, start + 10_000):
        index.add(f"shape-{number:05}", [descriptor(number)], digest=str(number))
