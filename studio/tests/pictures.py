"""Draw the pictures and the film of the docs: the studio as one sees it, moved by mouse and keyboard alone.

    python studio/hatch_build.py && python studio/tests/pictures.py docs/pictures

A digest of what is shown is written beside them, and a test compares it with that of today.
A giraffe whose head and neck are turned, its eigenfunctions, and its parts; a horse and the scan of
another pose, with the map between them. Then figures 6.3, 6.4 and 6.13 of the thesis, by the mouse:
knee, arm and waist of a biped, and a bar that is twisted. Last, the report of the collection that
docs/scans_to_figures.md makes.
"""

import hashlib
import math
import re
import subprocess
import sys
import tempfile
from contextlib import chdir
from functools import partial
from io import BytesIO
from pathlib import Path

from browser import (
    LAPTOP,
    PANEL,
    find,
    move_slider,
    open_page,
    place_of,
    serve_studio,
    start_browser,
    wait_for_edits,
    wait_until,
    wait_until_bound,
    wait_until_still,
)
from film import main as draw_film
from PIL import Image
from playwright.sync_api import Browser

import eigenshape as es
from eigenshape_studio.bundle import BUNDLE, read_static

DOCS = Path(__file__).parents[2] / "docs"
SCANS = DOCS / "scans_to_figures.md"
REPORT = Path(es.__file__).parent / "cli" / "steps" / "collection_report.html"
NECK = 0.62  # height, of the whole, above which the giraffe is turned
FIXED = 4  # number of the fixed part, after those of the four regions
# Edits of a biped that stands from -0.98 to 1.08 with its arms spread to x = -0.91 and 0.91: the sides
# of the box that are moved, axis, upper or lower and place; then the handle, its axis, and how far it is
# dragged, in degrees or lengths.
BIPED = {
    "knee": ({(0, 0): 0.02, (1, 0): -1.1, (1, 1): -0.45}, "rotate", 0, 70.0),
    "arm": ({(0, 0): 0.6, (1, 1): 1.0, (1, 0): 0.2}, "move", 0, 0.45),
    "waist": ({(0, 1): 1.5, (0, 0): -1.0, (1, 1): 1.2, (1, 0): 0.1}, "rotate", 2, 30.0),
}


def main(browser: Browser, folder: Path, *, n_vertices: int = 8000) -> list[Path]:
    """Draw all pictures into a folder."""
    giraffe = es.make_creature("giraffe", n_vertices=n_vertices)
    biped = es.make_creature("biped", n_vertices=n_vertices)
    cells = max(4, n_vertices // 650)  # along the short sides of the bar
    bar = es.geometry.boundary_surface(es.shapes.box(cells, 6 * cells, cells, sides=(1, 6, 1)))
    with tempfile.TemporaryDirectory() as work:
        draw = partial(draw_shape, browser, folder, Path(work))
        horse, running = (es.make_creature("quadruped", pose) for pose in (0, 1))
        scan = Path(work) / "scan of a running horse.ply"
        es.write_mesh(es.partial_scan(running, [1, 0, 0.3]).mesh, scan)
        compare = partial(show_second, path=scan)
        looks = {"deform": show_deform, "spectrum": show_spectrum, "parts": show_parts}
        return [
            *draw("giraffe", giraffe, looks),
            *draw("biped", biped, {"biped": bend_biped}),
            *draw("bar", bar, {"bar": twist_bar}),
            *draw("horse", horse, {"compare": compare}),
        ]


def draw_shape(browser, folder, work, title, mesh, steps):
    """Open a shape, and draw a picture after each step."""
    paths = []
    es.write_mesh(mesh, work / f"{title}.ply")
    with serve_studio(work / f"{title}.ply") as url, open_page(browser, url, size=LAPTOP) as page:
        wait_until(page, "eigenshape.state.deformation.status === 'ready'")
        for name, act in steps.items():
            act(page)
            page.mouse.move(5, 5)
            wait_until_still(page)
            save_picture(page, folder / f"studio_{name}.png")
            paths.append(folder / f"studio_{name}.png")
    return paths


def save_picture(page, path):
    """Save what is seen, in 256 colors, which takes a third of the bytes."""
    seen = Image.open(BytesIO(page.screenshot())).convert("RGB")
    seen.quantize(palette=seen.quantize(256)).save(path, optimize=True)


def draw_report(browser, path):
    """Make the collection of the docs, and draw its report with a specimen chosen."""
    make, label, collect = scan_blocks()
    with tempfile.TemporaryDirectory() as work, chdir(work):
        exec(make + label, {})
        subprocess.run([sys.executable, "-m", *collect.split()], check=True)
        page = browser.new_page(viewport={"width": 1180, "height": 860})
        page.goto(Path("hands-out/report.html").absolute().as_uri())
        page.locator(".sheet button").first.click()
        page.evaluate("scrollTo(0, 0)")
        save_picture(page, path)


def scan_blocks():
    """Return the code of the docs that makes scans and landmarks, and the command that collects them."""
    return re.findall(r"```(?:python|sh)\n(.*?)```", SCANS.read_text(), re.DOTALL)[:3]


def show_deform(page):
    """Put a box around neck and head, and turn it by numbers."""
    find(page, "tool-box").click()
    wait_until_bound(page)
    low, high = page.evaluate(f"[{PANEL}.selection.box.low, {PANEL}.selection.box.high]")
    x, z = (low[0] + high[0]) / 2, (low[2] + high[2]) / 2
    page.mouse.move(*place_of(page, [x, low[1], z]))
    page.mouse.down()
    page.mouse.move(*place_of(page, [x, low[1] + NECK * (high[1] - low[1]), z]), steps=5)
    page.mouse.up()
    wait_until_bound(page)
    find(page, "exact-kind").select_option(index=0)
    find(page, "exact-amount").fill("35")
    find(page, "exact-amount").press("Enter")
    wait_for_edits(page, 1)
    find(page, "tool-rotate").click()


def show_spectrum(page):
    """Show an eigenfunction of the bent shape, with its nodal lines."""
    find(page, "tab-spectrum").click()
    find(page, "eigenvalues").locator("canvas").wait_for(timeout=120_000)
    move_slider(page, "eigenfunction", 9)


def show_parts(page):
    """Show the parts."""
    find(page, "tab-parts").click()
    find(page, "diagram").locator("canvas").wait_for(timeout=120_000)


def show_second(page, path):
    """Open a second shape, and wait for the map."""
    find(page, "tab-compare").click()
    with page.expect_file_chooser() as chooser:
        find(page, "second-file").click()
    chooser.value.set_files(path)
    wait_until(page, "eigenshape.state.beside?.map.status === 'ready'")


def bend_biped(page):
    """Choose parts of the biped by the box, and turn or move each by a ring or an arrow."""
    for sides, handle, axis, amount in BIPED.values():
        drag_sides(page, sides)
        drag_handle(page, handle, axis, amount)


def twist_bar(page):
    """Hold the lower end of a bar, and turn the upper one."""
    find(page, f"region-{FIXED}").click()
    drag_sides(page, {(1, 0): -0.1, (1, 1): 0.6})
    find(page, "region-0").click()
    drag_sides(page, {(1, 1): 6.1, (1, 0): 5.4})
    drag_handle(page, "rotate", 1, 120.0)


def drag_sides(page, sides):
    """Drag sides of the box by the mouse, each to a place on its axis."""
    find(page, "tool-box").click()
    for (axis, upper), place in sides.items():
        low, high = page.evaluate(f"[{PANEL}.selection.box.low, {PANEL}.selection.box.high]")
        middle = [(one + other) / 2 for one, other in zip(low, high, strict=True)]
        start, end = (
            [*middle[:axis], at, *middle[axis + 1 :]] for at in ((low, high)[upper][axis], place)
        )
        page.mouse.move(*place_of(page, start))
        page.mouse.down()
        page.mouse.move(*place_of(page, end), steps=3)
        page.mouse.up()


def drag_handle(page, handle, axis, amount):
    """Drag a ring or an arrow of the gizmo until the region has turned or moved by an amount."""
    find(page, f"tool-{handle}").click()
    wait_until_bound(page)
    n_edits = page.evaluate("eigenshape.state.deformation.n_edits")
    x, y, along = find_handle(page, axis)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 4 * along[0], y + 4 * along[1])
    forth = math.copysign(1.0, motion_of(page, axis) * amount)
    step = 0
    while motion_of(page, axis) * math.copysign(1.0, amount) < abs(amount) and step < 400:
        step += 8
        page.mouse.move(x + forth * step * along[0], y + forth * step * along[1])
    page.mouse.up()
    wait_for_edits(page, n_edits + 1)


def find_handle(page, axis):
    """Return where the handle of an axis is, and in which direction of the screen to drag it."""
    pivot = page.evaluate(f"{PANEL}.motion.mover.anchor.position.toArray()")
    x, y = place_of(page, pivot)
    ahead_x, ahead_y = place_of(page, [one + 0.1 * (i == axis) for i, one in enumerate(pivot)])
    size = math.hypot(ahead_x - x, ahead_y - y)
    along = ((ahead_x - x) / size, (ahead_y - y) / size)
    across = (-along[1], along[0])
    for angle in range(0, 360, 15):
        right, down = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        for away in range(25, 110, 3):
            place = (x + away * right, y + away * down)
            page.mouse.move(*place)
            if page.evaluate(f"{PANEL}.motion.mover.gizmo.axis") == "XYZ"[axis]:
                # An arrow is dragged along its axis, a ring across it.
                turns = page.evaluate(f"{PANEL}.motion.mover.gizmo.mode") == "rotate"
                return *place, across if turns else along
    raise AssertionError("A handle of the gizmo must be in sight.")


def motion_of(page, axis):
    """Return by how many degrees the region is turned, or how far it is moved along an axis."""
    (handle,) = page.evaluate(f"{PANEL}.motion.rowHandles()")
    if handle is None:
        return 0.0
    if handle["type"] == "translation":
        return handle["vector"][axis]
    return math.degrees(handle["angle"]) * handle["axis"][axis]


def digests():
    """Return the digest of what pictures show, the built page and the report, by the file beside them."""
    shown = {
        "studio.sha256": read_static("index.html") + read_static(BUNDLE),
        "collection.sha256": REPORT.read_bytes() + "".join(scan_blocks()).encode(),
    }
    return {name: hashlib.sha256(content).hexdigest() for name, content in shown.items()}


if __name__ == "__main__":
    target = Path(sys.argv[1]).resolve()
    with start_browser() as chromium:
        sys.stdout.writelines(f"{path}\n" for path in main(chromium, target))
        draw_report(chromium, target / "collection.png")
    draw_film(target / "film.webp")
    # Last, so that pictures of which some could not be drawn remain old
    for name, digest in digests().items():
        (target / name).write_text(f"{digest}\n")
