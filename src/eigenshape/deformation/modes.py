"""The names of the methods that bend a region, in a light module: the command line reads it."""

from typing import Literal, cast

from certeig.kit.arguments import require_choice

Mode = Literal["graded", "uncrossed", "thesis"]


def require_mode(mode: str) -> Mode:
    """Return the mode; raise an error if it is unknown."""
    require_choice(mode, Mode, "mode")
    return cast(Mode, mode)
