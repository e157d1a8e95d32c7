"""Adding a shape to an index: what is checked, and which rows are written."""

from collections.abc import Sequence
from pathlib import Path
from typing import SupportsIndex
from zlib import crc32

import numpy as np

from eigenshape._arrays import whole_number
from eigenshape._errors import InvalidParameterError, StoreError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.store import files as store
from eigenshape.retrieval.store.catalog import Catalog, ShapeRow


def describe_to_store(
    mesh: TriangleMesh, recipe: AnyRecipe, n_views: SupportsIndex | None = None
) -> list[Descriptor]:
    """Describe a mesh as an index keeps it: the whole, and what viewpoints see if it is closed."""
    kind = kind_of(recipe)
    count = kind.n_views if n_views is None else whole_number(n_views, "n_views", 0)
    descriptors: list[Descriptor] = kind.describe_to_store(mesh, recipe, count)
    return descriptors


def require_text(name: str, *others: str | None) -> None:
    """Raise an error if a name, label, source or digest is not Unicode text."""
    for text in (name, *others):
        if text is not None and (
            not isinstance(text, str) or text != text.encode(errors="replace").decode()
        ):
            raise InvalidParameterError(
                "Names, labels, sources and digests in an index must be Unicode text; "
                f"{text!r} is not."
            )


def rows_of_each(name: str, descriptors: Sequence[Descriptor]) -> list[np.ndarray]:
    """Return the rows of descriptors as they are stored; refuse numbers that cannot be."""
    if not descriptors:
        raise InvalidParameterError(
            f"A shape must have a descriptor to be found; {name!r} has none."
        )
    return [kind_of(descriptor.recipe).rows(descriptor, name) for descriptor in descriptors]


def require_columns(descriptor: Descriptor, rows: np.ndarray, n_columns: int) -> None:
    """Raise an error if the rows of a descriptor are not as long as those of others by its recipe."""
    if rows.shape[1] != n_columns:
        raise InvalidParameterError(
            f"All features of one recipe must have as many numbers; those of recipe "
            f"{descriptor.recipe.name!r} have {n_columns}, and these have {rows.shape[1]}."
        )


def add_shape(catalog: Catalog, new: ShapeRow, *, replace: bool) -> tuple[Catalog, int]:
    """Return a catalog that holds a shape, and the number of the shape."""
    old = catalog.shape(new.name)
    if old is not None and old.digest is not None and old.digest == new.digest:
        return catalog, old.id
    if old is not None and not replace:
        raise StoreError(
            f"A name stands for one shape; {new.name!r} is in the index with digest {old.digest}, "
            f"not {new.digest}. Remove it first, or add it with replace=True."
        )
    if old is not None:
        catalog = catalog.without(old)
    row = catalog.database.execute("INSERT INTO shape VALUES (NULL, ?, ?, ?, ?)", new[1:])
    return catalog, int(row.lastrowid or 0)


def write_views(
    folder: Path,
    catalog: Catalog,
    shape: int,
    recipe: int,
    views: Sequence[tuple[Descriptor, np.ndarray]],
) -> None:
    """Write the views of a shape by one recipe, unless it has some already."""
    others = [row for row in catalog.descriptors if row.recipe == recipe]
    n_columns = others[0].n_columns if others else views[0][1].shape[1]
    for descriptor, rows in views:
        require_columns(descriptor, rows, n_columns)
    if any(row.shape == shape for row in others):
        return
    for view, (descriptor, rows) in enumerate(views):
        details = kind_of(descriptor.recipe).details(descriptor)
        offset = store.append_rows(folder, catalog.database, recipe, rows)
        checksums = crc32(rows.tobytes()), crc32(details)
        catalog.database.execute(
            "INSERT INTO descriptor VALUES (NULL, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (shape, recipe, view, offset, *rows.shape, *checksums, details),
        )
