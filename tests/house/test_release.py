"""What is released says one version everywhere."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


@pytest.mark.parametrize(
    ("file", "place"),
    [
        ("studio/pyproject.toml", r'^version = "(.*)"'),
        ("studio/pyproject.toml", r'^    "eigenshape>=(.*),<2"'),
        ("pyproject.toml", r'^studio = \["eigenshape-studio>=(.*),<2"'),
        ("CITATION.cff", "^version: (.*)"),
        ("CHANGELOG.md", r"^## (.*) \("),
    ],
)
def test_every_place_says_the_version(file: str, place: str):
    said = re.search(place, (ROOT / file).read_text(), re.MULTILINE)
    assert said is not None
    assert said[1] == VERSION
