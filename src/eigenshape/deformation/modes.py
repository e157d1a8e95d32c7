"""The names of the methods that bend a region, in a light module: the command line reads it."""

from typing import Literal, cast, get_args

from certeig.kit.errors import InvalidParameterError

Mode = Literal["graded", "uncrossed", "thesis"]


def require_mode(mode: str) -> Mode:
    """Return the mode; raise an error if it is unknown."""
    if mode not in get_args(Mode):
        raise InvalidParameterError(
            f"mode must be 'graded', 'uncrossed' or 'thesis'; it is {mode!r}."
        )
    return cast(Mode, mode)
