"""Draw the pictures of the docs: the studio as one sees it, moved by mouse and keyboard alone.

    python studio/tests/pictures.py docs/pictures

A giraffe whose head and neck are turned, its eigenfunctions, and its parts.
"""

import sys
import tempfile
from io import BytesIO
from pathlib import Path

from browser import (
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
from PIL import Image

import eigenshape as es

NECK = 0.62  # height, of the whole, above which the giraffe is turned


def main(folder: Path, *, n_vertices: int = 8000) -> list[Path]:
    """Draw all pictures into a folder."""
    giraffe = es.make_creature("giraffe", n_vertices=n_vertices)
    paths = [folder / f"studio_{name}.png" for name in ("deform", "spectrum", "parts")]
    with tempfile.TemporaryDirectory() as work, start_browser() as browser:
        mesh = Path(work, "giraffe.ply")
        es.write_mesh(giraffe, mesh)
        with serve_studio(mesh) as url, open_page(browser, url) as page:
            wait_until(page, "eigenshape.state.deformation.status === 'ready'", 120)
            for draw, path in zip((show_deform, show_spectrum, show_parts), paths, strict=True):
                draw(page)
                page.mouse.move(5, 5)
                wait_until_still(page)
                seen = Image.open(BytesIO(page.screenshot()))
                seen.convert("RGB").quantize(256).save(path, optimize=True)  # a third of the bytes
    return paths


def show_deform(page):
    """Put a box around neck and head, and turn it by numbers."""
    find(page, "tool-box").click()
    wait_until_bound(page)
    low, high = page.evaluate(f"[{PANEL}.box.low, {PANEL}.box.high]")
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
    """Find the parts, and show them."""
    find(page, "tab-parts").click()
    find(page, "find-parts").click()
    find(page, "diagram").locator("canvas").wait_for(timeout=120_000)


if __name__ == "__main__":
    sys.stdout.writelines(f"{path}\n" for path in main(Path(sys.argv[1])))
