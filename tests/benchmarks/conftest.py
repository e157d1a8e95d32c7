"""Benchmarks as a user starts them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
PAGE = "before\n<!-- {0} --markdown -->\nold\n<!-- end -->\nbetween\n<!-- other -->\n<!-- end -->\nafter\n"


@pytest.fixture
def run_quick(tmp_path):
    """Run a script on something small; return its rows, what it printed, and a page with its table between marks."""

    def run(script, *options):
        report, page = tmp_path / "report.json", tmp_path / "page.md"
        page.write_text(PAGE.format(script))
        command = [sys.executable, BENCHMARKS / script, "--quick", "--repeats", "1", *options]
        more = ["--json", report, "--markdown", page]
        done = subprocess.run([*command, *more], capture_output=True, text=True, check=True)
        figures, text = json.loads(report.read_text()), page.read_text()
        assert figures["machine"]["versions"]["numpy"]
        assert text.startswith(f"before\n<!-- {script} --markdown -->\n\nMeasured ")
        assert text.endswith("\n<!-- end -->\nbetween\n<!-- other -->\n<!-- end -->\nafter\n")
        return figures["rows"], done.stdout, text

    return run
