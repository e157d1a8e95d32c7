"""The benchmark of feature points runs from end to end, and the libraries find the points that we do."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_features.py"
BEGIN, END = "<!-- bench_features.py --markdown -->\n", "<!-- end -->\n"


def test_the_script_runs_and_all_methods_agree(tmp_path):
    report, page = tmp_path / "features.json", tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}old\n{END}after\n")
    command = [sys.executable, SCRIPT, "--quick", "--repeats", "1", "--json", report, "--markdown", page]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    rows = {row["method"]: row for row in json.loads(report.read_text())["rows"]}
    assert set(rows) == {"eigenshape, certified", "eigenshape", "pyFM and ToMATo", "LaPy, NumPy and ToMATo"}
    for name, row in rows.items():
        assert row["cpu"] > 0
        assert row["memory"] >= 0
        assert row["features_off"] <= 3
        assert name in done.stdout
    assert rows["eigenshape"]["true"] == 0
    assert rows["pyFM and ToMATo"]["true"] < 1e-6
    assert 0 < rows["LaPy, NumPy and ToMATo"]["true"] < 0.1
    assert page.read_text().startswith(f"before\n{BEGIN}\nMeasured ")
