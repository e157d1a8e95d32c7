"""The benchmark of approximate spectra runs from end to end, and its figures hold together."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_approximate.py"


def test_the_quick_case_has_an_exact_row_and_one_for_each_accuracy(tmp_path):
    report = tmp_path / "report.json"
    command = [sys.executable, SCRIPT, "--quick", "--accuracies", "0.1", "1e-4", "--json", report]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.count("| icosphere, n = 2,562, k = 20 |") == 3
    found = json.loads(report.read_text())
    assert found["machine"]["versions"]["numpy"]
    exact, *rough = found["rows"]
    assert exact["complete"]
    assert exact["true"] == 0.0
    assert [row["accuracy"] for row in rough] == [0.1, 1e-4]
    for row in rough:
        assert not row["complete"]
        assert row["true"] <= row["estimated"] <= row["accuracy"]
        assert row["true"] <= row["bound"]
        assert row["cpu"] > 0
