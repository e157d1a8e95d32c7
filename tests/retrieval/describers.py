"""What worker processes of the tests run; importable by name."""

import os
import time

import numpy as np

from eigenshape._errors import InvalidShapeError
from eigenshape.retrieval.descriptor import Recipe, ShapeDescriptor

RECIPE = Recipe(name="test", scales=(1.0, 2.0, 4.0), n_features=2, n_shifts=0)


def descriptor(seed, recipe=RECIPE, m=2):
    rng = np.random.default_rng(seed)
    return ShapeDescriptor(rng.random((m, len(recipe.scales))), np.arange(m), recipe)


def by_content(path):
    """Do what the file says: be described, raise, die, hang, return nonsense."""
    word = path.read_text()
    if word == "raise":
        raise InvalidShapeError("A face must have area; face 3 has none.")
    if word == "surprise":
        raise KeyError("lost")
    if word == "die":
        os._exit(77)
    if word == "hang":
        time.sleep(600)
    return [descriptor(int(word))]
