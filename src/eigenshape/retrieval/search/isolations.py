"""How isolated each shape of an index is, kept in a file that can be made again at any time."""

from contextlib import suppress
from typing import Any
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Float, Int

from eigenshape._errors import FileFormatError
from eigenshape._files import replacing
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.patches.isolation import N_REFERENCES, measure_isolations
from eigenshape.retrieval.patches.packing import unpack_codes
from eigenshape.retrieval.search.coarse import Rows

FEWEST_TO_KEEP = 100  # shapes of an index that has such a file; fewer are measured in 10 ms


def stored_isolations(
    source: Rows, recipe: PatchRecipe, checksums: Int[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the isolation of each shape of an index, of which those that are new are measured.

    The shapes with the 500 smallest checksums are the references, so the answer depends on what the
    index holds, and not on the order in which it was added. If one of them is added or removed, all
    shapes are measured again.

    Parameters
    ----------
    source : Rows
    recipe : PatchRecipe
    checksums : (n,) int
        Of the packed codes; equal checksums mean equal codes.
    """
    path = source.beside(f"isolation-{recipe.codebook.digest[:16]}-{recipe.clip!r}.npz")
    distinct, firsts, inverse = np.unique(checksums, return_index=True, return_inverse=True)
    found = np.full(len(distinct), np.nan)
    problems = (OSError, ValueError, KeyError, EOFError, BadZipFile)
    with suppress(*problems), path.open("rb") as file, np.load(file) as kept:
        if np.array_equal(kept["checksums"][:N_REFERENCES], distinct[:N_REFERENCES]):
            both = np.intersect1d(distinct, kept["checksums"], return_indices=True)
            found[both[1]] = kept["isolations"][both[2]]
    missing = np.flatnonzero(np.isnan(found))
    shape: Any = recipe.codebook.code_shape

    def whole(number: int) -> np.ndarray:
        (rows,) = source.rows_of(firsts[[number]], checked=True)
        return unpack_codes(rows[: shape[0] * shape[1]]).reshape(shape)

    found[missing] = measure_isolations(whole, len(distinct), missing)
    if len(missing) and len(distinct) >= FEWEST_TO_KEEP:
        # A folder that cannot be written to, as on a read-only disk, is searched all the same.
        with suppress(OSError, FileFormatError), replacing(path) as fresh:
            np.savez(fresh, checksums=distinct, isolations=found)
    return found[inverse]
