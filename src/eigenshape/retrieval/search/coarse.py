"""What search keeps in files beside an index: short rows of all shapes, and how isolated each is."""

from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol, runtime_checkable
from zipfile import BadZipFile
from zlib import crc32

import numpy as np
from jaxtyping import Float, Float32, Int, Int8, Int64
from numpy.lib.format import open_memmap, read_array

from certeig.kit.arrays import ReadOnly, freeze, record
from certeig.kit.errors import FileFormatError
from certeig.kit.files import replacing
from eigenshape._arrays import find_keys
from eigenshape.retrieval.patches.code_loops import scan
from eigenshape.retrieval.patches.descriptor import PatchRecipe
from eigenshape.retrieval.patches.distance import N_REFERENCES, SIZE_PRICE, measure_isolations
from eigenshape.retrieval.patches.packing import unpack_codes
from eigenshape.retrieval.search.axes import PatchAxes, fit_axes

# Shapes to which axes are fitted: three sizes of each give 6,000 vectors of 1,280 numbers, and the
# fit takes 2 s. Twice as many changed no list of candidates.
N_TO_FIT = 2000
SHAPES_AT_ONCE = 1000  # whose codes are unpacked at a time: 46 MB as floats
# Axes are fitted again once an index has this many times as many shapes as they were fitted to.
GROWTH = 4
# Rows that the file may lack, or hold of shapes that were removed, as a share of all. They are made
# at each opening, 0.2 ms a shape; writing the file anew takes as long as making a tenth of it.
MOST_CHANGED = 0.05
FEWEST_TO_KEEP = 100  # shapes of an index that has such a file; fewer are measured in 10 ms


@runtime_checkable
class Rows(Protocol):
    """Packed rows of all shapes of one recipe, at one moment."""

    @property
    def n_shapes(self) -> int:
        """Return the number of places."""

    @property
    def row_checksums(self) -> Int[np.ndarray, " n"]:
        """Return a checksum of the rows of each place, which tells whether they have changed."""

    def rows_of(self, places: Int[np.ndarray, " k"], *, checked: bool = False) -> list[np.ndarray]:
        """Return the packed rows of some places: those of the whole shape first."""

    def beside(self, name: str) -> Path:
        """Return the path of a file that can be made again from the rows."""


@record
class CoarseRows(ReadOnly):
    """Short rows of the whole shapes, for a scan of all of them.

    Attributes
    ----------
    axes : PatchAxes
    checksums : (m,) int64
        Of the packed rows that each short row is made from.
    numbers : (k, s, q) int8
        The rows of the file, mapped into memory.
    added : (m - k, s, q) int8
        Rows of shapes that were added since the file was written.
    rows : (n,) int64
        The row of each shape: one of the file or, from number k on, one that was added. Rows of
        shapes that were removed belong to none.
    n_fitted : int
        How many shapes there were when the axes were fitted.

    Examples
    --------
    An engine of your own is made from them; `FaissEngine` and `QdrantEngine` show how:

    >>> import eigenshape as es
    >>> class Engine:
    ...     def __init__(self, coarse: es.retrieval.CoarseRows) -> None:
    ...         self.rows = coarse.numbers.reshape(-1, coarse.numbers.shape[2])
    """

    axes: PatchAxes
    checksums: Int64[np.ndarray, " m"]
    numbers: Int8[np.ndarray, "k s q"]
    added: Int8[np.ndarray, "a s q"]
    rows: Int64[np.ndarray, " n"]
    n_fitted: int

    def scores(self, codes: Int8[np.ndarray, "b s v"]) -> Float32[np.ndarray, " n"]:
        """Return distances of a query to all whole shapes, as far as the axes show them.

        Parameters
        ----------
        codes : (b, s, v) int8
            Codes of the query, as a `PatchDescriptor` has them.
        """
        query, unit = self.axes.coarse_query(codes)
        found = np.empty(len(self.checksums), dtype=np.float32)
        scan(query, self.numbers, unit, SIZE_PRICE, found[: len(self.numbers)])
        scan(query, self.added, unit, SIZE_PRICE, found[len(self.numbers) :])
        return found[self.rows]

    def scores_at(
        self, codes: Int8[np.ndarray, "b s v"], places: Int[np.ndarray, " k"]
    ) -> Float32[np.ndarray, " k"]:
        """Return `scores` of some shapes.

        Parameters
        ----------
        codes : (b, s, v) int8
            Codes of the query.
        places : (k,) int
            Numbers of shapes.
        """
        query, unit = self.axes.coarse_query(codes)
        found = np.empty(len(places), dtype=np.float32)
        scan(query, self.numbers_at(places), unit, SIZE_PRICE, found)
        return found

    def numbers_at(self, places: Int[np.ndarray, " k"]) -> Int8[np.ndarray, "k s q"]:
        """Return the rows of some shapes.

        Parameters
        ----------
        places : (k,) int
            Numbers of shapes.
        """
        rows, n_kept = self.rows[places], len(self.numbers)
        found = np.empty((len(rows), *self.numbers.shape[1:]), dtype=np.int8)
        is_added = rows >= n_kept
        found[~is_added] = self.numbers[rows[~is_added]]
        found[is_added] = self.added[rows[is_added] - n_kept]
        return found


def coarse_rows(source: Rows, recipe: PatchRecipe, before: CoarseRows | None = None) -> CoarseRows:
    """Return the short rows of an index: as they were kept, with what is missing made now.

    They are kept in a file beside the index. What was kept serves shapes whose checksums are the
    same, so adding shapes makes their rows alone. A file that is damaged, or cannot be written,
    costs time and changes no answer.

    Parameters
    ----------
    source : Rows
    recipe : PatchRecipe
    before : CoarseRows, optional
        Of an earlier state of the index, in place of the file.
    """
    path = source.beside(f"coarse-{recipe.codebook.digest[:16]}-{recipe.clip!r}.bin")
    wanted = np.asarray(source.row_checksums, dtype=np.int64)
    kept = before or _read(path)
    if kept is None or len(wanted) > GROWTH * kept.n_fitted:
        spread = np.linspace(0, len(wanted) - 1, min(N_TO_FIT, len(wanted)))
        axes = fit_axes(_codes(source, recipe, np.unique(spread.astype(np.int64))))
        n_bases, n_sizes, _ = recipe.codebook.code_shape
        nothing = np.empty((0, n_sizes, n_bases * axes.axes.shape[2]), dtype=np.int8)
        kept = _in_order(axes, np.empty(0, np.int64), nothing, len(wanted))
    found = _completed(source, recipe, kept, wanted)
    few = MOST_CHANGED * len(wanted)
    if len(found.added) <= few and len(found.checksums) - len(wanted) <= few:
        return found
    # No copy is made to freeze these: at a million shapes it takes 1.2 GB.
    numbers = found.numbers_at(np.arange(len(wanted)))
    numbers.flags.writeable = False
    made = _in_order(found.axes, freeze(wanted), numbers, found.n_fitted)
    # A folder that cannot be written to, as on a read-only disk, is searched all the same.
    with suppress(OSError, FileFormatError):
        with replacing(path) as file:
            # The rows first, which are mapped into memory when they are read
            for part in (numbers, made.axes.axes, made.axes.steps, made.checksums):
                np.save(file, part)
            np.save(file, np.array([_checksum(made), made.n_fitted]))
        return _read(path) or made
    return made


def _in_order(
    axes: PatchAxes,
    checksums: Int64[np.ndarray, " n"],
    numbers: Int8[np.ndarray, "n s q"],
    n_fitted: int,
) -> CoarseRows:
    """Return rows of which each belongs to the shape of its number."""
    rows = freeze(np.arange(len(checksums)))
    return CoarseRows(axes, checksums, numbers, numbers[:0], rows, n_fitted)


def _completed(
    source: Rows, recipe: PatchRecipe, kept: CoarseRows, wanted: Int64[np.ndarray, " n"]
) -> CoarseRows:
    """Return rows with the wanted checksums: those that are kept, and the others made now."""
    if np.array_equal(kept.checksums[kept.rows], wanted):
        return kept
    rows = find_keys(kept.checksums, wanted)
    missing = np.flatnonzero(rows < 0)
    rows[missing] = len(kept.checksums) + np.arange(len(missing))
    made = [kept.added]
    for first in range(0, len(missing), SHAPES_AT_ONCE):
        some = missing[first : first + SHAPES_AT_ONCE]
        made.append(kept.axes.coarse_rows(_codes(source, recipe, some)))
    added = np.concatenate(made)
    added.flags.writeable = False
    checksums = np.concatenate([kept.checksums, wanted[missing]])
    known_rows = (freeze(checksums), kept.numbers, added, freeze(rows))
    return CoarseRows(kept.axes, *known_rows, kept.n_fitted)


def _codes(
    source: Rows, recipe: PatchRecipe, places: Int[np.ndarray, " k"]
) -> Int8[np.ndarray, "k b s v"]:
    """Return the codes of whole shapes."""
    shape = recipe.codebook.code_shape
    count = shape[0] * shape[1]
    packed = [np.asarray(rows[:count]) for rows in source.rows_of(places, checked=True)]
    return unpack_codes(np.concatenate(packed)).reshape(len(places), *shape)


def _read(path: Path) -> CoarseRows | None:
    """Return what a file holds, or None if it is missing, damaged, or of an older format."""
    # Whatever is wrong with the file, it can be made again.
    with suppress(OSError, ValueError, EOFError), path.open("rb") as file:
        mapped = open_memmap(path, mode="r")
        if mapped.dtype != np.int8:
            return None
        file.seek(mapped.offset + mapped.nbytes)
        axes, steps, checksums, facts = (freeze(read_array(file)) for _ in range(4))
        checksum, n_fitted = facts.tolist()
        rows = _in_order(PatchAxes(axes, steps), checksums, np.asarray(mapped), n_fitted)
        if _checksum(rows) == checksum:
            return rows
    return None


def _checksum(rows: CoarseRows) -> int:
    found = 0
    for part in (rows.axes.axes, rows.axes.steps, rows.checksums, rows.numbers):
        # In pieces, so that a mapped file need not be in memory as a whole
        for first in range(0, len(part), SHAPES_AT_ONCE):
            piece = np.ascontiguousarray(part[first : first + SHAPES_AT_ONCE])
            found = crc32(piece.data, found)
    return found


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
