"""A real server against hostile requests: none is accepted, and none stops it."""

import asyncio
import http.client
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest
from conftest import stretched_ball

import eigenshape as es
from eigenshape_studio.guard import Rules, local_hosts
from eigenshape_studio.server import MOST_CALLS, make_app, serve
from eigenshape_studio.tab.workspace import Answer
from eigenshape_studio.wire import decode, encode

# The studio with limits that tests can reach within a second or two.
SCRIPT = """
import sys
from functools import partial
from pathlib import Path
from eigenshape_studio import listening, server
listening.HEADER_SECONDS = 1.0
server.Rules = partial(server.Rules, most_bytes=1 << 20, pause=0.5, deadline=2.0)
sessions = Path(sys.argv[1]).parent
server.serve([sys.argv[1]], browse=False, announce=partial(print, flush=True), sessions=sessions)
"""
TAB = "a-tab-of-the-tests"


class Server:
    """A studio in a process of its own, and requests to it."""

    def __init__(self, path, setup="", stderr=None):
        command = [sys.executable, "-c", setup + SCRIPT, str(path)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True)
        self.url = self.process.stdout.readline().strip()
        parts = urlsplit(self.url)
        self.port, self.token = parts.port, parts.query.removeprefix("token=")
        self.base = f"http://127.0.0.1:{self.port}"
        self.cookie = f"eigenshape-studio-{self.port}={self.token}"
        self.client = httpx.Client(base_url=self.base, timeout=300)

    def call(self, name, meta=None, arrays=None, tab=TAB):
        kind = {"content-type": "application/octet-stream", "x-eigenshape-tab": tab}
        headers = {**kind, "cookie": self.cookie}
        return self.client.post(f"/api/{name}", headers=headers, content=encode(meta or {}, arrays))

    def state(self, tab=TAB):
        answer = self.call("meta", tab=tab)
        assert answer.status_code == 200
        return decode(answer.content)[0]

    def raw(self, data, pieces=(), pause=0.0):
        """Send bytes as they are; return the status of the answer, or None if there is none."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=8) as connection:
            try:
                connection.sendall(data)
                for piece in pieces:
                    time.sleep(pause)
                    connection.sendall(piece)
            except (BrokenPipeError, ConnectionResetError):
                pass
            return status_of(connection)

    def opening(self, data, name="a.ply"):
        """Return a request that opens a mesh."""
        return change_request(self, {"kind": "open", "name": name}, file=data)

    def request(self, method="POST", path="/api/meta", body=None, drop=(), **changes):
        """Return a request as the page sends it, with some headers changed or dropped."""
        body = encode({}) if body is None else body
        headers = {
            "host": f"127.0.0.1:{self.port}",
            "cookie": self.cookie,
            "content-type": "application/octet-stream",
            "x-eigenshape-tab": TAB,
            "content-length": str(len(body)),
        }
        headers |= {name.replace("_", "-"): value for name, value in changes.items()}
        lines = [f"{method} {path} HTTP/1.1"]
        for name, value in headers.items():
            values = value if isinstance(value, list) else [value]
            lines += [f"{name}: {each}" for each in values if name not in drop]
        return "\r\n".join(lines).encode("latin-1") + b"\r\n\r\n" + body


def status_of(connection):
    """Return the status of an answer; None if the connection ends or stays silent."""
    data = b""
    try:
        while b"\r\n" not in data:
            piece = connection.recv(4096)
            if not piece:
                return None
            data += piece
    except (ConnectionResetError, TimeoutError):
        return None
    return int(data.split()[1])


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    path = tmp_path_factory.mktemp("studio") / "ball.ply"
    es.write_mesh(stretched_ball(2), path)
    running = Server(path)
    yield running
    running.client.close()
    running.process.terminate()
    running.process.communicate(timeout=20)


def test_the_printed_address_becomes_a_cookie(server):
    answer = httpx.get(server.url, timeout=60)
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    cookie = answer.headers["set-cookie"]
    assert {"HttpOnly", "SameSite=Strict"} <= set(cookie.split("; "))
    page = httpx.get(server.base, headers={"cookie": cookie.split(";")[0]})
    assert page.status_code == 200
    assert 'id="eigenshape-studio"' in page.text
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert page.headers["x-content-type-options"] == "nosniff"
    again = httpx.get(server.base)
    assert again.status_code == 403
    assert "Open the address that it has printed" in again.text
    bundle = httpx.get(f"{server.base}/studio.js", headers={"cookie": server.cookie})
    assert bundle.headers["content-type"].startswith("text/javascript")


def test_tabs_are_apart_and_the_oldest_is_kept(server):
    tabs = [f"another-tab-{number:02}" for number in range(12)]
    ball = np.frombuffer(ply_of("0 0 0\n1 0 0\n0 1 0\n"), np.uint8)
    opened = server.call("finish", {"kind": "open", "name": "a.ply"}, {"file": ball}, tabs[0])
    assert decode(opened.content)[0]["state"]["n_vertices"] == 3
    assert server.state(tabs[1])["n_vertices"] == 162
    for tab in tabs:
        server.state(tab)
    assert server.state(tabs[0])["n_vertices"] == 3


class SlowWorkspace:
    """A workspace whose searches last until they are let go."""

    def __init__(self):
        self.begun, self.let_go = threading.Semaphore(0), threading.Event()

    def fork(self, _file):
        return self

    def answer(self, call, _message):
        if call == "query":
            self.begun.release()
            assert self.let_go.wait(60)
        return Answer(encode({"call": call}), 200)


def test_the_work_of_one_tab_does_not_stop_another(tmp_path):
    slow = SlowWorkspace()
    rules = Rules("secret", local_hosts(5000), 5000)
    cookie = {"cookie": "eigenshape-studio-5000=secret", "content-type": "application/octet-stream"}

    async def run():
        transport = httpx.ASGITransport(make_app(slow, rules, tmp_path))
        async with httpx.AsyncClient(
            transport=transport, base_url="http://127.0.0.1:5000", headers=cookie
        ) as client:

            async def call(name, tab):
                headers = {"x-eigenshape-tab": tab}
                answer = await client.post(f"/api/{name}", headers=headers, content=encode({}))
                return answer.status_code

            searches = [asyncio.create_task(call("query", "busy-tab")) for _ in range(MOST_CALLS)]
            for _ in searches:
                while not slow.begun.acquire(blocking=False):
                    await asyncio.sleep(0.01)
            assert await call("meta", "quiet-tab") == 200
            assert await call("meta", "busy-tab") == 429
            slow.let_go.set()
            assert await asyncio.gather(*searches) == [200] * MOST_CALLS
            assert await call("meta", "busy-tab") == 200

    with ThreadPoolExecutor(1) as thread:  # in that of the tests a browser may have an event loop
        thread.submit(asyncio.run, run()).result()


def ply_of(vertices, face="3 0 1 2", n_vertices=3, n_faces=1):
    header = f"ply\nformat ascii 1.0\nelement vertex {n_vertices}\n"
    header += "property float x\nproperty float y\nproperty float z\n"
    header += f"element face {n_faces}\nproperty list uchar int vertex_indices\nend_header\n"
    return (header + vertices + face + "\n").encode()


def change_request(server, meta, **arrays):
    kinds = {name: np.frombuffer(data, np.uint8) for name, data in arrays.items()}
    return server.request(path="/api/finish", body=encode(meta, kinds))


def message(header):
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    text += b" " * (-(4 + len(text)) % 8)
    return struct.pack("<I", len(text)) + text


GOOD = "0 0 0\n1 0 0\n0 1 0\n"
CHUNK = b"%x\r\n" % (1 << 16) + bytes(1 << 16) + b"\r\n"
# What is sent, by what is wrong with it.
HOSTILE = {
    # another name for this server
    "host of another site": lambda s: s.request(host="evil.example"),
    "host of another site with the port": lambda s: s.request(host=f"evil.example:{s.port}"),
    "host without port": lambda s: s.request(host="127.0.0.1"),
    "host with another port": lambda s: s.request(host="127.0.0.1:80"),
    "host that begins like ours": lambda s: s.request(host=f"127.0.0.1.evil.example:{s.port}"),
    "host of all addresses": lambda s: s.request(host=f"0.0.0.0:{s.port}"),
    "host with a user": lambda s: s.request(host=f"127.0.0.1:{s.port}@evil.example"),
    "host that is empty": lambda s: s.request(host=""),
    "host twice": lambda s: s.request(host=[f"127.0.0.1:{s.port}", "evil.example"]),
    "host missing": lambda s: s.request(drop=("host",)),
    # another page
    "origin of another site": lambda s: s.request(origin="https://evil.example"),
    "origin null": lambda s: s.request(origin="null"),
    "origin with another scheme": lambda s: s.request(origin=f"https://127.0.0.1:{s.port}"),
    "origin with another port": lambda s: s.request(origin="http://127.0.0.1:8888"),
    "origin of the other local name": lambda s: s.request(origin=f"http://localhost:{s.port}"),
    "origin twice": lambda s: s.request(origin=[s.base, "https://evil.example"]),
    "fetch from another site": lambda s: s.request(sec_fetch_site="cross-site"),
    "fetch from another port": lambda s: s.request(sec_fetch_site="same-site"),
    # without the token
    "no cookie": lambda s: s.request(drop=("cookie",)),
    "no cookie for the page": lambda s: s.request("GET", "/", b"", drop=("cookie",)),
    "no cookie for the bundle": lambda s: s.request("GET", "/studio.js", b"", drop=("cookie",)),
    "wrong token": lambda s: s.request(cookie=s.cookie[:-1] + "!"),
    "part of the token": lambda s: s.request(cookie=s.cookie[:-4]),
    "empty token": lambda s: s.request(cookie=s.cookie.partition("=")[0] + "="),
    "token of another port": lambda s: s.request(cookie=f"eigenshape-studio-1={s.token}"),
    "token that is not ASCII": lambda s: s.request(cookie=f"eigenshape-studio-{s.port}=\xe9\xff"),
    "token in the address of a call": lambda s: s.request(
        path=f"/api/meta?token={s.token}", drop=("cookie",)
    ),
    "wrong token in the address": lambda s: s.request("GET", "/?token=x", b"", drop=("cookie",)),
    "two tokens in the address": lambda s: s.request(
        "GET", f"/?token={s.token}&token=x", b"", drop=("cookie",)
    ),
    # other files
    "traversal": lambda s: s.request("GET", "/../../../../etc/passwd", b""),
    "traversal, escaped": lambda s: s.request("GET", "/%2e%2e%2f%2e%2e%2fetc%2fpasswd", b""),
    "traversal, escaped twice": lambda s: s.request("GET", "/%252e%252e/etc/passwd", b""),
    "traversal, backslash": lambda s: s.request("GET", "/..%5cserver.py", b""),
    "another file of the package": lambda s: s.request("GET", "/server.py", b""),
    "an absolute path": lambda s: s.request("GET", "//etc/passwd", b""),
    "a null byte": lambda s: s.request("GET", "/studio.js%00.png", b""),
    "traversal in a call": lambda s: s.request(path="/api/../server.py"),
    "traversal in the name of an array": lambda s: s.request(
        path="/api/array", body=encode({"name": "file/../../etc/passwd"})
    ),
    # other methods, and kinds that forms can send
    "PUT": lambda s: s.request("PUT"),
    "DELETE": lambda s: s.request("DELETE", "/"),
    "OPTIONS": lambda s: s.request("OPTIONS"),
    "TRACE": lambda s: s.request("TRACE", "/"),
    "CONNECT": lambda s: s.request("CONNECT", "evil.example:443", b""),
    "GET of a call": lambda s: s.request("GET", body=b""),
    "text": lambda s: s.request(content_type="text/plain"),
    "a form": lambda s: s.request(content_type="application/x-www-form-urlencoded"),
    "no kind": lambda s: s.request(drop=("content-type",)),
    # lengths
    "a length beyond the limit": lambda s: s.request(content_length=str(1 << 40)),
    "a length of many digits": lambda s: s.request(content_length="9" * 4000),
    "a negative length": lambda s: s.request(content_length="-1"),
    "a length that is no number": lambda s: s.request(content_length="8e3"),
    "two lengths": lambda s: s.request(content_length=["16", "17"]),
    "a message shorter than it says": lambda s: s.request(body=encode({})[:-3]),
    "a body beyond the limit": lambda s: s.request(
        drop=("content-length",), transfer_encoding="chunked", body=CHUNK * 20
    ),
    # what is no HTTP
    "no HTTP": lambda s: b"\x16\x03\x01\x02\x00\x01\x00" * 40 + b"\r\n\r\n",
    "a header without end": lambda s: s.request()[:40] + b"a" * (1 << 20),
    "an address without end": lambda s: b"GET /" + b"a" * (1 << 17) + b" HTTP/1.1\r\n\r\n",
    "a web socket": lambda s: s.request(
        "GET", "/", b"", connection="Upgrade", upgrade="websocket", sec_websocket_version="13",
        sec_websocket_key="AAAAAAAAAAAAAAAAAAAAAA==", origin="https://evil.example",
    ),
    # a tab
    "no tab": lambda s: s.request(drop=("x-eigenshape-tab",)),
    "a tab with a path": lambda s: s.request(x_eigenshape_tab="../../etc/passwd"),
    "a tab without end": lambda s: s.request(x_eigenshape_tab="a" * 5000),
    # messages
    "an empty message": lambda s: s.request(body=b""),
    "a message of noise": lambda s: s.request(body=bytes(range(256))),
    "a header beyond the message": lambda s: s.request(body=struct.pack("<I", 2**32 - 4)),
    "a header that is no JSON": lambda s: s.request(body=message(b"{nonsense")),
    "a header of brackets": lambda s: s.request(body=message(b"[" * 400_000)),
    "a header with NaN": lambda s: s.request(body=message(b'{"meta": NaN, "arrays": {}}')),
    "a meta that is a list": lambda s: s.request(body=encode([])),
    "an array beyond the data": lambda s: s.request(
        body=message({"meta": {}, "arrays": {"a": {"dtype": "<f8", "shape": [2**50], "offset": 0}}})
    ),
    "an array of objects": lambda s: s.request(
        body=message({"meta": {}, "arrays": {"a": {"dtype": "O", "shape": [0], "offset": 0}}})
    ),
    "an unknown call": lambda s: s.request(path="/api/__init__"),
    "an unknown change": lambda s: change_request(s, {"kind": "__class__"}),
    "a whole number without end": lambda s: change_request(s, {"kind": "solve", "k": 10**300}),
    # meshes
    "a mesh with NaN": lambda s: s.opening(ply_of("nan 0 0\n1 0 0\n0 1 0\n")),
    "a mesh with infinity": lambda s: s.opening(ply_of("1e999 0 0\n1 0 0\n0 1 0\n")),
    "a mesh beyond single precision": lambda s: s.opening(ply_of("1e300 0 0\n1 0 0\n0 1 0\n")),
    "a face without its vertex": lambda s: s.opening(ply_of(GOOD, "3 0 1 9")),
    "a face with a negative vertex": lambda s: s.opening(ply_of(GOOD, "3 0 1 -1")),
    "more vertices than there are": lambda s: s.opening(ply_of(GOOD, n_vertices=10**12)),
    "a polygon without end": lambda s: s.opening(ply_of(GOOD, "4000000000 0 1 2")),
    "a mesh without faces": lambda s: s.opening(ply_of(GOOD, "", n_faces=0)),
    "an STL that ends early": lambda s: s.opening(bytes(80) + struct.pack("<I", 9), "a.stl"),
    "an empty file": lambda s: s.opening(b""),
    "a program": lambda s: s.opening(b"MZ" + bytes(99), "a.exe"),
    "a file that names another": lambda s: s.opening(
        json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": "/etc/passwd", "byteLength": 9}]}).encode(),
        "a.gltf",
    ),
}  # fmt: skip


def test_there_are_sixty_hostile_requests():
    assert len(HOSTILE) >= 60


@pytest.mark.parametrize("what", HOSTILE)
def test_a_hostile_request_is_refused(server, what):
    status = server.raw(HOSTILE[what](server))
    assert status is None or 400 <= status < 500, status
    state = server.state()
    assert (state["shape"], state["pose"], state["n_vertices"]) == (0, 0, 162)
    assert server.process.poll() is None


def test_a_slow_header_ends_the_connection(server):
    began = time.monotonic()
    head = server.request()[:60]
    assert server.raw(head, [b"x"] * 8, pause=0.3) in (None, 400)
    assert time.monotonic() - began < 6
    server.state()


def test_a_connection_without_a_request_is_kept(server):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=8)
    kind = {"content-type": "application/octet-stream", "x-eigenshape-tab": TAB}
    headers = {**kind, "cookie": server.cookie}
    for pause in (0.0, 1.5):  # longer than HEADER_SECONDS: the second call must not meet a reset
        time.sleep(pause)
        connection.request("POST", "/api/meta", encode({}), headers)
        answer = connection.getresponse()
        assert answer.status == 200
        answer.read()
    # Once a byte of the next header has come, the rest is due.
    began = time.monotonic()
    connection.sock.sendall(server.request()[:60])
    assert connection.sock.recv(1) == b""
    assert 0.5 < time.monotonic() - began < 6
    connection.close()


def test_a_slow_body_is_given_up(server):
    request = server.request(content_length="4000")
    assert server.raw(request, [b"x"], pause=1.0) == 408
    # Bytes come in time, but never enough of them.
    assert server.raw(request, [b"x"] * 10, pause=0.3) == 408
    server.state()


def test_many_silent_connections_are_closed_again(server):
    silent = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(100)]
    server.state()
    time.sleep(1.5)
    for connection in silent:
        assert connection.recv(1) == b""
        connection.close()
    server.state()


def test_noise_is_refused(server):
    noise = np.random.default_rng(0)
    good = server.request(path="/api/array", body=encode({"name": "vertices"}))
    start = good.index(b"\r\n\r\n") + 4
    for _ in range(100):
        damaged = bytearray(good)
        damaged[noise.integers(start, len(good))] ^= 1 << noise.integers(8)
        status = server.raw(bytes(damaged))
        assert status in (200, 400), status
    server.state()


def test_many_good_calls_leave_the_server_well(server):
    with httpx.Client(base_url=server.base, headers={"cookie": server.cookie}) as client:
        kind = {"content-type": "application/octet-stream", "x-eigenshape-tab": TAB}
        for _ in range(300):
            answer = client.post("/api/meta", headers=kind, content=encode({}))
            assert answer.status_code == 200


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.7", "::", "example.org"])
def test_another_address_takes_permission(host):
    with pytest.raises(es.InvalidParameterError, match="--allow-remote"):
        serve(host=host, browse=False)


def test_ctrl_c_while_a_call_is_answered_prints_nothing(tmp_path):
    path = tmp_path / "ball.ply"
    es.write_mesh(es.icosphere(1), path)
    slow = (
        "import time\n"
        "from eigenshape_studio.tab.workspace import Workspace\n"
        "Workspace.answer = lambda *_: (print('asked', flush=True), time.sleep(6))\n"
    )
    running = Server(path, setup=slow, stderr=subprocess.PIPE)
    with socket.create_connection(("127.0.0.1", running.port), timeout=60) as connection:
        connection.sendall(running.request())
        assert running.process.stdout.readline() == "asked\n"
        running.process.send_signal(signal.SIGINT)
        _, errors = running.process.communicate(timeout=60)
    running.client.close()
    assert (running.process.returncode, errors) == (0, "")


def test_the_command_prints_the_address(tmp_path):
    path = tmp_path / "ball.ply"
    es.write_mesh(es.icosphere(1), path)
    command = [sys.executable, "-m", "eigenshape", "studio", str(path), "--no-browser"]
    environment = {**os.environ, "COLUMNS": "40"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        line = process.stdout.readline()
        url = re.fullmatch(r"The studio is open at (http://127\.0\.0\.1:\d+/\?token=\S+)\n", line)[
            1
        ]
        assert httpx.get(url, timeout=60).status_code == 303
    finally:
        process.terminate()
        process.communicate(timeout=20)
