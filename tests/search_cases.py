"""A small recipe, and packed rows of shapes that are mixtures of a few."""

from dataclasses import dataclass, replace

import numpy as np

import eigenshape as es
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.packing import pack_codes

WIDTH = 64  # numbers of a code


def small_recipe():
    """Return a recipe whose codes have 64 numbers, at one base radius less than usual."""
    rng = np.random.default_rng(0)
    shapes = {
        "means": (2, 64),
        "spreads": (2, 64),
        "axes": (2, 64, 4),
        "shares": (2, 8),
        "centers": (2, 8, 4),
        "variances": (2, 8, 4),
    }
    arrays = {name: rng.random(shape, dtype=np.float32) for name, shape in shapes.items()}
    return es.retrieval.PatchRecipe(es.retrieval.PatchCodebook(**arrays))


RECIPE = small_recipe()


@dataclass(frozen=True, eq=False)
class Source:
    """Packed rows in memory, as an index has them in a file."""

    folder: object
    codes: np.ndarray  # (n, w, b, s, v)
    row_checksums: np.ndarray

    @property
    def n_shapes(self):
        return len(self.codes)

    def rows_of(self, places, *, checked=False):
        return [pack_codes(self.codes[place]) for place in places]

    def beside(self, name):
        return self.folder / name

    def chosen(self, places):
        places = np.asarray(places)
        return replace(self, codes=self.codes[places], row_checksums=self.row_checksums[places])


def make_source(folder, n_shapes, n_views=1):
    return Source(folder, mixtures(1, n_shapes, n_views), np.arange(n_shapes) * 7919)


def mixtures(seed, count, n_views=0):
    base = np.random.default_rng(9).standard_normal((12, 1 + n_views, 2, 3, WIDTH))
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.full(12, 0.3), count)
    mixed = np.tensordot(weights, base, axes=1) + 0.1 * rng.standard_normal(
        (count, *base.shape[1:])
    )
    return np.rint(np.clip(7 * mixed / abs(mixed).max(axis=-1, keepdims=True), -7, 7)).astype(
        np.int8
    )


def as_query(codes):
    return PatchDescriptor(codes, (), RECIPE)
