import sys
from pathlib import Path
from types import ModuleType

import pytest
from typer.testing import CliRunner

import eigenshape as es
from eigenshape.cli import app


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize("verb", ["studio", "serve", "report"])
def test_without_the_studio_its_verbs_say_what_to_install(monkeypatch, tmp_path, verb):
    for name in [name for name in sys.modules if name.startswith("eigenshape_studio.")]:
        monkeypatch.delitem(sys.modules, name)  # of tests before this one
    monkeypatch.setitem(sys.modules, "eigenshape_studio", None)
    done = run(verb, "nowhere.ply", *(["-o", tmp_path / "a.html"] if verb == "report" else []))
    assert done.exit_code == 1
    assert "eigenshape_studio must be installed" in done.stderr
    assert "pip install eigenshape-studio" in done.stderr


def test_studio_passes_its_options_on_and_prints_the_address(monkeypatch):
    calls = []

    def serve(shapes, *, announce, **options):
        calls.append((shapes, options))
        announce("http://127.0.0.1:5/?token=abc")

    monkeypatch.setitem(sys.modules, "eigenshape_studio", ModuleType("eigenshape_studio"))
    module = ModuleType("eigenshape_studio.server")
    monkeypatch.setattr(module, "serve", serve, raising=False)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    side = ["--view", "1,0,2", "--up", "-z"]
    done = run("studio", "a.ply", "b.ply", "--index", "shelf", "--port", 5, "--no-browser", *side)
    assert done.stdout == "The studio is open at http://127.0.0.1:5/?token=abc\n"
    run("studio", "--host", "0.0.0.0", "--allow-remote")
    local = {"host": "127.0.0.1", "port": 5, "allow_remote": False, "browse": False}
    local |= {"view": [1.0, 0.0, 2.0], "up": "-z"}
    assert calls[0] == ([Path("a.ply"), Path("b.ply")], {"index": Path("shelf"), **local})
    remote = {"host": "0.0.0.0", "port": None, "allow_remote": True, "browse": True}
    remote |= {"view": "auto", "up": "auto"}
    assert calls[1] == ((), {"index": None, **remote})


def test_serve_passes_its_options_on_and_prints_the_address(monkeypatch):
    calls = []

    def serve(index, *, announce, **options):
        calls.append((index, options))
        announce("http://127.0.0.1:5/")

    for name in ("eigenshape_studio", "eigenshape_studio.service"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    module = ModuleType("eigenshape_studio.service.server")
    monkeypatch.setattr(module, "serve", serve, raising=False)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setenv("EIGENSHAPE_TOKEN", "a-token-of-the-environment")
    done = run("serve", "shelf", "--port", 5, "--workers", 3, "--timeout", 7, "--memory", 1.5)
    assert done.stdout == "The service is open at http://127.0.0.1:5/\n"
    index, options = calls[0]
    assert index == Path("shelf")
    assert options == {
        "host": "127.0.0.1",
        "port": 5,
        "allow_remote": False,
        "allow_hosts": (),
        "token": "a-token-of-the-environment",
        "write_token": None,
        "workers": es.retrieval.Workers(3, 7.0, 1.5e9),
        "show_sources": False,
        "prefix": "",
        "browse": False,
    }
    names = ["--allow-host", "a.example", "--allow-host", "b.example:80"]
    run("serve", "shelf", "--host", "::", "--allow-remote", *names, "--browser", "--show-sources")
    remote = {"host": "::", "allow_remote": True, "allow_hosts": ["a.example", "b.example:80"]}
    assert calls[1][1].items() >= (remote | {"browse": True, "show_sources": True}).items()


def test_report_reads_repairs_and_writes(monkeypatch, tmp_path):
    calls = []

    def write_report(mesh, path, **options):
        calls.append((mesh, path, options))

    monkeypatch.setitem(sys.modules, "eigenshape_studio", ModuleType("eigenshape_studio"))
    module = ModuleType("eigenshape_studio.report")
    monkeypatch.setattr(module, "write_report", write_report, raising=False)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    ball = es.icosphere(2)
    es.write_mesh(es.TriangleMesh(ball.vertices, ball.faces[:, ::-1]), tmp_path / "ball.ply")
    done = run(
        "report",
        tmp_path / "ball.ply",
        "-o",
        tmp_path / "a.html",
        "--repair",
        "orient",
        "--view",
        "left",
    )
    assert "wrote" in done.stderr
    (mesh, path, options) = calls[0]
    assert es.geometry.enclosed_volume(mesh) > 0
    assert path == tmp_path / "a.html"
    assert (options["name"], options["n_modes"]) == ("ball.ply", 20)
    assert (options["view"], options["up"]) == ("left", "auto")
    refused = run("report", tmp_path / "ball.ply", "-o", tmp_path / "a.txt")
    assert "A report must be written to a file that ends in .html" in refused.stderr
