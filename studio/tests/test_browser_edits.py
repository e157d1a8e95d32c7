"""Whole tasks in a real browser: two tabs, edits and poses for other meshes, crossings, keys alone."""

import numpy as np
import pytest
from browser import (
    PANEL,
    find,
    move_pointer,
    open_page,
    picture,
    place_of,
    positions,
    region,
    vertex_values,
    wait_for_edits,
    wait_until,
    wait_until_bound,
    wait_until_still,
)

import eigenshape as es
from eigenshape.deformation import BoxRegion, bend, bind, region_boundary, region_mask
from eigenshape_studio.others.poses import carry_pose

pytestmark = pytest.mark.long

HEAD = 0.4  # height above which the quadruped is chosen: head and neck
READY = "eigenshape.state.deformation.status === 'ready'"
REGION = f"{PANEL}.selection.regions.vertices(0)"
RED = [0xD8, 0x30, 0x1F]  # of faces that cross
N_VERTICES = 1000
SHADER = 1e-5  # single precision: the largest error that the shader may have, in lengths of about 1


def choose_above(page, height, wait=wait_until_bound):
    """Choose what lies above a height, by the numbers of the box; return the vertices."""
    find(page, "tool-box").click()
    find(page, "box-low-1").fill(str(height))
    find(page, "box-low-1").press("Enter")
    wait(page)
    return region(page)


def turn(page, degrees, n_edits=1, mode="graded"):
    """Turn the region about x by a number."""
    find(page, "mode").select_option(mode)
    find(page, "exact-kind").select_option(index=0)
    find(page, "exact-amount").fill(str(degrees))
    find(page, "exact-go").click()
    wait_for_edits(page, n_edits)
    wait_until_still(page)


def turn_by(mesh, rig, chosen, degrees, mode="graded"):
    """Return the shape turned as by `turn`."""
    pivot = mesh.vertices[region_boundary(mesh, np.isin(np.arange(mesh.n_vertices), chosen))].mean(
        0
    )
    handle = es.Rotation(pivot, [1, 0, 0], np.deg2rad(degrees))
    return bend(bind(rig, [chosen]), [handle], mode=mode)


def open_file(page, button, *paths):
    """Press a button that asks for files, and choose them."""
    with page.expect_file_chooser() as chooser:
        find(page, button).click()
    chooser.value.set_files(paths)


def test_two_tabs_have_edits_of_their_own(browser, page, url, mesh, rig):
    with open_page(browser, url) as other:
        wait_until(other, READY)
        chosen = choose_above(page, HEAD)
        choose_above(other, 0.0)
        turn(page, 40)
        assert other.evaluate("eigenshape.state.deformation.n_edits") == 0
        np.testing.assert_array_equal(positions(other), mesh.vertices.astype("f4"))
        turn(other, -20)
        find(other, "undo").click()
        wait_for_edits(other, 0)
        for each in (page, other):
            each.reload()
            wait_until(each, "window.eigenshape?.viewer.vertices.length > 0")
        bent = turn_by(mesh, rig, chosen, 40).vertices
        np.testing.assert_allclose(positions(page), bent, atol=SHADER)
        np.testing.assert_array_equal(positions(other), mesh.vertices.astype("f4"))


def test_a_long_job_of_one_tab_does_not_stop_another(browser, page, url, path, tmp_path):
    es.write_mesh(es.icosphere(6), tmp_path / "large.ply")
    status = "eigenshape.backend.meta().then((state) => state.spectrum.status)"
    with open_page(browser, url) as busy:
        find(busy, "tab-shape").click()
        open_file(busy, "open", tmp_path / "large.ply")
        wait_until(busy, "eigenshape.state.spectrum.status === 'running'")
        # Asked of the server itself: a picture may take longer than the job on a busy machine.
        assert page.evaluate("eigenshape.backend.array('vertices').then((found) => found.length)")
        assert busy.evaluate(status) == "running"
        open_file(busy, "open", path)  # ends the job
        wait_until(busy, "eigenshape.state.name === 'quadruped.ply'")


def test_undo_takes_back_what_the_hand_did_last(page, mesh, tmp_path):
    chosen = choose_above(page, HEAD)
    turn(page, 40)
    find(page, "clear").click()
    assert len(region(page)) == 0
    other = tmp_path / "ball.ply"
    es.write_mesh(es.icosphere(2), other)
    find(page, "tab-shape").click()
    open_file(page, "open", other)
    wait_until(page, "eigenshape.state.name === 'ball.ply'")
    page.keyboard.press("Control+z")
    wait_until(page, "eigenshape.state.name === 'quadruped.ply'")
    find(page, "tab-deform").click()
    page.keyboard.press("Control+z")
    wait_until(page, f"{REGION}.length === {len(chosen)}")
    wait_for_edits(page, 1)
    page.keyboard.press("Control+z")
    wait_for_edits(page, 0)
    np.testing.assert_array_equal(positions(page), mesh.vertices.astype("f4"))
    for _ in range(3):  # a hurry loses nothing
        page.keyboard.press("Control+y")
    wait_until(page, "eigenshape.state.name === 'ball.ply'")
    # What was done can be clicked, and the shapes stand in a list.
    bend = find(page, "history").get_by_role("button", name="Bend")
    bend.click()
    wait_until(page, "eigenshape.state.name === 'quadruped.ply'")
    wait_until(page, f"{REGION}.length === {len(chosen)}")
    assert bend.get_attribute("aria-current") == "step"
    find(page, "tab-shape").click()
    find(page, "shape-1").click()
    wait_until(page, "eigenshape.state.name === 'ball.ply'")


def test_a_broken_file_of_edits_is_named(page, tmp_path):
    (tmp_path / "edits.json").write_text('{"edits": [')
    open_file(page, "load-edits", tmp_path / "edits.json")
    wait_until(page, f"{PANEL}.app.status.textContent.includes('edits.json is not a JSON file')")


def test_a_file_that_is_too_large_is_not_read(page, path):
    wait_until(page, "eigenshape.state.parts.status === 'ready'")  # then the state stays
    page.evaluate("eigenshape.state.most_bytes = 2 ** 10")
    find(page, "tab-shape").click()
    open_file(page, "open", path)
    wait_until(page, f"{PANEL}.app.status.textContent.includes('the page takes 1 MB')")
    assert page.evaluate("eigenshape.state.shape") == 0


def test_the_pose_is_carried_to_a_file(page, mesh, rig, tmp_path):
    chosen = choose_above(page, HEAD)
    turn(page, 40)
    other = es.TriangleMesh(mesh.vertices * [1.5, 1.0, 1.0], mesh.faces)
    es.write_mesh(other, tmp_path / "wide.ply")
    open_file(page, "transfer", tmp_path / "wide.ply")
    wait_until(page, "eigenshape.state.name === 'wide.ply'")
    wait_until_still(page)
    expected = carry_pose(mesh, turn_by(mesh, rig, chosen, 40), es.read_mesh(tmp_path / "wide.ply"))
    np.testing.assert_allclose(positions(page), expected.vertices, atol=SHADER)
    assert np.abs(expected.vertices - other.vertices).max() > 0.2


def test_edits_are_replayed_on_another_resolution(page, path, mesh, tmp_path):
    choose_above(page, HEAD)
    turn(page, 40)
    with page.expect_download() as saved:
        find(page, "save-edits").click()
    edits = tmp_path / "edits.json"
    saved.value.save_as(edits)
    fine = tmp_path / "fine.ply"
    es.write_mesh(es.make_creature("quadruped", n_vertices=2000), fine)
    find(page, "tab-shape").click()
    open_file(page, "open", fine)
    wait_until(page, "eigenshape.state.name === 'fine.ply'")
    wait_until(page, READY)
    find(page, "tab-deform").click()
    open_file(page, "load-edits", edits, path)
    wait_for_edits(page, 1)
    rig = es.rig_shape(es.read_mesh(fine))
    session = es.deformation.replay(rig, es.io.read_edits(edits, mesh), source=mesh)
    np.testing.assert_allclose(positions(page), session.mesh.vertices, atol=SHADER)
    moved = np.linalg.norm(session.mesh.vertices - rig.mesh.vertices, axis=1)
    assert (moved > 0.1).mean() == pytest.approx((rig.mesh.vertices[:, 1] > HEAD).mean(), abs=0.1)


def test_crossing_faces_are_red_until_the_result_is_uncrossed(page, mesh, rig):
    chosen = choose_above(page, HEAD)
    find(page, "crossings").check()
    turn(page, 120)
    crossed = turn_by(mesh, rig, chosen, 120)
    pairs = es.geometry.self_intersections(crossed)
    assert len(pairs) > 0
    wait_until(page, f"{PANEL}.app.status.textContent === '{len(pairs)} pairs of faces cross.'")
    red = (vertex_values(page, "mark").reshape(-1, 4)[:, :3] == RED).all(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(red), np.unique(mesh.faces[np.unique(pairs)]))
    with_red = picture(page).astype(int)
    assert ((with_red[..., 0] > 90 + with_red[..., 1:3].max(axis=2)) & (with_red[..., 3] > 0)).any()

    find(page, "undo").click()
    wait_for_edits(page, 0)
    wait_until_bound(page)
    turn(page, 120, mode="uncrossed")
    uncrossed = turn_by(mesh, rig, chosen, 120, mode="uncrossed")
    np.testing.assert_allclose(positions(page), uncrossed.vertices, atol=SHADER)
    assert len(es.geometry.self_intersections(uncrossed)) == 0
    wait_until(page, f"{PANEL}.app.status.textContent === 'No faces cross.'")
    marks = vertex_values(page, "mark").reshape(-1, 4)[:, :3]
    assert not (marks == RED).all(axis=1).any()


def test_crossings_that_remain_are_a_warning(page):
    choose_above(page, -0.06)
    turn(page, 90, mode="uncrossed")
    assert "cross" in find(page, "status").inner_text()


@pytest.mark.parametrize("mode", ["graded", "uncrossed", "thesis"])
def test_each_method_shows_its_exact_result_at_rest(page, mesh, rig, mode):
    chosen = choose_above(page, HEAD)
    find(page, "mode").select_option(mode)
    find(page, "tool-pull").click()
    x, y = place_of(page, mesh.vertices[chosen].mean(axis=0))
    move_pointer(page, x, y)
    page.mouse.down()
    move_pointer(page, x - 50, y - 20, steps=3)
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    wait_until(page, "eigenshape.viewer.motion.blend.value === 1")
    bent = bend(bind(rig, [chosen]), [es.Translation(handle["vector"])], mode=mode).vertices
    np.testing.assert_allclose(positions(page), bent, atol=SHADER)
    page.mouse.up()
    wait_for_edits(page, 1)
    np.testing.assert_array_equal(positions(page), bent.astype("f4"))


def drag_arrow(page, axis, pixels):
    """Drag the arrow of the gizmo that belongs to an axis; the pointer stays down."""
    pivot = page.evaluate(f"{PANEL}.motion.mover.anchor.position.toArray()")
    x, y = place_of(page, pivot)
    aside = np.subtract(place_of(page, np.add(pivot, 0.1 * np.eye(3)[axis])), [x, y])
    aside /= np.linalg.norm(aside)
    for away in range(20, 120, 4):
        move_pointer(page, *(aside * away + [x, y]))
        if page.evaluate(f"{PANEL}.motion.mover.gizmo.axis") == "XYZ"[axis]:
            break
    page.mouse.down()
    for step in (0.3, 0.7, 1.0):
        move_pointer(page, *(aside * (away + step * pixels) + [x, y]))


def test_an_arrow_moves_the_region_along_its_axis(page, mesh, rig):
    chosen = choose_above(page, HEAD)
    find(page, "tool-move").click()
    drag_arrow(page, axis=1, pixels=60)
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert handle["vector"][1] > 0.1
    assert handle["vector"][0] == handle["vector"][2] == 0
    # At rest the exact result replaces the motion by shares, which is what is compared here.
    wait_until(page, "eigenshape.viewer.motion.blend.value === 1")
    page.evaluate("eigenshape.viewer.motion.blend.value = 0")
    binding = bind(rig, [chosen])
    motion = es.Translation(handle["vector"])
    moved = mesh.vertices + motion.carry(mesh.vertices, binding.shares[0])
    np.testing.assert_allclose(positions(page), moved, atol=SHADER)
    page.mouse.up()
    wait_for_edits(page, 1)
    bent = bend(binding, [motion]).vertices
    np.testing.assert_array_equal(positions(page), bent.astype("f4"))


def test_the_region_turns_about_the_pivot_that_was_moved(page, mesh, rig):
    chosen = choose_above(page, HEAD)
    find(page, "tool-pivot").click()
    before = page.evaluate(f"{PANEL}.motion.pivotOf(0)")
    drag_arrow(page, axis=2, pixels=50)
    page.mouse.up()
    pivot = page.evaluate(f"{PANEL}.motion.pivotOf(0)")
    assert pivot[2] - before[2] > 0.1
    assert pivot[:2] == pytest.approx(before[:2], abs=1e-6)
    np.testing.assert_array_equal(positions(page), mesh.vertices.astype("f4"))

    # Below the pivot the ring of x is wide, and no other is near; where it lies, the gizmo says.
    find(page, "tool-rotate").click()
    x, y = place_of(page, pivot)
    on_ring = []
    for radius in range(30, 110, 4):
        move_pointer(page, x, y + radius)
        if page.evaluate(f"{PANEL}.motion.mover.gizmo.axis") == "X":
            on_ring.append(radius)
    radius = on_ring[len(on_ring) // 2]
    move_pointer(page, x, y + radius)
    page.mouse.down()
    for away in (40, 80, 120):
        move_pointer(page, x + away, y + radius)
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    assert handle["pivot"] == pytest.approx(pivot)
    assert np.abs(handle["axis"]) == pytest.approx([1, 0, 0], abs=1e-9)
    assert abs(handle["angle"]) > 0.2
    page.mouse.up()
    wait_for_edits(page, 1)
    motion = es.Rotation(handle["pivot"], handle["axis"], handle["angle"])
    bent = bend(bind(rig, [chosen]), [motion]).vertices
    np.testing.assert_array_equal(positions(page), bent.astype("f4"))


def walk_to(page, name):
    """Press Tab until an element has the focus."""
    focus = "eigenshape.main.getRootNode().activeElement?.dataset.test"
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate(focus) == name:
            return
    raise AssertionError(f"Tab does not reach {name}.")


def test_keys_alone_choose_bend_and_undo(page, mesh, rig):
    page.keyboard.press("Shift+Digit1")
    page.keyboard.press("b")
    wait_until_bound(page)
    walk_to(page, "box-low-1")
    page.keyboard.type(str(HEAD))  # what has the focus by Tab is selected, so this replaces it
    page.keyboard.press("Enter")
    wait_until_bound(page)
    low, high = page.evaluate(f"[{PANEL}.selection.box.low, {PANEL}.selection.box.high]")
    assert low[1] == HEAD
    chosen = np.flatnonzero(region_mask(mesh, BoxRegion(low, high)))
    np.testing.assert_array_equal(region(page), chosen)

    walk_to(page, "tool-pivot")
    page.keyboard.press("Enter")
    walk_to(page, "pivot-2")
    page.keyboard.type("0.125")
    page.keyboard.press("Enter")
    pivot = page.evaluate(f"{PANEL}.motion.pivotOf(0)")
    assert pivot[2] == 0.125

    walk_to(page, "exact-kind")
    page.keyboard.press("Home")
    walk_to(page, "exact-amount")
    page.keyboard.type("35")
    page.keyboard.press("Enter")
    wait_for_edits(page, 1)
    motion = es.Rotation(pivot, [1, 0, 0], np.radians(35))
    bent = bend(bind(rig, [chosen]), [motion]).vertices
    np.testing.assert_allclose(positions(page), bent, atol=SHADER)

    page.keyboard.press("Tab")  # in a field the keys belong to its text
    page.keyboard.press("Control+z")
    wait_for_edits(page, 0)
    np.testing.assert_array_equal(positions(page), mesh.vertices.astype("f4"))
    page.keyboard.press("?")
    assert find(page, "help").get_by_text("Undo the last edit").is_visible()
    page.keyboard.press("Escape")
    assert not find(page, "help").is_visible()
