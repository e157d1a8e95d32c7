"""Kernels compute what the loops computed from which they were written, and do nothing undefined."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import hatch_build
import pytest

from certeig.kit import kernels

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tests" / "house" / "kernel_hashes.py"

BEYOND_THE_END = "KERNEL int64_t fault(const int64_t *values) { return values[8]; }"
OVERFLOW = "KERNEL int64_t fault(const int64_t *values) { return values[0] + 1; }"
CALL_FAULT = """
import ctypes, sys
import numpy as np
values = np.full(8, 2**63 - 1)
ctypes.CDLL(sys.argv[1]).fault(ctypes.c_void_p(values.ctypes.data))
"""


def run(*arguments, **variables):
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.long
@pytest.mark.sweep
def test_the_digits_are_those_of_before():
    if kernels.load_library(hatch_build.PACKAGES[0])[0].processor_level() < 3:
        pytest.skip("The digits are those of processors with AVX2.")
    done = run(SCRIPT)
    assert done.returncode == 0, done.stdout + done.stderr


def compile_with_zig(library, packages):
    pytest.importorskip("ziglang")
    target = hatch_build.TARGETS[hatch_build.target_name()]
    level = min(3, max(target.processors))
    hatch_build.compile_library(target, level, library, packages, options=hatch_build.UNDEFINED)
    return {kernels.VARIABLE: str(library)}


def compile_with_gcc(library, packages):
    gcc = shutil.which("gcc")
    if not gcc or sys.platform != "linux":
        pytest.skip("AddressSanitizer is that of GCC on Linux.")
    # GCC does not know the pragma of clang that lets one function fuse: other digits, same memory.
    flags = ["-std=c11", "-shared", "-fPIC", "-O1", "-g", "-fsanitize=address", "-w"]
    folders = [f"-I{folder}" for folder in (hatch_build.KIT, *packages)]
    sources = {*hatch_build.COMMON, *(path for each in packages for path in each.rglob("*.c"))}
    command = [gcc, *flags, *folders, "-o", library, *sorted(sources)]
    subprocess.run(command, check=True)
    found = subprocess.run(
        [gcc, "-print-file-name=libasan.so"], capture_output=True, text=True, check=True
    )
    return {
        kernels.VARIABLE: str(library),
        "LD_PRELOAD": found.stdout.strip(),
        "ASAN_OPTIONS": "detect_leaks=0",  # of Python itself
    }


@pytest.mark.long
@pytest.mark.sweep
@pytest.mark.parametrize(
    ("compile_with", "fault", "message"),
    [
        (compile_with_zig, OVERFLOW, "signed integer overflow: 9223372036854775807"),
        (compile_with_gcc, BEYOND_THE_END, "heap-buffer-overflow"),
    ],
)
def test_no_kernel_does_what_is_undefined(tmp_path, compile_with, fault, message):
    # A planted fault is named, ...
    source = tmp_path / "fault.c"
    source.write_text(f'#include "kernels.h"\n{fault}\n')
    variables = compile_with(tmp_path / "fault.so", [tmp_path])
    assert message in run("-c", CALL_FAULT, tmp_path / "fault.so", **variables).stderr
    # ... and kernels have none.
    done = run(SCRIPT, "--run", **compile_with(tmp_path / "kernels.so", hatch_build.PACKAGES))
    assert done.returncode == 0, done.stderr
