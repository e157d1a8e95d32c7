"""Deformation in a real browser: the mouse moves what numpy moves."""

import json
from datetime import datetime, timedelta

import numpy as np
import pytest
from browser import (
    PANEL,
    find,
    limb,
    move_pointer,
    place_of,
    positions,
    region,
    wait_for_edits,
    wait_until,
    wait_until_bound,
)

import eigenshape as es
from eigenshape.deformation import BoxRegion, BrushRegion, bend, bind, region_mask

pytestmark = pytest.mark.long

N_VERTICES = 2000
SHADER = 1e-5  # single precision: the largest error that the shader may have, in lengths of about 1


def click_brush(page, mesh):
    """Brush over the vertex on top, and return where, and the vertex that the brush took."""
    find(page, "tool-brush").click()
    x, y = place_of(page, mesh.vertices[mesh.vertices[:, 1].argmax()])
    hits = [page.evaluate(f"eigenshape.viewer.pick({x}, {y + down})") for down in range(2, 30, 2)]
    down = next(number for number, hit in enumerate(hits) if hit)
    y += 2 + 2 * down + 6
    vertex = page.evaluate(f"eigenshape.viewer.pick({x}, {y})")["vertex"]
    move_pointer(page, x, y)
    page.mouse.down()
    page.mouse.up()
    wait_until_bound(page)
    return x, y, vertex


def bend_by(mesh, rig, chosen, handles, mode="graded"):
    """Return the shape bent by the first handle of the page, and moved by its shares alone."""
    entry = handles[0]
    if entry["type"] == "rotation":
        handle = es.Rotation(entry["pivot"], entry["axis"], entry["angle"])
    else:
        handle = es.Translation(entry["vector"])
    binding = bind(rig, [chosen])
    moved = mesh.vertices + handle.carry(mesh.vertices, binding.shares[0])
    return bend(binding, [handle], mode=mode).vertices, moved


def test_box_and_brush_select_what_numpy_selects(page, mesh):
    _, _, vertex = click_brush(page, mesh)
    radius = 0.1 * page.evaluate("eigenshape.viewer.extent")
    disc = region_mask(mesh, BrushRegion(mesh.vertices[vertex], radius))
    np.testing.assert_array_equal(region(page), np.flatnonzero(disc))

    find(page, "clear").click()
    find(page, "tool-box").click()
    wait_until_bound(page)
    low, high = page.evaluate(f"[{PANEL}.selection.box.low, {PANEL}.selection.box.high]")
    np.testing.assert_array_equal(
        region(page), np.flatnonzero(region_mask(mesh, BoxRegion(low, high)))
    )

    # Drag the handle of the lower side upwards.
    x, y = place_of(page, [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    move_pointer(page, x, y)
    page.mouse.down()
    move_pointer(page, x, y - 60, steps=3)
    page.mouse.up()
    wait_until_bound(page)
    moved = page.evaluate(f"{PANEL}.selection.box.low")
    assert moved[1] > low[1]
    assert (moved[0], moved[2]) == (low[0], low[2])
    np.testing.assert_array_equal(
        region(page), np.flatnonzero(region_mask(mesh, BoxRegion(moved, high)))
    )


def test_a_mouse_drag_moves_the_shape_as_numpy_does(page, mesh, rig):
    x, y, _ = click_brush(page, mesh)
    find(page, "tool-pull").click()
    move_pointer(page, x, y)
    page.mouse.down()
    move_pointer(page, x + 40, y - 50, steps=5)
    handles = page.evaluate(f"{PANEL}.motion.rowHandles()")
    bent, moved = bend_by(mesh, rig, region(page), handles)
    assert np.linalg.norm(handles[0]["vector"]) > 0.02
    wait_until(page, "eigenshape.viewer.motion.blend.value === 1")  # the pointer rests
    np.testing.assert_allclose(positions(page), bent, atol=SHADER)
    page.evaluate("eigenshape.viewer.motion.blend.value = 0")
    np.testing.assert_allclose(positions(page), moved, atol=SHADER)
    # The shape is picked where it is seen, not where it was.
    hit = page.evaluate(f"eigenshape.viewer.pick({x + 40}, {y - 50})")
    assert hit["vertex"] in region(page)

    page.mouse.up()
    wait_for_edits(page, 1)
    np.testing.assert_array_equal(positions(page), bent.astype("f4"))


def test_no_call_while_the_pointer_moves(page, mesh):
    x, y, _ = click_brush(page, mesh)
    find(page, "tool-pull").click()
    move_pointer(page, x, y)
    # By a clock of the test: on a busy machine a motion may come later than a rest takes.
    page.clock.install()
    page.clock.pause_at(datetime.now() + timedelta(hours=1))
    page.mouse.down()
    calls = []
    page.on("request", lambda request: calls.append(request.url))
    move = """([x, y]) => eigenshape.viewer.canvas.dispatchEvent(
        new PointerEvent("pointermove", { clientX: x, clientY: y, bubbles: true }))"""
    for step in range(1, 21):  # motions each 20 ms, for longer than a rest takes
        page.evaluate(move, [x + step, y - step])
        page.clock.run_for(20)
    assert calls == []
    page.clock.run_for(200)
    assert calls, "a rest asks for the exact result"
    page.clock.resume()
    page.mouse.up()
    wait_for_edits(page, 1)


def test_the_rings_turn_about_the_middle_of_the_rim(page, mesh, rig):
    click_brush(page, mesh)
    find(page, "tool-rotate").click()
    chosen = region(page)
    mask = np.isin(np.arange(mesh.n_vertices), chosen)
    pivot = mesh.vertices[es.deformation.region_boundary(mesh, mask)].mean(axis=0)
    np.testing.assert_allclose(page.evaluate(f"{PANEL}.motion.pivotOf(0)"), pivot, atol=1e-6)

    x, y = place_of(page, pivot)
    aside = np.array([0.6, -0.8])
    for radius in range(40, 160, 3):  # the outer ring turns about the direction of the view
        move_pointer(page, *(aside * radius + [x, y]))
        if page.evaluate(f"{PANEL}.motion.mover.gizmo.axis") == "E":
            break
    page.mouse.down()
    for angle in np.linspace(0.1, 0.5, 4):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        move_pointer(page, *(turn @ aside * radius + [x, y]))
    handles = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert abs(handles[0]["angle"]) == pytest.approx(0.5, abs=0.02)
    bent, moved = bend_by(mesh, rig, chosen, handles)
    wait_until(page, "eigenshape.viewer.motion.blend.value === 1")  # the pointer rests
    page.evaluate("eigenshape.viewer.motion.blend.value = 0")
    np.testing.assert_allclose(positions(page), moved, atol=SHADER)
    page.mouse.up()
    wait_for_edits(page, 1)
    np.testing.assert_array_equal(positions(page), bent.astype("f4"))


@pytest.mark.parametrize("mode", ["graded", "thesis"])
def test_numbers_move_undo_redo_and_reload(page, mesh, rig, mode):
    click_brush(page, mesh)
    rest = positions(page)
    find(page, "mode").select_option(mode)
    find(page, "exact-kind").select_option(index=2)
    find(page, "exact-amount").fill("270")
    find(page, "exact-amount").press("Enter")
    wait_for_edits(page, 1)
    pivot = mesh.vertices[
        es.deformation.region_boundary(mesh, np.isin(np.arange(mesh.n_vertices), region(page)))
    ].mean(axis=0)
    handle = {"type": "rotation", "pivot": pivot, "axis": [0, 0, 1], "angle": np.deg2rad(270)}
    bent, _ = bend_by(mesh, rig, region(page), [handle], mode)
    np.testing.assert_allclose(positions(page), bent, atol=SHADER)

    posed = positions(page)
    page.keyboard.press("Escape")
    find(page, "canvas").focus()
    page.keyboard.press("Control+z")
    wait_for_edits(page, 0)
    np.testing.assert_array_equal(positions(page), rest)
    page.keyboard.press("Control+Shift+Z")
    wait_for_edits(page, 1)
    np.testing.assert_array_equal(positions(page), posed)

    chosen = region(page)
    page.reload()
    wait_until(page, "window.eigenshape?.viewer.vertices.length > 0")
    wait_until(page, f"{PANEL}?.active")
    np.testing.assert_array_equal(positions(page), posed)
    wait_until(page, f"{PANEL}.selection.regions.vertices(0).length > 0")
    np.testing.assert_array_equal(region(page), chosen)


def test_edits_are_saved_and_loaded(page, mesh, tmp_path):
    click_brush(page, mesh)
    find(page, "exact-kind").select_option(index=4)
    find(page, "exact-amount").fill("0.1")
    find(page, "exact-go").click()
    wait_for_edits(page, 1)
    posed = positions(page)
    with page.expect_download() as saved:
        find(page, "save-edits").click()
    path = tmp_path / "edits.json"
    saved.value.save_as(path)
    assert json.loads(path.read_text())["kind"] == "eigenshape edits"
    find(page, "reset").click()
    wait_for_edits(page, 0)
    with page.expect_file_chooser() as chooser:
        find(page, "load-edits").click()
    chooser.value.set_files(path)
    wait_for_edits(page, 1)
    np.testing.assert_array_equal(positions(page), posed)


def test_a_limb_is_bent_by_the_keyboard_alone(page, rig):
    wait_until(page, f"{PANEL}.limbs.labels !== null", 120)
    page.keyboard.press("n")
    number = page.evaluate(f"{PANEL}.limbs.lit")
    assert number >= 0
    chosen = limb(page, number)
    page.keyboard.press("Shift+ArrowUp")
    wait_until_bound(page)
    for key in ("Shift+ArrowUp", "Shift+ArrowUp", "Shift+ArrowLeft", "Shift+ArrowRight"):
        page.keyboard.press(key)
    axis = page.evaluate("eigenshape.viewer.axes.right.toArray()")
    wait_until(page, f"Math.abs({PANEL}.motion.handles[0]?.angle - {np.pi / 12}) < 1e-6")
    pivot = page.evaluate(f"{PANEL}.limbs.pivot.toArray()")
    page.keyboard.press("Enter")
    wait_for_edits(page, 1)
    turn = es.Rotation(pivot, [-one for one in axis], np.pi / 12)
    bent = es.deform(rig, chosen, turn)
    np.testing.assert_allclose(positions(page), bent.vertices, atol=SHADER)


def test_the_picture_returns_after_a_loss_of_the_context(page):
    page.evaluate(
        "window.loss = eigenshape.viewer.canvas.getContext('webgl2')"
        ".getExtension('WEBGL_lose_context'), loss.loseContext()"
    )
    find(page, "notice").wait_for()
    before = page.evaluate("eigenshape.viewer.vertices.length")
    page.evaluate("loss.restoreContext()")
    find(page, "notice").wait_for(state="detached")
    assert positions(page).size == before
    assert np.ptp(positions(page)) > 0.1
