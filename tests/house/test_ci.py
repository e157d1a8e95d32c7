"""CI runs what the README says, and sets nothing that a user would not have set."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_ci_sets_nothing_that_the_readme_does_not():
    readme_part = (ROOT / ".ci" / "run").read_text().split("kernel=$(")[0]
    # real shapes and a browser must be there, and the environment is a new one
    assert set(re.findall(r"^\s*export (\w+)=", readme_part, re.MULTILINE)) == {
        "EIGENSHAPE_REQUIRE_BROWSER",
        "EIGENSHAPE_REQUIRE_DATA",
        "PATH",
    }


def test_the_readme_runs_all_checks():
    commands = (ROOT / "README.md").read_text().split("```")[1]
    assert commands.rstrip().endswith("python3 check.py --all")


def test_an_unknown_option_of_check_is_refused():
    done = subprocess.run(
        [sys.executable, ROOT / "check.py", "--al"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "takes --all, --nightly or --fast; it was given --al." in done.stderr
