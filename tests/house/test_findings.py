"""The scripts of findings/ have the form that CONTRIBUTING.md gives. None of them is run here."""

import re
from pathlib import Path

import pytest

FINDINGS = Path(__file__).resolve().parents[2] / "findings"
SCRIPTS = sorted(FINDINGS.glob("*.sh"))
FIELDS = ["Guess", "Behavior", "Output", "Matters", "Versions", "Source"]
# What runs lives in a folder of its own, which is gone afterwards.
HEAD = """\
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
"""
N_LINES = 60


def notes_of(text: str) -> dict[str, str]:
    """Return the fields of the comments at the top of a script, in their order."""
    comments = re.match(r"#!/usr/bin/env bash\n((?:# .*\n)+)", text)
    assert comments is not None
    fields = re.split(r"^# (\w+): ", comments[1], flags=re.MULTILINE)
    return dict(zip(fields[1::2], fields[2::2], strict=True))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_finding_says_what_it_found(script: Path):
    text = script.read_text()
    assert list(notes_of(text)) == FIELDS
    assert text.count("\n") <= N_LINES
    assert "eigenshape" not in text


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_finding_installs_the_versions_that_it_names_in_a_temporary_folder(script: Path):
    text = script.read_text()
    assert HEAD in text
    installed = re.findall(
        r"^(?:env/bin/pip install --quiet|npm install --silent) (.*)", text, re.M
    )
    packages = " ".join(installed).split()
    assert packages
    versions = notes_of(text)["Versions"]
    for package in packages:
        name_and_version = re.fullmatch(r"[\w-]+(?:==|@)([\w.]+)", package)
        assert name_and_version is not None, package
        assert name_and_version[1] in versions


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_finding_fails_if_the_behavior_changes(script: Path):
    assert re.search(r"^\s*assert |process\.exit\(1\)", script.read_text(), re.MULTILINE)


def test_the_table_of_findings_names_each_script_once():
    rows = re.findall(r"^\| `(\w+\.sh)` \|", (FINDINGS / "README.md").read_text(), re.MULTILINE)
    assert rows == [script.name for script in SCRIPTS]
