"""The command line of eigenshape, where some files kill the process that reads them, hang, or eat memory.

    python benchmarks/misbehaving.py index add INDEX FOLDER

A file misbehaves if a comment in its PLY header says so: `comment die`, `comment hang` or `comment eat`.
"""

import importlib
import os
import time
from pathlib import Path

import eigenshape as es

BLOCK = 1 << 26  # bytes that are eaten at a time
SECONDS = 3600.0


def read_or_misbehave(path: Path) -> es.geometry.RepairedMesh:
    """Do what the file says, or read it."""
    with path.open("rb") as file:
        head = file.read(200)
    if b"comment die" in head:
        os._exit(9)
    if b"comment hang" in head:
        time.sleep(SECONDS)
    eaten = []
    while b"comment eat" in head:
        eaten.append(b"x" * BLOCK)
    return es.io.read_surface(path)


if __name__ == "__main__":
    importlib.import_module("eigenshape.cli.steps.indexing").read_surface = read_or_misbehave  # type: ignore[attr-defined]
    importlib.import_module("eigenshape.cli").app()
