"""Two shapes, landmarks and a collection in a real browser, by mouse and keyboard."""

import json

import numpy as np
import pytest
from browser import (
    find,
    find_faults,
    move_pointer,
    move_slider,
    open_page,
    place_of,
    positions,
    region,
    serve_studio,
    vertex_values,
    wait_until,
    wait_until_still,
)
from test_company import collection  # noqa: F401  a fixture

import eigenshape as es
from eigenshape_studio.wire import decode

pytestmark = pytest.mark.long

N_VERTICES = 800
MAP = "eigenshape.panels.find(({ id }) => id === 'compare').map"
BOTH = ("eigenshape.viewer", "eigenshape.second.viewer")
# Where both cameras stand, in the coordinates of their shapes
EYES = """[eigenshape.viewer, eigenshape.second.viewer].map(({ camera, space }) =>
    camera.position.clone().applyMatrix4(space.matrixWorld.clone().invert()).toArray())"""


def attribute(page, name, side):
    code = f"Array.from({BOTH[side]}.geometry.getAttribute('{name}').array)"
    return np.array(page.evaluate(code))


def discs(page, side):
    code = f"{BOTH[side]}.discs.visible ? Array.from({BOTH[side]}.discs.geometry.index.array) : []"
    return page.evaluate(code)


def place_in_second(page, point):
    """Return where a point of the second shape is seen."""
    page.evaluate(
        "[window.first, eigenshape.viewer] = [eigenshape.viewer, eigenshape.second.viewer]"
    )
    found = place_of(page, point)
    page.evaluate("eigenshape.viewer = window.first")
    return found


def seen_vertex(page, side):
    """Return a vertex that nothing hides, as the picture says, and where it is seen."""
    code = f"""(() => {{
        const {{ canvas, pick }} = {BOTH[side]};
        const view = {BOTH[side]};
        for (const x of [0.5, 0.45, 0.55, 0.4, 0.6])
            for (const y of [0.5, 0.45, 0.55, 0.4]) {{
                const hit = view.pick(x * canvas.clientWidth, y * canvas.clientHeight);
                if (hit) return hit.vertex;
            }}
    }})()"""
    vertex = page.evaluate(code)
    point = attribute(page, "position", side).reshape(-1, 3)[vertex]
    return vertex, place_of(page, point) if side == 0 else place_in_second(page, point)


def asks_for_disc(request):
    """Say whether a call asks for a disc on the second shape."""
    body = request.post_data_buffer
    return body is not None and b"beside/disc/" in body


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    path = tmp_path_factory.mktemp("second") / "other.ply"
    es.write_mesh(es.make_creature("quadruped", 1, n_vertices=N_VERTICES), path)
    return path


def test_a_second_shape_is_mapped_corrected_and_takes_over_what_is_painted(page, other):
    find(page, "tab-compare").click()
    with page.expect_file_chooser() as chooser:
        find(page, "second-file").click()
    chooser.value.set_files(other)
    wait_until(page, "eigenshape.state.beside?.map.status === 'ready'")
    wait_until(page, "eigenshape.panels.find(({ id }) => id === 'compare').map !== null")
    wait_until_still(page)

    # One camera follows the other, in both directions.
    laid = np.reshape(page.evaluate("eigenshape.state.beside.similarity"), (3, 4))
    for side in (0, 1):
        page.locator('[data-test="canvas"]').nth(side).press("ArrowLeft")
        page.locator('[data-test="canvas"]').nth(side).press("ArrowUp")
        ours, theirs = np.array(page.evaluate(EYES))
        np.testing.assert_allclose(theirs, laid[:, :3] @ ours + laid[:, 3], atol=1e-5)
    page.keyboard.press("3")
    assert page.evaluate(f"[{', '.join(BOTH)}].map(({{ camera }}) => camera.fov)") == [0.1, 0.1]
    ours, theirs = np.array(page.evaluate(EYES))
    np.testing.assert_allclose(theirs, laid[:, :3] @ ours + laid[:, 3], rtol=1e-5)
    page.keyboard.press("5")
    page.keyboard.press("Home")

    # Equal colors correspond; what is not sure is gray.
    partners, back = (np.array(page.evaluate(f"Array.from({MAP}.partners[{i}])")) for i in (0, 1))
    ours, theirs = (attribute(page, "mark", side).reshape(-1, 4).astype(int) for side in (0, 1))
    assert (ours[:, 3] == 255).all()
    assert np.median(np.abs(ours[:, :3] - theirs[partners, :3])) <= 6

    # The point under the pointer, and the one that corresponds
    _, place = seen_vertex(page, 0)
    move_pointer(page, *place)
    wait_until(page, "eigenshape.viewer.discs.visible")
    assert discs(page, 1) == [partners[discs(page, 0)[0]]]
    assert find(page, "under-pointer").inner_text().startswith("Right by ")

    assert find_faults(page) == []

    # Two points that belong together: the map goes through them, and Ctrl+Z takes that back.
    find(page, "correct").click()
    _vertex, place = seen_vertex(page, 0)
    page.mouse.click(*place)
    _there, place = seen_vertex(page, 1)
    page.mouse.click(*place)
    wait_until(page, "eigenshape.state.beside.pairs.length === 1")
    wait_until(page, "eigenshape.state.beside.map.status === 'ready'")
    wait_until_still(page)
    chosen = page.evaluate("eigenshape.state.beside.pairs[0]")
    assert page.evaluate(f"{MAP}.partners[0][{chosen[0]}]") == chosen[1]
    page.keyboard.press("Control+z")
    wait_until(page, "eigenshape.state.beside.pairs.length === 0")
    wait_until(page, "eigenshape.state.beside.map.status === 'ready'")
    wait_until_still(page)

    # What is painted on one is seen on the other.
    find(page, "tab-deform").click()
    find(page, "tool-brush").click()
    _, place = seen_vertex(page, 0)
    page.mouse.click(*place)
    wait_until_still(page)
    back = np.array(page.evaluate(f"Array.from({MAP}.partners[1])"))
    ours, theirs = (attribute(page, "mark", side).reshape(-1, 4) for side in (0, 1))
    assert (ours[:, 3] > 0).any()
    np.testing.assert_array_equal(theirs[back >= 0], ours[back[back >= 0]])

    check_painting_on_the_second(page, es.read_mesh(other))

    check_that_the_map_stays(page)

    find(page, "close-match").click()
    wait_until(page, "eigenshape.second === null")
    assert page.locator('[data-test="canvas"]').count() == 1


def check_that_the_map_stays(page):
    """The map stays when the shape takes the pose of the other one, and when that is undone."""
    find(page, "tab-compare").click()
    partners = page.evaluate(f"Array.from({MAP}.partners[0])")
    number = page.evaluate("eigenshape.state.shape")
    for act in (find(page, "take-pose").click, lambda: page.keyboard.press("Control+z")):
        act()
        wait_until(page, f"eigenshape.state.shape !== {number}")
        number = page.evaluate("eigenshape.state.shape")
        wait_until_still(page)
        wait_until(page, f"{MAP} !== null")
        assert page.evaluate(f"Array.from({MAP}.partners[0])") == partners


def check_painting_on_the_second(page, second):
    """What is painted there is chosen on the first, by the keyboard as well: a disc of the second."""
    _, place = seen_vertex(page, 1)
    for paint in (
        lambda: page.mouse.click(*place),
        lambda: page.locator('[data-test="canvas"]').nth(1).press(" "),
    ):
        find(page, "clear").click()
        wait_until_still(page)
        with page.expect_request(asks_for_disc) as asked:
            paint()
        wait_until_still(page)
        name = decode(asked.value.post_data_buffer)[0]["name"]
        _, _, vertex, radius = name.split("/")
        near = es.geometry.geodesic_waves(second)(int(vertex), float(radius)) <= float(radius)
        there = np.array(page.evaluate(f"Array.from({MAP}.partners[0])"))
        assert near.any()
        np.testing.assert_array_equal(region(page), np.flatnonzero((there >= 0) & near[there]))


def test_landmarks_are_placed_named_moved_saved_and_loaded(page, tmp_path):
    find(page, "tab-landmarks").click()
    find(page, "place").click()
    _first, place = seen_vertex(page, 0)
    page.mouse.click(*place)
    wait_until(page, "eigenshape.state.landmarks.length === 1")
    page.mouse.click(place[0] + 25, place[1])
    wait_until(page, "eigenshape.state.landmarks.length === 2")
    find(page, "place").click()
    wait_until_still(page)
    assert len(discs(page, 0)) == 2
    assert find_faults(page) == []
    name = find(page, "landmark-0").locator("input")
    name.fill("withers")
    name.press("Enter")
    wait_until(page, "eigenshape.state.landmarks[0].name === 'withers'")
    with page.expect_download() as download:
        find(page, "save-0").get_by_text(".mrk.json").click()
    path = tmp_path / download.value.suggested_filename
    download.value.save_as(path)
    saved = es.morphometrics.read_landmarks(path)
    points = page.evaluate("eigenshape.state.landmarks.map(({ point }) => point)")
    assert saved.names == ("withers", "2")
    np.testing.assert_array_equal(saved.points, points)

    find(page, "landmark-1").get_by_text("Move").click()
    page.mouse.click(place[0], place[1] + 20)
    wait_until(
        page, f"JSON.stringify(eigenshape.state.landmarks[1].point) !== '{json.dumps(points[1])}'"
    )
    find(page, "landmark-0").get_by_text("×").click()
    wait_until(page, "eigenshape.state.landmarks.length === 1")
    page.keyboard.press("Control+z")
    wait_until(page, "eigenshape.state.landmarks.length === 2")
    with page.expect_file_chooser() as chooser:
        find(page, "load-landmarks").click()
    chooser.value.set_files(path)
    wait_until_still(page)
    again = page.evaluate("eigenshape.state.landmarks.map(({ point }) => point)")
    np.testing.assert_allclose(again, points, atol=1e-9)


def test_a_cloud_is_shown_as_points_or_as_its_surface(page, tmp_path):
    cloud = tmp_path / "ball.xyz"
    es.io.write_points(es.PointCloud(es.icosphere(3).vertices), cloud)
    find(page, "tab-shape").click()
    with page.expect_file_chooser() as chooser:
        find(page, "open").click()
    chooser.value.set_files(cloud)
    wait_until(page, "eigenshape.state.n_points === 642")
    find(page, "cloud").wait_for()
    assert not page.evaluate("eigenshape.viewer.surface.visible")
    # Nothing lies over its buttons.
    click = """(name) => {
        const box = eigenshape.main.querySelector('[data-test="cloud"]').getBoundingClientRect();
        const root = eigenshape.main.getRootNode();
        return [0.1, 0.5, 0.9].map((share) =>
            root.elementFromPoint(box.x + share * box.width, box.y + box.height / 2).textContent);
    }"""
    assert page.evaluate(click) == ["Points", "Surface", "Surface"]
    find(page, "cloud").get_by_text("Surface").click()
    assert page.evaluate("eigenshape.viewer.surface.visible")
    page.keyboard.press("Control+z")
    wait_until(page, "eigenshape.state.n_points === 0")
    wait_until_still(page)
    assert find(page, "cloud").count() == 0
    assert page.evaluate("eigenshape.viewer.surface.visible")


def test_a_collection_is_opened_from_the_window_and_has_sliders_and_specimens(
    browser,
    collection,  # noqa: F811
    monkeypatch,
):
    # The page may open what lies in the folder in which the studio is started.
    monkeypatch.chdir(collection.parent)
    ball = collection.parent / "ball.ply"
    es.write_mesh(es.icosphere(1), ball)
    with serve_studio(ball) as url, open_page(browser, url) as page:
        find(page, "tab-shape").click()
        find(page, "open-folder").click()
        find(page, f"folder-{collection.name}").wait_for()
        assert find(page, "folder-open").inner_text() == "Open 1 shape of this folder"
        assert find_faults(page) == []
        find(page, f"folder-{collection.name}").click()
        find(page, "tab-collection").click()
        wait_until_still(page)
        assert find_faults(page) == []
        mean = positions(page)
        move_slider(page, "mode-0", 2)
        wait_until(page, "eigenshape.panels.find(({ id }) => id === 'collection').modes !== null")
        wait_until_still(page)
        modes = np.array(
            page.evaluate(
                "Array.from(eigenshape.panels.find(({ id }) => id === 'collection').modes)"
            )
        ).reshape(-1, *mean.shape)
        np.testing.assert_allclose(positions(page), mean + 2 * modes[0], atol=1e-5)
        assert np.abs(vertex_values(page)).max() > 0
        find(page, "mean").click()
        wait_until_still(page)
        np.testing.assert_allclose(positions(page), mean, atol=1e-6)
        find(page, "specimen-b").click()
        wait_until(page, "eigenshape.second?.viewer.vertices.length > 0")
        wait_until(page, "eigenshape.state.beside.map.status === 'ready'")
        find(page, "tab-compare").click()
        wait_until_still(page)
        assert page.evaluate("eigenshape.state.beside.name") == "b"
        assert (attribute(page, "mark", 1).reshape(-1, 4)[:, 3] == 255).all()
