"""The README's commands and pictures, and the form of the gallery, which the docs build runs."""

import ast
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "gallery").glob("*/*.py"))


def test_readme_begins_with_exactly_two_commands():
    blocks = (ROOT / "README.md").read_text().split("```")
    commands = blocks[1].splitlines()[1:]
    assert len([line for line in commands if line.strip()]) == 2


@pytest.mark.long
@pytest.mark.sweep
def test_the_pictures_of_the_front_page_can_be_drawn(tmp_path):
    drawn = runpy.run_path(str(ROOT / "docs" / "front_page.py"))["main"](tmp_path, n_vertices=800)
    pages = (ROOT / "README.md").read_text() + (ROOT / "docs" / "index.md").read_text()
    # Those of the studio are drawn, and tested, with the studio.
    shown = re.findall(r"pictures/(?!studio_|film\.gif)([\w.]+)", pages)
    assert set(shown) == {path.name for path in drawn}
    assert all(path.stat().st_size > 10_000 for path in drawn)


def test_the_gallery_has_a_page_for_each_thing_to_do():
    assert len(SCRIPTS) >= 40
    headers = {path.parent for path in (ROOT / "gallery").glob("*/GALLERY_HEADER.rst")}
    assert {path.parent for path in SCRIPTS} == headers


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_gallery_script_is_one_page(path):
    code = path.read_text()
    title, line, *_ = ast.get_docstring(ast.parse(code)).splitlines()
    assert line == "=" * len(title)
    assert 15 <= len(code.splitlines()) <= 60
    assert "../shared" not in code
