"""A billion of anything that is counted is refused by its number, or answered at once: nothing runs on."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from laws.large_counts import counts

TESTS = Path(__file__).resolve().parents[1]


@pytest.mark.skipif(sys.platform != "linux", reason="needs fork and a limit of memory")
def test_every_public_function_refuses_a_billion_or_answers_at_once(in_turn):
    names = counts()
    assert len(names) > 100
    # In a process of its own: each call is forked from it.
    done = subprocess.run(
        [sys.executable, "-m", "laws.large_counts", *in_turn(names)],
        cwd=TESTS,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert not found["complaints"], "\n".join(
        f"{where}: {what}" for where, what in found["complaints"]
    )
