"""Types in docstrings lead to their pages: ours, and pages of other libraries without asking their sites."""

import inspect
import re
import zlib
from functools import cache
from pathlib import Path

import eigenshape as es

# Classes of other libraries that docstrings name, and their pages. The build asks no network, so these
# few lines take the place of the lists that intersphinx would load.
SITES = {
    "numpy": (
        "https://numpy.org/doc/stable/",
        {
            "numpy.dtype": "reference/generated/numpy.dtype.html",
            "numpy.random.Generator": "reference/random/generator.html",
        },
    ),
    "matplotlib": (
        "https://matplotlib.org/stable/",
        {"matplotlib.figure.Figure": "api/_as_gen/matplotlib.figure.Figure.html"},
    ),
}
RETURNED = re.compile(r"(?<![\w*])\*([\w.]+)\*(?= --|$)")  # as napoleon writes the type of a result


def write_inventories(folder: Path) -> dict[str, tuple[str, str]]:
    """Write the lists of `SITES` as Sphinx keeps them; return the setting `intersphinx_mapping`."""
    folder.mkdir(parents=True, exist_ok=True)
    mapping = {}
    for project, (site, pages) in SITES.items():
        lines = [f"{name} py:class 1 {page}#$ -\n" for name, page in pages.items()]
        head = f"# Sphinx inventory version 2\n# Project: {project}\n# Version: stable\n"
        head += "# The remainder of this file is compressed using zlib.\n"
        path = folder / f"{project}.inv"
        path.write_bytes(head.encode() + zlib.compress("".join(lines).encode()))
        mapping[project] = (site, str(path))
    return mapping


@cache
def pages_of_classes() -> dict[str, str]:
    """Return the full name of each class that a docstring may name."""
    found = {name: name for _, pages in SITES.values() for name in pages}
    rooms = {f"eigenshape.{name}": getattr(es, name) for name in es.__all__}
    for full, room in rooms.items():
        if inspect.ismodule(room):
            things = {name: getattr(room, name) for name in room.__all__}
            found |= {name: f"{full}.{name}" for name in things if inspect.isclass(things[name])}
    return found


def link_returned_types(
    _app: object, _what: str, _name: str, _thing: object, _options: object, lines: list[str]
) -> None:
    """Let the type of a result lead to its page; Sphinx does so for parameters alone."""

    def link(found: re.Match[str]) -> str:
        full = pages_of_classes().get(found[1])
        return f":py:class:`{found[1]} <{full}>`" if full else found[0]

    for number, line in enumerate(lines):
        lines[number] = RETURNED.sub(link, line)
