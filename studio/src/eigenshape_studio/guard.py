"""Who may talk to the studio or the service: checks of every request, before it is routed.

The page listens on this machine, where any web page that is open in a browser can send requests to
it. A request must therefore name this server (against names that are bound anew to 127.0.0.1), come
from the server's own page (Origin, Sec-Fetch-Site), and bring the token: pages as a cookie, which
the printed address sets, and programs in the header `Authorization: Bearer TOKEN`.
"""

import asyncio
import ipaddress
import json
import secrets
import zlib
from collections.abc import Awaitable, Callable, Collection, MutableMapping
from dataclasses import dataclass
from time import monotonic
from typing import Any
from urllib.parse import parse_qs

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

# What a page shows that is loaded again after its server was started anew, or in another browser. It
# loads itself again, and shows what it showed when the cookie of the new address is there.
WAITING = """<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="2">
<title>{name}</title><h1>The {name} was started anew</h1>
<p>Open the address that it has printed, in this browser. Then this page goes on, and nothing is lost.
"""
READING = ("GET", "HEAD")  # methods
HTML = b"text/html; charset=utf-8"
MESSAGE_TYPE = b"application/octet-stream"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"cache-control", b"no-store"),
)


@dataclass(frozen=True)
class Rules:
    """What the guard lets through.

    Attributes
    ----------
    token : str
        The secret of the printed address.
    hosts : collection of str
        Values of the header Host that name this server, with the port.
    any_address : bool
        Whether any numeric address is accepted too. A numeric address cannot be a name that was
        bound anew. Only for servers on other addresses than that of this machine itself.
    port : int
    most_bytes : int
        Of the body of one request.
    pause, deadline : float
        Seconds without a byte, and in all, after which the sender of a body is given up.
    name : str
        What this server is, for its messages and for the name of its cookie.
    verb : str
        The verb of the command that printed the address.
    open_paths : collection of str
        That GET reads without the token.
    write_token : str, optional
        A second secret, which the header alone brings; it opens all that the first one does. The
        application says what takes it.
    json_errors : bool
        Whether refusals are JSON objects with a text under "error". Otherwise they are plain text.
    prefix : str
        The path, such as "/shapes", below which a proxy offers this server; see `below`.
    proxied : collection of str
        The hosts for which a proxy may speak HTTPS.
    """

    token: str
    hosts: Collection[str]
    port: int
    any_address: bool = False
    most_bytes: int = 256 << 20
    pause: float = 10.0
    deadline: float = 120.0
    name: str = "studio"
    verb: str = "studio"
    open_paths: Collection[str] = ()
    write_token: str | None = None
    json_errors: bool = False
    prefix: str = ""
    proxied: Collection[str] = ()


class RefusedError(Exception):
    """A request is refused, with a status of HTTP."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


class Guard:
    """An ASGI application that lets requests with the token through to another."""

    def __init__(self, app: App, rules: Rules) -> None:
        self.app, self.rules = app, rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a request and pass it on, or refuse it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":  # there are no web sockets
            await send({"type": "websocket.close", "code": 1008})
            return
        answered = _Answer(send, json_errors=self.rules.json_errors)
        try:
            self._check_source(scope)
            if self._is_entrance(scope):
                await self._enter(answered)
                return
            if scope["method"] not in READING or scope["path"] not in self.rules.open_paths:
                self._check_token(scope)
            self._check_kind(scope)
            body = await self._read_body(scope, receive)
            await self.app(scope, _replay(body, receive), answered)
        except RefusedError as error:
            page = (scope["method"], scope["path"]) == ("GET", "/")
            if page and error.status == 403 and not self.rules.json_errors:
                await answered.text(403, WAITING.format(name=self.rules.name), [], HTML)
            else:
                await answered.refuse(error)

    def _check_source(self, scope: Scope) -> None:
        """Refuse requests that another page, or for another name, sends."""
        host = _only(scope, b"host")
        if not self._is_ours(host):
            raise RefusedError(421, f"This address is not that of the {self.rules.name}.")
        origin = _only(scope, b"origin", default=f"http://{host}")
        site = _only(scope, b"sec-fetch-site", default="none")
        origins = [f"http://{host}"] + [f"https://{host}"] * (host in self.rules.proxied)
        if origin not in origins or site not in ("same-origin", "none"):
            raise RefusedError(403, f"Only the {self.rules.name}'s own page may send requests.")

    def _is_ours(self, host: str) -> bool:
        if host in self.rules.hosts:
            return True
        name, _, port = host.rpartition(":")
        if not self.rules.any_address or port != str(self.rules.port):
            return False
        try:
            ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return False
        return True

    def _is_entrance(self, scope: Scope) -> bool:
        """Say whether this is the printed address, with the right token."""
        if scope["method"] != "GET" or scope["path"] != "/" or not scope["query_string"]:
            return False
        given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])
        return len(given) == 1 and self._is_token(given[0])

    async def _enter(self, answered: "_Answer") -> None:
        """Turn the token of the address into a cookie, so that it leaves the address bar."""
        home = f"{self.rules.prefix}/"
        cookie = f"{self._cookie_name}={self.rules.token}; Path={home}; HttpOnly; SameSite=Strict"
        headers = [(b"set-cookie", cookie.encode()), (b"location", home.encode())]
        await answered.text(303, f"Opening the {self.rules.name}.", headers)

    @property
    def _cookie_name(self) -> str:
        # Cookies belong to a host whatever the port: two studios must not take each other's.
        return f"eigenshape-{self.rules.name}-{self.rules.port}"

    def _check_token(self, scope: Scope) -> None:
        given = [
            value
            for header in _all(scope, b"cookie")
            for name, _, value in (part.strip().partition("=") for part in header.split(";"))
            if name == self._cookie_name
        ]
        # No page of another site can send this header: it would take a permission by CORS.
        bearer = bearer_of(_only(scope, b"authorization", default=""))
        if bearer is not None:
            if is_secret(bearer, self.rules.write_token):
                return
            given.append(bearer)
        if not any(self._is_token(value) for value in given):
            raise RefusedError(
                403,
                "A request must bring the token. Open the address that "
                f"`eigenshape {self.rules.verb}` has printed, with ?token=TOKEN at its end, or "
                "send the header `Authorization: Bearer TOKEN`.",
            )

    def _is_token(self, given: str) -> bool:
        return is_secret(given, self.rules.token)

    def _check_kind(self, scope: Scope) -> None:
        """Refuse methods, types and sizes that no call of the page has."""
        methods = ["GET", "POST"] + ["DELETE"] * (self.rules.write_token is not None)
        if scope["method"] not in (*methods, "HEAD"):
            raise RefusedError(405, f"The {self.rules.name} takes {', '.join(methods)}.")
        if scope["method"] != "POST":
            return
        # A form of another page cannot have this type.
        if _only(scope, b"content-type").encode() != MESSAGE_TYPE:
            raise RefusedError(415, "The body must be application/octet-stream.")
        length = _only(scope, b"content-length", default="0")
        if not length.isdecimal() or int(length[:20]) > self.rules.most_bytes:
            raise RefusedError(413, f"The body may have {self.rules.most_bytes:,} bytes.")

    async def _read_body(self, scope: Scope, receive: Receive) -> bytes:
        """Read the whole body and unpack it, while counting its bytes and not waiting for ever."""
        encoding = _only(scope, b"content-encoding", default="identity").strip().lower()
        if encoding not in ("identity", "gzip"):
            raise RefusedError(415, f"The body may be packed by gzip, and not by {encoding[:20]}.")
        body = await self._receive_body(receive)
        return self._unpacked(body) if encoding == "gzip" else body

    def _unpacked(self, body: bytes) -> bytes:
        unpacker = zlib.decompressobj(wbits=31)
        try:
            found = unpacker.decompress(body, self.rules.most_bytes + 1)
        except zlib.error as error:
            raise RefusedError(
                400, "The body must be packed by gzip, as its header says."
            ) from error
        if len(found) > self.rules.most_bytes:
            raise RefusedError(413, f"The body may have {self.rules.most_bytes:,} bytes.")
        if not unpacker.eof or unpacker.unused_data:
            raise RefusedError(400, "The body must be packed by gzip, as its header says.")
        return found

    async def _receive_body(self, receive: Receive) -> bytes:
        end = monotonic() + self.rules.deadline
        parts, n_bytes = [], 0
        while True:
            wait = min(self.rules.pause, end - monotonic())
            try:
                message = await asyncio.wait_for(receive(), max(wait, 0.0))
            except TimeoutError as err:
                raise RefusedError(408, "The body came too slowly.") from err
            if message["type"] != "http.request":
                raise RefusedError(400, "The body must be complete.")
            parts.append(message.get("body", b""))
            n_bytes += len(parts[-1])
            if n_bytes > self.rules.most_bytes:
                raise RefusedError(413, f"The body may have {self.rules.most_bytes:,} bytes.")
            if not message.get("more_body", False):
                return b"".join(parts)


def below(app: App, prefix: str) -> App:
    """Return an application that serves another one below a path, which a proxy may leave out."""

    async def serve(scope: Scope, receive: Receive, send: Send) -> None:
        path = str(scope.get("path", ""))
        if prefix and path == prefix:  # links of the page are relative to the path with its slash
            query = scope["query_string"] and b"?" + scope["query_string"]
            headers = [(b"location", f"{prefix}/".encode() + query), (b"content-length", b"0")]
            await send({"type": "http.response.start", "status": 307, "headers": headers})
            await send({"type": "http.response.body", "body": b""})
            return
        if prefix and path.startswith(f"{prefix}/"):
            raw = scope.get("raw_path") or path.encode()
            start = len(prefix.encode())
            scope = {**scope, "path": path[len(prefix) :], "raw_path": raw[start:]}
        await app(scope, receive, send)

    return serve


def _replay(body: bytes, receive: Receive) -> Receive:
    """Return a `receive` that gives a body which has been read."""
    given = False

    async def receive_body() -> Message:
        nonlocal given
        if given:  # what comes now is only that the page has gone
            return await receive()
        given = True
        return {"type": "http.request", "body": body, "more_body": False}

    return receive_body


class _Answer:
    """A `send` that adds the headers of every answer, and that knows whether one has begun."""

    def __init__(self, send: Send, *, json_errors: bool) -> None:
        self._send, self._json_errors = send, json_errors
        self._begun = False

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self._begun = True
            given = [pair for pair in message.get("headers", []) if pair[0] != b"cache-control"]
            message = {**message, "headers": [*given, *HEADERS]}
        await self._send(message)

    async def refuse(self, error: RefusedError) -> None:
        if not self._begun:
            # The rest of the body is not read, so the connection cannot serve another request.
            closing = [(b"connection", b"close")]
            if self._json_errors:
                text, kind = json.dumps({"error": error.reason}), b"application/json"
                await self.text(error.status, text, closing, kind)
            else:
                await self.text(error.status, error.reason, closing)

    async def text(
        self,
        status: int,
        text: str,
        headers: list[tuple[bytes, bytes]],
        media_type: bytes = b"text/plain; charset=utf-8",
    ) -> None:
        data = f"{text}\n".encode()
        kind = (b"content-type", media_type)
        size = (b"content-length", str(len(data)).encode())
        await self(
            {"type": "http.response.start", "status": status, "headers": [kind, size, *headers]}
        )
        await self({"type": "http.response.body", "body": data})


def _all(scope: Scope, name: bytes) -> list[str]:
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def _only(scope: Scope, name: bytes, default: str | None = None) -> str:
    """Return the value of a header; refuse a request in which it stands twice, or is missing."""
    values = _all(scope, name)
    if len(values) > 1 or (not values and default is None):
        raise RefusedError(400, f"The header {name.decode()} must be given once.")
    return values[0] if values else str(default)


def bearer_of(authorization: str) -> str | None:
    """Return the token of a header Authorization, if it has one."""
    scheme, _, bearer = authorization.partition(" ")
    return bearer.strip() if scheme.lower() == "bearer" else None


def is_secret(given: str, secret: str | None) -> bool:
    """Say whether a secret was given, in a time that tells nothing of it."""
    return secret is not None and secrets.compare_digest(given.encode(), secret.encode())


def local_hosts(port: int) -> tuple[str, ...]:
    """Return the names of this machine itself, as a browser sends them."""
    return tuple(f"{name}:{port}" for name in ("127.0.0.1", "localhost"))
