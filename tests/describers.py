"""What worker processes of the tests run; importable by name."""

import os
import time
from dataclasses import replace

import numpy as np
from filelock import FileLock

from eigenshape._errors import InvalidShapeError
from eigenshape.retrieval.heat.descriptor import Recipe, ShapeDescriptor

RECIPE = Recipe(name="test", scales=(1.0, 2.0, 4.0), n_features=2, n_shifts=0)


class PicklesBadlyError(Exception):
    def __init__(self, first, second):
        super().__init__(f"{first} and {second}")


def descriptor(seed, recipe=RECIPE, m=2):
    rng = np.random.default_rng(seed)
    return ShapeDescriptor(rng.random((m, len(recipe.scales))), np.arange(m), recipe)


def by_content(path):
    """Do what the file says: be described, raise, die, hang, return nonsense."""
    word = path.read_text()
    if word in WORDS:
        return WORDS[word](path)
    return [descriptor(int(word))]


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
    return [descriptor(1)]


def vanish(path):
    path.unlink()
    return [descriptor(1)]


WORDS = {
    "raise": refuse,
    "pickle badly": pickle_badly,
    "hang": hang,
    "change": change,
    "vanish": vanish,
    "die": lambda path: os._exit(77),
    "nothing": lambda path: None,
    "text": lambda path: ["text"],
    "nan": lambda path: [ShapeDescriptor(np.full((2, 3), np.nan), np.arange(2), RECIPE)],
    "another recipe": lambda path: [descriptor(1, replace(RECIPE, name="other"))],
}
