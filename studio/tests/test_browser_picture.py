"""The strip over the picture, and the page on a phone, in a real browser."""

from io import BytesIO

import numpy as np
import pytest
from browser import (
    PANEL,
    find,
    find_faults,
    limb,
    move_pointer,
    move_slider,
    open_page,
    picture,
    place_of,
    positions,
    serve_studio,
    vertex_values,
    wait_for_edits,
    wait_until,
    wait_until_still,
)
from PIL import Image

import eigenshape as es

pytestmark = pytest.mark.long

N_VERTICES = 1000
PHONE = (390, 780)


@pytest.fixture
def page(browser, url):
    with open_page(browser, url) as page:
        wait_until(page, "eigenshape.state.spectrum.k > 0")
        yield page


def middle_of(page, vertex):
    """Return where a vertex is seen, a little inside the shape."""
    code = f"Array.from(eigenshape.viewer.vertices.subarray({3 * vertex}, {3 * vertex + 3}))"
    return place_of(page, page.evaluate(code))


def front_vertices(page, mesh):
    """Return vertices that are seen: what is picked where they are lies near them."""
    code = """(places) => places.map(([x, y]) => {
        const box = eigenshape.viewer.canvas.getBoundingClientRect();
        return eigenshape.viewer.pick(x - box.x, y - box.y)?.vertex ?? -1;
    })"""
    chosen = list(range(0, mesh.n_vertices, 23))
    places = [middle_of(page, vertex) for vertex in chosen]
    hit = page.evaluate(code, places)
    return [vertex for vertex, found in zip(chosen, hit, strict=True) if vertex == found]


def test_edges_and_a_cut_are_drawn_on_demand(page, mesh):
    plain = picture(page).astype(int)
    find(page, "edges").click()
    n_edges = page.evaluate("eigenshape.viewer.edges.geometry.index.count / 2")
    assert n_edges == 3 * mesh.n_faces / 2  # of a closed surface
    with_edges = picture(page).astype(int)
    inside = plain[..., 3] == 255
    assert (with_edges[inside] < plain[inside] - 20).any(axis=1).mean() > 0.05
    page.keyboard.press("e")
    assert find(page, "edges").get_attribute("aria-pressed") == "false"

    find(page, "cut").click()
    find(page, "cut-along").select_option("Top to bottom")
    move_slider(page, "cut-place", 0.5)
    cut = picture(page)[..., 3] == 255
    rows = np.flatnonzero(inside.any(axis=1))
    assert 0.2 < cut.sum() / inside.sum() < 0.8
    assert np.flatnonzero(cut.any(axis=1))[0] > rows[0] + 20  # its head is gone
    # What is cut off is not picked.
    x, y = place_of(page, mesh.vertices[mesh.vertices[:, 1].argmax()])
    assert page.evaluate(f"eigenshape.viewer.pick({x}, {y + 3})") is None
    find(page, "cut").click()
    assert ((picture(page)[..., 3] == 255) == inside).all()


def test_the_ruler_measures_between_two_clicks(page, mesh):
    one, other = (front_vertices(page, mesh)[place] for place in (0, -1))
    find(page, "measure").click()
    ends = []
    for vertex in (one, other):
        x, y = middle_of(page, vertex)
        ends.append(page.evaluate(f"eigenshape.viewer.pick({x}, {y}).point"))
        page.mouse.click(x, y)
    length = np.linalg.norm(np.subtract(*ends))
    assert float(find(page, "length").inner_text()) == pytest.approx(length, rel=0.02)
    find(page, "measure").click()
    assert not find(page, "length").is_visible()


def test_values_under_the_pointer_and_colors_of_choice(page, mesh):
    find(page, "tab-spectrum").click()
    find(page, "legend").wait_for()
    wait_until_still(page)
    vertex = front_vertices(page, mesh)[2]
    move_pointer(page, *middle_of(page, vertex))
    tip = find(page, "tip").get_by_text(f"at vertex {vertex}")
    tip.wait_for()
    shown = float(tip.inner_text().split()[0].replace("−", "-"))
    assert shown == pytest.approx(vertex_values(page)[vertex], rel=1e-3)

    before = picture(page).astype(int)
    find(page, "legend").locator("summary").click()
    find(page, "map").select_option("inferno")
    find(page, "range-1").fill("0.25")
    find(page, "range-1").press("Enter")
    scale = "eigenshape.viewer.surface.material.uniforms.range.value.y"
    assert page.evaluate(scale) == 0.25
    seen = before[..., 3] == 255  # its shadow on the ground is less
    assert np.abs(picture(page).astype(int) - before)[seen].mean() > 20
    move_slider(page, "eigenfunction", 2)  # another function has its own colors
    wait_until_still(page)
    assert page.evaluate(scale) != 0.25


def test_films_are_played_and_saved(page, tmp_path):
    find(page, "tab-spectrum").click()
    find(page, "legend").wait_for()
    wait_until_still(page)
    find(page, "film").click()
    find(page, "film-kind").select_option("Vibration")
    find(page, "film-play").click()
    swing = "eigenshape.viewer.surface.material.uniforms.swing.value"
    wait_until(page, f"{swing} < 0")
    find(page, "film-play").click()
    wait_until(page, f"{swing} === 0")
    before = page.evaluate("eigenshape.viewer.camera.position.toArray()")
    find(page, "film-kind").select_option("Turntable")
    with page.expect_download(timeout=120_000) as saved:
        find(page, "film-save").click()
    film = Image.open(BytesIO(saved.value.path().read_bytes()))
    assert (film.format, film.n_frames, film.width) == ("GIF", 90, 480)
    frames = []
    for number in (0, 45):
        film.seek(number)
        frames.append(np.asarray(film.convert("RGB"), dtype=int))
    assert (np.abs(frames[0] - frames[1]).max(axis=2) > 40).mean() > 0.05
    after = page.evaluate("eigenshape.viewer.camera.position.toArray()")
    assert after == pytest.approx(before, abs=1e-6)


def test_the_page_is_saved_as_one_file(browser, page, mesh, tmp_path):
    find(page, "film").click()
    with page.expect_download(timeout=120_000) as saved:
        find(page, "film-page").click()
    path = tmp_path / "shape.html"
    saved.value.save_as(path)
    with open_page(browser, path.as_uri()) as alone:
        assert alone.evaluate("eigenshape.state.n_vertices") == mesh.n_vertices
        find(alone, "tab-spectrum").click()
        find(alone, "film").click()
        assert "Vibration" in find(alone, "film-kind").inner_text()
        assert not find(alone, "film-page").is_visible()


def touch(session, kind, *places):
    """Put fingers on the screen, move them, or lift them."""
    points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(places)]
    session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


@pytest.mark.parametrize("size", [PHONE, (1280, 800)])
def test_the_picture_keeps_its_size_while_a_wheel_turns(browser, url, size):
    busy = "panel => panel.getRootNode().querySelector('.studio').classList.toggle('busy')"
    with open_page(browser, url, size=size) as page:
        wait_until(page, f"{PANEL}?.limbs.farthest()")
        stage = find(page, "stage").bounding_box()
        find(page, "panels").evaluate(busy)
        assert find(page, "stage").bounding_box() == stage


def test_on_a_phone_fingers_turn_zoom_and_bend_where_they_are_told_to(browser, url, mesh):
    with open_page(browser, url, size=PHONE, more=False) as page:
        wait_until(page, f"{PANEL}?.limbs.farthest()")
        fingers = page.context.new_cdp_session(page)
        stage = find(page, "stage").bounding_box()
        assert stage["width"] == PHONE[0]
        assert stage["height"] > 0.75 * PHONE[1]
        assert not find(page, "hint").is_visible()
        find(page, "tab-heat").click()
        find(page, "time").wait_for()
        assert find(page, "stage").bounding_box() == stage  # the panel lies over it
        find(page, "tab-deform").click()
        find(page, "hint").wait_for()
        assert "Finger: turns" in find(page, "hint").inner_text()
        # All of the shape is seen above the panel, and is picked where it is seen.
        wait_until_still(page)
        top = find(page, "panels").bounding_box()["y"]
        places = np.array([place_of(page, mesh.vertices[v]) for v in range(0, mesh.n_vertices, 9)])
        assert places[:, 1].max() < top
        assert front_vertices(page, mesh)
        find(page, "sheet").click()
        assert not find(page, "hint").is_visible()

        chosen = limb(page, page.evaluate(f"{PANEL}.limbs.farthest().number"))
        x, y = place_of(page, mesh.vertices[chosen].mean(axis=0))
        camera = "eigenshape.viewer.camera.position.toArray()"
        distance = "eigenshape.viewer.camera.position.distanceTo(eigenshape.viewer.controls.target)"
        start, away = page.evaluate(camera), page.evaluate(distance)
        swipe(page, fingers, x, y)
        assert page.evaluate(camera) != start  # one finger turns, on a limb, too
        assert page.evaluate(distance) == pytest.approx(away)
        touch(fingers, "touchStart", (x - 30, y), (x + 30, y))
        touch(fingers, "touchMove", (x - 60, y), (x + 60, y))
        touch(fingers, "touchEnd")
        wait_until(page, f"{distance} < {0.9 * away}")
        assert page.evaluate("eigenshape.state.deformation.n_edits") == 0

        find(page, "whole").click()
        find(page, "finger").click()
        assert find(page, "finger").inner_text() == "Finger: bends or paints"
        swipe(page, fingers, x, y)
        wait_for_edits(page, 1)
        # Two shapes stand side by side, both above the panel.
        find(page, "tab-compare").click()
        find(page, "second-sample").select_option("hand")
        wait_until(page, "eigenshape.second?.viewer.vertices.length > 0")
        wait_until_still(page)
        boxes = [find(page, name).bounding_box() for name in ("stage", "beside")]
        assert boxes == [stage | {"x": x, "width": PHONE[0] / 2} for x in (0, PHONE[0] / 2)]
        assert page.evaluate("eigenshape.second.viewer.covered") > 100
        # Also where the panel has gone away, nothing of them is cut off.
        find(page, "sheet").click()
        wait_until_still(page)
        assert page.evaluate("eigenshape.second.viewer.covered") == 0
        places = np.array([place_of(page, point) for point in positions(page)[::9]])
        assert 0 < places[:, 0].min() < places[:, 0].max() < PHONE[0] / 2


def swipe(page, fingers, x, y):
    touch(fingers, "touchStart", (x, y))
    for step in (10, 25, 40):
        touch(fingers, "touchMove", (x + step, y))
    touch(fingers, "touchEnd")
    wait_until_still(page)


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_axe_finds_nothing_serious_or_moderate(browser, url, dark):
    with open_page(browser, url, dark=dark) as page:
        wait_until(page, f"{PANEL}?.limbs.farthest()")
        for name in ("cut", "measure", "film"):
            find(page, name).click()
        for panel in ("deform", "shape", "spectrum", "heat", "parts"):
            find(page, f"tab-{panel}").click()
            wait_until_still(page)
            assert find_faults(page) == []
        page.keyboard.press("?")
        assert find_faults(page) == []


def test_a_cortex_is_upright_and_gray_where_its_map_has_no_value(browser, tmp_path):
    ball = es.icosphere(4)
    # A left hemisphere, longest along y, as files of brains have it
    cortex = es.TriangleMesh(ball.vertices * [30, 80, 50] - [35, 0, 0], ball.faces)
    height = ball.vertices[:, 2]
    values = np.where(height > 0, np.nan, height)
    es.io.write_fields(cortex, tmp_path / "lh.height.gii", {"height": values})
    with (
        serve_studio(tmp_path / "lh.height.gii") as url,
        open_page(browser, url) as page,
    ):
        wait_until_still(page)
        find(page, "tab-shape").click()
        find(page, "values").select_option("height")
        wait_until_still(page)
        seen = picture(page).astype(int)
    rows, columns = np.nonzero(seen[..., 3] == 255)
    assert np.ptp(columns) > 1.4 * np.ptp(rows)  # from the side
    # The upper half has no value, and is as wide as the lower one.
    middle = (columns.min() + columns.max()) // 2
    spread = np.ptp(seen[..., :3], axis=2)
    for share, gray in ((0.2, True), (0.35, True), (0.65, False), (0.8, False)):
        row = int(rows.min() + share * np.ptp(rows))
        assert seen[row, middle, 3] == 255
        assert (spread[row, middle] < 3) == gray
