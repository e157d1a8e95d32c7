"""What tests of experiments share: an experiment's quick form run again, and tables of changes over seeds."""

import json
import subprocess
import sys

import numpy as np
import pytest

CELL = "{mean:.4f} ({least:.4f} to {most:.4f})"


def run_quickly(folder, tmp_path):
    """Run an experiment in its quick form, and return what it writes."""
    out = tmp_path / "results.json"
    subprocess.run([sys.executable, folder / "run.py", "--quick", "--out", out], check=True, capture_output=True)
    return json.loads(out.read_text())


def require_equal(found, expected, *, rel=2e-3, abs=1e-6):
    """Compare all numbers and words of two nested tables."""
    one, two = flat(found), flat(expected)
    assert one.keys() == two.keys()
    for name, value in two.items():
        assert one[name] == (value if isinstance(value, str) else pytest.approx(value, rel=rel, abs=abs)), name


def flat(value, path=""):
    """Return each number of a nested table by its path."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return {name: x for key, item in items for name, x in flat(item, f"{path}/{key}").items()}
    return {path: value}


def change_rows(samples):
    """Return the README's row of each variant: mean, least and most of the largest change, a column a run."""
    names = dict.fromkeys(name for run in samples.values() for name in run)
    for name in names:
        rows = [run.get(name) for run in samples.values()]
        yield f"| {name} | " + " | ".join(CELL.format(**row["largest"]) if row else "" for row in rows) + " |"


def largest(rows, part="mean"):
    """Return the largest change of each variant, the floor left out."""
    return np.array([row["largest"][part] for name, row in rows.items() if name != "M again"])
