"""What an index says of a shape beside its descriptors."""

from dataclasses import dataclass
from typing import Any

from eigenshape._text import html_repr, short_repr
from eigenshape.retrieval.kinds import AnyRecipe


@dataclass(frozen=True)
class Record:
    """What an index holds of a shape beside its descriptors.

    Attributes
    ----------
    name : str
        Unique in the index.
    label : str or None
        Class of the shape.
    source : str or None
        Where the shape came from: a path, for example.
    digest : str or None
        Hash of the content, by which `build_index` recognizes a file that it has described.
    tags : tuple of str
        Words by which shapes are chosen.
    attributes : dict
        Numbers and texts by name, by which shapes are chosen.
    recipes : tuple of HeatRecipe or PatchRecipe
        By which the shape is described.

    See Also
    --------
    ShapeIndex.records

    Examples
    --------
    >>> import eigenshape as es
    >>> index = es.ShapeIndex.create(None)
    >>> fish, recipe = es.make_creature("fish", n_vertices=500), es.retrieval.SCALE_FREE
    >>> index.add("fish 1", fish, label="fish", attributes={"length": 0.4}, recipe=recipe)
    >>> [(record.name, record.attributes) for record in index.records(where={"label": "fish"})]
    [('fish 1', {'length': 0.4})]
    """

    name: str
    label: str | None
    source: str | None
    digest: str | None
    tags: tuple[str, ...]
    attributes: dict[str, Any]
    recipes: tuple[AnyRecipe, ...]

    __repr__ = short_repr
    _repr_html_ = html_repr
