"""A change of an index: rows and bytes that are added or deleted in one transaction."""

import os
import re
import sqlite3
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO
from zlib import crc32

from eigenshape._errors import StoreError
from eigenshape.retrieval.kinds import AnyRecipe, kind_of
from eigenshape.retrieval.store.catalog import (
    CHANGES,
    DATABASE,
    MODULUS,
    TABLES,
    DescriptorRow,
    FileRow,
    Piece,
    RecipeRow,
    Seal,
    ShapeRow,
    keep_seal,
    read_recipes,
    read_table,
    recipe_values,
    row_checksum,
)
from eigenshape.retrieval.store.damage import Damage
from eigenshape.retrieval.store.syncing import sync_folder

# Names of the files that `append` writes
OWN_FILES = re.compile(r"(rows-\d+|details-\d+|thumbnails)(\.\d+)?\.bin")


class Change:
    """An open transaction. What it costs does not grow with the number of shapes in the index.

    Attributes
    ----------
    folder : Path
    database : Connection
    recipe_rows, files : dict
        The rows of these tables by their numbers; both are short.
    n_changes : int
        Number of changes of the index, including this one.
    """

    def __init__(self, folder: Path, database: sqlite3.Connection, seals: dict[str, Seal]) -> None:
        self.folder, self.database = folder, database
        self.n_changes = seals[CHANGES].n_rows + 1
        self._n_touched = seals[CHANGES].last
        self._seals = dict(seals)
        self._touched = False
        self._handles: dict[int, BinaryIO] = {}
        self._grown: set[int] = set()
        self._is_compacted = False
        damages: list[Damage] = []
        self.recipe_rows: dict[int, RecipeRow] = {}
        self.files: dict[int, FileRow] = {}
        for table, rows in (("recipe", self.recipe_rows), ("file", self.files)):
            for chunk in read_table(database, seals[table], damages):
                rows.update((row[0], row) for row in chunk.rows)
        self._recipes = read_recipes(
            str(folder), database, list(self.recipe_rows.values()), damages
        )
        if damages:
            raise StoreError(
                f"An index must be whole to be changed; {folder}: {damages[0]}. Merge it into a "
                "new index to keep what is whole."
            )

    def insert(self, table: str, *values: Any) -> int:
        """Add a row to a table; return its number, which no row had before."""
        number = self._seals[table].last + 1
        self._write(table, (number, *values))
        return number

    def replace(self, table: str, row: Any) -> None:
        """Replace the row of the same number."""
        self.delete(table, "id", row[0])
        self._write(table, row)

    def delete(self, table: str, column: str, value: int) -> None:
        """Delete the rows that have a number in a column."""
        where = f"FROM {table} WHERE {column} = ?"
        checksums = self.database.execute(f"SELECT checksum {where}", (value,)).fetchall()
        self.database.execute(f"DELETE {where}", (value,))
        self._count(table, -len(checksums), -sum(checksum for (checksum,) in checksums))
        if table == "shape":
            self._n_touched += 1
            self.database.execute("INSERT INTO touched VALUES (?, ?)", (self._n_touched, value))

    def _write(self, table: str, row: Any) -> None:
        checksum = row_checksum(table, row)
        marks = ", ".join("?" * (len(row) + 1))
        self.database.execute(f"INSERT INTO {table} VALUES ({marks})", (*row, checksum))
        self._count(table, 1, checksum, row[0])

    def _count(self, table: str, n_rows: int, checksum: int, last: int = 0) -> None:
        seal = self._seals[table]
        total = (seal.total + checksum) % MODULUS
        self._seals[table] = Seal(table, seal.n_rows + n_rows, total, max(seal.last, last))
        self._touched = True

    def find_shape(self, name: str) -> ShapeRow | None:
        """Return the shape of a name, or None if there is none."""
        query = f"SELECT {', '.join(ShapeRow._fields)} FROM shape WHERE name = ?"
        row = self.database.execute(query, (name,)).fetchone()
        if row is None:
            return None
        found = ShapeRow(*row)
        if found.name != name:  # a flipped bit in the list of names led to another shape
            raise StoreError(
                f"The list of names must lead from {name!r} to its shape; it leads to "
                f"{found.name!r}. {self.folder / DATABASE} is damaged: merge the index into a new "
                "one to keep what is whole."
            )
        return found

    def find_whole_shape(self, name: str, digest: str | None) -> ShapeRow | None:
        """Return the shape of a name; one of the same digest is deleted first if it is damaged.

        What has the same digest is the same, so a damaged shape can be written anew.
        """
        shape = self.find_shape(name)
        if shape is None or shape.digest is None or shape.digest != digest or self._is_whole(shape):
            return shape
        self.delete_shape(shape)
        return None

    def _is_whole(self, shape: ShapeRow) -> bool:
        """Return whether a shape, its numbers and its picture agree with their checksums."""
        query = "SELECT checksum FROM shape WHERE id = ?"
        (checksum,) = self.database.execute(query, (shape.id,)).fetchone()
        if row_checksum("shape", shape) != checksum:
            return False
        pieces: list[Piece] = [shape[-4:]]
        columns = ", ".join(DescriptorRow._fields)
        query = f"SELECT {columns}, checksum FROM descriptor WHERE shape = ?"
        for *values, checksum in self.database.execute(query, (shape.id,)).fetchall():
            row = DescriptorRow(*values)
            if row_checksum("descriptor", row) != checksum:
                return False
            number_size = kind_of(self._recipes[row.recipe]).row_type.itemsize
            pieces += row.pieces(number_size).values()
        return all(self._holds(piece) for piece in pieces)

    def _holds(self, piece: Piece) -> bool:
        """Return whether a file holds bytes with their checksum."""
        number, offset, size, checksum = piece
        if not size:  # there is no picture
            return True
        file = self.files[number]
        if number in self._handles:
            self._handles[number].flush()
        try:
            with (self.folder / (file.folder or "") / file.name).open("rb") as handle:
                handle.seek(offset)
                return crc32(handle.read(size)) == checksum
        except OSError:
            return False

    def delete_shape(self, shape: ShapeRow) -> None:
        """Delete a shape and its descriptors; their bytes stay, since readers may need them."""
        self.delete("descriptor", "shape", shape.id)
        self.delete("shape", "id", shape.id)

    def is_described(self, shape: int, recipe: int) -> bool:
        """Return whether a shape has descriptors by a recipe."""
        query = "SELECT 1 FROM descriptor WHERE shape = ? AND recipe = ?"
        return self.database.execute(query, (shape, recipe)).fetchone() is not None

    def keep_recipe(self, recipe: AnyRecipe) -> int:
        """Return the number of a recipe; store the recipe under a new number if it is new.

        A field that a stored recipe lacks, since it was introduced later, has its default.
        """
        for number, other in self._recipes.items():
            if other == recipe:
                return number
        fields, checksum, codebook = recipe_values(recipe)
        number = self.insert("recipe", fields, 0, checksum)
        self.database.execute("INSERT INTO codebook VALUES (?, ?)", (number, codebook))
        self.recipe_rows[number] = RecipeRow(number, fields, 0, checksum)
        self._recipes[number] = recipe
        return number

    def keep_columns(self, recipe: int, n_columns: int) -> int:
        """Return how many numbers a row by a recipe has; store it with the first descriptor."""
        row = self.recipe_rows[recipe]
        if not row.n_columns:
            row = self.recipe_rows[recipe] = row._replace(n_columns=n_columns)
            self.replace("recipe", row)
        return row.n_columns

    def append(self, content: str, data: bytes) -> tuple[int, int, int, int]:
        """Write bytes behind the committed ones of a file.

        Returns
        -------
        tuple of int
            The number of the file, where the bytes begin, how many they are, and their checksum.
        """
        number = self._own_file(content)
        file = self.files[number]
        if number not in self._handles:
            self._handles[number] = self._open(file)
        self._handles[number].write(data)
        self.files[number] = file._replace(size=file.size + len(data))
        self._grown.add(number)
        return number, file.size, len(data), crc32(data)

    def _own_file(self, content: str) -> int:
        for file in self.files.values():
            if file.content == content and file.folder is None:
                return file.id
        return self.add_file(None, content, 0)

    def add_file(self, folder: str | None, content: str, generation: int, size: int = 0) -> int:
        """Add a file to the catalog; return its number."""
        number = self.insert("file", folder, content, generation, size)
        self.files[number] = FileRow(number, folder, content, generation, size)
        return number

    def grow_file(self, number: int, size: int) -> None:
        """Note that a file of another index has grown."""
        if size > self.files[number].size:
            self.files[number] = self.files[number]._replace(size=size)
            self._grown.add(number)

    def begin_generation(self, number: int) -> FileRow:
        """Begin a file anew, empty and under another name; return what it was before.

        The old file is deleted after the change is committed.
        """
        old = self.files[number]
        new = old._replace(generation=old.generation + 1, size=0)
        self.files[number] = new
        self._grown.add(number)
        self._is_compacted = True
        (self.folder / new.name).unlink(missing_ok=True)  # of a change that was not committed
        return old

    def _open(self, file: FileRow) -> BinaryIO:
        path = self.folder / file.name
        if not path.exists():
            path.touch()
            sync_folder(self.folder)
        handle = path.open("r+b")
        handle.seek(file.size)
        return handle

    def keep(self) -> bool:
        """Force all bytes to disk and seal the tables; return False if nothing was changed."""
        for handle in self._handles.values():
            handle.truncate()
            handle.flush()
            os.fsync(handle.fileno())
        for number in sorted(self._grown):
            self.replace("file", self.files[number])
        if not self._touched:
            return False
        for table in TABLES:
            keep_seal(self.database, self._seals[table])
        keep_seal(self.database, Seal(CHANGES, self.n_changes, 0, self._n_touched))
        return True

    def finish(self) -> None:
        """Delete the files that nothing refers to any more, after the commit."""
        if not self._is_compacted:
            return
        try:
            # If the log were lost after this, the state before would be read, without its files.
            self.database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        except sqlite3.OperationalError:  # no space for it; the next compaction deletes the files
            return
        names = {file.name for file in self.files.values() if file.folder is None}
        for path in self.folder.glob("*.bin"):
            if OWN_FILES.fullmatch(path.name) and path.name not in names:
                with suppress(OSError):  # Windows refuses it as long as a reader has it mapped
                    path.unlink()

    def close(self) -> None:
        """Close the files."""
        for handle in self._handles.values():
            with suppress(OSError):  # bytes that did not fit on the disk are still in the buffer
                handle.close()
