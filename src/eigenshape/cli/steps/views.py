"""From which side pictures show a shape."""

from typing import TypedDict

from eigenshape._errors import InvalidParameterError
from eigenshape.plot.camera import UP_NAMES, VIEWS, Up, View


class Side(TypedDict):
    """The two options of a picture, as figures take them."""

    view: View
    up: Up


def parse_side(view: str, up: str) -> Side:
    """Return names as they are, and three numbers separated by commas as a direction.

    Raises
    ------
    InvalidParameterError
        If one is neither.
    """
    return {
        "view": _name_or_direction(view, "--view", ("auto", *VIEWS)),
        "up": _name_or_direction(up, "--up", UP_NAMES),
    }


def _name_or_direction(text: str, option: str, names: tuple[str, ...]) -> str | list[float]:
    if text in names:
        return text
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not any(numbers):
        raise InvalidParameterError(
            f"{option} takes {', '.join(names)}, or a direction as three numbers separated by "
            f"commas, such as 1,0,2; it is {text!r}."
        )
    return numbers
