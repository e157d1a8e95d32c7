"""The benchmark of the studio runs from end to end."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "bench_studio.py"


@pytest.mark.long
@pytest.mark.sweep
def test_the_script_runs(tmp_path):
    command = [sys.executable, SCRIPT, "--quick", "--only", "drag", "--repeats", "1"]
    subprocess.run([*command, "--json", tmp_path / "figures.json"], check=True)
    rows = json.loads((tmp_path / "figures.json").read_text())["rows"]
    found = {row["figure"]: row["value"] for row in rows}
    assert found["calls while the pointer moves"] == 0
    assert found["CPU of a shown frame"] > 0
    assert 0 < found["region chosen to ready to drag"] < 60
    # It waits 0.08 s for the pointer to rest.
    assert found["exact result, after the last motion"] > 0.08
