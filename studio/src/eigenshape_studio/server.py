"""The studio in the browser: a server on this machine, one workspace for each tab."""

import re
import secrets
import socket
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from pathlib import Path

import anyio.to_thread
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

import eigenshape as es
from eigenshape.plot.camera import Up, View
from eigenshape_studio.bundle import NotBuiltError, read_static
from eigenshape_studio.guard import App, Guard, Rules
from eigenshape_studio.listening import (
    listen,
    own_hosts,
    require_permission,
    run_app,
    shown_address,
)
from eigenshape_studio.memory import share_one_arena, trim_memory
from eigenshape_studio.opening import open_workspace
from eigenshape_studio.others.folders import Folders
from eigenshape_studio.owner import own, remove_old_of_others, sessions_folder
from eigenshape_studio.tab.sessions import SessionFile, remove_old
from eigenshape_studio.tab.workspace import Answer, Workspace, error_message

FILES = {"index.html": "text/html; charset=utf-8", "studio.js": "text/javascript; charset=utf-8"}
TAB = re.compile(r"[A-Za-z0-9_-]{8,64}")
MOST_TABS = 8  # of 25,000 vertices, a tab with a spectrum of its own takes about 200 MB
MOST_CALLS = 8  # of one tab at the same time; the panels together send fewer
PORT = 8642  # unless another one is requested
N_THREADS = 32  # for calls; MOST_CALLS of them for one tab leave enough for the others
LARGE_CALLS = ("finish", "query")  # which take and free much memory


class Tabs:
    """The workspaces of the tabs, by the number that each tab gave itself.

    Those that were not used for longest leave the memory when there are too many; their files have
    them until they are used again.
    """

    def __init__(self, first: Workspace, folder: Path, most: int = MOST_TABS) -> None:
        self._first, self._folder, self._most = first, folder, most
        self._open: OrderedDict[str, Workspace] = OrderedDict()
        self._calls: dict[str, int] = {}
        self._lock = threading.Lock()

    def workspace(self, tab: str) -> Workspace:
        """Return the workspace of a tab; a new tab shows the first shape without edits."""
        with self._lock:
            if tab not in self._open:
                file = SessionFile(self._folder / f"{tab}.sqlite")
                self._open[tab] = self._first.fork(file)
                remove_old(self._folder, [self._folder / f"{each}.sqlite" for each in self._open])
            self._open.move_to_end(tab)
            idle = [each for each in self._open if each not in self._calls and each != tab]
            for each in idle[: max(0, len(self._open) - self._most)]:
                self._open.pop(each).close()
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


def make_app(first: Workspace, rules: Rules, folder: Path) -> App:
    """Return the application: the page, its bundle, and the five calls, behind the guard.

    Parameters
    ----------
    first : Workspace
        What new tabs show.
    rules : Rules
    folder : Path
        Where the sessions are kept, which the caller owns.
    """
    first.most_bytes = rules.most_bytes
    tabs = Tabs(first, folder)
    limiter = anyio.CapacityLimiter(N_THREADS)

    async def show_file(request: Request) -> Response:
        name = request.path_params.get("name", "index.html")
        if name not in FILES:
            return PlainTextResponse("There is no such page.\n", 404)
        try:
            return Response(read_static(name), media_type=FILES[name])
        except NotBuiltError as error:
            return PlainTextResponse(f"{error}\n", 500)

    def answer(tab: str, name: str, body: bytes) -> Answer:
        try:
            return tabs.workspace(tab).answer(name, body)
        except (es.StoreError, OSError) as error:  # its file cannot be read now
            return Answer(error_message("StoreError", str(error)), 507)
        finally:
            if name in LARGE_CALLS:
                trim_memory()

    async def call(request: Request) -> Response:
        tab = request.headers.get("x-eigenshape-tab", "")
        if not TAB.fullmatch(tab):
            return _respond(Answer(error_message("RequestError", "A call must name its tab."), 400))
        body = await request.body()
        if not tabs.begin(tab):
            return _respond(Answer(error_message("BusyError", "This tab has too many calls."), 429))
        try:
            found = await anyio.to_thread.run_sync(
                answer, tab, request.path_params["call"], body, limiter=limiter
            )
        finally:
            tabs.end(tab)
        return _respond(found)

    routes = [
        Route("/", show_file, methods=["GET"]),
        Route("/api/{call}", call, methods=["POST"]),
        Route("/{name}", show_file, methods=["GET"]),
    ]
    return Guard(Starlette(routes=routes), rules)


def _respond(answer: Answer) -> Response:
    return Response(answer.message, answer.status, media_type="application/octet-stream")


def serve(  # noqa: PLR0913  one for each option of the command
    paths: Sequence[str | Path] = (),
    *,
    index: str | Path | None = None,
    view: View = "auto",
    up: Up = "auto",
    host: str = "127.0.0.1",
    port: int | None = 0,
    allow_remote: bool = False,
    announce: Callable[[str], None] = print,
    browse: bool = True,
    sessions: Path | None = None,
) -> None:
    """Open the studio in the browser, and serve it until Ctrl-C.

    Parameters
    ----------
    paths : sequence of paths
        Files, folders and indexes of shapes to choose from; see `open_workspace`.
    index : path, optional
        Folder of an index to search in.
    view : str or (3,) float
        The side from which the shape is shown at first, as in `es.plot.aim_camera`.
    up : str or (3,) float
        The upward direction, as in `es.plot.aim_camera`.
    host : str
        Address to listen on.
    port : int, optional
        0 for any that is free; None for 8642 if it is free, so that pages which are open find the
        studio when it is started again.
    allow_remote : bool
        Whether the address may be another one than this machine's own. Whoever has the printed
        address then controls the studio, and can read what is sent, because HTTP is not encrypted.
    announce : callable
        Called with the address, when the server listens there.
    browse : bool
        Whether to open the address in a browser.
    sessions : Path, optional
        The folder in which the work of each tab is kept; by default that of the port in the user's
        cache. One server owns it.

    Raises
    ------
    InvalidParameterError
        If the host is another machine's or all of them, and `allow_remote` is not set; if `view` or
        `up` is neither a name nor a direction.
    OSError
        If the port is taken.
    StoreError
        If another server owns the folder of sessions.
    """
    require_permission(host, "studio", allow_remote=allow_remote)
    share_one_arena()
    first = open_workspace(paths, index)
    # What is not requested is as the file says, if it does.
    sides = zip((view, up), first.analysis.side, strict=True)
    first.analysis.look_from(
        *(known if isinstance(given, str) and given == "auto" else given for given, known in sides)
    )
    # Who may come from another machine must not see the folders of this one.
    first.folders = None if allow_remote else Folders(Path.cwd())
    listening = _listen(host, port)
    port = listening.getsockname()[1]
    token = secrets.token_urlsafe(32)
    hosts = own_hosts(host, port, allow_remote=allow_remote)
    rules = Rules(token, hosts, port, any_address=allow_remote)
    address = shown_address(host, port)
    url = f"{address}/?token={token}"
    folder = sessions or sessions_folder(port)
    with closing(listening), closing(first), closing(own(folder, address)):
        if sessions is None:
            remove_old_of_others(folder)
        app = make_app(first, rules, folder)
        run_app(app, listening, lambda: announce(url), url if browse else None)


def _listen(host: str, port: int | None) -> socket.socket:
    """Return a socket on a port; on any that is free if none is requested and the usual is taken."""
    if port is None:
        with suppress(OSError):
            return listen(host, PORT)
    return listen(host, port or 0)
