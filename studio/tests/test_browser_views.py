"""Views along the axes, points behind the shape, and what fits into the window, in a real browser."""

import numpy as np
import pytest
from browser import (
    LAPTOP,
    find,
    open_page,
    picture,
    place_of,
    wait_until,
    wait_until_still,
)

pytestmark = pytest.mark.long

N_VERTICES = 1000
RED = "#ff0000"
RING = 5  # pixels from the middle, of 7


@pytest.fixture
def page(browser, url):
    with open_page(browser, url) as page:
        wait_until(page, "eigenshape.state.spectrum.k > 0")
        yield page


# The creature stands along y and looks along z.
@pytest.mark.parametrize(
    ("key", "button", "axes"),
    [
        ("1", "view-front", ["x", "y", "z"]),
        ("3", "view-right", ["-z", "y", "x"]),
        ("7", "view-top", ["x", "-z", "y"]),
    ],
)
def test_a_key_looks_along_an_axis(page, mesh, key, button, axes):
    find(page, "views").click()
    find(page, button).click()
    named = read_axes(page)
    page.keyboard.press("Home")
    assert read_axes(page) != named
    page.keyboard.press(key)
    assert read_axes(page) == named == axes
    # Lines of sight are parallel: both ends of the shape along them are seen at one place.
    depth = "xyz".index(axes[2])
    far, near = mesh.vertices[::50].copy(), mesh.vertices[::50].copy()
    far[:, depth], near[:, depth] = mesh.vertices.min(), mesh.vertices.max()
    shifts = [
        np.subtract(place_of(page, one), place_of(page, other))
        for one, other in zip(far, near, strict=True)
    ]
    assert np.abs(shifts).max() < 1  # pixel
    box = page.evaluate("(({ left, right, top, bottom }) => [left, right, top, bottom])"
                        "(eigenshape.viewer.canvas.getBoundingClientRect())")  # fmt: skip
    seen = np.array([place_of(page, point) for point in mesh.vertices[::20]])
    assert (seen > [box[0], box[2]]).all()
    assert (seen < [box[1], box[3]]).all()


def read_axes(page):
    """Return the axes of the mesh that point to the right, up and to the viewer, if they are axes."""
    code = "Object.values(eigenshape.viewer.axes).map((axis) => axis.toArray())"
    names = []
    for axis in np.array(page.evaluate(code)):
        entry = np.abs(axis).argmax()
        straight = abs(axis[entry]) > 1 - 1e-6
        names.append(f"{'-' if axis[entry] < 0 else ''}{'xyz'[entry]}" if straight else "none")
    return names


def test_the_opposite_side_and_perspective_by_keys(page):
    page.keyboard.press("1")
    page.keyboard.press("9")
    assert read_axes(page) == ["-x", "y", "-z"]
    assert find(page, "parallel").get_attribute("aria-pressed") == "true"
    height = page.evaluate("eigenshape.viewer.pixelsOf(1)")
    page.keyboard.press("5")
    assert page.evaluate("eigenshape.viewer.camera.fov") == 26
    assert page.evaluate("eigenshape.viewer.pixelsOf(1)") == pytest.approx(height, rel=1e-6)
    page.keyboard.press("5")
    view = page.evaluate("eigenshape.viewer.camera.position.toArray()")
    page.reload()
    wait_until(page, "window.eigenshape?.strip")
    assert find(page, "parallel").get_attribute("aria-pressed") == "true"
    assert page.evaluate("eigenshape.viewer.camera.position.toArray()") == pytest.approx(view)
    page.keyboard.press("?")
    keys = find(page, "keys").inner_text()
    for text in ("the front", "the right side", "from above", "the opposite side", "perspective"):
        assert text in keys


def test_a_vertex_is_picked_where_an_orthographic_view_shows_it(page, mesh):
    page.keyboard.press("3")
    vertex = int(mesh.vertices[:, 0].argmax())
    x, y = place_of(page, mesh.vertices[vertex])
    hit = page.evaluate(f"eigenshape.viewer.pick({x}, {y})")
    assert np.linalg.norm(hit["point"] - mesh.vertices[vertex]) < 0.02


def test_points_behind_the_shape_are_hollow(page, mesh):
    page.keyboard.press("3")
    side = mesh.vertices[:, 0]
    near, far = int(side.argmax()), int(side.argmin())
    page.evaluate(f"eigenshape.viewer.setPoints([{near}, {far}], '{RED}')")
    assert is_red(disc_colors(page, mesh.vertices[near])[0])
    middle, edge = disc_colors(page, mesh.vertices[far])
    assert not is_red(middle)  # the shape itself
    assert is_red(edge)
    page.keyboard.press("9")
    assert is_red(disc_colors(page, mesh.vertices[far])[0])
    assert not is_red(disc_colors(page, mesh.vertices[near])[0])


def disc_colors(page, point):
    """Return the colors in the middle of a disc, and near its edge, where a ring has its color."""
    x, y = np.round(place_of(page, point)).astype(int)
    seen = picture(page)[..., :3].astype(int)
    ring = [seen[y, x + step] for step in (-RING, RING)]
    return seen[y, x], np.mean(ring, axis=0)


def is_red(color):
    return color[0] > 1.6 * max(color[1:])


def test_tabs_fit_into_one_row_on_a_laptop(browser, url):
    with open_page(browser, url, size=LAPTOP) as page:
        wait_until(page, "eigenshape.active !== null")
        assert find(page, "brand").inner_text() == "eigenshape studio"
        for name in page.evaluate("[...eigenshape.pages.keys()]"):
            find(page, f"tab-{name}").click()  # the chosen one is bold
            tabs = page.get_by_role("tab").all()
            boxes = [tab.bounding_box() for tab in tabs]
            assert len({box["y"] for box in boxes}) == 1
            assert boxes[-1]["x"] + boxes[-1]["width"] <= LAPTOP[0]
            cut = "(tab) => tab.scrollWidth > tab.clientWidth"
            assert not [tab for tab in tabs if tab.evaluate(cut)]


@pytest.mark.parametrize("panel", ["spectrum", "parts"])
def test_no_number_of_a_diagram_is_cut(page, panel):
    find(page, f"tab-{panel}").click()
    wait_until(page, "eigenshape.active.plot?.axes[1]._values?.length > 0")
    wait_until_still(page)
    code = """() => {
        const { ctx, axes: [, { font, _values, _size }] } = eigenshape.active.plot;
        ctx.font = font[0];
        return [_size, Math.max(..._values.map((text) => ctx.measureText(text).width))];
    }"""
    size, widest = page.evaluate(code)
    assert widest <= size - 13  # pixels of ticks and gap
