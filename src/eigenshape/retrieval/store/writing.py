"""Adding shapes to an index: what is checked, and which rows are written."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, SupportsIndex

import numpy as np

from eigenshape._arguments import require_each, require_type
from eigenshape._errors import InvalidParameterError, StoreError
from eigenshape._text import html_repr, short_repr
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.retrieval.kinds import AnyRecipe, Descriptor, kind_of
from eigenshape.retrieval.store.change import Change
from eigenshape.retrieval.store.filters import RESERVED
from eigenshape.retrieval.store.records import Record
from eigenshape.scans.partial import view_number

LARGEST_THUMBNAIL = 8192  # bytes, so that a shape takes less than 60 KB


@dataclass(frozen=True, eq=False)
class DescribedShape:
    """A shape that is described already, to be added to an index.

    Descriptors of one recipe are views of the shape: the whole first, then what is seen of it from
    some sides. The view with the lowest score counts.

    Parameters
    ----------
    name : str
        By which the shape is found; unique in the index.
    descriptors : sequence of HeatDescriptor or PatchDescriptor
    label, source : str, optional
        Class of the shape, and where it came from.
    digest : str, optional
        Hash of its content. If the name is in the index with the same digest, the shape gains the
        recipes that it lacks, and keeps its descriptors by the others, unless it is damaged.
    tags : sequence of str
        Words by which queries may choose shapes.
    attributes : mapping
        Numbers and texts by name, by which queries may choose shapes.
    thumbnail : bytes, optional
        A picture, PNG or WebP, of at most 8,192 bytes.

    See Also
    --------
    ShapeIndex.add_many, draw_thumbnail

    Examples
    --------
    >>> import eigenshape as es
    >>> fish = es.describe(es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE)
    >>> shape = es.retrieval.DescribedShape("fish", [fish], attributes={"length": 0.4})
    >>> index = es.ShapeIndex.create(None)
    >>> index.add_many([shape])
    >>> index.query(fish, where={"length": (0, 1)})[0].name
    'fish'
    """

    name: str
    descriptors: Sequence[Descriptor]
    label: str | None = None
    source: str | None = None
    digest: str | None = None
    tags: Sequence[str] = ()
    attributes: Mapping[str, Any] = field(default_factory=dict)
    thumbnail: bytes | None = None

    __repr__ = short_repr
    _repr_html_ = html_repr


def describe_to_store(
    mesh: TriangleMesh, recipe: AnyRecipe, n_views: SupportsIndex | None = None
) -> list[Descriptor]:
    """Describe a mesh as an index keeps it: the whole, and what viewpoints see if it is closed."""
    kind = kind_of(recipe)
    count = kind.n_views if n_views is None else view_number(n_views, "n_views")
    descriptors: list[Descriptor] = kind.describe_to_store(mesh, recipe, count)
    return descriptors


def require_name(name: str) -> None:
    """Raise an error if a shape cannot have a name: in a path or an address it must say something."""
    require_text(name)
    if not name.strip() or "\0" in name:
        raise InvalidParameterError(
            f"The name of a shape must have a character that shows, and no NUL; it is {name!r}."
        )


def require_text(*texts: str | None) -> None:
    """Raise an error if a name, label, source or digest is not Unicode text."""
    for text in texts:
        if text is not None and (
            not isinstance(text, str) or text != text.encode(errors="replace").decode()
        ):
            raise InvalidParameterError(
                "Names, labels, sources and digests in an index must be Unicode text; "
                f"{text!r} is not."
            )


def facts_text(tags: Sequence[str], attributes: Mapping[str, Any]) -> tuple[str, str]:
    """Return tags and attributes as they are stored; refuse what cannot be."""
    if isinstance(tags, str):
        raise InvalidParameterError(
            f"tags must be a list of texts; it is {tags!r}. Try [{tags!r}]."
        )
    require_each(tags, str, "tags")
    require_type(attributes, Mapping, "attributes")
    for tag in tags:
        require_text(tag)
    for key, value in attributes.items():
        require_text(key)
        number = isinstance(value, int | float | np.integer | np.floating)
        if isinstance(value, bool) or not (
            isinstance(value, str) or (number and _is_finite(value))
        ):
            raise InvalidParameterError(
                f"An attribute must be a text or a finite number; {key!r} is {value!r}. Use a tag "
                "for what is true or false."
            )
        if isinstance(value, str):
            require_text(value)
        if key in RESERVED:
            raise InvalidParameterError(
                f"An attribute may have any name but {' and '.join(RESERVED)}, by which filters "
                f"choose labels and tags; one is {key!r}."
            )
    numbers = json.dumps(dict(attributes), sort_keys=True, default=np.generic.item)
    return json.dumps(sorted(set(tags))), numbers


def _is_finite(value: Any) -> bool:
    return isinstance(value, int | np.integer) or bool(np.isfinite(value))


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


def write_shape(change: Change, shape: DescribedShape, *, replace: bool) -> None:
    """Write a shape in an open change."""
    require_each(shape.descriptors, Descriptor, "descriptors")
    require_name(shape.name)
    require_text(shape.label, shape.source, shape.digest)
    facts = facts_text(shape.tags, shape.attributes)
    rows = rows_of_each(shape.name, shape.descriptors)
    number = _keep_shape(change, shape, facts, replace=replace)
    recipes = list(dict.fromkeys(descriptor.recipe for descriptor in shape.descriptors))
    for recipe in recipes:
        recipe_number = change.keep_recipe(recipe)
        known = change.is_described(number, recipe_number)
        pairs = zip(shape.descriptors, rows, strict=True)
        views = [pair for pair in pairs if pair[0].recipe == recipe]
        for view, (descriptor, each) in enumerate(views):
            columns = change.keep_columns(recipe_number, each.shape[1])
            require_columns(descriptor, each, columns)
            if known:
                continue
            details = kind_of(recipe).details(descriptor)
            at, offset, _, checksum = change.append(f"rows-{recipe_number}", each.tobytes())
            where = change.append(f"details-{recipe_number}", details)
            fields = (number, recipe_number, view)
            change.insert("descriptor", *fields, at, offset, *each.shape, checksum, *where)


def update_shape(change: Change, record: Record) -> None:
    """Write what is known of a shape anew, in an open change."""
    require_text(record.name, record.label, record.source, record.digest)
    tags, attributes = facts_text(record.tags, record.attributes)
    old = change.find_shape(record.name)
    if old is None:
        raise StoreError(
            f"A shape must be in the index to be updated; {record.name!r} is not. Add it first."
        )
    new = old._replace(
        label=record.label,
        source=record.source,
        digest=record.digest,
        tags=tags,
        attributes=attributes,
    )
    if new != old:
        change.replace("shape", new)


def _keep_shape(
    change: Change, shape: DescribedShape, facts: tuple[str, str], *, replace: bool
) -> int:
    """Return the number of a shape, which is added unless the index has the same."""
    name, digest = shape.name, shape.digest
    old = change.find_whole_shape(name, digest)
    if old is not None and old.digest is not None and old.digest == digest:
        return old.id
    if old is not None and not replace:
        raise StoreError(
            f"A name stands for one shape; {name!r} is in the index with digest {old.digest}, "
            f"not {digest}. Remove it first, or add it with replace=True."
        )
    if old is not None:
        change.delete_shape(old)
    picture = (0, 0, 0, 0)
    if shape.thumbnail is not None:
        if len(shape.thumbnail) > LARGEST_THUMBNAIL:
            raise InvalidParameterError(
                f"A thumbnail must have at most {LARGEST_THUMBNAIL} bytes; that of {name!r} has "
                f"{len(shape.thumbnail)}. Use draw_thumbnail."
            )
        picture = change.append("thumbnails", shape.thumbnail)
    return change.insert("shape", name, shape.label, shape.source, digest, *facts, *picture)
