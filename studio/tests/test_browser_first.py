"""The first minute in a real browser: samples, the tour, a limb that bends, which way up."""

import numpy as np
import pytest
from browser import (
    PANEL,
    drop_file,
    find,
    limb,
    move_pointer,
    open_page,
    place_of,
    positions,
    serve_studio,
    vertex_values,
    wait_for_edits,
    wait_until,
    wait_until_still,
)
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import eigenshape as es
from eigenshape.deformation import bend, bind

pytestmark = pytest.mark.long

N_VERTICES = 1000
LIMBS = f"{PANEL}.limbs"
HAS_LIMBS = f"{LIMBS}?.farthest()"


@pytest.fixture
def page(browser, url):
    """A tab as a person finds it, when the limbs are found."""
    with open_page(browser, url, more=False) as page:
        wait_until(page, HAS_LIMBS)
        yield page


def test_a_limb_lights_up_and_bends_without_any_step_before(page, mesh, rig):
    assert find(page, "hint").inner_text().startswith("Point at a limb")
    number = page.evaluate(HAS_LIMBS)["number"]
    chosen = limb(page, number)
    x, y = place_of(page, mesh.vertices[chosen].mean(axis=0))
    move_pointer(page, x, y)
    wait_until(page, f"{LIMBS}.lit === {number}")
    lit = vertex_values(page, "mark").reshape(-1, 4)[:, 3]
    inside = np.isin(np.arange(mesh.n_vertices), chosen)
    assert ((lit > lit.max() / 2) == inside).mean() > 0.97  # its rim is soft
    assert not lit[~inside].all()

    page.mouse.down()
    move_pointer(page, x + 40, y + 20, steps=3)
    wait_until(page, f"{PANEL}.motion.rowHandles()[0] !== null")
    wait_until(page, "eigenshape.viewer.motion.blend.value === 1")  # the pointer rests
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    bent = bend(
        bind(rig, [chosen]), [es.Rotation(handle["pivot"], handle["axis"], handle["angle"])]
    )
    assert abs(handle["angle"]) > 0.1
    page.mouse.up()
    wait_for_edits(page, 1)
    np.testing.assert_array_equal(positions(page), bent.vertices.astype("f4"))
    page.keyboard.press("Control+z")
    wait_for_edits(page, 0)
    np.testing.assert_array_equal(positions(page), mesh.vertices.astype("f4"))
    # In another panel no limb is lit.
    move_pointer(page, x, y)
    wait_until(page, f"{LIMBS}.lit === {number}")
    find(page, "tab-shape").click()
    assert not vertex_values(page, "mark").any()


def test_what_hangs_on_a_limb_moves_with_it(page, mesh):
    # Where the quadruped has more parts than limbs, one of them hangs on another.
    labels = np.array(page.evaluate(f"Array.from({LIMBS}.labels)"))
    body = page.evaluate(f"{LIMBS}.body")
    edges = np.vstack([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    for number in np.unique(labels[labels != body]):
        # Without this limb the rest is in one piece, which holds the body.
        rest = np.setdiff1d(np.arange(mesh.n_vertices), limb(page, number))
        inside = np.isin(edges, rest).all(axis=1)
        graph = coo_array(
            (np.ones(inside.sum()), edges[inside].T), shape=(mesh.n_vertices, mesh.n_vertices)
        )
        pieces = connected_components(graph, directed=False)[1]
        assert len(set(pieces[rest])) == 1


def test_a_character_with_seams_is_joined_and_says_so(page, tmp_path, mesh):
    """Files of animation programs hold each vertex on a seam twice."""
    seam = np.flatnonzero(mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0)
    faces = mesh.faces.copy()
    faces[seam] += mesh.n_vertices
    doubled = es.TriangleMesh(np.tile(mesh.vertices, (2, 1)), faces)
    es.write_mesh(es.repair(doubled, ["drop_unreferenced"]).mesh, tmp_path / "character.obj")
    drop_file(page, "stage", tmp_path / "character.obj")
    page.get_by_text("vertices along seams").first.wait_for()
    assert page.evaluate("eigenshape.state.n_vertices") == mesh.n_vertices
    wait_until(page, HAS_LIMBS)


def test_beside_a_limb_the_view_turns_and_few_controls_are_seen(page):
    before = page.evaluate("eigenshape.viewer.camera.position.toArray()")
    move_pointer(page, 20, 400)
    page.mouse.down()
    move_pointer(page, 120, 400, steps=3)
    page.mouse.up()
    assert page.evaluate("eigenshape.viewer.camera.position.toArray()") != before
    assert page.evaluate("eigenshape.state.deformation.n_edits") == 0
    controls = find(page, "panel-deform").locator("button, input, select, summary")
    assert sum(control.is_visible() for control in controls.all()) <= 8


def test_samples_a_tour_and_once_is_enough(browser):
    with serve_studio(None) as url, open_page(browser, url, more=False) as page:
        find(page, "sample-hand").locator("img").wait_for()
        find(page, "sample-biped").click()
        wait_until(page, "eigenshape.state.name === 'biped'")
        assert find(page, "welcome").count() == 0
        find(page, "tour-bar").get_by_text("Drag it").wait_for(timeout=120_000)
        moved = "eigenshape.viewer.motion.angle.value[0]"
        wait_until(page, f"{moved} > 0.2")
        find(page, "tour-skip").click()
        find(page, "tour-bar").wait_for(state="detached")
        assert page.evaluate("eigenshape.viewer.motion.n_moving.value") == 0
        assert page.evaluate("eigenshape.state.deformation.n_edits") == 0
        page.reload()
        wait_until(page, HAS_LIMBS)
        assert find(page, "welcome").count() == find(page, "tour-bar").count() == 0
        # A second studio has another port; the person is the same.
        page.evaluate("sessionStorage.clear()")
        page.reload()
        find(page, "sample-quadruped").click()
        wait_until(page, HAS_LIMBS)
        assert find(page, "tour-bar").count() == 0


def test_which_way_up_is_corrected_and_remembered(browser, path, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with serve_studio(path, view="front") as url, open_page(browser, url) as page:
        find(page, "tab-shape").click()
        right, before = (
            page.evaluate(f"eigenshape.viewer.axes.{each}.toArray()")
            for each in ("right", "towards")
        )
        find(page, "roll-left").click()
        wait_until_still(page)
        assert page.evaluate("eigenshape.state.up") == pytest.approx(right, abs=1e-6)
        assert page.evaluate("eigenshape.viewer.axes.towards.toArray()") == pytest.approx(
            before, abs=1e-6
        )
        find(page, "canvas").press("ArrowLeft")
        find(page, "front").click()
        wait_until_still(page)
        side = page.evaluate("[eigenshape.state.up, eigenshape.state.towards]")
        assert side[1] != before
    with serve_studio(path) as url, open_page(browser, url) as page:
        assert page.evaluate("[eigenshape.state.up, eigenshape.state.towards]") == side
