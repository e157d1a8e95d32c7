"""CI runs what the README says, and sets nothing that a user would not have set."""

import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_ci_sets_nothing_that_the_readme_does_not():
    script = (ROOT / ".ci" / "run").read_text()
    # real shapes and a browser must be there, and the environment is a new one
    assert set(re.findall(r"^\s*export (\w+)=", script, re.MULTILINE)) == {
        "EIGENSHAPE_REQUIRE_BROWSER",
        "EIGENSHAPE_REQUIRE_DATA",
        "PATH",
    }


def test_the_readme_runs_the_checks_and_ci_the_rest_of_them():
    commands = (ROOT / "README.md").read_text().split("```")[1]
    assert commands.rstrip().endswith("python3 check.py")
    assert "\npython3 check.py --rest\n" in (ROOT / ".ci" / "run").read_text()


def test_no_two_test_files_have_the_same_name():
    # pytest imports them by name, and a second one of a name is an error in one process of two
    folders = [ROOT / "tests", ROOT / "studio" / "tests", ROOT / "certeig" / "tests"]
    names = Counter(path.name for folder in folders for path in folder.rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--al"], "unrecognized arguments: --al"),
        (["cor"], "invalid choice: 'cor'"),
        (["core", "--all"], "a group is checked without options"),
        (["--all", "--rest"], "argument --rest: not allowed with argument --all"),
    ],
)
def test_wrong_options_of_check_are_named(options, message):
    done = subprocess.run(
        [sys.executable, ROOT / "check.py", *options], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert message in done.stderr


def test_the_rest_is_what_the_checks_leave_of_all():
    code = """
import json, check
print(json.dumps([check.checks_of_all(mode, "site") for mode in (None, "rest", "all")]))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    quick, rest, everything = (
        {name: command for checks in parts for name, command in checks.items()}
        for parts in json.loads(done.stdout)
    )
    both, all_tests = quick | rest, everything.pop("all tests")
    quick_tests, long_tests = both.pop("tests"), both.pop("long tests")
    assert both == everything
    without_half = [each for each in all_tests if each != "--half"]
    assert all_tests.count("--half") == long_tests.count("--half") == 1
    for marks, tests in (("not long", quick_tests), ("long", long_tests)):
        at = tests.index(marks)
        assert tests[at - 1] == "-m"
        rest = tests[: at - 1] + tests[at + 1 :]
        assert [each for each in rest if each != "--half"] == without_half
