"""Size: what an installation takes, beside other libraries: packages, and MB on disk.

    python benchmarks/bench_size.py            seconds
    python benchmarks/bench_size.py --quick    only ours

It reads what is installed here, with no network: a library, and by its metadata all that it needs on this
system, without extras. Files .pyc, which are written later, are not counted. The third
column is the library alone, packed as a wheel packs its files. Libraries that are not installed are left out.
"""

import zlib
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from machine import ROOT
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from report import Report, Row, options_of

PACKAGES = ["eigenshape", "eigenshape-studio", "lapy", "pyvista", "libigl", "numpy", "scipy"]
COLUMNS = ("installed", "version", "alone, packed, MB", "packages", "MB in all")
# What is asked of pip for each row
INSTALLED = {
    "eigenshape": ("eigenshape",),
    "eigenshape[studio]": ("eigenshape", "eigenshape-studio"),
    "lapy": ("lapy",),
    "pyvista": ("pyvista",),
    "libigl": ("libigl",),
}
QUICK = ("eigenshape",)
# An editable installation lists none of its files, so ours are read where they are.
SOURCES = {
    "certeig": ROOT / "certeig" / "src",
    "eigenshape": ROOT / "src",
    "eigenshape-studio": ROOT / "studio" / "src",
}
MB = 1e6


def files_of(package: Distribution) -> list[Path]:
    """Return the files that a wheel brings."""
    source = SOURCES.get(canonicalize_name(package.name))
    if source:
        paths = list(source.rglob("*"))
    else:
        paths = [Path(str(package.locate_file(file))) for file in package.files or []]
    return [path for path in paths if path.is_file() and path.suffix != ".pyc"]


def all_needed(names: tuple[str, ...]) -> dict[str, Distribution]:
    """Return packages by name with all that they need, directly or not."""
    found: dict[str, Distribution] = {}
    waiting = list(names)
    while waiting:
        name = canonicalize_name(waiting.pop())
        if name in found:
            continue
        found[name] = distribution(name)
        for text in found[name].requires or []:
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                waiting.append(requirement.name)
    return found


def measure(name: str) -> Row:
    """Return the sizes of a library and of what it needs."""
    asked = INSTALLED[name]
    needed = all_needed(asked)
    packed = sum(
        len(zlib.compress(path.read_bytes()))
        for each in asked
        for path in files_of(distribution(each))
    )
    whole = sum(path.stat().st_size for each in needed.values() for path in files_of(each))
    return {
        "installed": name,
        "version": distribution(asked[0]).version,
        "packed": packed / MB,
        "packages": len(needed),
        "whole": whole / MB,
    }


def is_installed(name: str) -> bool:
    """Return whether all packages of a row are here."""
    try:
        return bool([distribution(each) for each in INSTALLED[name]])
    except PackageNotFoundError:
        return False


def cells(row: Row) -> list[str]:
    """Return a row as text."""
    sizes = [f"{row['packed']:.1f}", str(row["packages"]), f"{row['whole']:.0f}"]
    return [row["installed"], row["version"], *sizes]


def main() -> None:
    """Measure, print, and write what the options ask for."""
    options = options_of(__doc__).parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells)
    for name in QUICK if options.quick else INSTALLED:
        if is_installed(name):
            report.add(measure(name))


if __name__ == "__main__":
    main()
