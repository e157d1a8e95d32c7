"""Builds that are killed, and bits that are turned; benchmarks/kills.py counts many more."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

KILLS = Path(__file__).parents[2] / "benchmarks" / "kills.py"


@pytest.mark.long
@pytest.mark.parametrize("store", ["collection", "index"])
def test_kills_lose_nothing_and_turned_bits_are_named(store):
    command = [sys.executable, KILLS, "--store", store, "--kills", "6", "--flips", "12"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    kills, flips = done.stdout.splitlines()
    assert "'kills': 6" in kills
    named, equal = (re.search(rf"'{word}': (\d+)", flips) for word in ("named", "equal"))
    assert int(named[1]) + int(equal[1]) == 12
