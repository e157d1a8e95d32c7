"""Draw the film of the page on the studio: twenty seconds of the studio, moved by the mouse alone.

    python studio/tests/film.py docs/pictures/film.webp

A limb of a horse is bent. Its parts are shown. The scan of another pose is opened beside it, with the map between
them. Then shapes like it are found in an index of creatures.
"""

import math
import sys
import tempfile
from io import BytesIO
from pathlib import Path

from browser import (
    PANEL,
    TWO_FRAMES,
    find,
    move_slider,
    open_page,
    place_of,
    serve_studio,
    start_browser,
    wait_for_edits,
    wait_until,
    wait_until_still,
)
from PIL import Image

import eigenshape as es

WINDOW = (1200, 750)  # pixels
WIDTH = 720  # of the film
QUALITY = 60  # of 100; letters stay sharp, and smooth shades need fewer bytes than the 256 colors of a GIF
STEP = 0.09  # seconds that a frame of a motion is shown
INDEXED = ("quadruped", "giraffe", "biped", "hand", "fish", "bird")
COMPARE = "eigenshape.panels.find(({ id }) => id === 'compare')"
# A pointer and a caption: pictures of a page have no pointer of their own.
DECORATE = """() => {
    const make = (style) => {
        const element = document.createElement("div");
        Object.assign(element.style, { position: "fixed", zIndex: 9, pointerEvents: "none", ...style });
        return document.body.appendChild(element);
    };
    const pointer = make({
        width: "19px", height: "28px", background: "#111",
        clipPath: "polygon(0 0, 100% 66%, 58% 68%, 80% 100%, 58% 100%, 38% 72%, 0 90%)",
    });
    const follow = ({ clientX, clientY }) =>
        Object.assign(pointer.style, { left: `${clientX}px`, top: `${clientY}px` });
    window.addEventListener("pointermove", follow, { capture: true });
    // The page gives elements of its body all its height.
    window.caption = make({
        left: "28px", bottom: "48px", height: "auto",
        font: "600 30px system-ui, sans-serif", color: "#24221f",
    });
}"""


class Film:
    """Frames of a page, each with the time for which it is shown.

    Parameters
    ----------
    page : Page
    """

    def __init__(self, page):
        self.page = page
        self.frames: list[Image.Image] = []
        self.seconds: list[float] = []
        self.at = (WINDOW[0] / 2, WINDOW[1] - 90)
        page.evaluate(DECORATE)

    def show(self, seconds=STEP):
        """Add what the page shows now."""
        seen = Image.open(BytesIO(self.page.screenshot())).convert("RGB")
        height = round(WIDTH * seen.height / seen.width)
        self.frames.append(seen.resize((WIDTH, height), Image.Resampling.LANCZOS))
        self.seconds.append(seconds)

    def say(self, text):
        """Show a caption from now on."""
        self.page.evaluate("(text) => (caption.textContent = text)", text)

    def glide(self, x, y, steps=5):
        """Move the pointer to a place, slowly at both ends."""
        before = self.at
        for step in range(1, steps + 1):
            share = 0.5 - 0.5 * math.cos(math.pi * step / steps)
            self.at = tuple(a + share * (b - a) for a, b in zip(before, (x, y), strict=True))
            self.page.mouse.move(*self.at)
            self.page.evaluate(TWO_FRAMES)
            self.show()

    def click(self, name):
        """Move the pointer to a control, and click it."""
        box = find(self.page, name).bounding_box()
        self.glide(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, 4)
        self.page.mouse.down()
        self.page.mouse.up()

    def drag(self, x, y, steps):
        """Drag from where the pointer is to another place."""
        self.page.mouse.down()
        self.glide(x, y, steps)
        self.page.mouse.up()

    def settle(self, seconds):
        """Show what the page shows when nothing moves any more, with smooth edges."""
        wait_until_still(self.page)
        self.page.wait_for_timeout(600)
        self.show(seconds)

    def save(self, path):
        """Write the film."""
        first, *others = self.frames
        times = [round(1000 * seconds) for seconds in self.seconds]
        first.save(
            path, save_all=True, append_images=others, duration=times, loop=0, quality=QUALITY
        )


def main(path: Path, *, n_vertices: int = 3000) -> Film:
    """Draw the film into a file."""
    horse, running = (es.make_creature("quadruped", pose, n_vertices=n_vertices) for pose in (0, 1))
    with tempfile.TemporaryDirectory() as work, start_browser() as browser:
        folder = Path(work)
        shape, scan = folder / "horse.ply", folder / "scan.ply"
        es.write_mesh(horse, shape)
        es.write_mesh(es.partial_scan(running, [1, 0, 0.3]).mesh, scan)
        index = es.ShapeIndex.create(folder / "index")
        for kind in INDEXED:
            mesh = es.make_creature(kind, 2, n_vertices=1500)
            es.write_mesh(mesh, folder / f"{kind}.ply")
            index.add(kind, mesh, source=str(folder / f"{kind}.ply"), n_views=0)
        with (
            serve_studio(shape, index.folder) as url,
            open_page(browser, url, size=WINDOW, more=False) as page,
        ):
            wait_until(page, f"{PANEL}?.limbs.farthest()", 240)
            wait_until(page, "eigenshape.viewer.ambient.ground.visible")
            film = Film(page)
            bend_limb(film)
            show_parts(film)
            show_map(film, scan)
            search(film)
    film.save(path)
    return film


def bend_limb(film):
    """Bend the limb that is farthest from the body, and turn the view."""
    page = film.page
    film.say("Drag a limb: it bends")
    film.settle(0.8)
    tip = page.evaluate(f"{PANEL}.limbs.farthest().tip")
    x, y = place_of(page, tip)
    middle = place_of(
        page,
        page.evaluate(
            "eigenshape.viewer.box.min.toArray().map((low, i) =>"
            " (low + eigenshape.viewer.box.max.toArray()[i]) / 2)"
        ),
    )
    # A little inside the outline
    x, y = x + 0.08 * (middle[0] - x), y + 0.08 * (middle[1] - y)
    film.glide(x, y)
    wait_until(page, f"{PANEL}.limbs.lit >= 0")
    film.settle(0.6)
    page.mouse.down()
    wait_until(page, f"{PANEL}.form.root.dataset.ready === 'true'")
    film.glide(x + 0.3 * (middle[0] - x), y - 150, 12)
    wait_until(page, "eigenshape.viewer.motion.blend.value === 1")
    page.mouse.up()
    wait_for_edits(page, 1)
    film.settle(0.6)
    film.glide(120, 600)
    film.drag(330, 570, 9)
    film.settle(0.8)


def show_parts(film):
    """Show the parts, and more of them."""
    film.click("tab-parts")
    film.say("Its parts")
    find(film.page, "diagram").locator("canvas").wait_for(timeout=120_000)
    film.settle(1.2)
    for count in (4, 6, 8, 10):
        move_slider(film.page, "n-parts", count)
        film.settle(0.35)
    film.settle(0.8)


def show_map(film, scan):
    """Open the scan of another pose, and show which points correspond."""
    page = film.page
    film.click("tab-compare")
    film.say("Which points of a scan correspond")
    film.settle(0.7)
    with page.expect_file_chooser() as chooser:
        find(page, "second-file").click()
    chooser.value.set_files(scan)
    wait_until(page, f"eigenshape.state.beside?.map.status === 'ready' && {COMPARE}.map", 400)
    film.settle(1.2)
    for x, y in ((230, 330), (300, 420)):
        film.glide(x, y)
        film.settle(0.5)
    film.glide(120, 620, 3)
    film.drag(185, 612, 7)
    film.settle(0.9)


def search(film):
    """Find shapes like this one, and show one of them beside it."""
    page = film.page
    film.click("close-match")
    film.click("tab-search")
    film.say("Shapes like this one")
    film.settle(0.4)
    film.click("search")
    find(page, "match-0").wait_for(timeout=240_000)
    film.settle(1.3)
    film.click("match-0")
    wait_until(page, "eigenshape.second?.viewer.vertices.length > 0")
    film.settle(2.0)


if __name__ == "__main__":
    made = main(Path(sys.argv[1]))
    size = Path(sys.argv[1]).stat().st_size
    sys.stdout.write(f"{len(made.frames)} frames, {sum(made.seconds):.1f} s, {size:,} bytes\n")
