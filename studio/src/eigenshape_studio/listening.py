"""Listening on an address, and serving an application there until Ctrl-C or SIGTERM."""

import asyncio
import logging
import signal
import socket
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

import eigenshape as es
from eigenshape_studio.guard import App, local_hosts

LOCAL = ("127.0.0.1", "localhost")
ALL_ADDRESSES = ("0.0.0.0", "::")
MOST_CONNECTIONS = 128
HEADER_SECONDS = 10.0  # within which a header must have come, once it or its connection has begun
# A connection without a request is kept longer than browsers keep it (Chromium for 300 s).
# Otherwise the server may close it while a call is on its way, and Firefox does not send a POST a
# second time.
KEEP_SECONDS = 330


class TimedProtocol(H11Protocol):
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


def _tells_more(record: logging.LogRecord) -> bool:
    """Say whether a line of the log tells more than that Ctrl-C left a request without an answer."""
    error = record.exc_info[1] if record.exc_info else None
    ended = isinstance(error, asyncio.CancelledError)
    return not ended and "graceful shutdown exceeded" not in record.getMessage()


class _Server(uvicorn.Server):
    """A server that a signal ends as if all was done, so that the process can end with code 0."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """End at SIGINT and SIGTERM; uvicorn's own method raises them again after it has ended."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        ends = (signal.SIGINT, signal.SIGTERM)
        before = {number: signal.signal(number, self.handle_exit) for number in ends}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


def require_permission(host: str, name: str, *, allow_remote: bool) -> None:
    """Raise InvalidParameterError if others could reach an address, and may not."""
    if host not in LOCAL and not allow_remote:
        raise es.InvalidParameterError(
            f"The {name} listens on this machine alone, at {LOCAL[0]}; the address is {host}. "
            "Pass allow_remote=True (--allow-remote) if others may use it."
        )


def listen(host: str, port: int) -> socket.socket:
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


def own_hosts(host: str, port: int, *, allow_remote: bool) -> frozenset[str]:
    """Return the values of the header Host that name this server."""
    hosts = local_hosts(port)
    if allow_remote:
        hosts += tuple(f"{name}:{port}" for name in (host, socket.gethostname()))
    return frozenset(hosts)


def shown_address(host: str, port: int) -> str:
    """Return the address for people, without a path."""
    name = socket.gethostname() if host in ALL_ADDRESSES else host
    return f"http://[{name}]:{port}" if ":" in name else f"http://{name}:{port}"


def run_app(
    app: App,
    listening: socket.socket,
    announce: Callable[[], None],
    browse: str | None,
    *,
    grace: int = 2,
) -> None:
    """Serve an application until SIGINT or SIGTERM.

    Parameters
    ----------
    app : App
    listening : socket
    announce : callable
        Called when the server listens.
    browse : str, optional
        An address to open in a browser.
    grace : int
        Seconds that requests under way have to end.
    """
    config = uvicorn.Config(
        app,
        http=TimedProtocol,
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
        timeout_graceful_shutdown=grace,
    )
    logging.getLogger("uvicorn.error").addFilter(_tells_more)
    server = _Server(config)

    async def run() -> None:
        running = asyncio.create_task(server.serve(sockets=[listening]))
        while not server.started and not running.done():
            await asyncio.sleep(0.01)
        announce()
        if browse:
            with suppress(webbrowser.Error):
                webbrowser.open(browse)
        await running

    with suppress(KeyboardInterrupt):
        asyncio.run(run())
