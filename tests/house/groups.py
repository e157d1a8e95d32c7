"""The groups of the house, as groups.toml draws them: the files of each, what it may use, and what it uses."""

import ast
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

HOUSE = Path(__file__).resolve().parent
ROOT = HOUSE.parents[1]
GROUPS = tomllib.loads((HOUSE / "groups.toml").read_text(encoding="utf-8"))
# The short door says again what rooms say, and steps of the command line are no room for users.
NO_ROOMS = ("eigenshape", "eigenshape.cli.steps")
ROOMS_WITHOUT_STUB = ("certeig", "eigenshape.types")


class Import(NamedTuple):
    """A name that a module imports: from the module `origin`, which may be the name of a module in it."""

    module: str
    origin: str
    name: str


@cache
def group_of(path: Path, kind: str = "sources") -> str | None:
    """Return the group of a module, or of a test with kind "tests"; None if it belongs to all."""
    groups = {place: name for name, group in GROUPS.items() for place in group[kind]}
    place = path.relative_to(ROOT)
    for each in (place, *place.parents):  # the longest path first
        if each.as_posix() in groups:
            return groups[each.as_posix()]
    return None


@cache
def modules() -> dict[str, Path]:
    """Return the modules of all packages of the house, by the names that one imports."""
    found = {}
    for path in sorted([*ROOT.glob("src/**/*.py"), *ROOT.glob("*/src/**/*.py")]):
        source = next(parent for parent in path.parents if parent.name == "src")
        parts = path.relative_to(source).with_suffix("").parts
        found[".".join(parts).removesuffix(".__init__")] = path
    return found


@cache
def usable_by(group: str) -> frozenset[str]:
    """Return the group itself, and all groups below it."""
    return frozenset({group}).union(*map(usable_by, GROUPS[group]["uses"]))


def imports(module: str, path: Path) -> Iterator[Import]:
    """Yield what a module, or the stub of a room, imports from modules."""
    package = module if path.stem == "__init__" else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            above = package.rsplit(".", node.level - 1)[0] if node.level else ""
            origin = ".".join(filter(None, (above, node.module)))
            for name in node.names:
                yield Import(module, origin, name.name)


@cache
def imports_across_walls() -> list[tuple[str, str, Import]]:
    """Return what groups import from other groups, with the group that imports and the other."""
    found = []
    for module, path in modules().items():
        for each in imports(module, path):
            imported = f"{each.origin}.{each.name}"
            source = imported if imported in modules() else each.origin
            if source in modules():
                group, other = group_of(path), group_of(modules()[source])
                if group != other:
                    found.append((group, other, each))
    return found


@cache
def public_names() -> dict[str, dict[str, str]]:
    """Return the names of each room, each with the module that it comes from."""
    found = {}
    for room, path in modules().items():
        stub = path.with_suffix(".pyi")
        if room in ROOMS_WITHOUT_STUB:
            origins = {each.name: each.origin for each in imports(room, path)}
            names = import_module(room).__all__
            found[room] = {name: origins.get(name, room) for name in names}
        elif stub.exists() and room not in NO_ROOMS:
            # What comes from the room itself is a room inside it.
            found[room] = {
                each.name: each.origin for each in imports(room, stub) if each.origin != room
            }
    return found


# What every group may use: checks of arguments, arrays, matrices and meshes, vectors,
# errors, threads, kernels, files, workers, extras
TOOLKIT = (
    "certeig.kit.",
    "eigenshape.geometry.conversion.",
    "eigenshape.geometry.requirements.",
    *(
        f"eigenshape._{name}"
        for name in ("arrays", "errors", "extras", "sealed", "typing", "vectors", "workers")
    ),
)


@cache
def private_across_walls() -> list[str]:
    """Return what groups import from other groups though no room names it: both groups, module and name."""
    public = {(room, name) for room, names in public_names().items() for name in names}
    public |= {
        (origin, name) for names in public_names().values() for name, origin in names.items()
    }
    return sorted(
        {
            f"{group} {other} {each.origin}:{each.name}"
            for group, other, each in imports_across_walls()
            if (each.origin, each.name) not in public
            and not f"{each.origin}.{each.name}".startswith(TOOLKIT)
        }
    )


@cache
def arrows_against_walls() -> list[str]:
    """Return what groups import from groups that they may not use, with the module that does."""
    return sorted(
        {
            f"{group} {other} {each.module} -> {each.origin}:{each.name}"
            for group, other, each in imports_across_walls()
            if other not in usable_by(group)
        }
    )
