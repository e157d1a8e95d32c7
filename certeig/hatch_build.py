"""Compile kernels with the C compiler of the wheel `ziglang`, so that pip alone installs a package.

The build hook of certeig and of eigenshape. `pip install` runs it for wheels and for editable
installs; `python certeig/hatch_build.py` compiles the kernels of both anew, in place, for this
processor, which takes `pip install ziglang`. CERTEIG_TARGET builds a wheel for another platform, one
of TARGETS; zig compiles for all of them on any.
"""

import ctypes
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
PACKAGES = HERE / "src" / "certeig", HERE.parent / "src" / "eigenshape"
# What every library holds: the level of the processor, and what Windows asks for
KIT = HERE / "src" / "certeig" / "kit"
COMMON = KIT / "processor.c", KIT / "windows.c"
FOLDER = "_libraries"
LIBRARY = "kernels-{}.so"  # of a level of processors, whatever such files are called elsewhere
VARIABLE = "CERTEIG_TARGET"

try:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface
except ImportError:  # run by hand
    BuildHookInterface = object


class Target(NamedTuple):
    """A platform: its name for zig, that of its wheels, and its processors by level."""

    zig: str
    wheel: str
    processors: dict[int, str]


X86 = {level: f"x86_64_v{level}" for level in (2, 3, 4)}
ARM = {0: "generic"}
# Kernels call no library, so that one wheel serves every Linux.
LINUX = "manylinux_2_17_{0}.manylinux2014_{0}.musllinux_1_1_{0}"
TARGETS = {
    "linux-x86_64": Target("x86_64-linux-gnu", LINUX.format("x86_64"), X86),
    "linux-aarch64": Target("aarch64-linux-gnu", LINUX.format("aarch64"), ARM),
    "macosx-x86_64": Target("x86_64-macos.10.13", "macosx_10_13_x86_64", {2: X86[2], 3: X86[3]}),
    "macosx-arm64": Target("aarch64-macos.11.0", "macosx_11_0_arm64", {0: "apple_m1"}),
    "win-amd64": Target("x86_64-windows-gnu", "win_amd64", X86),
    "win-arm64": Target("aarch64-windows-gnu", "win_arm64", ARM),
}
WARNINGS = ["-Wall", "-Wextra", "-Werror"]
FLAGS = [
    *["-std=c11", "-shared", "-fPIC", "-fvisibility=hidden", *WARNINGS],
    "-fno-math-errno",  # otherwise roots of negative numbers call the library
    "-ffp-contract=off",  # the same digits from any compiler; lanes.h says where it may fuse
]
RELEASE = [
    *["-O3", "-s"],
    "-fno-sanitize=undefined",  # which zig turns on by itself
    "-nostdlib",  # otherwise zig builds parts of the C library first, for eight seconds
    # A larger frame calls that library on Windows, so that no kernel may have one anywhere.
    "-Wframe-larger-than=3967",  # bytes: a page, less the 128 below the stack that Linux may use
]
# With checks that end the process, and name the line
UNDEFINED = [
    *["-O1", "-g", "-fsanitize=undefined"],
    *["-fno-sanitize-trap=all", "-fno-sanitize-recover=all"],
]


class KernelBuildHook(BuildHookInterface):  # type: ignore[misc, valid-type]
    """Compile the kernels before the files of the package are gathered."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and give the wheel the name of its platform, for any Python 3."""
        if self.target_name != "wheel":
            return
        self.folder = tempfile.TemporaryDirectory()
        # zig keeps results in the home otherwise, which cannot be written to in some containers.
        for name in ("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"):
            os.environ.setdefault(name, self.folder.name)
        package = Path(self.root) / "src" / self.config["package"]
        if version == "editable":
            build_in_place(package)
            return
        target = TARGETS[target_name()]
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{target.wheel}"
        for level in target.processors:
            library = Path(self.folder.name) / LIBRARY.format(level)
            compile_library(target, level, library, [package])
            build_data["force_include"][str(library)] = f"{package.name}/{FOLDER}/{library.name}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what is in the wheel now."""
        if hasattr(self, "folder"):
            self.folder.cleanup()


def target_name() -> str:
    """Return the name of the platform to build for: this one, if none is asked for."""
    name = os.environ.get(VARIABLE) or sysconfig.get_platform()
    if name.startswith("macosx") and name not in TARGETS:
        name = f"macosx-{platform.machine()}"
    if name not in TARGETS:
        raise SystemExit(f"{VARIABLE} must be one of {', '.join(TARGETS)}; it is {name}.")
    return name


def build_in_place(package: Path) -> None:
    """Compile a library of a package for this processor alone, beside the sources."""
    target = TARGETS[target_name()]
    lowest = min(target.processors)
    with tempfile.TemporaryDirectory() as folder:
        small = Path(folder) / LIBRARY.format(lowest)
        compile_library(target, lowest, small, [])
        level = ctypes.CDLL(str(small)).processor_level()
    libraries = package / FOLDER
    libraries.mkdir(exist_ok=True)
    for library in libraries.iterdir():
        library.unlink()
    compile_library(target, level, libraries / LIBRARY.format(level), [package])


def compile_library(
    target: Target,
    level: int,
    library: Path,
    packages: Sequence[Path],
    *,
    options: Sequence[str] = RELEASE,
) -> None:
    """Compile one library of the kernels of some packages."""
    flags = [*FLAGS, *options, "-target", target.zig, f"-mcpu={target.processors[level]}"]
    if "macos" in target.zig:  # otherwise the library names the folder in which it was linked
        flags.append(f"-Wl,-install_name,{library.name}")
    folders = [f"-I{folder}" for folder in (KIT, *packages)]
    command = [sys.executable, "-m", "ziglang", "cc", *flags, *folders, "-o"]
    kernels = sorted({*COMMON, *(path for package in packages for path in package.rglob("*.c"))})
    if not find_spec("ziglang"):
        raise SystemExit(
            "To compile the kernels takes ziglang, a C compiler, which is not installed. "
            "`pip install -e .` compiles by itself; `pip install -e '.[test]'` also installs ziglang."
        )
    # On Windows the linker leaves other files beside its result.
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / library.name
        if subprocess.run([*command, made, *kernels], check=False).returncode:
            raise SystemExit(
                "The kernels cannot be compiled; see the messages of the compiler above."
            )
        shutil.move(made, library)


if __name__ == "__main__":
    for package in PACKAGES:
        build_in_place(package)
