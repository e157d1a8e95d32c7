"""The search service under many clients: errors, answers a second, and whether its memory grows.

    python benchmarks/bench_service.py                  16 clients for five minutes
    python benchmarks/bench_service.py --quick          four clients for ten seconds
    python benchmarks/bench_service.py --minutes 1 --clients 8

Each client sends scans and looks at shapes and pictures, one request after the other. One request in a hundred is
hostile: a mesh with NaN, bytes that are no mesh, no token, another host, a wrong parameter, or a body that ends early.
An error is an answer to a good request that is not 200 with matches, or to a hostile one that is not refused.
Memory is that of the service and its workers for themselves alone. Its growth is the least in the last third of
the time after a quarter of it, beside the least in the first third.
"""

import os
import re
import secrets
import socket
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from time import monotonic
from typing import Any

import httpx
import numpy as np
import psutil
from report import Report, Row, options_of
from studio_pages import process_memory

import eigenshape as es

PACKAGES = ["eigenshape", "eigenshape-studio", "uvicorn", "starlette", "pebble", "numpy"]
COLUMNS = ("clients", "figure", "measured", "aim")
KINDS = ("fish", "bird", "biped", "quadruped", "giraffe")
SHARE_OF_HOSTILE = 0.01
SHARE_OF_SCANS = 0.5  # of the good requests; the others look at shapes and pictures
SECONDS_A_SAMPLE = 2.0
BYTES = {"content-type": "application/octet-stream"}


def make_index(folder: Path) -> dict[str, bytes]:
    """Index some creatures; return the files of others, in another pose, by their kinds."""
    index = es.ShapeIndex.create(folder / "index")
    scans = {}
    for kind in KINDS:
        path = folder / f"{kind}.ply"
        mesh = es.make_creature(kind, n_vertices=500)
        es.write_mesh(mesh, path)
        index.add(kind, mesh, label="creature", source=str(path), n_views=0)
        es.write_mesh(es.make_creature(kind, 1, n_vertices=500), folder / "scan.ply")
        scans[kind] = (folder / "scan.ply").read_bytes()
    return scans


class Client:
    """Sends requests until a time, and counts what came back."""

    def __init__(self, address: str, token: str, scans: dict[str, bytes], number: int) -> None:
        self.address, self.token, self.scans = address, token, scans
        self.rng = np.random.default_rng(number)
        self.counts: Counter[str] = Counter()
        self.errors: list[str] = []

    def work(self, end: float) -> None:
        """Send one request after the other."""
        bearer = {"authorization": f"Bearer {self.token}"}
        with httpx.Client(base_url=self.address, timeout=300, headers=bearer) as client:
            while monotonic() < end:
                draw = self.rng.random()
                kind = str(self.rng.choice(KINDS))
                if draw < SHARE_OF_HOSTILE:
                    self.be_hostile(client)
                elif self.rng.random() < SHARE_OF_SCANS:
                    self.ask(client, kind)
                else:
                    self.look(client, kind)

    def ask(self, client: httpx.Client, kind: str) -> None:
        """Send a scan, whose kind must be found."""
        wanted = {"name": "scan.ply", "n": "1"}
        answer = client.post("/v1/query", params=wanted, content=self.scans[kind], headers=BYTES)
        self.counts["queries"] += 1
        if answer.status_code != 200 or answer.json()["matches"][0]["name"] != kind:
            self.errors.append(f"query of {kind}: {answer.status_code} {answer.text[:200]}")

    def look(self, client: httpx.Client, kind: str) -> None:
        """Look at a shape, or at its picture."""
        path = str(self.rng.choice([f"/v1/shapes/{kind}", f"/v1/thumbnails?name={kind}"]))
        answer = client.get(path)
        self.counts["looks"] += 1
        if answer.status_code != 200:
            self.errors.append(f"{path}: {answer.status_code} {answer.text[:200]}")

    def be_hostile(self, client: httpx.Client) -> None:
        """Send something that must be refused."""
        nan = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n"
        path = "/v1/query?name=scan.off"
        tricks: list[Callable[[], int | None]] = [
            lambda: client.post(path, content=nan, headers=BYTES).status_code,
            lambda: client.post(path, content=bytes(5000), headers=BYTES).status_code,
            lambda: client.post(f"{path}&n=0", content=nan, headers=BYTES).status_code,
            lambda: client.get("/v1/shapes", headers={"authorization": "Bearer x"}).status_code,
            lambda: client.get("/v1/shapes", headers={"host": "evil.example"}).status_code,
            self.end_early,
        ]
        status = tricks[self.rng.integers(len(tricks))]()
        self.counts["hostile requests"] += 1
        if status is not None and not 400 <= status < 500:
            self.errors.append(f"a hostile request: {status}")

    def end_early(self) -> None:
        """Begin to send a body, and go away."""
        host, port = self.address.removeprefix("http://").split(":")
        head = f"POST /v1/query?name=a.ply HTTP/1.1\r\nHost: {host}:{port}\r\n"
        head += f"Authorization: Bearer {self.token}\r\nContent-Length: 9999\r\n"
        head += "Content-Type: application/octet-stream\r\n\r\nply"
        with socket.create_connection((host, int(port)), timeout=60) as connection:
            connection.sendall(head.encode())


def measure(folder: Path, n_clients: int, seconds: float) -> list[Row]:
    """Serve an index to clients for some time; return the figures."""
    scans = make_index(folder)
    token = secrets.token_urlsafe()
    command = [sys.executable, "-m", "eigenshape", "serve", str(folder / "index"), "--port", "0"]
    environment = {**os.environ, "EIGENSHAPE_TOKEN": token}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        line = str(process.stdout.readline())  # type: ignore[union-attr]
        address = re.findall(r"http://[^/]+", line)[0]
        service = psutil.Process(process.pid)
        end = monotonic() + seconds
        clients = [Client(address, token, scans, number) for number in range(n_clients)]
        samples: list[tuple[float, float]] = []
        stop = threading.Event()

        def sample() -> None:
            while not stop.wait(SECONDS_A_SAMPLE):
                everyone = [service, *service.children(recursive=True)]
                samples.append((monotonic(), process_memory(everyone)))

        sampling = threading.Thread(target=sample)
        sampling.start()
        with ThreadPoolExecutor(n_clients) as threads:
            list(threads.map(lambda client: client.work(end), clients))
        took = monotonic() - (end - seconds)
        stop.set()
        sampling.join()
        process.terminate()
        code = process.wait(60)
    counts = sum((client.counts for client in clients), Counter[str]())
    errors = [error for client in clients for error in client.errors]
    for error in errors[:10]:
        print(error)
    late = [memory for at, memory in samples if at > end - 0.75 * seconds] or [0.0]
    third = max(1, len(late) // 3)
    growth = 100 * (min(late[-third:]) / max(min(late[:third]), 1e-9) - 1)
    figures: list[tuple[str, float, str, float | None]] = [
        ("errors", len(errors), "", 0),
        ("exit code at the end", code, "", 0),
        *[(name, float(count), "", None) for name, count in sorted(counts.items())],
        ("rate of requests", sum(counts.values()) / took, "a second", None),
        ("rate of queries", counts["queries"] / took, "a second", None),
        ("memory at the end", late[-1], "MiB", None),
        ("growth of the memory", growth, "%", 5),
    ]
    return [
        {"clients": n_clients, "figure": name, "value": value, "unit": unit, "most": most}
        for name, value, unit, most in figures
    ]


def cells(row: dict[str, Any]) -> list[str]:
    """Return a row as text."""
    most = "" if row["most"] is None else f"at most {row['most']:g} {row['unit']}".rstrip()
    measured = f"{row['value']:.4g} {row['unit']}".rstrip()
    return [str(row["clients"]), row["figure"], measured, most]


def main() -> None:
    """Measure, print, and write what the options ask for."""
    parser = options_of(__doc__)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--clients", type=int, default=16)
    parser.set_defaults(repeats=1)
    options = parser.parse_args()
    report = Report(PACKAGES, options, COLUMNS, cells, threads="all threads")
    n_clients, seconds = (4, 10.0) if options.quick else (options.clients, 60 * options.minutes)
    with tempfile.TemporaryDirectory() as folder:
        for row in measure(Path(folder), n_clients, seconds):
            report.add(row)


if __name__ == "__main__":
    main()
