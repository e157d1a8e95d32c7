"""The README (commands, size, links, code), its pictures, and the form of the gallery, which the docs build runs."""

import ast
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import eigenshape as es

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SHOWN = [
    path.with_name("README.md")
    for path in [ROOT / "pyproject.toml", *ROOT.glob("*/pyproject.toml")]
]
# The target of [text](target), of [name]: target, and of src="target" and href="target".
LINK = re.compile(r"(?:\]\(|^\[[^]]+\]: |\b(?:src|href)=\")([^\s)\"]+)", re.MULTILINE)
SCRIPTS = sorted((ROOT / "gallery").glob("*/*.py"))


def test_readme_begins_with_exactly_two_commands():
    commands = README.split("```")[1].splitlines()[1:]
    assert len([line for line in commands if line.strip()]) == 2


def test_readme_is_short_and_shows_one_picture():
    assert len(README.encode()) <= 5000
    assert len(re.findall(r"!\[|<img", README)) == 1


@pytest.mark.parametrize("page", SHOWN, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_of_a_readme_are_absolute_and_lead_to_files_of_the_repository(page):
    """PyPI shows the README of each package, without the files beside it."""
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    (address,) = re.findall(r'^repository-code: "(.*)"', citation, re.MULTILINE)
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        assert target.startswith("https://"), target
        place = target.removeprefix(address)
        if place not in (target, ""):
            file = re.fullmatch(r"/(?:blob|raw)/main/([\w./]+)", place)
            assert file, target
            assert (ROOT / file[1]).is_file(), target


@pytest.mark.long
def test_the_code_of_the_readme_runs(tmp_path, monkeypatch):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    giraffe = es.make_creature("giraffe", n_vertices=600)
    es.write_mesh(giraffe, "scan.ply")
    es.write_mesh(giraffe, "other.ply")
    names: dict[str, object] = {}
    exec(code, names)
    assert names["match"].name == "scan"
    assert Path("parts.png").stat().st_size > 1000


@pytest.mark.long
@pytest.mark.sweep
def test_the_pictures_of_the_front_page_show_what_is_drawn_today(tmp_path):
    drawn = runpy.run_path(str(ROOT / "docs" / "front_page.py"))["main"](tmp_path)
    pages = README + (ROOT / "docs" / "index.md").read_text()
    # Those of the studio are drawn, and tested, with the studio.
    shown = re.findall(r"pictures/(?!studio_|film\.gif)([\w.]+)", pages)
    assert set(shown) <= {path.name for path in drawn}
    changes = {
        path.name: np.abs(coarse(path) - coarse(ROOT / "docs" / "pictures" / path.name)).mean()
        for path in drawn
    }
    # Another renderer of text changes them by 0.4, another color of two parts by 2.
    old = {name: round(change, 2) for name, change in changes.items() if change > 0.8}
    assert not old, "draw them again: python docs/front_page.py docs/pictures"


def coarse(path):
    """Return the colors of a picture, 0 to 255, on white, in squares of a 48th of each side."""
    with Image.open(path) as image:
        opaque = Image.alpha_composite(
            Image.new("RGBA", image.size, "white"), image.convert("RGBA")
        )
        return np.asarray(opaque.convert("RGB").resize((48, 48), Image.Resampling.BOX), float)


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
