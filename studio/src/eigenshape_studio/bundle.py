"""The page's module, which is built when the package is installed."""

from functools import cache
from pathlib import Path

STATIC = Path(__file__).parent / "static"
BUNDLE = "studio.js"


class NotBuiltError(RuntimeError):
    """The page of the studio is not there."""


def read_static(name: str) -> bytes:
    """Return a file of the page.

    Raises
    ------
    NotBuiltError
        If the page is not built.
    """
    path = STATIC / name
    if not path.exists():
        raise NotBuiltError(
            f"The page of the studio must be built; {path} does not exist. Install the package "
            "with pip, which builds it, or run `python hatch_build.py` in its folder."
        )
    return path.read_bytes()


@cache
def bundle_text() -> str:
    """Return the page's module as text; raise NotBuiltError if there is none."""
    return read_static(BUNDLE).decode()
