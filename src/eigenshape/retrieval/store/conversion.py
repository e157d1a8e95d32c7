"""Indexes of formats 7 and 8, which kept numbers in files of their own, are read to be converted."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import fields
from io import BytesIO
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, recipe_from_text, row_type
from eigenshape.retrieval.patches.codebook import PatchCodebook, write_codebook
from eigenshape.retrieval.store.damage import Damage, warn_of_damage
from eigenshape.retrieval.store.database import (
    APPLICATION,
    DATABASE,
    FORMAT,
    create,
    explained,
    require_database,
    writing,
)
from eigenshape.retrieval.store.state import StoredDescriptor, StoredShape
from eigenshape.retrieval.store.writing import Writer

OLD_FORMATS = (7, 8)  # of the tables, as in PRAGMA user_version
SHAPES = (
    "SELECT id, name, label, source, digest, tags, attributes, thumbnail_file, thumbnail_offset, "
    "thumbnail_size, thumbnail_checksum FROM shape ORDER BY id"
)
DESCRIPTORS = (
    "SELECT recipe, view, n_rows, n_columns, rows_file, rows_offset, rows_checksum, details_file, "
    "details_offset, details_size, details_checksum FROM descriptor WHERE shape = ? ORDER BY id"
)
# Fields of a codebook; one of format 7 may have codes of a cohort of shapes beside them.
FIELDS = {field.name for field in fields(PatchCodebook)}


def convert_index(old: Path, new: Path) -> int:
    """Write an index of format 7 or 8 anew in this format; return the number of its shapes.

    Shapes whose numbers differ from their checksums are left out, with a warning.

    Raise StoreError if `old` is no index of these formats, `new` holds anything, or the disk is
    full.

    Parameters
    ----------
    old : Path
    new : Path
        An empty folder, or one that does not exist.
    """
    require_database(old)
    damages: list[Damage] = []
    with explained(old), closing(sqlite3.connect(old / DATABASE)) as database:
        (application,) = database.execute("PRAGMA application_id").fetchone()
        (version,) = database.execute("PRAGMA user_version").fetchone()
        if application != APPLICATION or version not in OLD_FORMATS:
            reason = f"of format {version}" if application == APPLICATION else "another program's"
            raise StoreError(
                f"An index that is converted is of format 7 or 8; {old} is {reason}. Indexes of "
                f"format {FORMAT} are used as they are."
            )
        create(new)
        n_shapes = 0
        with writing(new) as target:
            writer = Writer(new, target)
            for shape in _shapes(old, database, damages):
                writer.add(shape, replace=False)
                n_shapes += 1
    warn_of_damage(str(old), damages)
    return n_shapes


def _shapes(
    folder: Path, database: sqlite3.Connection, damages: list[Damage]
) -> Iterator[StoredShape]:
    """Yield the shapes that agree with their checksums."""
    recipes: dict[int, AnyRecipe] = {}
    query = "SELECT recipe.id, fields, data FROM recipe JOIN codebook ON recipe.id = codebook.id"
    for number, text, data in database.execute(query).fetchall():
        codebook = None
        if data:  # written anew, as this version writes it
            with np.load(BytesIO(data)) as arrays:
                known = {name: arrays[name] for name in FIELDS}
            codebook = write_codebook(PatchCodebook(**known))
        recipes[number] = recipe_from_text(text, codebook)
    paths: dict[int, Path] = {0: folder}
    for number, away, content, generation in database.execute(
        "SELECT id, folder, content, generation FROM file"
    ):
        name = f"{content}.{generation}.bin" if generation else f"{content}.bin"
        paths[number] = folder / (away or "") / name

    def piece(file: int, offset: int, size: int, checksum: int) -> bytes:
        """Return bytes of a file, checked."""
        with paths[file].open("rb") as opened:
            opened.seek(offset)
            data = opened.read(size)
        if crc32(data) != checksum:
            raise ValueError(f"{size} bytes of {paths[file].name} differ from their checksum")
        return data

    for number, *facts in database.execute(SHAPES).fetchall():
        try:
            picture = piece(*facts[6:]) if facts[8] else None
            descriptors = []
            for row in database.execute(DESCRIPTORS, (number,)):
                recipe, view, n_rows, n_columns, *where = row
                size = n_rows * n_columns * row_type(recipes[recipe]).itemsize
                rows = piece(where[0], where[1], size, where[2])
                details = piece(*where[3:])
                found: Any = (recipes[recipe], view, n_rows, n_columns, rows, details)
                descriptors.append(StoredDescriptor(*found))
            whole: Any = (*facts[:6], picture, descriptors)
            yield StoredShape(*whole)
        except (OSError, ValueError, KeyError) as err:
            damages.append(Damage(DATABASE, str(err), facts[0]))
