"""The recipe "Add a verb" of CONTRIBUTING.md: what it says is enough."""

import json
import re
import sys
import textwrap
from pathlib import Path

import pytest
from running import run

import eigenshape as es
import eigenshape.cli
from eigenshape.cli.verbs import VERBS, Verbs

ROOT = Path(__file__).resolve().parents[2]
RECIPE = re.split("\n##+ ", (ROOT / "CONTRIBUTING.md").read_text().split("### Add a verb")[1])[0]


@pytest.fixture
def holes(tmp_path, monkeypatch):
    """Take the steps: write the file of the recipe into the package, and name the verb in the list."""
    code = textwrap.dedent(re.search(r"( *)```python\n(.*?)```", RECIPE, re.DOTALL)[2])
    (tmp_path / "holes.py").write_text(code)
    monkeypatch.setattr(eigenshape.cli, "__path__", [*eigenshape.cli.__path__, str(tmp_path)])
    monkeypatch.setattr(Verbs, "names", (*VERBS, "holes"))
    yield tmp_path
    sys.modules.pop("eigenshape.cli.holes", None)


def test_a_verb_takes_three_files():
    steps = re.findall(r"^\d\. `([^`]+)`", RECIPE, re.MULTILINE)
    assert steps == [
        "src/eigenshape/cli/<verb>.py",
        "src/eigenshape/cli/verbs.py",
        "tests/cli/test_cli_<verb>.py",
    ]


def test_the_rest_comes_by_itself(holes, monkeypatch):
    assert "List the boundary loops of a mesh." in run("--help").stdout
    told = run("holes", "--help").stdout
    for words in (
        "--longest",
        "Only the loop with most vertices.",
        "--json",
        "Print JSON",
        "--repair",
    ):
        assert words in told
    assert run("holes", code=2).output  # the help, because the mesh is missing

    path = holes / "open.ply"
    es.write_mesh(es.shapes.grid(2, 2), path)
    assert run("holes", path).stdout == "1 loops of 8 vertices\n"
    found = json.loads(run("holes", path, "--longest", "--json").stdout)
    assert found["path"] == str(path)
    assert sorted(found["loops"][0]) == [0, 1, 2, 3, 5, 6, 7, 8]
    assert run("holes", "nowhere.ply", code=1).stderr == (
        "error: nowhere.ply: No such file or directory\n"
    )
    assert run("holes", path, "--repair", "all", code=2).stderr.startswith(
        "error: Names of --repair"
    )

    monkeypatch.syspath_prepend(ROOT / "docs")
    import command_line

    monkeypatch.setattr(command_line, "VERBS", Verbs.names)
    page = command_line.command_line_page()
    assert "| [`holes`](#eigenshape-holes) | List the boundary loops of a mesh. |" in page
    assert "| `--longest` | Only the loop with most vertices. |" in page


def test_results_become_json_by_one_rule(capsys):
    """Fields and properties by their names, also within each other; what is not finite is null."""
    from eigenshape.cli.console import print_json, result_facts

    spectrum = es.solve_spectrum(es.cotangent_laplacian(es.icosphere(1)), 4)
    print_json({"certificate": spectrum.certificate, "worst": float("inf")})
    printed = json.loads(capsys.readouterr().out)
    assert printed["worst"] is None
    certificate = printed["certificate"]
    assert certificate["n_found"] == spectrum.certificate.n_found
    assert certificate["complete"] is spectrum.certificate.complete is True  # a property
    assert certificate["explanation"] == spectrum.certificate.explain()
    assert "n_found" not in result_facts(spectrum.certificate, "n_found")
