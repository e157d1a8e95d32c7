"""What an index knows of a shape beside its descriptors: as users see it, and as it is stored."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, NamedTuple

import numpy as np

from certeig.kit.arguments import require_each, require_type, require_unicode
from certeig.kit.errors import InvalidParameterError
from certeig.kit.text import Shown

RESERVED = ("label", "tag")  # keys of a filter that are no attributes; their values are texts


@dataclass(frozen=True)
class ShapeFacts(Shown):
    """The name of a shape, where it came from, and by what queries choose it."""

    name: str
    _: KW_ONLY
    label: str | None = None
    source: str | None = None
    digest: str | None = None
    tags: Sequence[str] = ()
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def as_row(self) -> "ShapeRow":
        """Return these facts as they are stored; refuse what cannot be."""
        texts = (self.name, self.label, self.source, self.digest)
        require_name(self.name)
        for text in texts:
            _require_text(text)
        if isinstance(self.tags, str):
            raise InvalidParameterError(
                f"tags must be a list of texts; it is {self.tags!r}. Try [{self.tags!r}]."
            )
        require_each(self.tags, str, "tags")
        for tag in self.tags:
            _require_text(tag)
        require_type(self.attributes, Mapping, "attributes")
        for key, value in self.attributes.items():
            _require_attribute(key, value)
        tags = json.dumps(sorted(set(self.tags)))
        numbers = json.dumps(dict(self.attributes), sort_keys=True, default=np.generic.item)
        return ShapeRow(0, *texts, tags, numbers)


class ShapeRow(NamedTuple):
    """A row of the table `shape`; tags and attributes are JSON.

    By the numbers of its descriptors and pictures, of which there is one or none, it is noticed if a
    row of these is lost.
    """

    id: int
    name: str
    label: str | None
    source: str | None
    digest: str | None
    tags: str
    attributes: str
    n_descriptors: int = 0
    n_pictures: int = 0

    def tags_and_attributes(self) -> tuple[tuple[str, ...], dict[str, Any]]:
        """Return the tags and the attributes."""
        return tuple(json.loads(self.tags)), json.loads(self.attributes)

    def as_facts(self) -> dict[str, Any]:
        """Return what is known of the shape, as `ShapeFacts` takes it."""
        known = (*self[1:5], *self.tags_and_attributes())
        return dict(zip(self._fields[1:7], known, strict=True))


def require_name(name: str) -> None:
    """Raise an error if a shape cannot have a name: in a path or an address it must say something."""
    _require_text(name)
    if not (name or "").strip() or "\0" in name:
        raise InvalidParameterError(
            f"The name of a shape must have a character that shows, and no NUL; it is {name!r}."
        )


def _require_text(text: str | None) -> None:
    if text is not None:
        require_unicode(text, "Names, labels, sources and digests in an index")


def _require_attribute(key: str, value: Any) -> None:
    _require_text(key)
    is_whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    is_finite = isinstance(value, float | np.floating) and bool(np.isfinite(value))
    if not (isinstance(value, str) or is_whole or is_finite):
        raise InvalidParameterError(
            f"An attribute must be a text or a finite number; {key!r} is {value!r}. Use a tag "
            "for what is true or false."
        )
    if isinstance(value, str):
        _require_text(value)
    if key in RESERVED:
        raise InvalidParameterError(
            f"An attribute may have any name but {' and '.join(RESERVED)}, by which filters "
            f"choose labels and tags; one is {key!r}."
        )
