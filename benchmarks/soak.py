"""Long use of one process: memory, handles, threads, temporary files, and whether answers stay right.

    python benchmarks/soak.py calls                  2,000 calls of each of five functions
    python benchmarks/soak.py service                a service for 60 s under eight clients that add, remove and query
    python benchmarks/soak.py calls --quick          20 calls of each

The first tenth of the calls or of the time fills caches; "before" is after it, and "after" is at the end. An answer to
a call is wrong if it differs in a bit from the first one. Each client of the service adds a shape of its own, finds it
by its scan, removes it, and finds it no more. Temporary files are those in the folder for them (TMPDIR), which is one
of its own; that of the service has uploads, the index and its log.
"""

import argparse
import os
import re
import secrets
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import httpx
import numpy as np
import psutil
from report import Report, Row, options_of
from studio_pages import process_memory

import eigenshape as es

PACKAGES = ["eigenshape", "eigenshape-studio", "numpy", "scipy"]
COLUMNS = ("what", "figure", "before", "after")
WARM = 0.1  # share of the calls, or of the time, before the first look
N_CLIENTS = 8
BYTES = {"content-type": "application/octet-stream"}


def bumpy_ball(seed: int, level: int = 2) -> es.TriangleMesh:
    """Return a ball of 162 vertices, or of another level, with bumps of its own for each number."""
    ball = es.icosphere(level)
    radii = 1 + 0.4 * np.random.default_rng(seed).random(ball.n_vertices)
    return es.TriangleMesh(radii[:, None] * ball.vertices, ball.faces)


def n_temporary() -> int:
    """Count the files in the folder for temporary ones, which is ours alone."""
    return len(list(Path(tempfile.gettempdir()).rglob("*")))


def look_at(processes: list[psutil.Process]) -> dict[str, float]:
    """Return what processes take."""
    return {
        "memory, MiB": process_memory(processes),
        "handles": sum(each.num_fds() for each in processes),
        "threads": sum(each.num_threads() for each in processes),
        "temporary files": n_temporary(),
    }


def functions() -> dict[str, Callable[[], np.ndarray]]:
    """Return calls by name, each of which gives numbers."""
    ball, small = bumpy_ball(0), bumpy_ball(0, level=1)  # a match of 162 vertices takes 2.6 s
    rig = es.rig_shape(ball, es.solve_spectrum(es.cotangent_laplacian(ball), 30))
    top = es.deformation.BoxRegion([-9, -9, 0.3], [9, 9, 9])
    turn = es.Rotation(pivot=[0, 0, 0.3], axis=[1, 0, 0], angle=0.5)
    recipe = es.retrieval.SCALE_FREE
    index = es.ShapeIndex.create(Path(tempfile.gettempdir()) / "index")
    for seed in range(10):
        index.add(f"{seed}", bumpy_ball(seed), recipe=recipe, n_views=0)
    query = es.describe(ball, recipe)
    return {
        "solve": lambda: es.solve_spectrum(es.cotangent_laplacian(ball), 10).eigenvectors,
        "describe": lambda: es.describe(ball, recipe).vectors,
        "match": lambda: es.match_shapes(small, small).weights,
        "deform": lambda: es.deform(rig, top, turn).vertices,
        "query": lambda: np.array([match.score for match in index.query(query)]),
    }


def soak_calls(n_calls: int) -> list[Row]:
    """Call each function often; return the figures."""
    process = [psutil.Process()]
    rows = []
    for name, call in functions().items():
        first, wrong, before = call(), 0, {}
        for number in range(n_calls):
            wrong += not np.array_equal(call(), first)
            if number == int(WARM * n_calls):
                before = look_at(process)
        rows += rows_of(name, before, look_at(process), wrong)
    return rows


def rows_of(what: str, before: dict[str, float], after: dict[str, float], wrong: int) -> list[Row]:
    """Return a row for each figure."""
    rows = [
        {"what": what, "figure": name, "before": before[name], "after": after[name]}
        for name in after
    ]
    return [*rows, {"what": what, "figure": "wrong answers", "before": 0, "after": wrong}]


def be_client(
    address: str, token: str, number: int, scan: bytes, end: float
) -> tuple[int, list[str]]:
    """Add, find, remove and miss a shape until a time; return how often, and what was wrong."""
    name, n_rounds, wrong = f"client {number}", 0, []
    headers = BYTES | {"authorization": f"Bearer {token}"}
    with httpx.Client(base_url=address, timeout=300, headers=headers) as client:

        def find() -> list[str]:
            wanted = {"name": "scan.ply", "n": "1"}
            answer = client.post("/v1/query", params=wanted, content=scan).raise_for_status()
            return [match["name"] for match in answer.json()["matches"]]

        while monotonic() < end:
            wanted = {"name": name, "file": "scan.ply"}
            added = client.post("/v1/shapes", params=wanted, content=scan)
            if added.status_code != 201:
                wrong.append(f"{name} is not added: {added.text[:200]}")
            if find() != [name]:
                wrong.append(f"{name} is not found")
            if client.delete(f"/v1/shapes/{name}").status_code != 200:
                wrong.append(f"{name} is not removed")
            if name in find():
                wrong.append(f"{name} is found after it was removed")
            n_rounds += 1
    return n_rounds, wrong


def soak_service(seconds: float) -> list[Row]:
    """Serve an index to clients that change it; return the figures."""
    folder = Path(tempfile.gettempdir())
    index = es.ShapeIndex.create(folder / "index")
    scans = []
    for number in range(N_CLIENTS):
        es.write_mesh(bumpy_ball(number), folder / "scan.ply")
        scans.append((folder / "scan.ply").read_bytes())
    index.add("fish", es.make_creature("fish", n_vertices=500), n_views=0)
    tokens = [secrets.token_urlsafe() for _ in range(2)]
    names = ("EIGENSHAPE_TOKEN", "EIGENSHAPE_WRITE_TOKEN")
    environment = os.environ | dict(zip(names, tokens, strict=True))
    command = [sys.executable, "-m", "eigenshape", "serve", str(folder / "index"), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        address = re.findall(r"http://[^/]+", str(process.stdout.readline()))[0]  # type: ignore[union-attr]
        service = psutil.Process(process.pid)
        looks: list[dict[str, float]] = []
        stop = threading.Event()

        def look() -> None:
            while not stop.wait(1.0):
                found = look_at([service, *service.children(recursive=True)])
                size = sum(path.stat().st_size for path in index.folder.iterdir())
                looks.append(found | {"index and log, KiB": size / 1024})

        looking = threading.Thread(target=look)
        looking.start()
        end = monotonic() + seconds
        with ThreadPoolExecutor(N_CLIENTS) as threads:
            work = [
                threads.submit(be_client, address, tokens[1], number, scan, end)
                for number, scan in enumerate(scans)
            ]
            outcomes = [each.result() for each in work]
        sleep(2)  # the last look is without requests
        stop.set()
        looking.join()
        process.terminate()
        code = process.wait(60)
    wrong = [text for _, texts in outcomes for text in texts]
    print(*wrong[:10], sep="\n")
    # Between requests the figures go up and down: the least of a quarter of the time is compared.
    quarter = max(1, len(looks) // 4)
    start = int(WARM * len(looks))
    parts = looks[start : start + quarter], looks[-quarter:]
    before, after = (
        {name: min(each[name] for each in part) for name in looks[0]} for part in parts
    )
    rounds = sum(n_rounds for n_rounds, _ in outcomes)
    return [
        *rows_of("service", before, after, len(wrong)),
        {"what": "service", "figure": "rounds of four requests", "before": 0, "after": rounds},
        {"what": "service", "figure": "exit code", "before": 0, "after": code},
    ]


def soak(options: argparse.Namespace) -> list[Row]:
    """Return the figures that the options ask for."""
    if options.what == "calls":
        return soak_calls(20 if options.quick else options.calls)
    return soak_service(6.0 if options.quick else options.seconds)


def cells(row: dict[str, Any]) -> list[str]:
    """Return a row as text."""
    return [row["what"], row["figure"], f"{row['before']:.4g}", f"{row['after']:.4g}"]


def main() -> None:
    """Measure, print, and write what the options ask for."""
    parser = options_of(__doc__)
    parser.add_argument("what", choices=["calls", "service"])
    parser.add_argument("--calls", type=int, default=2000)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.set_defaults(repeats=1)
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells, threads="all threads")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["TMPDIR"] = tempfile.tempdir = folder
        rows = soak(options)
    for row in rows:
        report.add(row)


if __name__ == "__main__":
    main()
