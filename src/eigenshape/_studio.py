"""The door to the studio, a package of its own."""

from importlib import import_module
from types import ModuleType

from eigenshape._errors import MissingExtraError


def studio_module(name: str) -> ModuleType:
    """Return a module of the studio.

    Raise MissingExtraError if the studio, or what this module needs, is not installed.
    """
    try:
        return import_module(f"eigenshape_studio.{name}")
    except ImportError as err:
        extra = "'eigenshape-studio[notebook]'" if name == "widget" else "eigenshape-studio"
        missing = str(err.name).partition(".")[0]
        raise MissingExtraError(
            f"{missing} must be installed; it is not. Run pip install {extra}."
        ) from err
