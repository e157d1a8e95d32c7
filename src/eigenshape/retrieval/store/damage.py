"""What is damaged in an index, by name."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

from certeig.kit.text import Shown, printable
from eigenshape._sealed import StoreWarning

__all__ = ["Damage", "StoreWarning", "warn_of_damage"]  # the warning for the room, as it is
MOST_NAMED = 3  # damages that a warning names; `ShapeIndex.verify` lists all


@dataclass(frozen=True)
class Damage(Shown):
    """A place of an index that does not hold what was written.

    Attributes
    ----------
    file : str
        Name of the file, in the folder of the index.
    what : str
        What differs.
    shape : str or None
        Name of the shape that is concerned, if it is known.

    See Also
    --------
    ShapeIndex.verify

    Examples
    --------
    >>> import eigenshape as es
    >>> print(es.retrieval.Damage("index.sqlite", "its rows differ", "cat"))
    index.sqlite, shape 'cat': its rows differ
    """

    file: str
    what: str
    shape: str | None = None

    def __str__(self) -> str:
        place = printable(self.file)
        if self.shape is not None:
            place += f", shape {self.shape!r}"
        return f"{place}: {self.what}"


def warn_of_damage(place: str, damages: Sequence[Damage]) -> None:
    """Warn of what is damaged, and say that the rest is served."""
    if not damages:
        return
    named = "; ".join(map(str, damages[:MOST_NAMED]))
    more = f"; and {len(damages) - MOST_NAMED} more" if len(damages) > MOST_NAMED else ""
    warnings.warn(
        f"{place} must hold what was written; {named}{more}. The rest is served. "
        "ShapeIndex.verify lists all damage; index the named shapes again.",
        StoreWarning,
        stacklevel=4,
    )
