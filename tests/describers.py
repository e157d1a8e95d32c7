"""What worker processes of the tests read; importable by name."""

import os
import sqlite3
import time
from contextlib import closing

import numpy as np
from filelock import FileLock

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.heat.recipe import HeatRecipe
from eigenshape.retrieval.heat.score import HeatDescriptor
from eigenshape.retrieval.store.writing import DescribedShape
from eigenshape.shapes.surfaces import icosphere

RECIPE = HeatRecipe(name="test", scales=(1.0, 2.0, 4.0), n_features=2, n_shifts=0)


class PicklesBadlyError(Exception):
    def __init__(self, first, second):
        super().__init__(f"{first} and {second}")


def descriptor(seed, recipe=RECIPE, m=2):
    rng = np.random.default_rng(seed)
    return HeatDescriptor(rng.random((m, len(recipe.scales))), np.arange(m), recipe)


def keep(index, name, descriptors, *, replace=False, **facts):
    """Add a shape that is described already."""
    index.add_many([DescribedShape(name, descriptors, **facts)], replace=replace)


def spoil(folder, query):
    """Change the database of an index behind the back of its checksums."""
    with closing(sqlite3.connect(folder / "index.sqlite")) as database, database:
        database.execute(query)


SPOIL_ROWS = "UPDATE descriptor SET rows = zeroblob(length(rows)) WHERE id = 1"


def mesh_of(number):
    """Return a small closed mesh of its own form for each number."""
    radii = 1 + 0.5 * np.random.default_rng(number).random(42)
    ball = icosphere(1)
    return TriangleMesh(radii[:, None] * ball.vertices, ball.faces)


def read_by_content(path):
    """Do what the file says: be a mesh, raise, die, hang, return nonsense."""
    word = path.read_text()
    if word in WORDS:
        return WORDS[word](path)
    return mesh_of(int(word))


def read_and_count(path):
    """Return the mesh of a number, and leave a byte beside the file for each time it is read."""
    with path.with_suffix(".count").open("ab") as file:
        file.write(b"1")
    return mesh_of(int(path.read_text()))


def refuse(path):
    raise InvalidShapeError("A face must have area; face 3 has none.")


def pickle_badly(path):
    raise PicklesBadlyError(path.name, "more")


def hang(path):
    """Hang with a lock in hand, so that a test learns of the end."""
    FileLock(path.with_suffix(".lock")).acquire()
    path.with_suffix(".busy").touch()
    time.sleep(600)


def change(path):
    path.write_text("9")
    return mesh_of(1)


def vanish(path):
    path.unlink()
    return mesh_of(1)


WORDS = {
    "raise": refuse,
    "pickle badly": pickle_badly,
    "hang": hang,
    "change": change,
    "vanish": vanish,
    "die": lambda path: os._exit(77),
    "nothing": lambda path: None,
    "loose": lambda path: TriangleMesh([*mesh_of(1).vertices, [9, 9, 9]], mesh_of(1).faces),
}
