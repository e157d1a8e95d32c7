"""Every number in a table has a source, and each table stands as its file of figures writes it."""

import json
import runpy
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FIGURES = runpy.run_path(str(ROOT / "benchmarks" / "figures.py"))
TABLE = "| shape | CPU s |\n|---|---|\n| sphere | 0.12 |\n"


@pytest.mark.parametrize("page", FIGURES["PAGES"], ids=lambda page: str(page.relative_to(ROOT)))
def test_tables_are_those_of_their_files(page):
    assert FIGURES["complaints"](page) == []


@pytest.mark.parametrize(
    "path", sorted(FIGURES["FOLDER"].glob("*.json")), ids=lambda path: path.stem
)
def test_each_run_says_how_it_was_measured(path):
    figures = json.loads(path.read_text(encoding="utf-8"))
    assert path.stem in FIGURES["FIGURES"]
    assert {"command", "date", "commit", "machine", "times", "rows"} <= figures.keys()
    assert {"cpu", "cores", "threads", "load", "versions", "python"} <= figures["machine"].keys()
    assert all((ROOT / place).exists() for place in figures["times"])
    # what a row is of: its first two cells, and a third where the same points are solved for several
    # k, or files go several ways
    n_labels = 3 if figures["columns"][2] in ("pairs", "way") else 2
    labels = [tuple(row[:n_labels]) for row in figures["table"]]
    assert len(set(labels)) == len(labels), "rows of two runs"
    if path.stem == "interop":  # a row for each program, format and way, of several shapes
        results = [(each["tool"], each["way"]) for each in figures["rows"]]
        assert len(set(results)) <= len(labels) <= len(results)
    else:
        assert len(labels) == len(figures["rows"]), "rows of two runs"


@pytest.mark.parametrize(
    "path",
    sorted((ROOT / "experiments").glob("*/expected*.json")),
    ids=lambda path: path.parent.name,
)
def test_each_experiment_says_how_it_was_run(path):
    source = json.loads(path.read_text(encoding="utf-8"))["source"]
    # of files older than November 2026 the machine is not known
    assert source.keys() == {"command", "date", "commit", "machine"}
    assert source["command"].startswith(f"python experiments/{path.parent.name}/")
    assert " /" not in source["command"], "a place of the machine that measured"


@pytest.fixture
def a_page(tmp_path, monkeypatch):
    """Return a function that writes a page and says what is wrong with it; its figures are in a folder of their own."""
    monkeypatch.setitem(FIGURES["block"].__globals__, "FOLDER", tmp_path)
    monkeypatch.setitem(FIGURES["block"].__globals__, "ROOT", tmp_path)

    def complaints(text):
        (tmp_path / "page.md").write_text(text)
        return FIGURES["complaints"](tmp_path / "page.md")

    return complaints


def test_a_number_without_a_source_is_refused(a_page):
    assert a_page(TABLE) == ["page.md: numbers without a source in the table | shape | CPU s |"]
    assert a_page(TABLE.replace("0.12", "quick, by `es.solve_spectrum(laplacian, 20)`")) == []
    assert a_page("<!-- no figures: exact values -->\n" + TABLE) == []
    (refused,) = a_page("<!-- no figures: everybody knows -->\n" + TABLE)
    assert "'everybody knows' is no reason" in refused


def test_a_table_that_its_file_does_not_write_is_refused(a_page, tmp_path):
    figures = {
        "command": "python benchmarks/bench_x.py",
        "date": "2026-11-25",
        "commit": "abc",
        "machine": {
            "cpu": "a CPU",
            "threads": "one thread",
            "cores": 2,
            "memory_gib": 8,
            "load": [0],
        }
        | {"system": "Linux", "python": "3", "versions": {}, "blas": []},
        "settings": {"repeats": 3},
        "columns": ["shape", "CPU s"],
        "table": [["sphere", "0.12"]],
    }
    (tmp_path / "x.json").write_text(json.dumps(figures))
    page = FIGURES["written"]("before\n<!-- figures: x -->\nold\n<!-- end -->\nafter\n", tmp_path)
    assert page.startswith(
        "before\n<!-- figures: x -->\n\nMeasured 2026-11-25 by `python benchmarks/bench_x.py`"
    )
    assert page.endswith(
        f"Medians of 3 unless the table says so.\n\n{TABLE}\n<!-- end -->\nafter\n"
    )
    assert a_page(page) == []
    (refused,) = a_page(page.replace("0.12", "0.11"))
    assert "'| sphere | 0.11 |' is '| sphere | 0.12 |' in its file" in refused
    (tmp_path / "x.json").unlink()
    assert "Not measured since" in FIGURES["written"](page, tmp_path)
    assert a_page(page)


def test_numbers_of_an_experiment_are_those_at_their_paths(a_page, tmp_path):
    results = {"full": {"cut: 1": {"cat": [0.127, 1234]}, "hole": {"cat": [None, "≤ 1e-9"]}}}
    (tmp_path / "found.json").write_text(json.dumps(results))
    comment = (
        "<!-- figures: found.json>full\ncut: 1>cat | hole>cat\n= | {*>*>0:.1%} % | {1:,} -->\n"
    )
    head = "| part | share | points |\n|---|---|---|\n"
    page = comment + head + "| a cut | 12.7 % | 1,234 |\n| a hole | none | ≤ 1e-9 |\n"
    assert a_page(page) == []
    assert "'| a cut | 12.7 % | 1,234 |'" in a_page(page.replace("12.7", "12.6"))[0]
    # what has no number keeps its words, and no number
    assert "| a hole |  |" in FIGURES["written"](page.replace("none", "8 %"), tmp_path)
    (refused,) = a_page(page.replace("{1:,}", "="))
    assert refused == "page.md: numbers without a source in the column points"


def test_sentences_say_the_figures_of_their_files(a_page, tmp_path):
    (tmp_path / "found.json").write_text(json.dumps({"full": {"cats: 2": [0.127, 1234]}}))
    page = "The share is 12.7 % of\n1,234 cats.\n\n<!-- sentences: found.json>full\n"
    page += "share is {cats: 2>0:.1%} % of {cats: 2>1:,} cats\n-->\n"
    assert a_page(page) == []
    assert a_page(page.replace("12.7", "12.8")) == [
        "page.md: it must say, as its file does: share is 12.7 % of 1,234 cats"
    ]


def test_a_readme_s_tables_are_read_with_the_figures_of_a_run(tmp_path):
    head = "| part | share |\n|---|---|\n"
    comment = "<!-- figures: expected.json>full>parts\ncat | dog\n= | {share:.0%} % -->\n"
    (tmp_path / "README.md").write_text(comment + head + "| a cat | 1 % |\n| a dog | 2 % |\n")
    (tmp_path / "run.json").write_text(json.dumps({"parts": {"dog": {"share": 0.07}}}))
    tables = FIGURES["tables_of_run"](tmp_path / "expected.json", tmp_path / "run.json")
    assert tables == head + "| a dog | 7 % |\n"
    (tmp_path / "run.json").write_text("{}")
    assert FIGURES["tables_of_run"](tmp_path / "expected.json", tmp_path / "run.json") == ""


def test_every_benchmark_that_is_listed_is_shown():
    shown = {
        name
        for page in FIGURES["PAGES"]
        for name, _ in FIGURES["MEASURED"].findall(page.read_text())
    }
    assert shown == FIGURES["FIGURES"].keys()


def test_figures_older_than_their_code_are_named(a_page, tmp_path):
    def git(*words):
        who = ["-c", "user.name=x", "-c", "user.email=x@x"]
        return subprocess.run(
            ["git", *who, *words], cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout.strip()

    def commit(text):
        (tmp_path / "code.py").write_text(text)
        git("add", "code.py")
        git("commit", "-m", text)
        return git("rev-parse", "--short", "HEAD")

    git("init")
    first = commit("one")
    figures = {"times": ["code.py"], "date": "2026-11-25"}
    path = tmp_path / "x.json"
    path.write_text(json.dumps(figures | {"commit": first}))
    assert FIGURES["stale"]() == []
    commit("two")
    (told,) = FIGURES["stale"]()
    assert told.startswith("x, of 2026-11-25, is older than what it times: 1 commits since")
    # as in a clone without a history
    path.write_text(json.dumps(figures | {"commit": "0123456789ab and changes"}))
    assert FIGURES["stale"]() == ["x: age not known, since commit 0123456789ab is not here"]
