"""The names that options of operators take. The command line reads them, so this module is light."""

from typing import Any, Literal, get_args

from eigenshape._errors import InvalidParameterError

Mass = Literal["lumped", "consistent", "averaged"]  # mass matrix of linear elements
Condition = Literal["neumann", "dirichlet"]  # at the boundary
Correction = Literal["log"]  # of the bias of a kernel
Form = Literal["literal", "random-walk"]  # mass matrix of a kernel operator
Distance = Literal["euclidean", "geodesic"]  # in a kernel


def require_choice(value: object, choice: Any, name: str) -> None:
    """Raise an error if an option is none of its names."""
    *names, last = get_args(choice)
    if value not in (*names, last):
        listed = "', '".join(names)
        raise InvalidParameterError(f"{name} must be '{listed}' or '{last}'; it is {value!r}.")
