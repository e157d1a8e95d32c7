"""The studio in a real browser: how soon it answers, what a frame costs, and whether it grows.

    python benchmarks/bench_studio.py                  5,000 to a million vertices; some minutes
    python benchmarks/bench_studio.py --quick          2,500 vertices, half a minute
    python benchmarks/bench_studio.py --minutes 10     then ten minutes of work by a script

Chromium draws in software (SwiftShader), in a window of 1280 by 800. A plain page of three.js shows the same mesh
from the same place; both take turns, and the CPU is that of all processes of the browser. The work of `--minutes`
is what a person does: select, drag, undo, look at modes, heat and parts, search. Any error of the page ends it.
"""

import itertools
import json
import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import psutil
from playwright.sync_api import Browser, Page
from report import Report, Row, options_of
from studio_pages import (
    THREE,
    browser_cpu,
    browser_processes,
    frame_cpu,
    page_memory,
    peak_memory,
    process_memory,
    serve_plain,
)

import eigenshape as es
from eigenshape_studio.report import write_report

STUDIO = Path(__file__).parents[1] / "studio"
sys.path[:0] = [str(STUDIO), str(STUDIO / "tests")]
import browser as studio  # noqa: E402
from hatch_build import install_packages  # noqa: E402

PACKAGES = ["eigenshape", "eigenshape-studio", "playwright", "numpy", "scipy"]
COLUMNS = ("shape", "figure", "measured", "aim")
FULL, QUICK = (25_000, 100_000, 20_000), (2_500, 3_000, 2_000)  # drag, first picture, report
SIZES, QUICK_SIZES = (5_000, 25_000, 100_000, 1_000_000), (2_000, 8_000)
N_FRAMES = 30
WARM = 120.0  # seconds of work after which memory may no longer grow
BEAST = "giraffe"
MOST_LIT = 400_000  # faces of a shape for which daylight is computed, as in ambient.ts
LARGEST_CREATURE = 100_000  # vertices; larger shapes are subdivided
# Resolves with the seconds from the end of the next stroke of the pointer until regions can be moved.
WATCH = """() => {
    const { root } = PANEL.form;
    let begin = 0;
    const end = { once: true, capture: true };
    eigenshape.viewer.canvas.addEventListener("pointerup", () => (begin = performance.now()), end);
    window.ready = new Promise((done) =>
        new MutationObserver((_, watch) => {
            if (!begin || root.dataset.ready !== "true") return;
            watch.disconnect();
            done((performance.now() - begin) / 1000);
        }).observe(root, { attributes: true }),
    );
}""".replace("PANEL", studio.PANEL)
MOVE = """(number) => eigenshape.viewer.canvas.dispatchEvent(
    new PointerEvent("pointermove", { clientX: AT_X + number, clientY: AT_Y - number, bubbles: true }))"""
# Moves each 20 ms, for longer than the pause after which the exact result is requested.
KEEP_MOVING = """async () => {
    for (let number = 1; number <= 40; number++) {
        (MOVE)(number);
        await new Promise((done) => setTimeout(done, 20));
    }
}"""
# The seconds from the last motion until the exact result is there and begins to blend in.
REST = """() => new Promise((done) => {
    const { viewer } = eigenshape;
    const begin = performance.now();
    viewer.setExact = (vertices) => {
        delete viewer.setExact;
        viewer.setExact(vertices);
        done((performance.now() - begin) / 1000);
    };
    (MOVE)(NUMBER);
})"""
VIEW = """() => {
    const { vertices, faces, canvas, camera, space } = eigenshape.viewer;
    return {
        vertices: Array.from(vertices), faces: Array.from(faces), aspect: camera.aspect,
        width: canvas.clientWidth, height: canvas.clientHeight,
        camera: camera.matrixWorld.toArray(), space: space.matrixWorld.toArray(),
    };
}"""


def row(n_vertices: int, figure: str, value: float, unit: str = "s", most: Any = None) -> Row:
    """Return one figure, with the most that it should be."""
    return {
        "shape": f"{n_vertices:,} vertices",
        "figure": figure,
        "value": value,
        "unit": unit,
        "most": most,
    }


def cells(row: Row) -> list[str]:
    """Return a row as text."""
    most = "" if row["most"] is None else f"at most {row['most']:g} {row['unit']}".rstrip()
    return [row["shape"], row["figure"], f"{row['value']:.3g} {row['unit']}".rstrip(), most]


def wait_until_ready(page: Page) -> None:
    """Wait until the shape can be bent."""
    studio.wait_until(page, "eigenshape.state.deformation.status === 'ready'", 300)


def stroke_box(page: Page, share: float) -> float:
    """Drag the lower side of the box to a share of the height; return the seconds until ready."""
    studio.find(page, "tool-box").click()
    low, high = page.evaluate(
        f"[{studio.PANEL}.selection.box.low, {studio.PANEL}.selection.box.high]"
    )
    box = page.evaluate(
        "[eigenshape.viewer.box.min.toArray(), eigenshape.viewer.box.max.toArray()]"
    )
    x, z = (low[0] + high[0]) / 2, (low[2] + high[2]) / 2
    height = box[0][1] + share * (box[1][1] - box[0][1])
    page.evaluate(WATCH)
    page.mouse.move(*studio.place_of(page, [x, low[1], z]))
    page.mouse.down()
    page.mouse.move(*studio.place_of(page, [x, height, z]))
    page.mouse.up()
    return float(page.evaluate("ready"))


def grip(page: Page) -> tuple[float, float]:
    """Return a place where the chosen region is seen."""
    chosen = studio.region(page)
    points = np.array(page.evaluate("Array.from(eigenshape.viewer.vertices)")).reshape(-1, 3)
    for vertex in chosen[np.linspace(0, len(chosen) - 1, 40).astype(int)]:
        x, y = studio.place_of(page, points[vertex])
        hit = page.evaluate("([x, y]) => eigenshape.viewer.pick(x, y)", [x, y])
        if hit and hit["vertex"] in chosen:
            return x, y
    raise AssertionError("The region must be in sight; no vertex of it is.")


def measure_drag(browser: Browser, folder: Path, n_vertices: int, repeats: int) -> list[Row]:
    """Measure choosing, dragging and resting, and the frames beside those of a plain page."""
    path = folder / "drag.ply"
    mesh = es.make_creature(BEAST, n_vertices=n_vertices)
    es.write_mesh(mesh, path)
    with (
        studio.serve_studio(path) as url,
        studio.open_page(browser, url, size=studio.LAPTOP) as page,
    ):
        wait_until_ready(page)
        stroke_box(page, 0.5)  # loads what is needed
        ready = [stroke_box(page, 0.6 + 0.02 * number) for number in range(repeats)]

        studio.find(page, "tool-pull").click()
        x, y = grip(page)
        move = MOVE.replace("AT_X", str(x)).replace("AT_Y", str(y))
        page.mouse.move(x, y)
        page.mouse.down()
        # The first rest loads what it needs; each of the others is at another place.
        rests = [
            page.evaluate(REST.replace("MOVE", move).replace("NUMBER", str(number)))
            for number in range(1, repeats + 2)
        ][1:]
        calls: list[str] = []
        page.on("request", lambda request: calls.append(request.url))
        page.evaluate(KEEP_MOVING.replace("MOVE", move))
        n_calls = len(calls)
        with serve_plain(json.dumps(page.evaluate(VIEW))) as address:
            width, height = studio.LAPTOP
            context = browser.new_context(viewport={"width": width, "height": height})
            plain = context.new_page()
            plain.goto(address)
            studio.wait_until(plain, "window.step !== undefined")
            frames = []
            for _ in range(repeats):
                page.bring_to_front()
                ours = frame_cpu(page, move, N_FRAMES)
                plain.bring_to_front()
                frames.append((ours, frame_cpu(plain, "window.step", N_FRAMES)))
            context.close()
        page.bring_to_front()
        page.mouse.up()
        studio.wait_for_edits(page, 1)
    ours, theirs = (1000 * statistics.median(pair[side] for pair in frames) for side in (0, 1))
    median = statistics.median
    return [
        row(mesh.n_vertices, "region chosen to ready to drag", median(ready), most=0.3),
        row(mesh.n_vertices, "calls while the pointer moves", n_calls, "", 0),
        row(mesh.n_vertices, "exact result, after the last motion", median(rests), most=0.3),
        row(mesh.n_vertices, "CPU of a shown frame", ours, "ms", 200),
        row(mesh.n_vertices, "CPU of a frame of a plain page", theirs, "ms"),
        row(mesh.n_vertices, "ratio of these", ours / theirs, ""),
    ]


def measure_opening(browser: Browser, folder: Path, n_vertices: int) -> list[Row]:
    """Measure how long one waits for a picture, for the spectrum, and until the shape can be bent."""
    path = folder / "large.ply"
    mesh = es.make_creature(BEAST, n_vertices=n_vertices)
    es.write_mesh(mesh, path)
    since = "performance.now() / 1000"  # since the address was opened
    with (
        studio.serve_studio(path) as url,
        studio.open_page(browser, url, size=studio.LAPTOP) as page,
    ):
        drawn = f"eigenshape.viewer.renderer.info.render.triangles >= {len(mesh.faces)}"
        studio.wait_until(page, drawn)
        picture = page.evaluate(since)
        studio.wait_until(page, "eigenshape.state.spectrum.status === 'ready'", 300)
        spectrum = page.evaluate(since)
        wait_until_ready(page)
        return [
            row(mesh.n_vertices, "first picture", picture, most=2),
            row(mesh.n_vertices, "spectrum ready", spectrum),
            row(mesh.n_vertices, "ready to choose a region", page.evaluate(since)),
        ]


def measure_size(browser: Browser, folder: Path, n_vertices: int) -> list[Row]:
    """Measure what the first picture of a shape costs, and a frame of it.

    The server starts to compute a spectrum meanwhile unless the shape is large, and that counts.
    """
    path = folder / "size.ply"
    halvings = 3 if n_vertices > LARGEST_CREATURE else 0
    mesh = es.make_creature(BEAST, n_vertices=n_vertices // 4**halvings)
    for _ in range(halvings):
        mesh = es.geometry.subdivide(mesh)
    es.write_mesh(mesh, path)
    before = browser_cpu()
    with (
        studio.start_server(path) as (url, number),
        studio.open_page(browser, url, ready="true", size=studio.LAPTOP) as page,
    ):
        drawn = f"window.eigenshape?.viewer.renderer.info.render.triangles >= {len(mesh.faces)}"
        studio.wait_until(page, drawn, 300)
        server = psutil.Process(number)
        cpu = browser_cpu() - before + sum(server.cpu_times()[:2])
        memory = peak_memory(server)
        studio.wait_until_still(page)
        held = process_memory(browser_processes())
        # Daylight is computed with the first frames, which are not those that are meant.
        if mesh.n_faces <= MOST_LIT:
            studio.wait_until(page, "eigenshape.viewer.ambient.ground.visible")
        server.suspend()  # only the browser shall work now
        million = n_vertices > LARGEST_CREATURE
        step = "() => eigenshape.viewer.invalidate()"
        frame = frame_cpu(page, step, N_FRAMES // 6 if million else N_FRAMES)
        server.resume()
    most_cpu, most_memory = (10, 1430) if million else (None, None)
    most_frame = {25_000: 150, 100_000: 250}.get(n_vertices)
    return [
        row(mesh.n_vertices, "CPU to the first picture", cpu, most=most_cpu),
        row(mesh.n_vertices, "most memory of the server until then", memory, "MiB", most_memory),
        row(mesh.n_vertices, "memory of the browser", held, "MiB"),
        row(mesh.n_vertices, "CPU of a frame", 1000 * frame, "ms", most_frame),
    ]


def measure_report(folder: Path, n_vertices: int) -> list[Row]:
    """Measure the size of a report."""
    mesh = es.make_creature(BEAST, n_vertices=n_vertices)
    write_report(mesh, folder / "report.html")
    size = (folder / "report.html").stat().st_size / 1e6
    return [row(mesh.n_vertices, "size of a report", size, "MB", 3)]


def work_for(browser: Browser, folder: Path, minutes: float) -> list[Row]:
    """Work like a person for some minutes; return how much memory grew after the second minute.

    That is the least that was held in the last third of the time, beside the least in the first.
    """
    shapes = {kind: es.make_creature(kind, n_vertices=2500) for kind in ("quadruped", BEAST)}
    index = es.ShapeIndex.create(folder / "index")
    for name, mesh in shapes.items():
        es.write_mesh(mesh, folder / f"{name}.ply")
        index.add(name, mesh, source=str(folder / f"{name}.ply"), n_views=0)
    samples: list[dict[str, float]] = []
    path = folder / "quadruped.ply"
    with (
        studio.start_server(path, folder / "index") as (url, number),
        studio.open_page(browser, url, size=studio.LAPTOP) as page,
    ):
        wait_until_ready(page)
        server, begin = psutil.Process(number), monotonic()
        for turn in itertools.count():
            work_once(page, turn)
            samples.append(
                {
                    "seconds": monotonic() - begin,
                    "page": page_memory(page),
                    "browser": process_memory(browser_processes()),
                    "server": process_memory([server]),
                }
            )
            late = [sample for sample in samples if sample["seconds"] > min(WARM, 30 * minutes)]
            if samples[-1]["seconds"] > 60 * minutes and len(late) > 1:
                break
    what = {"page": "scripts of the page", "browser": "browser", "server": "server"}
    rows = [row(shapes["quadruped"].n_vertices, "rounds of work", len(samples), "")]
    for name, words in what.items():
        held = [sample[name] for sample in late]
        # Memory that is free again is not given back at once, so the least counts: what stays.
        third = max(1, len(held) // 3)
        growth = 100 * (min(held[-third:]) / min(held[:third]) - 1)
        rows += [
            row(2500, f"{words}: memory at the end", held[-1], "MiB"),
            row(2500, f"{words}: growth after the second minute", growth, "%", 10),
        ]
    rows[0]["samples"] = samples
    return rows


def work_once(page: Page, turn: int) -> None:
    """Select, drag, undo, and look at modes, heat, parts and similar shapes."""
    find = studio.find
    find(page, "tab-deform").click()
    stroke_box(page, 0.55 + 0.05 * (turn % 5))
    find(page, "tool-pull").click()
    x, y = grip(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 10 * (turn % 3 + 1), y - 15, steps=4)
    if turn % 2:
        studio.wait_until(page, "eigenshape.viewer.motion.blend.value === 1")
    page.mouse.up()
    studio.wait_for_edits(page, 1)
    find(page, "undo").click()
    studio.wait_for_edits(page, 0)
    find(page, "tab-spectrum").click()
    find(page, "legend").wait_for()
    for mode in range(1, 20, 6):
        studio.move_slider(page, "eigenfunction", mode + turn % 40)
    find(page, "tab-heat").click()
    for step in range(20, 400, 60):
        studio.move_slider(page, "time", step)
    find(page, "tab-parts").click()
    find(page, "diagram").locator("canvas").wait_for(timeout=120_000)
    studio.move_slider(page, "n-parts", 2 + turn % 9)
    find(page, "tab-search").click()
    find(page, "search").click()
    find(page, "match-1").wait_for(timeout=120_000)
    studio.wait_until_still(page)
    find(page, f"match-{turn % 2}").click()
    find(page, "close-match").click()
    studio.wait_until_still(page)


def main() -> None:
    """Measure, print, and write what the options ask for."""
    parser = options_of(__doc__)
    parser.add_argument(
        "--minutes", type=float, default=0.0, help="of work by a script, for the memory; none"
    )
    parser.add_argument("--sizes", type=int, nargs="+", help="vertices of the table of sizes")
    parser.add_argument(
        "--only", action="append", choices=["drag", "opening", "sizes", "report", "work"]
    )
    options = parser.parse_args()
    if not THREE.exists():
        install_packages()
    report = Report(PACKAGES, options, COLUMNS, cells, threads="all threads")
    drag, large, reported = QUICK if options.quick else FULL
    with tempfile.TemporaryDirectory() as work, studio.start_browser() as browser:
        folder = Path(work)
        parts: dict[str, Callable[[], list[Row]]] = {
            "drag": lambda: measure_drag(browser, folder, drag, options.repeats),
            "opening": lambda: measure_opening(browser, folder, large),
            "sizes": lambda: [
                found
                for size in options.sizes or (QUICK_SIZES if options.quick else SIZES)
                for found in measure_size(browser, folder, size)
            ],
            "report": lambda: measure_report(folder, reported),
            "work": lambda: work_for(browser, folder, options.minutes) if options.minutes else [],
        }
        for name, measure in parts.items():
            for found in measure() if name in (options.only or parts) else []:
                report.add(found)


if __name__ == "__main__":
    main()
