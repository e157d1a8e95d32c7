"""How long work reports how far it has come."""

from collections.abc import Callable

# Called with the fraction done, in 0..1, and a short message.
Progress = Callable[[float, str], None]


def silent(fraction: float, message: str) -> None:
    """Report to nobody."""
