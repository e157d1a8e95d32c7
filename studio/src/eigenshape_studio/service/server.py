"""`eigenshape serve`: a service on an index, until SIGTERM or Ctrl-C."""

import re
import secrets
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import eigenshape as es
from eigenshape_studio.guard import Rules
from eigenshape_studio.listening import (
    listen,
    own_hosts,
    require_permission,
    run_app,
    shown_address,
)
from eigenshape_studio.service.app import Service, Settings, make_app
from eigenshape_studio.service.describing import Describe, Describers, describe_upload
from eigenshape_studio.service.shelf import ShelfReader

MOST_BYTES = 64 << 20  # of an upload: about a million faces in a binary file
GRACE = 10  # seconds that queries under way have to end
PREFIX = re.compile(r"(/[A-Za-z0-9._~-]+)+")
# A token stands in an address and in a cookie. 16 letters of 64 are 96 bits, beyond guessing.
TOKEN = re.compile(r"[A-Za-z0-9._~-]{16,256}")


def serve(  # noqa: PLR0913  one for each option of the command
    index: str | Path,
    *,
    host: str = "127.0.0.1",
    port: int = 8000,
    allow_remote: bool = False,
    allow_hosts: Sequence[str] = (),
    token: str | None = None,
    write_token: str | None = None,
    workers: es.retrieval.Workers | None = None,
    show_sources: bool = False,
    prefix: str = "",
    announce: Callable[[str], None] = print,
    browse: bool = False,
    describe: Describe = describe_upload,
) -> None:
    """Serve an index until SIGTERM or Ctrl-C, which let queries under way end.

    Parameters
    ----------
    index : path
        Folder of the index. Other processes may add shapes to it at the same time.
    host : str
        Address to listen on.
    port : int
        0 for any that is free.
    allow_remote : bool
        Whether the address may be another one than this machine's own. HTTP is not encrypted.
    allow_hosts : sequence of str
        Further names of this server, as clients send them: "shapes.example:8000".
    token : str, optional
        The secret that requests bring. By default a random one, which is part of the address that
        is announced; a token that is given is not announced.
    write_token : str, optional
        Another secret, with which requests may also add and remove shapes. Without it nobody may.
    workers : Workers, optional
        The processes that describe uploads: how many, and what each mesh may take. By default two,
        with 60 s for each mesh.
    show_sources : bool
        Whether answers name the files of shapes.
    prefix : str
        The path below which a proxy offers the service, such as "/shapes", whether it passes the
        path on or leaves it out.
    announce : callable
        Called with the address, when the server listens there.
    browse : bool
        Whether to open the address in a browser.
    describe : callable
        How a worker describes an upload.

    Raises
    ------
    InvalidParameterError
        If the host is another machine's or all of them, and `allow_remote` is not set; if a token
        is too short or has letters that an address cannot hold, or the two tokens are equal; if the
        prefix is no path.
    StoreError
        If the folder is no index, or is damaged.
    OSError
        If the port is taken.
    """
    require_permission(host, "service", allow_remote=allow_remote)
    for given in (token, write_token):
        if given is not None and not TOKEN.fullmatch(given):
            raise es.InvalidParameterError(
                "A token must have 16 to 256 letters, digits, or any of ._~- and no others; the "
                f"given one, of {len(given)} characters, does not. Try python -c 'import secrets; "
                "print(secrets.token_urlsafe())'."
            )
    if token is not None and token == write_token:
        raise es.InvalidParameterError(
            "The token for writing must differ from the token for reading, which stands in the "
            "address of the page; they are equal."
        )
    if prefix and not PREFIX.fullmatch(prefix):
        raise es.InvalidParameterError(
            "A prefix must be a path of letters, digits, or any of ._~- that begins with a slash and ends "
            f"with none, such as /shapes; it is {prefix[:80]!r}."
        )
    shelf = ShelfReader(index)
    listening = listen(host, port)
    port = listening.getsockname()[1]
    secret = token or secrets.token_urlsafe(32)
    rules = Rules(
        secret,
        own_hosts(host, port, allow_remote=allow_remote) | set(allow_hosts),
        port,
        any_address=allow_remote,
        most_bytes=MOST_BYTES,
        name="service",
        verb="serve",
        open_paths=("/health",),
        write_token=write_token,
        json_errors=True,
        prefix=prefix,
        proxied=set(allow_hosts),
    )
    address = shown_address(host, port) + prefix
    shown = f"{address}/" if token else f"{address}/?token={secret}"
    if workers is None:
        workers = es.retrieval.Workers(timeout=60.0)
    describers = Describers(workers, shelf.recipe, describe)
    ended = threading.Event()
    threading.Thread(target=shelf.refresh_until, args=(ended,), daemon=True).start()
    try:
        app = make_app(
            Service(shelf, describers, Settings(show_sources, write_token, prefix)), rules
        )
        page = f"{address}/?token={secret}" if browse else None
        run_app(app, listening, lambda: announce(shown), page, grace=GRACE)
    finally:
        ended.set()
        describers.close()
