"""The studio in the browser: a server on this machine, one workspace for each tab."""

import asyncio
import re
import secrets
import socket
import threading
import webbrowser
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import anyio.to_thread
import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from uvicorn.protocols.http.h11_impl import H11Protocol

import eigenshape as es
from eigenshape_studio.analysis import warm_up
from eigenshape_studio.bundle import NotBuiltError, read_static
from eigenshape_studio.guard import App, Guard, Rules, local_hosts
from eigenshape_studio.workspace import Answer, Workspace, error_message

FILES = {"index.html": "text/html; charset=utf-8", "studio.js": "text/javascript; charset=utf-8"}
LOCAL = ("127.0.0.1", "localhost")
TAB = re.compile(r"[A-Za-z0-9_-]{8,64}")
MOST_TABS = 8  # of 25,000 vertices, a tab with a spectrum of its own takes about 200 MB
MOST_CALLS = 8  # of one tab at the same time; the panels together send fewer
N_THREADS = 32  # for calls; MOST_CALLS of them for one tab leave enough for the others
MOST_CONNECTIONS = 128
HEADER_SECONDS = 10.0  # within which a header must have come, once it or its connection has begun
# A connection without a request is kept longer than browsers keep it (Chromium for 300 s). Otherwise
# the server may close it while a call is on its way, and Firefox does not send a POST a second time.
KEEP_SECONDS = 330


class Tabs:
    """The workspaces of the tabs that are open, by the number that each tab gave itself."""

    def __init__(self, first: Workspace, most: int = MOST_TABS) -> None:
        self._first, self._most = first, most
        self._open: OrderedDict[str, Workspace] = OrderedDict()
        self._calls: dict[str, int] = {}
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._open)

    def workspace(self, tab: str) -> Workspace:
        """Return the workspace of a tab; a new tab shows the first shape without edits."""
        with self._lock:
            if tab not in self._open:
                self._open[tab] = self._first.fork()
            self._open.move_to_end(tab)
            while len(self._open) > self._most:
                _, dropped = self._open.popitem(last=False)
                dropped.close()
            return self._open[tab]

    def begin(self, tab: str) -> bool:
        """Count a call of a tab; return False if it has too many already."""
        with self._lock:
            n_calls = self._calls.get(tab, 0)
            if n_calls >= MOST_CALLS:
                return False
            self._calls[tab] = n_calls + 1
            return True

    def end(self, tab: str) -> None:
        """Count the end of a call."""
        with self._lock:
            self._calls[tab] -= 1
            if not self._calls[tab]:
                del self._calls[tab]


class StudioProtocol(H11Protocol):
    """HTTP that closes connections which do not send the header of a request in time.

    The first request is due when the connection begins, each later one when its first byte comes.
    """

    def connection_made(self, transport: Any) -> None:
        """Expect the first header."""
        super().connection_made(transport)
        self._expect_header()

    def data_received(self, data: bytes) -> None:
        """Expect the rest of a header that begins."""
        if self.timeout_keep_alive_task is not None:  # no request was under way
            self._expect_header()
        super().data_received(data)

    def _expect_header(self) -> None:
        before = self.cycle  # a complete header begins another one

        def close_if_late() -> None:
            if self.cycle is before and not self.transport.is_closing():
                self.transport.close()

        self.loop.call_later(HEADER_SECONDS, close_if_late)


def make_app(first: Workspace, rules: Rules) -> App:
    """Return the application: the page, its bundle, and the five calls, behind the guard.

    Parameters
    ----------
    first : Workspace
        What new tabs show.
    rules : Rules
    """
    tabs = Tabs(first)
    limiter = anyio.CapacityLimiter(N_THREADS)

    async def show_file(request: Request) -> Response:
        name = request.path_params.get("name", "index.html")
        if name not in FILES:
            return PlainTextResponse("There is no such page.\n", 404)
        try:
            return Response(read_static(name), media_type=FILES[name])
        except NotBuiltError as error:
            return PlainTextResponse(f"{error}\n", 500)

    async def call(request: Request) -> Response:
        tab = request.headers.get("x-eigenshape-tab", "")
        if not TAB.fullmatch(tab):
            return _respond(Answer(error_message("RequestError", "A call must name its tab."), 400))
        body = await request.body()
        if not tabs.begin(tab):
            return _respond(Answer(error_message("BusyError", "This tab has too many calls."), 429))
        try:
            name = request.path_params["call"]
            answer = await anyio.to_thread.run_sync(
                lambda: tabs.workspace(tab).answer(name, body), limiter=limiter
            )
        finally:
            tabs.end(tab)
        return _respond(answer)

    routes = [
        Route("/", show_file, methods=["GET"]),
        Route("/api/{call}", call, methods=["POST"]),
        Route("/{name}", show_file, methods=["GET"]),
    ]
    return Guard(Starlette(routes=routes), rules)


def _respond(answer: Answer) -> Response:
    return Response(answer.message, answer.status, media_type="application/octet-stream")


def serve(  # noqa: PLR0913  one for each option of the command
    mesh: str | Path | es.types.MeshLike | None = None,
    *,
    index: str | Path | None = None,
    host: str = "127.0.0.1",
    port: int = 0,
    allow_remote: bool = False,
    announce: Callable[[str], None] = print,
    browse: bool = True,
) -> None:
    """Open the studio in the browser, and serve it until Ctrl-C.

    Parameters
    ----------
    mesh : path or MeshLike, optional
        The shape to show; by default a creature that the library makes.
    index : path, optional
        Folder of an index to search in.
    host : str
        Address to listen on.
    port : int
        0 for any that is free.
    allow_remote : bool
        Whether the address may be another one than this machine's own. Whoever has the printed
        address then controls the studio, and can read what is sent, because HTTP is not encrypted.
    announce : callable
        Called with the address, when the server listens there.
    browse : bool
        Whether to open the address in a browser.

    Raises
    ------
    InvalidParameterError
        If the host is another machine's or all of them, and `allow_remote` is not set.
    OSError
        If the port is taken.
    """
    if host not in LOCAL and not allow_remote:
        raise es.InvalidParameterError(
            f"The studio listens on this machine alone, at {LOCAL[0]}; the address is {host}. "
            "Pass allow_remote=True (--allow-remote) if others may use it."
        )
    first = _first_workspace(mesh, index)
    warm_up()
    listening = _listen(host, port)
    port = listening.getsockname()[1]
    token = secrets.token_urlsafe(32)
    hosts = local_hosts(port)
    if allow_remote:
        hosts += tuple(f"{name}:{port}" for name in (host, socket.gethostname()))
    rules = Rules(token, frozenset(hosts), port, any_address=allow_remote)
    shown = host if host not in ("0.0.0.0", "::") else socket.gethostname()
    url = f"http://{shown}:{port}/?token={token}"
    config = uvicorn.Config(
        make_app(first, rules),
        http=StudioProtocol,
        ws="none",
        lifespan="off",
        log_level="error",
        access_log=False,
        server_header=False,
        date_header=False,
        proxy_headers=False,
        limit_concurrency=MOST_CONNECTIONS,
        timeout_keep_alive=KEEP_SECONDS,
        h11_max_incomplete_event_size=32 << 10,
        timeout_graceful_shutdown=2,
    )
    server = uvicorn.Server(config)

    async def run() -> None:
        running = asyncio.create_task(server.serve(sockets=[listening]))
        while not server.started and not running.done():
            await asyncio.sleep(0.01)
        announce(url)
        if browse:
            with suppress(webbrowser.Error):
                webbrowser.open(url)
        await running

    with suppress(KeyboardInterrupt):
        asyncio.run(run())
    first.close()


def _first_workspace(
    mesh: str | Path | es.types.MeshLike | None, index: str | Path | None
) -> Workspace:
    """Return what new tabs show; their analysis is shared."""
    if mesh is None:
        creature = es.make_creature("quadruped", n_vertices=2500)
        return Workspace(creature, "quadruped", index=index, shared=True)
    if isinstance(mesh, str | Path):
        return Workspace(es.read_mesh(mesh), Path(mesh).name, index=index, shared=True)
    return Workspace(mesh, index=index, shared=True)


def _listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens, so that the port is known before the server starts."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # With the protocol named, asyncio sends small answers at once (TCP_NODELAY): 40 ms less a call.
    listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
    except OSError:
        listening.close()
        raise
    return listening
