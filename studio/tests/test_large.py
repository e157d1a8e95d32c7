"""Of a large shape, and of what cannot be opened: a picture first, and the rest when it is asked for."""

import numpy as np
import pytest
from browser import find, open_page, start_server, wait_until
from conftest import stretched_ball
from test_workspace import Page, file_of

import eigenshape as es
from eigenshape_studio.opening import open_workspace
from eigenshape_studio.shape import analysis
from eigenshape_studio.shape.analysis import frame_shape
from eigenshape_studio.tab import changes
from eigenshape_studio.tab.workspace import Workspace

LOWER = """
from eigenshape_studio.shape import analysis
from eigenshape_studio.tab import changes
analysis.LARGE, changes.LIGHT = 500, 300
"""


@pytest.fixture
def page(monkeypatch):
    monkeypatch.setattr(analysis, "LARGE", 500)
    monkeypatch.setattr(changes, "LIGHT", 300)
    mesh = stretched_ball()
    height = {"height (m)": mesh.vertices[:, 1]}
    return Page(Workspace(mesh, "ball.ply", values=height, shared=True).fork())


def test_nothing_is_computed_of_a_large_shape_before_it_is_asked_for(page):
    state = page.call("meta")[0]
    assert "642 vertices" in state["large"]
    assert {state[what]["status"] for what in ("health", "spectrum", "deformation")} == {"none"}
    assert state["health"]["lines"] == [["fair", "It has not been examined."]]
    found = page.error("rig", {"n_regions": 1}, {"region0": np.arange(9, dtype="<u4")})
    assert (
        found["message"] == "The shape must be prepared for bending: ask for it above the panels."
    )
    assert page.array("vertices").shape == (642, 3)
    found = page.call("finish", kind="examine")[0]["state"]
    assert found["spectrum"]["status"] == "none"
    assert page.workspace.analysis.health.wait(600)
    assert page.call("meta")[0]["health"]["closed"]


def test_a_large_shape_can_be_prepared_for_bending(page):
    page.call("finish", kind="prepare")
    assert page.workspace.analysis.rig.wait(600)
    state = page.call("meta")[0]
    assert state["large"] == ""
    assert state["deformation"]["status"] == "ready"


def test_the_spectrum_that_is_asked_for_is_the_one_for_bending(page):
    found = page.workspace.analysis
    for_bending = found.spectrum
    page.call("finish", kind="solve", k=analysis.N_MODES)
    assert found.spectrum is for_bending
    assert for_bending.wait(600)
    page.call("finish", kind="solve", k=20)
    assert found.spectrum is not for_bending
    assert found.health.wait(600)  # Weyl's law takes the area


def test_a_shape_that_waits_still_does_when_it_is_shown_again(page):
    page.call("finish", {"kind": "open", "name": "b.ply"}, {"file": file_of(es.icosphere(1))})
    page.call("finish", kind="undo")
    assert page.call("meta")[0]["spectrum"]["status"] == "none"
    page.call("finish", kind="prepare")
    assert page.workspace.analysis.rig.wait(600)
    assert page.call("meta")[0]["deformation"]["status"] == "ready"


def test_a_lighter_copy_keeps_vertices_with_their_values(page):
    whole = page.array("vertices")
    answer = page.call("finish", kind="lighten")[0]
    state = answer["state"]
    assert (state["name"], state["large"]) == ("ball.ply, lighter", "")
    assert 150 < state["n_vertices"] <= 300
    assert answer["warnings"] == [f"{state['n_vertices']} of 642 vertices were kept."]
    thin = page.array("vertices")
    assert {tuple(row) for row in thin} <= {tuple(row) for row in whole}
    np.testing.assert_array_equal(page.array("values/height (m)"), thin[:, 1])
    assert [name for _, name in state["shapes"]] == ["ball.ply", "ball.ply, lighter"]


@pytest.mark.parametrize("kind", ["giraffe", "biped", "fish"])
def test_a_large_shape_is_framed_as_the_whole_is(kind, monkeypatch):
    mesh = es.make_creature(kind, n_vertices=3000)
    turned = mesh.vertices @ [[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]
    for shape in (mesh, es.TriangleMesh(turned, mesh.faces)):
        expected = frame_shape(shape)
        with monkeypatch.context() as patch:
            patch.setattr(analysis, "LARGE", 500)
            assert frame_shape(shape) == expected


def test_what_cannot_be_opened_is_skipped_and_named(tmp_path):
    (tmp_path / "a.ply").write_text("not a mesh")
    with pytest.raises(es.FileFormatError, match=r"a\.ply"):
        open_workspace([tmp_path])
    es.write_mesh(es.icosphere(1), tmp_path / "b.ply")
    first = open_workspace([tmp_path])
    state = Page(first.fork()).call("meta")[0]
    assert state["shapes"] == [[0, "b"]]
    assert state["notes"][0].startswith("a cannot be opened: ")
    first.close()


@pytest.mark.long
def test_the_page_of_a_large_shape_and_a_duplicate_of_its_tab(browser, tmp_path):
    (tmp_path / "a.ply").write_text("not a mesh")
    es.write_mesh(stretched_ball(), tmp_path / "b.ply")
    with (
        start_server(tmp_path, setup=LOWER) as (url, _),
        open_page(browser, url) as page,
    ):
        wait_until(page, "!!eigenshape.active")
        note = find(page, "large-text").text_content()
        assert "a cannot be opened" in note
        assert "642 vertices" in note
        find(page, "examine").click()
        wait_until(page, "eigenshape.state.health.status === 'ready'")
        find(page, "examine").wait_for(state="hidden")
        assert page.evaluate("eigenshape.state.spectrum.status") == "none"
        find(page, "lighten").click()
        wait_until(page, "eigenshape.viewer.vertices.length <= 900")
        find(page, "large").wait_for(state="hidden")

        # A window that is opened by a page gets a copy of its storage, as a duplicated tab does.
        with page.expect_popup() as popup:
            page.evaluate("void open(location.href)")
        other, number = popup.value, "eigenshape.settings.get('tab')"
        wait_until(other, "window.eigenshape?.viewer.vertices.length > 0")
        assert other.evaluate(number) != page.evaluate(number)
        assert other.evaluate("eigenshape.state.history") == []
        # A page that is loaded again keeps its session.
        before = page.evaluate(number)
        page.reload()
        wait_until(page, "window.eigenshape?.viewer.vertices.length > 0")
        assert page.evaluate(number) == before
        assert page.evaluate("eigenshape.state.history") == ["Lighter copy"]
