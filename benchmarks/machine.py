"""What a benchmark ran on, and what it took: the name of the machine, its libraries, and the memory of a process."""

import os
import platform
import re
import resource
import shlex
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_info

import certeig
from certeig.kit.kernels import load_library

ROOT = Path(__file__).resolve().parents[1]
STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def describe(packages: list[str]) -> dict[str, object]:
    """Name the processor, cores, memory, load, BLAS, kernels, and the versions of these packages."""
    np.ones((2, 2)) @ np.ones((2, 2))  # a BLAS is listed once it is loaded
    _, library = load_library(Path(certeig.__file__).parent)
    level = f"level {library.stem.rpartition('-')[2]}"  # of processors, as in kernels-3.so
    return {
        "cpu": _field("/proc/cpuinfo", r"model name\s*:\s*(.+)")
        or platform.processor()
        or platform.machine(),
        "cores": os.cpu_count(),
        "memory_gib": round(int(_field("/proc/meminfo", r"MemTotal:\s*(\d+)") or 0) / 2**20, 1),
        "load": [round(load, 2) for load in os.getloadavg()],
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
        "blas": sorted({f"{pool['internal_api']} {pool['version']}" for pool in threadpool_info()}),
        "versions": {package: _version(package) for package in packages} | {"kernels": level},
    }


def command(output: str) -> str:
    """Return the command that runs, without options for places of this machine: output and absolute paths."""
    program, *words = sys.argv
    kept: list[str] = []
    for word in words:
        option = kept[-1] if kept else ""
        if option == output or (option.startswith("--") and Path(word).is_absolute()):
            kept.pop()
        else:
            kept.append(word)
    return shlex.join(["python", Path(program).resolve().relative_to(ROOT).as_posix(), *kept])


def commit() -> str:
    """Name the commit whose code runs; "and changes" if files of the library differ from it."""
    try:
        head, changed = (
            subprocess.run(
                ["git", *words], cwd=ROOT, capture_output=True, text=True, check=True
            ).stdout.strip()
            for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--", "src", "studio"])
        )
    except (OSError, subprocess.CalledProcessError):
        return "not known"
    return f"{head[:12]} and changes" if changed else head[:12]


def _field(path: str, pattern: str) -> str:
    try:
        found = re.search(pattern, Path(path).read_text())
    except OSError:
        return ""
    return found.group(1).strip() if found else ""


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def memory_now() -> float:
    """Return the memory that this process holds, in MiB, and start its peak from there."""
    try:
        CLEAR.write_text("5")
    except OSError:
        return peak_memory()
    return int(_field(str(STATUS), r"VmRSS:\s*(\d+)")) / 2**10


def peak_memory() -> float:
    """Return the most that this process has held since `memory_now`, or since its start where that cannot be told."""
    peak = _field(str(STATUS), r"VmHWM:\s*(\d+)")
    return int(peak or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 2**10


def own_memory() -> float:
    """Return the memory that this process holds without pages of files, in MiB."""
    return int(_field(str(STATUS), r"RssAnon:\s*(\d+)") or 0) / 2**10


def file_memory() -> float:
    """Return the pages of files that this process has mapped and that are in memory, in MiB."""
    return int(_field(str(STATUS), r"RssFile:\s*(\d+)") or 0) / 2**10
