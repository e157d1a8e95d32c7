"""How long work reports how far it has come."""

from collections.abc import Callable

from typing_extensions import TypeAliasType

# Called with the fraction done, in 0..1, and a short message. `help` shows the name.
Progress = TypeAliasType("Progress", Callable[[float, str], None])
# Called after each file of a batch: how many are done, of how many, the name, and the error if any.
Callback = TypeAliasType("Callback", Callable[[int, int, str, str | None], None])


def silent(fraction: float, message: str) -> None:
    """Report to nobody."""


def ignore(n_done: int, n_items: int, name: str, error: str | None) -> None:
    """Do nothing after a file of a batch."""
