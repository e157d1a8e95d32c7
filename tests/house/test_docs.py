"""What the docs mention is there, and all that is public is mentioned."""

import re
from operator import attrgetter
from pathlib import Path

import pytest

import eigenshape as es

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "coming_from").glob("*.md")),
    *sorted((ROOT / "experiments").rglob("*.md")),
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_names_in_docs_are_there(page):
    for name in set(re.findall(r"\bes\.((?:\w+\.)*\w+)", page.read_text())):
        attrgetter(name)(es)
