"""The widget answers the same calls in messages, and a real JupyterLab shows it."""

import gc
import json
import re
import secrets
import subprocess
import sys
import threading
from contextlib import suppress
from io import BytesIO
from urllib.parse import quote

import numpy as np
import pytest
from browser import PATIENCE, build_page, find
from conftest import stretched_ball
from matplotlib.image import imread
from playwright.sync_api import TimeoutError as NothingSeenError

import eigenshape as es
from eigenshape_studio.tab.workspace import Workspace
from eigenshape_studio.widget import ShapeWidget
from eigenshape_studio.wire import decode, encode

CELL = """
import eigenshape as es
mesh = es.TriangleMesh(es.icosphere(3).vertices * [1.0, 1.7, 0.8], es.icosphere(3).faces)
widget = es.view(mesh, {"height (m)": mesh.vertices[:, 1]}, height=500)
widget
"""


@pytest.fixture(scope="module", autouse=True)
def page_is_built():
    build_page()


class Sent:
    """What a widget has sent, and waiting for it."""

    def __init__(self, widget, monkeypatch):
        self.messages, self._came = [], threading.Semaphore(0)
        monkeypatch.setattr(widget, "send", self._keep)

    def _keep(self, content, buffers):
        self.messages.append((content, decode(buffers[0])))
        self._came.release()

    def wait(self):
        assert self._came.acquire(timeout=60)
        return self.messages[-1]


def test_view_makes_a_widget_of_the_shape_and_its_values():
    mesh = stretched_ball(2)
    widget = es.view(mesh, mesh.vertices[:, 2], height=300)
    assert widget.height == 300
    assert widget.mesh is mesh
    assert widget.edits == ()
    assert repr(widget) == "ShapeWidget(TriangleMesh(162 vertices, 320 faces))"
    assert list(widget.workspace.fields) == ["values"]
    assert "render" in widget._esm
    widget.close()


@pytest.mark.parametrize("given", [{"mesh": None}, {"mesh": es.icosphere(1), "index": "nowhere"}])
def test_a_refused_widget_is_forgotten_without_an_error(given, monkeypatch):
    unraisable = []
    monkeypatch.setattr(sys, "unraisablehook", unraisable.append)
    with pytest.raises(es.EigenshapeError, match=r"mesh must be|must be an index"):
        ShapeWidget(**given)
    gc.collect()
    assert unraisable == []


def test_calls_are_answered_with_their_number(monkeypatch):
    widget = es.view(stretched_ball(2))
    sent = Sent(widget, monkeypatch)
    widget._receive(widget, {"id": "a-1", "call": "meta"}, [memoryview(encode({}))])
    content, (state, _) = sent.wait()
    assert content == {"id": "a-1"}
    assert state["n_vertices"] == 162
    widget._receive(widget, {"id": 7, "call": "array"}, [encode({"name": "vertices"})])
    content, (_, arrays) = sent.wait()
    assert content == {"id": 7}
    np.testing.assert_array_equal(arrays["vertices"], stretched_ball(2).vertices.astype("<f4"))
    widget._receive(widget, {"id": 8, "call": "explode"}, [encode({})])
    assert sent.wait()[1][0]["error"]["kind"] == "RequestError"
    widget._receive(widget, {"id": 9, "call": "meta"}, [])
    assert sent.wait()[1][0]["error"]["kind"] == "WireError"
    widget._receive(widget, "nonsense", [])
    widget.close()
    assert len(sent.messages) == 4


def test_edits_by_hand_are_there_in_the_next_cell(monkeypatch):
    mesh = stretched_ball(2)
    widget = es.view(mesh)
    assert widget.workspace.analysis.rig.wait(600)
    top = np.flatnonzero(mesh.vertices[:, 1] > 0.9).astype("<u4")
    call = {"n_modes": None, "n_regions": 1, "fixed": False}
    widget.workspace.answer("rig", encode(call, {"region0": top}))
    pull = {"type": "translation", "vector": [0, 0.4, 0]}
    commit = {"kind": "commit", "handles": [pull], "mode": "graded"}
    widget.workspace.answer("finish", encode(commit))
    bent = es.deform(es.rig_shape(mesh), top.astype(int), es.Translation([0, 0.4, 0]))
    np.testing.assert_array_equal(widget.mesh.vertices, bent.vertices)
    assert len(widget.edits) == 1
    assert isinstance(widget.workspace, Workspace)
    widget.close()


@pytest.fixture
def lab(tmp_path):
    """Start JupyterLab with a notebook of one cell, and return the notebook's address."""
    cell = {"cell_type": "code", "id": "show", "metadata": {}, "outputs": [], "source": CELL}
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    cells = [cell | {"execution_count": None}]
    notebook = {"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}
    (tmp_path / "shape.ipynb").write_text(json.dumps(notebook))
    token = secrets.token_hex(16)
    options = {
        "ServerApp.root_dir": str(tmp_path),
        "ServerApp.port": "0",
        "ServerApp.open_browser": "False",
        "ServerApp.allow_root": "True",
        "IdentityProvider.token": token,
        "LabApp.news_url": "None",
        "LabApp.check_for_updates_class": "jupyterlab.NeverCheckForUpdate",
    }
    command = [sys.executable, "-m", "jupyterlab", *(f"--{k}={v}" for k, v in options.items())]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            for line in process.stderr:
                if "http://127.0.0.1:" in line or "http://localhost:" in line:
                    base = line[line.index("http") :].split("/lab")[0]
                    break
            threading.Thread(target=process.stderr.read, daemon=True).start()
            yield f"{base}/lab/tree/{quote('shape.ipynb')}?token={token}&reset"
        finally:
            process.terminate()


def run_cell(page):
    """Run the only cell, and wait until it has run.

    A page that has just opened may lose a key, or send a cell to a kernel that does not hear it. So the
    key is pressed again, but never while the kernel works. On a busy machine JupyterLab asks which
    kernel to take, before it has heard that there is one.
    """
    idle = page.locator(".jp-Notebook-ExecutionIndicator[data-status=idle]")
    idle.wait_for()
    cell = page.locator(".jp-Notebook .jp-CodeCell").first
    count = cell.locator(".jp-InputPrompt").filter(has_text=re.compile(r"\[\d+\]"))
    question = page.locator(".jp-Dialog .jp-mod-accept")
    for _ in range(8):
        if question.count():
            question.click()
        if idle.count():
            cell.locator(".cm-content").click()
            page.keyboard.press("Control+Enter")
        with suppress(NothingSeenError):
            count.wait_for(timeout=30_000)
            return
    raise AssertionError("JupyterLab does not run the cell.")


@pytest.mark.long
def test_jupyterlab_shows_the_widget(lab, browser):
    pytest.importorskip("jupyterlab")
    with browser.new_page(viewport={"width": 1280, "height": 900}) as page:
        page.set_default_timeout(1000 * PATIENCE)
        seen = []
        page.on("pageerror", lambda error: seen.append(str(error)))
        page.goto(lab)
        run_cell(page)
        error = page.locator("[data-mime-type='application/vnd.jupyter.error']")
        assert not error.count(), error.first.inner_text()
        canvas = page.locator(".jp-OutputArea canvas").first
        canvas.wait_for()
        find(page, "counts").get_by_text("642 vertices").wait_for()
        find(page, "legend").get_by_text("height, m").wait_for()  # the values that were given
        find(page, "tab-spectrum").click()
        find(page, "panel-spectrum").get_by_text("none is missing").wait_for()
        shown = imread(BytesIO(canvas.screenshot()))
        assert shown.std() > 0.05  # the shape, and not one color
        assert not seen, seen
