"""What should change nothing changes nothing: the README shows the folder's figures."""

import json
import runpy
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch3_invariance"
FULL = json.loads((FOLDER / "expected.json").read_text())["full"]


def test_the_readme_shows_the_table():
    markdown = runpy.run_path(str(FOLDER / "run.py"))["markdown"]
    assert markdown(FULL) in (FOLDER / "README.md").read_text()
    assert len(FULL) == 16
