"""The panels in a real browser: what they show is what the library computes."""

import csv
import io

import numpy as np
import pytest
from browser import (
    drop_file,
    find,
    find_faults,
    move_slider,
    open_page,
    picture,
    serve_studio,
    vertex_labels,
    vertex_values,
    wait_until,
    wait_until_still,
)
from scipy.ndimage import binary_erosion, maximum_filter, minimum_filter

import eigenshape as es
from eigenshape.plot.render import palette
from eigenshape_studio.report import write_report
from eigenshape_studio.shape.analysis import N_MODES
from eigenshape_studio.shape.analysis import vertex_labels as label_vertices

pytestmark = pytest.mark.long

N_VERTICES = 1000
FRONT, BOTH_SIDES = 0, 2  # of faces, in three.js
SIDE = "eigenshape.viewer.surface.material.side"
SINGLE = 2e-5  # relative error of sums of 300 products in single precision


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a quadruped, and an index of four shapes."""
    folder = tmp_path_factory.mktemp("studio")
    shapes = {
        "quadruped": es.make_creature("quadruped", n_vertices=N_VERTICES),
        "biped": es.make_creature("biped", n_vertices=N_VERTICES),
        "torus": es.shapes.torus(40, 20),
        "ball": es.icosphere(3),
    }
    for name, mesh in shapes.items():
        es.write_mesh(mesh, folder / f"{name}.ply")
    index = es.ShapeIndex.create(folder / "index")
    for name in shapes:
        path = folder / f"{name}.ply"
        index.add(name, es.read_mesh(path), source=str(path), n_views=0)
    return folder


@pytest.fixture(scope="module")
def mesh(folder):
    return es.read_mesh(folder / "quadruped.ply")


@pytest.fixture(scope="module")
def spectrum(mesh):
    return es.solve_spectrum(es.cotangent_laplacian(mesh), N_MODES)


@pytest.fixture(scope="module")
def url(folder):
    with serve_studio(folder / "quadruped.ply", folder / "index") as address:
        yield address


@pytest.fixture
def page(browser, url):
    with open_page(browser, url) as opened:
        yield opened


@pytest.fixture(scope="module")
def still(browser, url):
    """Return one page for all tests that only look at the shape: opening another costs 3 s of CPU time."""
    with open_page(browser, url) as opened:
        yield opened


def open_panel(page, name, ready=None):
    find(page, f"tab-{name}").click()
    if ready:
        find(page, ready).wait_for()
    wait_until_still(page)


def assert_close(found, expected, tolerance=SINGLE):
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= tolerance * np.abs(expected).max()


def test_heat_slider_shows_the_heat_kernel_signature(still, spectrum):
    open_panel(still, "heat", "legend")
    first, last = es.spectral.default_times(spectrum, 2)
    for step in (0, 130, 400):
        move_slider(still, "time", step)
        time = first * (last / first) ** (step / 400)
        assert_close(vertex_values(still), es.heat_kernel_signature(spectrum, [time])[:, 0])
    low, middle, high = find(still, "legend").locator("span").all_inner_texts()
    heat = vertex_values(still)
    shown = [float(text.replace("−", "-")) for text in (low, middle, high)]
    np.testing.assert_allclose(shown, [heat.min(), heat.mean(), heat.max()], rtol=0.2)


def test_colors_of_the_picture_follow_the_slider(still):
    open_panel(still, "heat", "legend")
    move_slider(still, "time", 40)
    early = picture(still)
    move_slider(still, "time", 360)
    late = picture(still)
    shape = early[..., 3] == 255  # its shadow on the ground is less
    assert 0.05 < shape.mean() < 0.9
    assert np.array_equal(shape, late[..., 3] == 255)
    assert np.abs(early[shape].astype(int) - late[shape]).mean() > 10


def test_daylight_comes_from_above(still, mesh):
    wait_until(still, "eigenshape.viewer.ambient.ground.visible")
    up = np.array(still.evaluate("eigenshape.state.up"))
    height = es.geometry.vertex_normals(mesh) @ up
    seen = vertex_values(still, "ambient")
    assert seen[height > 0.8].mean() > 1.5 * seen[height < -0.8].mean()
    # Between the legs less is seen of the sky than beside them, with the same slope.
    sideways = np.abs(height) < 0.2
    assert np.ptp(seen[sideways]) > 60
    # Below the shape the ground is darker than at its rim.
    dark = "eigenshape.viewer.ambient.ground.geometry.getAttribute('dark').array"
    ground = np.array(still.evaluate(f"Array.from({dark})")).reshape(96, 96)
    assert ground[44:52, 44:52].mean() > ground[:8].mean() + 0.07
    assert not ground[0].any()


def test_heat_starts_where_the_shape_is_clicked(still, spectrum):
    open_panel(still, "heat", "legend")
    move_slider(still, "time", 200)
    find(still, "heat-source").click()
    x, y, vertex = click_shape(still)
    hit = still.evaluate("([x, y]) => eigenshape.viewer.pick(x, y)", [x, y])
    assert hit["vertex"] == vertex
    assert f"vertex {vertex}" in find(still, "heat-explained").inner_text()
    first, last = es.spectral.default_times(spectrum, 2)
    time = (first * last) ** 0.5
    modes = spectrum.eigenvectors
    assert_close(
        vertex_values(still), modes @ (np.exp(-time * spectrum.eigenvalues) * modes[vertex])
    )
    assert find(still, "legend").inner_text().startswith("heat, 1/length²")


def click_shape(page):
    """Click the middle of what is drawn; return where, and the vertex there."""
    box = find(page, "canvas").bounding_box()
    inside = picture(page)[..., 3] == 255
    rows, columns = np.nonzero(inside)
    row = int(np.median(rows))
    column = int(np.median(columns[rows == row]))
    x = column * box["width"] / inside.shape[1]
    y = row * box["height"] / inside.shape[0]
    vertex = page.evaluate("([x, y]) => eigenshape.viewer.pick(x, y).vertex", [x, y])
    page.mouse.click(box["x"] + x, box["y"] + y)
    wait_until_still(page)
    return x, y, vertex


def test_spectrum_shows_eigenfunctions_and_the_proof(still, spectrum):
    open_panel(still, "spectrum", "legend")
    for index in (1, 7, 60):
        move_slider(still, "eigenfunction", index)
        wait_until_still(still)
        assert_close(vertex_values(still), spectrum.eigenvectors[:, index], 1e-6)
        assert (
            f"{index}: λ = {spectrum.eigenvalues[index]:.4g}"
            == find(still, "eigenfunction-value").inner_text()
        )
    assert find(still, "certificate").inner_text() == spectrum.certificate.explain()
    find(still, "eigenfunction").press("ArrowRight")
    wait_until_still(still)
    assert_close(vertex_values(still), spectrum.eigenvectors[:, 61], 1e-6)


def test_nodal_lines_are_drawn_where_the_function_is_zero(still, mesh, spectrum):
    open_panel(still, "spectrum", "legend")
    move_slider(still, "eigenfunction", 4)
    wait_until_still(still)
    lines = picture(still).astype(int)
    find(still, "nodal").uncheck()
    wait_until_still(still)
    # At the rim the surface is steep, and the next pixel lies far away on it.
    inside = binary_erosion(lines[..., 3] == 255, iterations=4)
    rows, columns = np.nonzero(inside & (np.abs(lines - picture(still)).max(axis=2) > 60))
    assert len(rows) > 300
    for place in np.linspace(0, len(rows) - 1, 12).astype(int):
        # A pixel where a leg covers the body is a mixture of both, so its neighbors count, too.
        steps = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))
        places = [[columns[place] + 0.5 + right, rows[place] + 0.5 + down] for right, down in steps]
        code = "(places) => places.map(([x, y]) => eigenshape.viewer.pick(x, y).corners)"
        corners = spectrum.eigenvectors[still.evaluate(code, places), 4]
        assert (np.abs(corners).min(axis=1) < np.ptp(corners, axis=1)).any()


def test_click_on_an_eigenvalue_selects_it(still):
    open_panel(still, "spectrum", "legend")
    plot = find(still, "eigenvalues").locator(".u-over")
    width = plot.bounding_box()["width"]
    plot.click(position={"x": width / 2, "y": 60})
    wait_until_still(still)
    assert find(still, "eigenfunction").input_value() in ("149", "150")


def test_shape_of_few_modes_is_the_eigen_skeleton(still, mesh, spectrum):
    open_panel(still, "spectrum", "legend")
    move_slider(still, "eigenfunction", 11)
    find(still, "view-lowpass").click()
    wait_until_still(still)
    modes = spectrum.eigenvectors[:, :12]
    smooth = modes @ (modes.T @ (spectrum.mass @ mesh.vertices))
    assert_close(vertex_values(still, "position").reshape(-1, 3), smooth)
    assert still.evaluate(SIDE) == BOTH_SIDES  # the smooth shape may show its inside
    open_panel(still, "shape")
    assert_close(vertex_values(still, "position").reshape(-1, 3), mesh.vertices, 1e-6)


def test_brackets_hold_the_eigenvalues(still, mesh):
    open_panel(still, "spectrum", "legend")
    find(still, "bracket").click()
    still.locator(".bracketed").wait_for(timeout=120_000)
    move_slider(still, "eigenfunction", 3)
    brackets = es.bracket_eigenvalues(mesh, 20)
    text = f"between {brackets.lower[3]:.6g} and {brackets.upper[3]:.6g}."
    assert find(still, "bounds").inner_text().endswith(text)


def test_solving_for_fewer_eigenpairs(page):
    open_panel(page, "spectrum", "legend")
    find(page, "k").fill("30")
    find(page, "solve").click()
    wait_until(page, "eigenshape.state.spectrum.k === 30")
    wait_until_still(page)
    assert find(page, "eigenfunction").get_attribute("max") == "29"
    assert "30 lowest eigenvalues" in find(page, "certificate").inner_text()


def test_parts_equal_those_of_segment(page, mesh):
    open_panel(page, "parts")
    find(page, "diagram").locator("canvas").wait_for(timeout=120_000)
    wait_until_still(page)
    found = es.find_parts(mesh)
    assert find(page, "n-parts-value").inner_text() == str(len(found.parts.features.vertices))
    n_fine = len(found.fine.features.vertices)
    for count in (1, 4, n_fine - 1, n_fine):
        move_slider(page, "n-parts", count)
        assert_parts(page, es.segment(found.tree, n_regions=count), found)
    for step in (300, 700):
        move_slider(page, "persistence", step)
        level = 1.02 * found.tree.persistence[1] * (step / 1000) ** 2
        cut = es.segment(found.tree, n_regions=n_above(found, level))
        assert_parts(page, cut, found)
        assert find(page, "n-parts").input_value() == str(len(cut.features.vertices))

    move_slider(page, "n-parts", 5)
    colors = np.round(255 * palette(vertex_labels(page)))
    assert np.array_equal(vertex_values(page, "paint").reshape(-1, 3), colors)
    check_picture_of_parts(page, mesh)
    check_clicks_on_parts(page, found)


def n_above(found, level):
    """Return how many fine parts have this persistence or more."""
    n_fine = len(found.fine.features.vertices)
    return int(np.count_nonzero(found.tree.persistence[:n_fine] >= level))


def assert_parts(page, cut, found):
    """Check the part of each vertex: that of the fine part around it."""
    n_fine = len(found.fine.features.vertices)
    part_of_fine = np.full(n_fine, -1)
    part_of_fine[es.segment(found.tree, n_regions=n_fine).labels] = cut.labels
    fine = label_vertices(found.mesh, found.fine.labels)
    assert np.array_equal(vertex_labels(page), part_of_fine[fine])


def check_picture_of_parts(page, mesh):
    """Away from borders a face has the color of its part; light changes it only by a factor."""
    image = picture(page).astype(float)
    inside = binary_erosion(image[..., 3] == 255, iterations=4)
    # A pixel across an edge has the mean of two colors.
    colors = image[..., :3]
    jump = maximum_filter(colors, size=(3, 3, 1)) - minimum_filter(colors, size=(3, 3, 1))
    rows, columns = np.nonzero(inside & (jump.max(axis=2) < 12))
    chosen = np.linspace(0, len(rows) - 1, 300).astype(int)
    places = np.column_stack([columns[chosen], rows[chosen]]) + 0.5
    code = "(places) => places.map(([x, y]) => eigenshape.viewer.pick(x, y).corners)"
    parts = vertex_labels(page)[page.evaluate(code, places.tolist())]
    n_inside, n_border = 0, 0
    for corners, pixel in zip(parts, image[rows[chosen], columns[chosen], :3], strict=True):
        if pixel.max() == 255:
            continue
        # The border is smooth, so in a face of two parts it has the color of either.
        colors = 255 * palette(np.unique(corners))
        light = (colors @ pixel) / (colors**2).sum(axis=1)
        away = np.abs(pixel - light[:, None] * colors).max(axis=1)
        assert away.min() < 3
        n_inside += len(colors) == 1
        n_border += len(colors) == 2
    assert n_inside > 100
    assert n_border > 0


def check_clicks_on_parts(page, found):
    """A click on the shape shows its part alone; one on the diagram marks a maximum and its part."""
    _, _, vertex = click_shape(page)
    part = vertex_labels(page)[vertex]
    assert find(page, "chosen-part").inner_text().startswith(f"Part {part}:")
    paint, labels = vertex_values(page, "paint").reshape(-1, 3), vertex_labels(page)
    full = np.round(255 * palette(labels))
    assert np.array_equal(paint[labels == part], full[labels == part])
    assert (paint[labels != part] != full[labels != part]).any(axis=1).all()

    tree = es.merge_tree(found.mesh, found.heat)
    births, deaths = tree.values, tree.values - tree.persistence
    # The finite maximum that lies farthest from all others, so that a click can only mean it.
    places = np.column_stack([births, np.where(np.isinf(deaths), found.heat.min(), deaths)])
    gaps = np.linalg.norm((places[:, None] - places[None]) / np.ptp(places, axis=0), axis=2)
    np.fill_diagonal(gaps, np.inf)
    index = int(gaps.min(axis=1).argmax())
    at = """([x, y]) => {
        const panel = [...eigenshape.pages.values()].find(({ panel }) => panel.id === "parts").panel;
        return [panel.plot.valToPos(x, "x"), panel.plot.valToPos(y, "y")];
    }"""
    x, y = page.evaluate(at, places[index].tolist())
    find(page, "diagram").locator(".u-over").click(position={"x": x, "y": y})
    assert find(page, "maximum").input_value() == str(index)
    marked = page.evaluate("Array.from(eigenshape.viewer.discs.geometry.index.array)")
    assert marked == [tree.maxima[index]]
    part = vertex_labels(page)[tree.maxima[index]]
    assert find(page, "chosen-part").inner_text().startswith(f"Part {part}:")


def test_shape_panel_opens_repairs_and_saves(page, folder, mesh):
    open_panel(page, "shape")
    assert "It is closed" in find(page, "health").inner_text()
    with page.expect_download() as download:
        find(page, "save-ply").click()
    saved = es.read_mesh(download.value.path().rename(folder / "saved.ply"))
    assert np.array_equal(saved.faces, mesh.faces)
    with page.expect_download() as download:
        find(page, "save-png").click()
    png = io.BytesIO(download.value.path().read_bytes())
    assert png.read(8) == b"\x89PNG\r\n\x1a\n"
    assert download.value.suggested_filename == "quadruped.png"

    turned = es.TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    es.write_mesh(turned, folder / "turned.obj")
    with page.expect_file_chooser() as chooser:
        find(page, "open").click()
    chooser.value.set_files(folder / "turned.obj")
    find(page, "repair-orient").wait_for()
    assert find(page, "name").inner_text() == "turned.obj"
    assert page.evaluate(SIDE) == BOTH_SIDES  # faces inward
    find(page, "repair-orient").click()
    find(page, "repair-orient").wait_for(state="detached")
    page.get_by_text("No repair is needed.").wait_for()
    assert page.evaluate(SIDE) == FRONT

    es.write_mesh(es.icosphere(2), folder / "dropped.obj")
    drop_file(page, "stage", folder / "dropped.obj")
    wait_until(page, "eigenshape.viewer.vertices.length === 3 * 162")
    assert find(page, "name").inner_text() == "dropped.obj"


def test_search_ranks_shapes_and_shows_corresponding_points(page, folder, mesh):
    open_panel(page, "search")
    find(page, "search").click()
    find(page, "match-0").wait_for()
    index = es.ShapeIndex.open(folder / "index")
    # The first match is the shape itself, which the page leaves out.
    matches = index.query(mesh, n_matches=10)[1:]
    assert find(page, "found").inner_text().endswith("is there, too, as quadruped.")
    cards = find(page, "matches").locator("button").all_inner_texts()
    assert len(cards) == len(matches)
    for card, match in zip(cards, matches, strict=True):
        assert match.name in card
        assert f"{match.score:.3f}" in card
    find(page, "match-1").click()
    find(page, "close-match").wait_for()
    wait_until_still(page)
    assert page.locator('[data-test="canvas"]').count() == 2
    marked = page.evaluate("eigenshape.viewer.discs.geometry.index.count")
    assert marked == len(matches[1].correspondences)
    assert find_faults(page) == []
    find(page, "close-match").click()
    wait_until(page, "eigenshape.second === null")
    assert page.locator('[data-test="canvas"]').count() == 1
    # What was found is found again after a reload.
    page.reload()
    find(page, "match-0").wait_for()
    again = find(page, "matches").locator("button").all_inner_texts()
    assert again == cards

    # A painted part
    find(page, "search-part").click()
    page.get_by_text("Paint a part first").wait_for()
    open_panel(page, "deform")
    find(page, "tool-box").click()
    wait_until_still(page)
    open_panel(page, "search")
    find(page, "search-part").click()
    page.get_by_text("Shapes with a part like the painted one.").wait_for()
    assert find(page, "matches").locator("button").count() >= 1


def picture_axes(page):
    """Return where the picture's right, up and the viewer are, in the coordinates of the mesh."""
    code = "(eigenshape.viewer.camera.updateMatrixWorld(), eigenshape.viewer.camera.matrixWorld)"
    return np.array(page.evaluate(f"Array.from({code}.elements)")).reshape(4, 4)[:3, :3]


@pytest.mark.parametrize("view", ["top", "front-left"])
def test_the_studio_opens_from_the_requested_side(browser, tmp_path, view):
    """The page shows what figures show: its camera has the axes of theirs."""
    path = tmp_path / "biped.ply"
    es.write_mesh(es.make_creature("biped", n_vertices=500), path)
    right, down, towards = es.plot.aim_camera(es.read_mesh(path), view=view, up="x").rotation
    with serve_studio(path, view=view, up="x") as url, open_page(browser, url) as page:
        # "top" may be 1e-3 off, and another 1e-6 where the page limits the angle
        np.testing.assert_allclose(picture_axes(page), [right, -down, towards], atol=2e-3)


def test_report_opens_from_a_file_without_a_server(browser, folder, mesh):
    path = folder / "report.html"
    height = mesh.vertices[:, 1]
    write_report(mesh, path, name="quadruped", values={"height (m)": height}, view="right")
    with open_page(browser, path.as_uri()) as page:
        right, down, towards = es.plot.aim_camera(mesh, view="right").rotation
        np.testing.assert_allclose(picture_axes(page), [right, -down, towards], atol=1e-6)
        assert find(page, "tab-deform").count() == find(page, "tab-search").count() == 0
        find(page, "legend").wait_for()
        assert_close(vertex_values(page), height, 1e-6)
        assert find(page, "legend").inner_text().startswith("height, m")
        open_panel(page, "spectrum", "legend")
        move_slider(page, "eigenfunction", 5)
        wait_until_still(page)
        modes = es.solve_spectrum(es.cotangent_laplacian(mesh), 20).eigenvectors
        assert_close(vertex_values(page), modes[:, 5], 1e-3)  # three digits, half precision
        assert not find(page, "solve").is_visible()
        open_panel(page, "heat", "legend")
        open_panel(page, "parts", "diagram")
        move_slider(page, "n-parts", 4)
        found = es.find_parts(mesh)
        cut = es.segment(found.tree, n_regions=4)
        assert_parts(page, cut, found)
        assert picture(page)[..., 3].any()
    with open_page(browser, f"{path.as_uri()}#parts") as page:
        find(page, "diagram").wait_for()
        assert find(page, "tab-parts").get_attribute("aria-selected") == "true"


def test_tab_reaches_every_control_of_every_panel(page):
    wait_until(page, "eigenshape.state.parts.status === 'ready'")
    open_panel(page, "search")
    find(page, "search").click()
    find(page, "match-0").wait_for()
    list_controls = """window.controls = [...eigenshape.main.querySelectorAll(
            "button, input, select, summary, canvas[tabindex]"
        )].filter((each) => each.checkVisibility({ visibilityProperty: true }) && !each.disabled
            && each.role !== "tab"), controls.map((each) =>
            each.dataset.test || each.outerHTML.slice(0, 90))"""
    # Arrow keys go from tab to tab, as everywhere.
    find(page, "tab-deform").click()
    tabs = page.evaluate("[...eigenshape.pages.keys()]")
    for name in tabs:
        assert page.evaluate("eigenshape.active.id") == name
        wait_until_still(page)
        names = page.evaluate(list_controls)
        page.evaluate("eigenshape.viewer.canvas.focus()")
        reached = {page.evaluate("controls.indexOf(eigenshape.viewer.canvas)")}
        focus = "controls.indexOf(eigenshape.main.getRootNode().activeElement)"
        for _ in range(len(names) + 5):
            page.keyboard.press("Tab")
            reached.add(page.evaluate(focus))
        missed = [each for i, each in enumerate(names) if i not in reached]
        assert not missed, (name, missed)
        page.evaluate("eigenshape.pages.get(eigenshape.active.id).tab.focus()")
        page.keyboard.press("ArrowRight")


def test_a_part_is_named_and_all_are_saved_as_a_table(page, tmp_path):
    open_panel(page, "parts", "diagram")
    labels = vertex_labels(page)
    move_slider(page, "maximum", 1)
    part = page.evaluate("eigenshape.active.part")
    find(page, "part-name").fill('the "head"')
    find(page, "part-name").press("Enter")
    assert find(page, "chosen-part").inner_text().startswith('the "head": ')
    page.reload()  # names survive that
    find(page, "all-parts").wait_for()
    wait_until_still(page)
    with page.expect_download() as saved:
        find(page, "save-parts").click()
    assert saved.value.suggested_filename == "quadruped.parts.csv"
    saved.value.save_as(tmp_path / "parts.csv")
    with (tmp_path / "parts.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["vertex"]) for row in rows] == list(range(len(labels)))
    assert [int(row["part"]) for row in rows] == labels.tolist()
    names = {int(row["part"]): row["name"] for row in rows}
    assert names == {each: f"part {each}" for each in set(labels)} | {part: 'the "head"'}
