"""Benchmarks as a user starts them."""

import json
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


SCRIPTS = sorted(path.name for path in BENCHMARKS.glob("bench_*.py"))


@pytest.fixture
def run_quick(tmp_path, in_turn):
    """Run a script on something small; return its rows, what it printed, and the table that a page would show."""
    chosen = in_turn(SCRIPTS)

    def run(script, *options):
        if script not in chosen:
            pytest.skip("This benchmark has another turn.")
        report = tmp_path / "report.json"
        command = [sys.executable, BENCHMARKS / script, "--quick", "--repeats", "1", *options]
        done = subprocess.run(
            [*command, "--json", report], capture_output=True, text=True, check=True
        )
        figures = json.loads(report.read_text())
        assert figures["machine"]["versions"]["numpy"]
        assert figures["command"].startswith(f"python benchmarks/{script} --quick")
        assert "--json" not in figures["command"]
        text = runpy.run_path(str(BENCHMARKS / "figures.py"))["table"](
            figures["columns"], figures["table"]
        )
        return figures["rows"], done.stdout, text

    return run
