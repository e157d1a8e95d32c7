"""What the docs mention is there, and all that is public is mentioned."""

import re
import shlex
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from public_names import public_things
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app
from eigenshape.cli.verbs import load_verb

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "coming_from").glob("*.md")),
    *sorted((ROOT / "docs" / "decisions").glob("*.md")),
    *sorted((ROOT / "experiments").rglob("*.md")),
]
# What stands for the names of files.
PATTERNS = {"number/recipe/view/", "run.py", "x_loops.py"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_names_in_docs_are_there(page):
    for name in set(re.findall(r"\bes\.((?:\w+\.)*\w+)", page.read_text())):
        attrgetter(name)(es)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_in_docs_are_there(page):
    sources = (ROOT / "src" / "eigenshape", ROOT / "certeig" / "src", ROOT / "certeig")
    files = re.findall(r"`(?:python )?([\w./]+\.py|[a-z_]+(?:/[a-z_]+)*/)`", page.read_text())
    missing = {
        name
        for name in files
        if not any((folder / name).exists() for folder in (ROOT, ROOT / "studio", page.parent))
        and not any(list(source.rglob(name)) for source in sources)
    }
    assert not missing - PATTERNS


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_in_docs_are_understood(page):
    """Verbs and options are parsed; nothing runs."""
    text = page.read_text()
    blocks = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    cells = re.findall(r"\| `(eigenshape .*?)` \|", text)
    commands = r"^ *(?:.*&& )?eigenshape (.*?)(?: &)?$"
    for words in re.findall(commands, "\n".join(blocks + cells), re.MULTILINE):
        verb, *options = shlex.split(words, comments=True)
        if verb == "index":
            verb += f" {options.pop(0)}"
        load_verb(verb).make_context(verb, options)


def test_the_architecture_is_a_map_and_each_decision_is_listed_with_a_date():
    assert (ROOT / "docs" / "architecture.md").stat().st_size <= 8000
    listed = (ROOT / "docs" / "decisions" / "index.md").read_text().splitlines()
    for page in (ROOT / "docs" / "decisions").glob("*.md"):
        if page.name != "index.md":
            assert re.match(r"# .*\n\n\*\d+ \w+ 20\d\d\*\n\n", page.read_text()), page.name
            assert page.stem in listed, page.name


def test_experiments_that_comments_name_are_there():
    for path in (ROOT / "src").rglob("*.py"):
        for name in re.findall(r"\b(?:experiments|benchmarks)/\w+", path.read_text()):
            assert (ROOT / name).exists() or (ROOT / f"{name}.py").exists(), (path.name, name)


def test_every_public_name_is_mentioned_beside_the_api_pages():
    files = [*PAGES, *(ROOT / "gallery").rglob("*.py"), *(ROOT / "experiments").rglob("*.py")]
    words = {word for path in files for word in re.findall(r"\w+", path.read_text())}
    assert not sorted(public_things().keys() - words)


@pytest.mark.long
def test_the_page_of_modes_runs():
    """Its blocks follow one another, and need no file."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "modes.md").read_text(), re.DOTALL)
    names: dict[str, object] = {}
    exec("\n".join(blocks), names)
    assert 0 < names["p_value"] < 0.5
    assert len(names["modes"])


@pytest.mark.long
@pytest.mark.sweep
def test_the_page_of_first_steps_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    biped = es.make_creature("biped", n_vertices=800)
    tall = es.TriangleMesh(2 * biped.vertices, biped.faces)  # as the page's region supposes
    es.write_mesh(tall, "scan.ply")
    es.write_mesh(tall, "other.ply")
    es.write_mesh(es.TriangleMesh(1.01 * tall.vertices, tall.faces), "noisy.ply")
    es.io.write_fields(es.shapes.ball(4), "brain.vtu", {})
    page = (ROOT / "docs" / "first_steps.md").read_text()
    names: dict[str, object] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)), names)
    assert names["match"].name == "scan"
    assert np.abs(names["bent"].vertices - names["longer"].vertices).max() > 0.1
    for written in ("parts.png", "bent.ply", "report.png"):
        assert Path(written).stat().st_size > 1000


@pytest.mark.long
@pytest.mark.sweep
def test_the_page_from_a_cortex_to_a_figure_runs(tmp_path, monkeypatch):
    pytest.importorskip("neuromodes", reason="the cortices of neuromodes are missing")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "brains.md").read_text()
    names: dict[str, object] = {}
    exec("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)), names)
    assert names["spectrum"].certificate.complete
    assert 0.9 < names["accuracy"][names["needed"] - 1] < 0.91
    # Myelin is high where the cortex is thin.
    assert names["measured"] < -0.3
    assert names["p_value"] < 0.01
    assert np.isnan(names["on_left"]).sum() == 2796
    assert Path("myelin.pdf").stat().st_size > 1000
    read = es.io.read_fields("lh.modes.func.gii")["mode"]
    np.testing.assert_array_equal(read, names["modes"].astype(np.float32))


@pytest.mark.long
@pytest.mark.sweep
def test_the_page_from_scans_to_figures_runs(tmp_path, monkeypatch):
    """Its blocks follow one another, with the command between them, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "scans_to_figures.md").read_text()
    names: dict[str, object] = {}
    for kind, block in re.findall(r"```(python|sh)\n(.*?)```", page, re.DOTALL):
        if kind == "python":
            exec(block, names)
        else:
            command, *arguments = block.split()
            assert command == "eigenshape"
            done = CliRunner().invoke(app, [*arguments, "--workers", "1"])
            assert done.exit_code == 0, done.output
    assert sorted(names["hands"]) == sorted(path.stem for path in Path("hands").glob("*.ply"))
    for written in ("hands.pdf", "broad-against-slim.png", "scores.csv", "hands-out/report.html"):
        assert Path(written).stat().st_size > 100
    # Hands that were made 1.3 times as broad are found to be broader.
    breadths = []
    for mesh in (names["broad"], names["slim"]):
        away = mesh.vertices - mesh.vertices.mean(axis=0)
        length, breadth, _ = np.linalg.svd(away, compute_uv=False)
        breadths.append(breadth / length)
    assert 1.1 < breadths[0] / breadths[1] < 1.3
