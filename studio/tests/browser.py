"""The studio in a real browser, for tests: a server, and pages on which no error goes unseen.

Chromium is that of the system (Debian's package `chromium`), or the one that CHROMIUM names.
"""

import base64
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from io import BytesIO
from pathlib import Path
from time import monotonic
from weakref import WeakKeyDictionary

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, Request, sync_playwright

STUDIO = Path(__file__).parents[1]
AXE = STUDIO / "front" / "node_modules" / "axe-core" / "axe.min.js"
# WebGL2 in software, the same on every machine, and no request of the browser's own.
FLAGS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)
SERVE = """
import sys
from pathlib import Path
from eigenshape_studio.server import serve

mesh, index, view, up, port, sessions = sys.argv[1:]
serve(
    [mesh] if mesh else [], index=index or None, view=view, up=up, port=int(port), sessions=Path(sessions),
    announce=lambda url: print(url, flush=True), browse=False,
)
"""
# Tests wait for states. Only one that fails waits this long, so a machine with much else to do fails none.
PATIENCE = 300.0  # seconds
LAPTOP = (1280, 800)
WINDOW = (960, 600)  # of tests: half as many pixels to draw in software
# The panel in which shapes are bent, in the code of the page.
PANEL = "eigenshape.panels.find((panel) => panel.id === 'deform')"
# Opens all that the page hides at first; there are panels soon after the shape.
SHOW_MORE = "eigenshape.main.querySelectorAll('details').forEach((each) => (each.open = true))"
HAS_SHAPE = "window.eigenshape?.viewer.vertices.length > 0"
# Requests of each page that have no answer yet.
UNDER_WAY: WeakKeyDictionary[Page, set[Request]] = WeakKeyDictionary()
TWO_FRAMES = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


@contextmanager
def start_browser() -> Iterator[Browser]:
    """Start Chromium without a window; skip the test where there is none, unless one is required."""
    path = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    if path is None:
        needed = "The browser tests need Chromium: apt-get install chromium."
        if os.environ.get("EIGENSHAPE_REQUIRE_BROWSER"):
            raise FileNotFoundError(needed)
        pytest.skip(needed)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


@cache
def build_page() -> None:
    """Build the page if its sources have changed."""
    subprocess.run([sys.executable, "hatch_build.py"], cwd=STUDIO, check=True)


@contextmanager
def start_server(
    mesh: Path | None,
    index: Path | None = None,
    view: str = "auto",
    up: str = "auto",
    port: int = 0,
    sessions: Path | None = None,
    *,
    setup: str = "",
) -> Iterator[tuple[str, int]]:
    """Serve the studio in a process of its own; yield its address and the number of the process.

    That process begins with the code in `setup`.
    """
    build_page()
    folder = tempfile.TemporaryDirectory()
    options = [str(index or ""), view, up, str(port), str(sessions or folder.name)]
    command = [sys.executable, "-c", setup + SERVE, str(mesh or ""), *options]
    with folder, subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield str(process.stdout.readline().strip()), process.pid  # type: ignore[union-attr]
        finally:
            process.terminate()


@contextmanager
def serve_studio(
    mesh: Path | None, index: Path | None = None, view: str = "auto", up: str = "auto"
) -> Iterator[str]:
    """Serve the studio in a process of its own, and yield its address."""
    with start_server(mesh, index, view, up) as (url, _):
        yield url


@contextmanager
def open_page(
    browser: Browser,
    url: str,
    *,
    dark: bool = False,
    ready: str = HAS_SHAPE,
    more: bool = True,
    size: tuple[int, int] = WINDOW,
    expected: tuple[str, ...] = (),
) -> Iterator[Page]:
    """Open the studio in a window of its own, and wait until it shows a shape, or another condition.

    With `more`, what the page hides at first is opened.

    At the end every error, warning and request to another machine fails the test, but for lines of the
    console with a text that is expected.
    """
    scheme = "dark" if dark else "light"
    viewport = {"width": size[0], "height": size[1]}
    phone = size[0] < 600
    context = browser.new_context(
        viewport=viewport, color_scheme=scheme, has_touch=phone, is_mobile=phone
    )
    page = context.new_page()
    page.set_default_timeout(1000 * PATIENCE)
    seen: list[str] = []
    page.on("pageerror", lambda error: seen.append(f"page error: {error}"))
    page.on(
        "console",
        lambda line: line.type in ("error", "warning") and seen.append(f"{line.type}: {line.text}"),
    )
    UNDER_WAY[page] = set()

    def begin(request: Request) -> None:
        UNDER_WAY[page].add(request)
        if not is_local(request.url):
            seen.append(f"request to {request.url}")

    def end(request: Request) -> None:
        UNDER_WAY[page].discard(request)

    page.on("request", begin)
    page.on("requestfinished", end)
    page.on("requestfailed", end)
    page.goto(url)
    wait_until(page, ready)
    if more and ready == HAS_SHAPE:
        wait_until(page, "eigenshape.active !== null")
        page.evaluate(SHOW_MORE)
    try:
        yield page
    finally:
        context.close()
    seen = [line for line in seen if not any(text in line for text in expected)]
    assert not seen, "\n".join(seen)


def is_local(url: str) -> bool:
    """Say whether a request stays on this machine."""
    return url.startswith(("http://127.0.0.1:", "file:", "data:", "blob:"))


def find(page: Page, name: str) -> Locator:
    """Return the element with this name in `data-test`."""
    return page.locator(f'[data-test="{name}"]')


def find_faults(page: Page) -> list[list[object]]:
    """Return what axe finds that is serious or moderate: rules, and the elements that break them."""
    page.evaluate(AXE.read_text())
    code = """async () => (await axe.run()).violations
        .filter(({ impact }) => impact !== "minor")
        .map(({ id, nodes }) => [id, nodes.map(({ target }) => target.flat().join(" "))])"""
    return list(page.evaluate(code))


def move_slider(page: Page, name: str, value: float) -> None:
    """Set a slider, as a person does: the page hears of it."""
    find(page, name).fill(str(value))


def wait_until(page: Page, condition: str, seconds: float = PATIENCE) -> None:
    """Wait until an expression is true.

    `page.wait_for_function` would call eval, which the policy of the page forbids.
    """
    end, pause = monotonic() + seconds, 20.0
    while not page.evaluate(condition):
        assert monotonic() < end, f"not true within {seconds} s: {condition}"
        page.wait_for_timeout(pause)
        pause = min(1.5 * pause, 300.0)  # to ask often would slow down what takes long


def move_pointer(page: Page, x: float, y: float, steps: int = 1) -> None:
    """Move the pointer, and wait until the page has seen it: motions come with the next frame."""
    page.mouse.move(x, y, steps=steps)
    page.evaluate(TWO_FRAMES)


def wait_until_still(page: Page) -> None:
    """Wait until no request is under way, and two frames have been drawn."""
    page.evaluate(TWO_FRAMES)  # what was clicked may send a request only now
    end = monotonic() + PATIENCE
    while UNDER_WAY[page]:
        assert monotonic() < end, f"requests without an answer: {UNDER_WAY[page]}"
        page.wait_for_timeout(20)
    page.evaluate(TWO_FRAMES)


def vertex_values(page: Page, name: str = "value") -> np.ndarray:
    """Return an attribute of the vertices that the graphics card has: value, paint, position."""
    code = f"Array.from(eigenshape.viewer.geometry.getAttribute('{name}').array)"
    return np.array(page.evaluate(code))


def vertex_labels(page: Page) -> np.ndarray:
    """Return the part that each vertex is colored by."""
    return np.array(page.evaluate("Array.from(eigenshape.viewer.labels)"))


def picture(page: Page) -> np.ndarray:
    """Return what is drawn on the canvas, (height, width, 4), without what lies over it.

    The studio draws two pixels for each of the page, in both directions; every other is left out.
    """
    code = """async () => {
        const bytes = new Uint8Array(await (await eigenshape.viewer.screenshot()).arrayBuffer());
        return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    }"""
    return np.asarray(Image.open(BytesIO(base64.b64decode(page.evaluate(code)))))[::2, ::2]


def drop_file(page: Page, name: str, path: Path) -> None:
    """Drop a file on an element."""
    make = """([name, text]) => {
        const files = new DataTransfer();
        files.items.add(new File([text], name));
        return files;
    }"""
    files = page.evaluate_handle(make, [path.name, path.read_text(encoding="utf-8")])
    find(page, name).dispatch_event("drop", {"dataTransfer": files})


def positions(page: Page) -> np.ndarray:
    """Return the vertices as the shader computes them."""
    return np.array(page.evaluate("Array.from(eigenshape.viewer.readPositions())")).reshape(-1, 3)


def region(page: Page, number: int = 0) -> np.ndarray:
    """Return the vertices of a region, ascending."""
    return np.array(
        page.evaluate(f"Array.from({PANEL}.selection.regions.vertices({number}))"), dtype=int
    )


def limb(page: Page, number: int) -> np.ndarray:
    """Return the vertices of a limb, ascending: those of its part, and of all that hangs on it."""
    return np.array(page.evaluate(f"Array.from({PANEL}.limbs.verticesOf({number}))"), dtype=int)


def wait_until_bound(page: Page) -> None:
    """Wait until the regions can be moved."""
    wait_until(page, f"{PANEL}.form.root.dataset.ready === 'true'")


def wait_for_edits(page: Page, count: int) -> None:
    """Wait until this many edits are committed."""
    wait_until(page, f"eigenshape.state.deformation.n_edits === {count}")


def place_of(page: Page, point: Sequence[float]) -> list[float]:
    """Return where a point is seen, in pixels of the page."""
    code = """([point]) => {
        const { camera, canvas, space } = eigenshape.viewer;
        camera.updateMatrixWorld();
        const seen = camera.position.clone().fromArray(point).applyMatrix4(space.matrixWorld);
        seen.project(camera);
        const box = canvas.getBoundingClientRect();
        return [box.x + (seen.x + 1) / 2 * box.width, box.y + (1 - seen.y) / 2 * box.height];
    }"""
    return list(page.evaluate(code, [list(point)]))
