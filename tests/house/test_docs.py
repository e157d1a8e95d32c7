"""What the docs mention is there, and all that is public is mentioned."""

import re
from operator import attrgetter
from pathlib import Path

import pytest
from public_names import public_things

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


def test_every_public_name_is_mentioned_beside_the_api_pages():
    files = [*PAGES, *(ROOT / "examples").rglob("*.py"), *(ROOT / "experiments").rglob("*.py")]
    words = {word for path in files for word in re.findall(r"\w+", path.read_text())}
    assert not sorted(public_things().keys() - words)
