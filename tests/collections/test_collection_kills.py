"""Builds that are killed, and bits that are turned; benchmarks/kills.py counts many more."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

KILLS = Path(__file__).parents[2] / "benchmarks" / "kills.py"


@pytest.mark.sweep
@pytest.mark.long
@pytest.mark.parametrize("store", ["collection", "index"])
def test_kills_lose_nothing_and_turned_bits_are_named(store):
    command = [sys.executable, KILLS, "--store", store, "--kills", "6", "--flips", "12"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    kills, flips = done.stdout.splitlines()
    assert "'kills': 6" in kills
    # None is silent or bare; of few bits in spare pages, all may change nothing.
    assert sum(map(int, re.findall(r"'(?:named|equal)': (\d+)", flips))) == 12
