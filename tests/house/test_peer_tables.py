"""The tables for people who come from other libraries name every public function of these."""

import inspect
import pkgutil
import re
from importlib import import_module
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs" / "coming_from"
# Modules of command lines and of reports on the machine, which are no functions of shapes.
NO_SHAPES = {"lapy.commands", "lapy.utils", "brainprint.cli", "brainprint.commands"}


def public_names(package: str) -> set[str]:
    """Return the names of public functions, and of public methods of public classes."""
    root = import_module(package)
    modules = [root] + [
        import_module(f"{package}.{found.name}")
        for found in pkgutil.iter_modules(root.__path__)
        if not found.name.startswith("_") and f"{package}.{found.name}" not in NO_SHAPES
    ]
    names: set[str] = set()
    for module in modules:
        for name, value in vars(module).items():
            if name.startswith("_") or not getattr(value, "__module__", "").startswith(package):
                continue
            if inspect.isfunction(value):
                names.add(name)
            elif inspect.isclass(value):
                members = {member for member in vars(value) if not member.startswith("_")}
                names |= {name} | {
                    member
                    for member in members
                    if callable(getattr(value, member)) or isinstance(vars(value)[member], property)
                }
    return names - {"sys_info", "EigenData"}  # no function of shapes


def named_in(page: str) -> set[str]:
    """Return all words of code that stand in the first column of the tables of a page."""
    rows = re.findall(r"^\| *(.*?) \| ", (DOCS / page).read_text(), re.MULTILINE)
    code = " ".join(text for row in rows for text in re.findall(r"`([^`]*)`", row))
    return set(re.findall(r"\w+", code))


@pytest.mark.parametrize(
    ("package", "page"),
    [
        ("lapy", "lapy.md"),
        ("neuromodes", "neuromodes.md"),
        ("brainprint", "brainprint.md"),
        ("potpourri3d", "potpourri3d.md"),
        ("robust_laplacian", "potpourri3d.md"),
    ],
)
def test_every_public_function_stands_in_the_table(package, page):
    pytest.importorskip(package)
    names = public_names(package)
    assert len(names) > 1
    assert sorted(names - named_in(page)) == []


def test_every_section_of_the_tutorial_stands_in_the_table():
    rows = re.findall(r"^\| *(\d{3}) ", (DOCS / "libigl.md").read_text(), re.MULTILINE)
    assert {*range(201, 208), *range(501, 512)} <= {int(number) for number in rows}
