"""Packages that are not installed with this one: those of extras, and the studio."""

from importlib import import_module
from typing import Any

from eigenshape._errors import MissingExtraError


def import_extra(name: str, install: str) -> Any:
    """Return a module that needs a further package; `install` is what pip installs.

    Raise MissingExtraError if the package, or what it needs, is not installed.
    """
    try:
        return import_module(name)
    except ImportError as err:
        missing = (err.name or name).partition(".")[0]
        raise MissingExtraError(
            f"{missing} must be installed; it is not. Run pip install {install}."
        ) from err
