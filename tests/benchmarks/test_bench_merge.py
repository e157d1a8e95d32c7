"""The benchmark of region merging runs from end to end, and GUDHI finds the pairs that we do."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_merge.py"
BEGIN, END = "<!-- bench_merge.py --markdown -->\n", "<!-- end -->\n"


def test_the_script_runs_and_all_methods_agree(tmp_path):
    report, page = tmp_path / "merge.json", tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}old\n{END}after\n")
    command = [sys.executable, SCRIPT, "--quick", "--repeats", "1", "--json", report, "--markdown", page]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = json.loads(report.read_text())["rows"]
    assert [row["function"] for row in rows] == ["waves"] * 4 + ["noise"] * 4
    assert {row["method"] for row in rows if row["equals_ours"]} == {"GUDHI, whole mesh"}
    for row in rows:
        assert row["n"] == 588
        assert row["cpu"] > 0
        assert row["wall"] > 0
        assert row["memory"] >= 0
        assert row["maxima"] == rows[4 * (row["function"] == "noise")]["maxima"]
        assert row["method"] in done.stdout
    text = page.read_text()
    assert text.startswith(f"before\n{BEGIN}\nMeasured ")
    assert text.endswith(f"\n{END}after\n")
    assert "| 588 | waves | GUDHI, whole mesh (same pairs) |" in text
