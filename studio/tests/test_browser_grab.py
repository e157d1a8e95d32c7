"""Several limbs at once, mirrored motions, and motions begun by keys, in a real browser."""

import numpy as np
import pytest
from browser import (
    PANEL,
    find,
    limb,
    move_pointer,
    open_page,
    positions,
    region,
    wait_for_edits,
    wait_until,
    wait_until_bound,
)

import eigenshape as es
from eigenshape.deformation import bend, bind, region_boundary

pytestmark = pytest.mark.long

N_VERTICES = 1000
SHADER = 1e-5
LIMBS = f"{PANEL}.limbs"
# Where each limb is seen, in pixels: the vertex of it that has most of its limb around it.
PLACES = f"""() => {{
    const {{ viewer }} = eigenshape, {{ limbs }} = {PANEL}, found = {{}};
    for (let vertex = 0; 3 * vertex < viewer.vertices.length; vertex += 3) {{
        const [x, y] = viewer.placeOf([...viewer.vertices.subarray(3 * vertex, 3 * vertex + 3)]);
        const number = limbs.at(viewer.pick(x, y)?.vertex);
        if (number < 0 || number !== limbs.at(vertex)) continue;
        const around = [[9, 0], [-9, 0], [0, 9], [0, -9]].filter(([right, down]) =>
            limbs.at(viewer.pick(x + right, y + down)?.vertex) === number);
        if (around.length > (found[number]?.[0] ?? 0)) found[number] = [around.length, x, y];
    }}
    return Object.entries(found).map(([number, [, x, y]]) => [Number(number), x, y]);
}}"""


@pytest.fixture
def page(browser, url):
    with open_page(browser, url) as page:
        wait_until(page, f"{LIMBS}?.farthest()")
        page.keyboard.press("1")
        yield page


def pivot_of(mesh, chosen):
    rim = region_boundary(mesh, np.isin(np.arange(mesh.n_vertices), chosen))
    return mesh.vertices[rim].mean(axis=0)


def point_at(page, place):
    """Let a limb light up, and return its number."""
    number, x, y = place
    move_pointer(page, x, y)
    wait_until(page, f"{LIMBS}.lit === {number}")
    return number


def choose(page, place):
    """Choose a limb, which stays lit wherever the pointer is, and return its number."""
    number = point_at(page, place)
    page.keyboard.down("Shift")
    page.mouse.click(*place[1:])
    page.keyboard.up("Shift")
    return number


def test_limbs_that_are_chosen_turn_together(page, mesh, rig):
    one, other, *_ = page.evaluate(PLACES)
    for place in (one, other):
        choose(page, place)
    assert page.evaluate(f"{LIMBS}.chosen") == [one[0], other[0]]
    move_pointer(page, 5, 300)  # beside the shape, they stay chosen
    for key in "r40":
        page.keyboard.press(key)
        wait_until(page, f"{PANEL}.grab.grip !== null")
    page.keyboard.press("Enter")
    wait_for_edits(page, 1)
    chosen = [limb(page, number) for number in (one[0], other[0])]
    towards = [0, 0, 1]
    turns = [es.Rotation(pivot_of(mesh, each), towards, np.radians(40)) for each in chosen]
    bent = bend(bind(rig, chosen), turns)
    np.testing.assert_allclose(positions(page), bent.vertices, atol=1e-4)  # the view leans by 1e-4
    page.keyboard.press("Escape")
    assert page.evaluate(f"{LIMBS}.chosen") == []


def test_a_motion_is_mirrored_along_an_axis(page, mesh, rig):
    find(page, "mirror").select_option("in x")
    places = page.evaluate(PLACES)
    images = {number: page.evaluate(f"{LIMBS}.imageOf({number})") for number, *_ in places}
    for number, image in images.items():  # legs and ears come in pairs
        if image >= 0:
            one, two = (mesh.vertices[limb(page, each)].mean(axis=0) for each in (number, image))
            # Parts of a pair may end at different heights; legs are 0.27 apart.
            np.testing.assert_allclose(one * [-1, 1, 1], two, atol=0.1)
    number = point_at(page, next(place for place in places if images[place[0]] >= 0))
    lit = np.array(page.evaluate(f"Array.from({PANEL}.selection.lit)"))
    chosen = [limb(page, each) for each in (number, images[number])]
    assert all((lit[each] > 127).mean() > 0.9 for each in chosen)

    for key in "gx.1":
        page.keyboard.press(key)
        wait_until(page, f"{PANEL}.grab.grip !== null")
    page.keyboard.press("Enter")
    wait_for_edits(page, 1)
    assert find(page, "cut").get_attribute("aria-pressed") == "false"  # X was an axis
    bent = bend(bind(rig, chosen), [es.Translation([0.1, 0, 0]), es.Translation([-0.1, 0, 0])])
    np.testing.assert_allclose(positions(page), bent.vertices, atol=SHADER)


def test_a_limb_is_scaled_by_its_distance_to_the_pivot(page, mesh, rig):
    number = choose(page, page.evaluate(PLACES)[0])
    pivot = pivot_of(mesh, limb(page, number))
    x, y = page.evaluate(f"eigenshape.viewer.placeOf({pivot.tolist()})")
    move_pointer(page, x + 30, y + 40)
    page.keyboard.press("s")
    wait_until(page, f"{PANEL}.grab.grip !== null")
    move_pointer(page, x + 45, y + 60)
    page.keyboard.press("z")
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert handle["factors"] == pytest.approx([1, 1, 1.5], rel=0.02)
    binding = bind(rig, [limb(page, number)])
    scaling = es.deformation.Scaling(handle["pivot"], handle["factors"])
    page.evaluate("eigenshape.viewer.motion.blend.value = 0")
    moved = mesh.vertices + scaling.carry(mesh.vertices, binding.shares[0])
    np.testing.assert_allclose(positions(page), moved, atol=SHADER)
    page.keyboard.press("Enter")
    wait_for_edits(page, 1)
    np.testing.assert_allclose(positions(page), bend(binding, [scaling]).vertices, atol=SHADER)


def test_the_pointer_turns_what_a_key_began_and_escape_drops_it(page, mesh):
    rest = positions(page)
    number = choose(page, page.evaluate(PLACES)[0])
    pivot = pivot_of(mesh, limb(page, number))
    x, y = page.evaluate(f"eigenshape.viewer.placeOf({pivot.tolist()})")
    angles = np.linspace(0, 8, 17)
    around = np.column_stack([x + 80 * np.cos(angles), y - 80 * np.sin(angles)]).tolist()
    move_pointer(page, *around[0])
    page.keyboard.press("r")
    wait_until(page, f"{PANEL}.grab.grip !== null")
    for place in around:
        move_pointer(page, *place)
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert handle["angle"] == pytest.approx(8, abs=0.05)  # more than a full turn, as it was seen
    assert handle["axis"] == pytest.approx([0, 0, 1], abs=1e-3)
    page.keyboard.press("y")
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert handle["axis"] == [0, 1, 0]
    page.keyboard.press("Escape")
    assert page.evaluate(f"{PANEL}.grab.grip") is None
    np.testing.assert_array_equal(positions(page), rest)


def test_a_region_follows_the_pointer_along_an_axis_until_a_click(page, mesh, rig):
    find(page, "tool-box").click()
    wait_until_bound(page)
    chosen = region(page)
    move_pointer(page, 300, 300)
    page.keyboard.press("g")
    wait_until(page, f"{PANEL}.grab.grip !== null")
    move_pointer(page, 340, 270)
    length = 1 / page.evaluate("eigenshape.viewer.pixelsOf(1)")
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert handle["vector"] == pytest.approx([40 * length, 30 * length, 0], abs=1e-3)
    page.keyboard.press("y")
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert handle["vector"] == pytest.approx([0, 30 * length, 0], rel=1e-2)
    page.mouse.click(340, 270)
    wait_for_edits(page, 1)
    bent = bend(bind(rig, [chosen]), [es.Translation(handle["vector"])])
    np.testing.assert_allclose(positions(page), bent.vertices, atol=SHADER)
    page.mouse.move(400, 200)  # nothing follows any more
    np.testing.assert_allclose(positions(page), bent.vertices, atol=SHADER)
