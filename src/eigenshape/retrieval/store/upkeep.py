"""Upkeep of an index: give space back, find damage, take descriptors out, make one of several."""

import json
import os
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from jaxtyping import Bool

from eigenshape._errors import StoreError
from eigenshape._text import html_repr, short_repr
from eigenshape.retrieval.store.catalog import DATABASE, DescriptorRow, FileRow, Piece, ShapeRow
from eigenshape.retrieval.store.change import Change
from eigenshape.retrieval.store.damage import Damage, warn_of_damage
from eigenshape.retrieval.store.files import check_database, vacuum, writing
from eigenshape.retrieval.store.records import Record
from eigenshape.retrieval.store.snapshot import DamagedEntryError, IndexState, read_state


@dataclass(frozen=True)
class IndexReport:
    """What `ShapeIndex.verify` found.

    Attributes
    ----------
    n_shapes : int
        Shapes that can be read.
    n_bytes : int
        Bytes that were compared with their checksums.
    damages : tuple of Damage
        Empty if the index holds all that was written.

    See Also
    --------
    ShapeIndex.verify

    Examples
    --------
    >>> import eigenshape as es
    >>> report = es.ShapeIndex.create(None).verify()
    >>> for damage in report.damages:
    ...     print(damage)
    >>> report.n_shapes
    0
    """

    n_shapes: int
    n_bytes: int
    damages: tuple[Damage, ...]

    __repr__ = short_repr
    _repr_html_ = html_repr


def verify_index(folder: Path) -> IndexReport:
    """Compare everything in an index with its checksums."""
    state = read_state(folder)
    of_database = [Damage(DATABASE, text) for text in check_database(folder)]
    n_shapes = len(state.shapes.ids)
    n_bytes, of_shapes = _check_shapes(state, np.ones(n_shapes, dtype=bool))
    return IndexReport(n_shapes, n_bytes, (*state.damages, *of_database, *of_shapes))


def find_damaged(folder: Path, names: Sequence[str]) -> set[str | None]:
    """Return which of some shapes of an index differ from their checksums."""
    state = read_state(folder)
    chosen = np.zeros(len(state.shapes.ids), dtype=bool)
    chosen[[state.names[name] for name in names if name in state.names]] = True
    damages = [*state.damages, *_check_shapes(state, chosen)[1]]
    return {damage.shape for damage in damages}.intersection(names)


def _check_shapes(state: IndexState, chosen: Bool[np.ndarray, " n"]) -> tuple[int, list[Damage]]:
    """Compare the numbers and the pictures of shapes with their checksums; count the bytes."""
    n_bytes, damages = 0, []
    for place in np.flatnonzero(chosen).tolist():
        try:
            n_bytes += len(state.thumbnail(place) or b"")
        except DamagedEntryError as err:
            damages.append(err.damage)
    for entry in state.descriptors[chosen[state.shape_of]]:
        for part, piece in _pieces(state, _row(entry)).items():
            data = state.piece(*piece[:3])
            n_bytes += len(data)
            if crc32(data) != piece[3]:
                damages.append(_damage(state, int(entry["shape"]), part, piece))
    return n_bytes, damages


def _row(entry: Any) -> DescriptorRow:
    return DescriptorRow(*entry.tolist())


def _pieces(state: IndexState, row: DescriptorRow) -> dict[str, Piece]:
    """Return where the rows and the details of a descriptor are."""
    return row.pieces(state.row_size(row.recipe))


def _damage(state: IndexState, shape: int, part: str, piece: Piece) -> Damage:
    file, offset, size, _ = piece
    name = state.shapes.row(int(np.searchsorted(state.shapes.ids, shape))).name
    what = f"its {part} differ from their checksum"
    return Damage(state.file_name(file), what, name, offset, offset + size)


def compact_index(folder: Path) -> int:
    """Write the files of an index anew, without what was removed; return the bytes given back.

    Raises
    ------
    StoreError
        If anything is damaged: its checksum would be lost.
    """
    freed = 0
    with writing(folder) as change:
        state = read_state(folder)
        if state.damages:
            raise _not_whole(folder, state.damages[0])
        own = {file.id for file in change.files.values() if file.folder is None}
        used = dict.fromkeys(own, 0)
        for file, size in _used(state):
            if file in used:
                used[file] += size
        # Only files with something to give back
        moving = {file for file in own if used[file] < change.files[file].size}
        freed = sum(change.files[file].size - used[file] for file in moving)
        for file in moving:
            change.begin_generation(file)
        if moving:
            _move_pieces(change, state, moving)
    vacuum(folder)
    return freed


def _used(state: IndexState) -> Iterator[tuple[int, int]]:
    """Yield the file and the size of all bytes that are in use."""
    for entry in state.descriptors:
        for piece in _pieces(state, _row(entry)).values():
            yield piece[0], piece[2]
    for file, _, size, _ in state.shapes.pictures.tolist():
        yield file, size


def _move_pieces(change: Change, state: IndexState, moving: set[int]) -> None:
    for entry in state.descriptors:
        row = _row(entry)
        moved = {}
        for part, piece in _pieces(state, row).items():
            if piece[0] in moving:
                data = _whole_piece(state, row.shape, part, piece)
                _, moved[f"{part}_offset"], _, _ = change.append(
                    state.files[piece[0]].content, data
                )
        if moved:
            change.replace("descriptor", row._replace(**moved))
    for place in range(len(state.shapes.ids)):
        shape = state.shapes.row(place)
        if shape.thumbnail_size and shape.thumbnail_file in moving:
            _, offset, _, _ = change.append("thumbnails", state.thumbnail(place) or b"")
            change.replace("shape", shape._replace(thumbnail_offset=offset))


def _whole_piece(state: IndexState, shape: int, part: str, piece: Piece) -> bytes:
    data = bytes(state.piece(*piece[:3]))
    if crc32(data) != piece[3]:
        raise _not_whole(state.folder, _damage(state, shape, part, piece))
    return data


def _not_whole(folder: Path, damage: Damage) -> StoreError:
    return StoreError(
        f"An index must be whole to be compacted; {folder}: {damage}. Remove the damaged shapes, "
        "which `verify` lists, or merge the index into a new one."
    )


def merge_indexes(
    folder: Path, others: Sequence[Path], *, copy: bool = True, replace: bool = False
) -> int:
    """Add the shapes of other indexes in one transaction; return how many were added.

    What is damaged in them is left out, with a warning.
    """
    n_added, damages = 0, list[Damage]()
    with writing(folder) as change:
        for other in others:
            if other.resolve() == folder.resolve():
                raise StoreError(
                    f"An index is merged with others; {folder} is this one. Leave it out."
                )
            state = read_state(other)
            damages += state.damages
            merging = _Merging(change, state, copy=copy, replace=replace)
            for place in range(len(state.shapes.ids)):
                try:
                    n_added += merging.add(place)
                except DamagedEntryError as err:
                    damages.append(err.damage)
    warn_of_damage(", ".join(map(str, others)), damages)
    return n_added


class _Merging:
    """The shapes of one index, on their way into another."""

    def __init__(self, change: Change, state: IndexState, *, copy: bool, replace: bool) -> None:
        self.change, self.state, self.copy, self.replaces = change, state, copy, replace
        self.recipes = {
            number: change.keep_recipe(recipe) for number, recipe in state.recipes.items()
        }
        self.files: dict[int, int] = {}  # our numbers of the other's files
        order = np.argsort(state.shape_of, kind="stable")
        bounds = np.searchsorted(state.shape_of[order], np.arange(len(state.shapes.ids) + 1))
        self.order, self.bounds = order, bounds

    def add(self, place: int) -> int:
        """Add a shape; return 1 if it is new, 0 if the index has it."""
        shape, change = self.state.shapes.row(place), self.change
        entries = self.order[self.bounds[place] : self.bounds[place + 1]]
        rows = [_row(self.state.descriptors[entry]) for entry in entries]
        if not rows:  # they are damaged, which is named already
            return 0
        pieces = [self._whole(row, shape.name) for row in rows]  # before anything is written
        picture = self.state.thumbnail(place)
        old = change.find_whole_shape(shape.name, shape.digest)
        same = old is not None and old.digest is not None and old.digest == shape.digest
        if old is not None and not same:
            if not self.replaces:
                raise StoreError(
                    f"A name stands for one shape; {shape.name!r} of {self.state.folder} is in the "
                    "index with other content. Remove one of them, or merge with replace=True (--replace)."
                )
            change.delete_shape(old)
        if old is not None and same:
            number = old.id
        else:
            where = (0, 0, 0, 0)
            if picture is not None:
                where = self._carry(shape[-4:], "thumbnails", picture)
            number = change.insert("shape", *shape[1:7], *where)
        described = {
            recipe: change.is_described(number, recipe) for recipe in self.recipes.values()
        }
        for row, (rows_data, details_data) in zip(rows, pieces, strict=True):
            recipe = self.recipes[row.recipe]
            if described[recipe]:
                continue
            self._require_columns(recipe, row, shape)
            found = _pieces(self.state, row)
            at, offset, _, checksum = self._carry(found["rows"], f"rows-{recipe}", rows_data)
            where = self._carry(found["details"], f"details-{recipe}", details_data)
            size = (row.n_rows, row.n_columns)
            fields = (number, recipe, row.view)
            change.insert("descriptor", *fields, at, offset, *size, checksum, *where)
        return int(not same)

    def _require_columns(self, recipe: int, row: DescriptorRow, shape: ShapeRow) -> None:
        known = self.change.keep_columns(recipe, row.n_columns)
        if known != row.n_columns:
            raise StoreError(
                f"Rows by one recipe must have as many numbers; those of {shape.name!r} of "
                f"{self.state.folder} have {row.n_columns}, and others have {known}."
            )

    def _whole(self, row: DescriptorRow, name: str) -> tuple[bytes, bytes]:
        """Return the rows and the details of a descriptor, checked."""
        found = []
        for part, piece in _pieces(self.state, row).items():
            data = bytes(self.state.piece(*piece[:3]))
            if crc32(data) != piece[3]:
                raise DamagedEntryError(0, _damage(self.state, row.shape, part, piece))
            found.append(data)
        return found[0], found[1]

    def _carry(self, piece: Piece, content: str, data: bytes) -> Piece:
        """Copy bytes, or refer to the file that holds them."""
        if self.copy:
            return self.change.append(content, data)
        if piece[0] not in self.files:
            self.files[piece[0]] = self._refer(self.state.files[piece[0]])
        return (self.files[piece[0]], *piece[1:])

    def _refer(self, file: FileRow) -> int:
        """Return the number of our row for a file of the other index."""
        theirs = self.state.folder / (file.folder or "")
        away = Path(os.path.relpath(theirs.resolve(), self.change.folder.resolve())).as_posix()
        for known in self.change.files.values():
            if known[1:4] == (away, file.content, file.generation):
                self.change.grow_file(known.id, file.size)
                return known.id
        return self.change.add_file(away, file.content, file.generation, file.size)


def export_index(state: IndexState, records: Sequence[Record], folder: Path) -> None:
    """Write records as JSON and descriptors as NPZ into a new folder.

    Raises
    ------
    StoreError
        If the folder holds anything, or something that is exported is damaged.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise StoreError(
            f"{folder} must be empty to export into; it is not. Choose another folder."
        )
    listing = []
    with zipfile.ZipFile(folder / "descriptors.npz", "w", zipfile.ZIP_STORED) as archive:
        for number, record in enumerate(records):
            facts = {"number": number} | {
                each.name: getattr(record, each.name) for each in fields(Record)
            }
            facts["recipes"] = [recipe.name for recipe in record.recipes]
            listing.append(facts)
            for recipe in record.recipes:
                snapshot = state.snapshot(recipe)
                places = np.flatnonzero(snapshot.shape_of == state.names[record.name])
                for place in places.tolist():
                    view = int(snapshot.columns["view"][place])
                    key = f"{number}/{recipe.name}/{view}"
                    for name, array in _arrays(snapshot.descriptor(place), key):
                        with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                            np.lib.format.write_array(file, array, allow_pickle=False)
    text = json.dumps(listing, indent=1, ensure_ascii=True)
    (folder / "records.json").write_text(text, encoding="utf-8")


def _arrays(value: Any, key: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the arrays of a descriptor, and of values inside it, by name."""
    for each in fields(value):
        found = getattr(value, each.name)
        if isinstance(found, np.ndarray):
            yield f"{key}/{each.name}", found
        elif isinstance(found, tuple):
            for number, inner in enumerate(found):
                if is_dataclass(inner):
                    yield from _arrays(inner, f"{key}/{each.name}/{number}")
