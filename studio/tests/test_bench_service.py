"""The benchmark of the service runs from end to end."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "bench_service.py"


@pytest.mark.long
@pytest.mark.sweep
def test_the_script_runs(tmp_path):
    command = [sys.executable, SCRIPT, "--quick", "--json", tmp_path / "figures.json"]
    subprocess.run(command, check=True)
    rows = json.loads((tmp_path / "figures.json").read_text())["rows"]
    found = {row["figure"]: row["value"] for row in rows}
    assert found["errors"] == 0
    assert found["exit code at the end"] == 0
    assert found["memory at the end"] > 0
