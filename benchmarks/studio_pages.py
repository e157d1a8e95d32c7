"""What the benchmark of the studio drives: a plain page with the same picture, and the processes of a browser."""

import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
from playwright.sync_api import Page

THREE = Path(__file__).parents[1] / "studio" / "front" / "node_modules" / "three" / "build"
# The same mesh, camera and size of the picture, one light, and none of the studio.
PLAIN = """<!doctype html><body style="margin: 0"><script type="module">
import * as three from "./three.module.js";
const { vertices, faces, width, height, camera: seen, space, aspect } = await (await fetch("view.json")).json();
const geometry = new three.BufferGeometry();
geometry.setAttribute("position", new three.Float32BufferAttribute(vertices, 3));
geometry.setIndex(new three.Uint32BufferAttribute(faces, 1));
geometry.computeVertexNormals();
const mesh = new three.Mesh(geometry, new three.MeshLambertMaterial({ color: "#cdc8c0", side: three.DoubleSide }));
const group = new three.Group();
group.applyMatrix4(new three.Matrix4().fromArray(space));
group.add(mesh);
const scene = new three.Scene();
scene.add(group, new three.HemisphereLight());
const camera = new three.PerspectiveCamera(26, aspect, 0.01, 100);
new three.Matrix4().fromArray(seen).decompose(camera.position, camera.quaternion, camera.scale);
const renderer = new three.WebGLRenderer();
renderer.setSize(width, height);
document.body.append(renderer.domElement);
window.step = (number) => {
  mesh.rotation.y = 0.004 * number;
  renderer.render(scene, camera);
};
window.step(0);
</script>"""
# Move, and draw in the next frame, for a number of frames; then wait until all of them are drawn.
FRAMES = """async (count) => {
    const step = STEP;
    for (let number = 1; number <= count; number++) {
        await new Promise((done) => requestAnimationFrame(done));
        step(number);
    }
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
}"""


@contextmanager
def serve_plain(view: str) -> Iterator[str]:
    """Serve the plain page with a mesh and a camera, as JSON; yield its address."""
    texts = {"/": PLAIN.encode(), "/view.json": view.encode()}
    texts |= {f"/{path.name}": path.read_bytes() for path in THREE.glob("three.*.js")}
    kinds = {"/": "text/html", "/view.json": "application/json"}

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:  # the name that http.server calls
            text = texts.get(self.path)
            self.send_response(404 if text is None else 200)
            self.send_header("content-type", kinds.get(self.path, "text/javascript"))
            self.end_headers()
            self.wfile.write(text or b"")

        def log_message(self, *_: object) -> None:
            """Print nothing."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()


def browser_processes() -> list[psutil.Process]:
    """Return the processes of the browser that this process has started."""
    children = psutil.Process().children(recursive=True)
    return [child for child in children if "chrom" in child.name()]


def browser_cpu() -> float:
    """Return the CPU seconds of all processes of the browser, user and system."""
    return sum(sum(process.cpu_times()[:2]) for process in browser_processes())


def frame_cpu(page: Page, step: str, count: int) -> float:
    """Return the CPU seconds of a shown frame; `step` is a function of the frame's number."""
    run = FRAMES.replace("STEP", step)
    page.evaluate(run, 3)  # compiles the shaders
    before = browser_cpu()
    page.evaluate(run, count)
    return (browser_cpu() - before) / count


def page_memory(page: Page) -> float:
    """Return the MiB that the scripts of a page hold, after garbage is collected."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    held = session.send("Runtime.getHeapUsage")
    session.detach()
    return (held["usedSize"] + held.get("backingStorageSize", 0.0)) / 2**20


def peak_memory(process: psutil.Process) -> float:
    """Return the most MiB that a process has held so far (Linux)."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0]) / 2**10


def process_memory(processes: list[psutil.Process]) -> float:
    """Return the MiB that processes hold for themselves alone."""
    return sum(process.memory_full_info().uss for process in processes) / 2**20
