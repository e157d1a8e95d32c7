"""What a query asks for beside the shape, as one value."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Int

from certeig.kit.arrays import whole_number
from certeig.kit.errors import InvalidParameterError
from certeig.kit.typing import Integer
from eigenshape.retrieval.store.filters import choose_shapes
from eigenshape.retrieval.store.state import IndexState

MOST_MATCHES = 2**30  # no index holds as many shapes


@dataclass(frozen=True)
class QueryOptions:
    """How many matches a query wants, of which shapes, and how they are compared.

    Attributes
    ----------
    n_matches, where, without, exact
        As of `ShapeIndex.query`.
    is_scaled : bool
        Whether scores are corrected for hubness; otherwise they depend on the two shapes alone.
    must_know : bool
        Whether a condition about an attribute that no shape has is an error.
    """

    n_matches: Integer = 5
    where: Mapping[str, Any] | None = None
    without: str | None = None
    exact: bool = False
    is_scaled: bool = True
    must_know: bool = True

    def __post_init__(self) -> None:
        whole_number(self.n_matches, "n_matches", 1, MOST_MATCHES)

    def choose(self, state: IndexState) -> "Choice":
        """Return which shapes of an index may be found; refuse what it does not know."""
        ids = choose_shapes(state, self.where, must_know=self.must_know)
        if self.without is None:
            return Choice(ids)
        row = state.find(self.without)
        if row is None:
            raise InvalidParameterError(
                f"without must be the name of a shape of the index; {self.without!r} is none. "
                "`records` lists them."
            )
        return Choice(ids, row.id)


@dataclass(frozen=True)
class Choice:
    """Which shapes of an index may be found: those with some numbers, or all, but for one."""

    ids: Int[np.ndarray, " k"] | None = None
    left_out: int = -1

    def allowed(self, shapes: Int[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
        """Return which of some shapes may be found."""
        found = shapes != self.left_out
        return found if self.ids is None else found & np.isin(shapes, self.ids)
