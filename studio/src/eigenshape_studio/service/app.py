"""The application of the service: its page, and its calls."""

import asyncio
import json
from collections import OrderedDict
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from string import Template
from time import perf_counter
from typing import Any, TypeVar
from urllib.parse import quote

import anyio.to_thread
from prometheus_client import CONTENT_TYPE_LATEST
from starlette.applications import Starlette
from starlette.convertors import StringConvertor, register_url_convertor
from starlette.endpoints import HTTPEndpoint
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

import eigenshape as es
from eigenshape.retrieval.store.facts import ShapeFacts
from eigenshape.retrieval.store.filters import parse_filters
from eigenshape.retrieval.store.state import MissingShapeError
from eigenshape.retrieval.store.writing import NameTakenError
from eigenshape_studio.guard import App, Guard, Rules, bearer_of, below, is_secret
from eigenshape_studio.service import openapi
from eigenshape_studio.service.describing import Describers, MeshRefusedError, Picture
from eigenshape_studio.service.metrics import Metrics, count_requests
from eigenshape_studio.service.parameters import RequestError, read_parameters
from eigenshape_studio.service.shelf import Found, Shape, ShelfReader
from eigenshape_studio.shape.parse import display_name, shape_suffix

PAGE = Path(__file__).parent / "page"
# Names of the two pages, each a body (.html) and a script (.js), and their titles.
PAGES = {"/": ("page", "similar shapes"), "/docs": ("docs", "calls for programs")}
FILES = {
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/docs.js": ("docs.js", "text/javascript; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
}
# Queries that wait or run; each keeps an upload in memory while it comes in. With two workers and a
# second for each mesh, the last one waits for half a minute.
MOST_QUERIES = 64
N_THREADS = 8  # that read the index at the same time
PICTURE_BYTES = 64 << 20  # of drawings that are kept, 20 to 100 kB each
T = TypeVar("T")
Endpoint = Callable[[Request], Awaitable[Response]]


@dataclass(frozen=True)
class Settings:
    """What answers may hold, and who may change the index.

    Attributes
    ----------
    show_sources : bool
        Whether answers name the files of shapes.
    write_token : str, optional
        The secret of those who may add and remove shapes; without it, nobody may.
    prefix : str
        The path, such as "/shapes", below which a proxy offers the service.
    """

    show_sources: bool = False
    write_token: str | None = None
    prefix: str = ""


class _Drawings:
    """Pictures that were drawn, up to a number of bytes; the one that was used longest ago goes."""

    def __init__(self, most_bytes: int = PICTURE_BYTES) -> None:
        self._kept: OrderedDict[tuple[str, int], Picture] = OrderedDict()
        self._most, self._n_bytes = most_bytes, 0

    def find(self, key: tuple[str, int]) -> Picture | None:
        if key in self._kept:
            self._kept.move_to_end(key)
        return self._kept.get(key)

    def keep(self, key: tuple[str, int], picture: Picture) -> None:
        before = self._kept.pop(key, None)  # two requests may have drawn it at the same time
        self._n_bytes += picture.n_bytes - (before.n_bytes if before else 0)
        self._kept[key] = picture
        while self._n_bytes > self._most:
            self._n_bytes -= self._kept.popitem(last=False)[1].n_bytes


class _AnyName(StringConvertor):
    """The rest of a path, with any characters: names are paths below a folder, or what one likes."""

    regex = "(?s:.+)"


register_url_convertor("any", _AnyName())


class Service:
    """The calls of the service, each a coroutine that answers a request."""

    def __init__(self, shelf: ShelfReader, describers: Describers, settings: Settings) -> None:
        self.shelf, self.describers, self.settings = shelf, describers, settings
        self.metrics = Metrics(lambda: len(shelf))
        self._threads = anyio.CapacityLimiter(N_THREADS)
        self._drawings = _Drawings()
        self._n_queries = 0

    async def query(self, request: Request) -> Response:
        """Find the shapes that are most like an uploaded mesh."""
        wanted = read_parameters(request, openapi.QUERY)
        where = _conditions(wanted)
        suffix = _suffix(wanted["name"])
        data = await request.body()
        async with self._describing(wanted["name"]):
            return await self._answer(wanted, where, suffix, data)

    async def add_shape(self, request: Request) -> Response:
        """Describe an uploaded mesh and add it to the index."""
        self._require_writer(request)
        wanted = read_parameters(request, openapi.ADD)
        name, suffix = wanted["name"], _suffix(wanted["file"])
        facts = ShapeFacts(
            name,
            label=wanted["label"],
            tags=wanted["tag"] or (),
            attributes=_attributes(wanted["attributes"]),
        )
        facts.as_row()  # which refuses them before the mesh is described, which takes seconds
        await self._refresh()
        if name in self.shelf and not wanted["replace"]:
            raise _name_taken(name)
        data = await request.body()
        async with self._describing(wanted["file"]):
            shape = await self.describers.describe_shape(suffix, data, self.shelf.recipe, facts)
        added = await self._change(name, lambda: self.shelf.add(shape, replace=wanted["replace"]))
        return JSONResponse(self._facts(added), 201)

    async def remove_shape(self, request: Request) -> Response:
        """Remove a shape from the index, and tell what was known of it."""
        self._require_writer(request)
        read_parameters(request, ())
        name = request.path_params["name"]
        return JSONResponse(self._facts(await self._change(name, lambda: self.shelf.remove(name))))

    async def compact(self, request: Request) -> Response:
        """Give the space of removed shapes back."""
        self._require_writer(request)
        read_parameters(request, ())
        return JSONResponse({"bytes": await self._change("", self.shelf.compact)})

    def _require_writer(self, request: Request) -> None:
        """Refuse a request without the token of those who may change the index."""
        given = bearer_of(request.headers.get("authorization", ""))
        if self.settings.write_token is None:
            raise RequestError(
                403, "This service only reads; start it with EIGENSHAPE_WRITE_TOKEN in place."
            )
        if given is None or not is_secret(given, self.settings.write_token):
            raise RequestError(
                403,
                "A change takes the token for writing; send it in the header `Authorization: "
                "Bearer TOKEN`.",
            )

    async def _change(self, name: str, work: Callable[[], T]) -> T:
        """Change the index in a thread, and return what it holds then of a shape."""
        try:
            return await anyio.to_thread.run_sync(work, limiter=self._threads)
        except NameTakenError as error:  # by another request, or process, since it was looked for
            raise _name_taken(name) from error
        except MissingShapeError as error:
            raise _no_shape(name) from error
        except es.StoreError as error:  # a full disk, or another process that writes for long
            raise RequestError(503, f"The index was not changed: {error}") from error

    @asynccontextmanager
    async def _describing(self, file: str) -> AsyncIterator[None]:
        """Count a mesh that is described, and say in the answer why one cannot be."""
        if self._n_queries >= MOST_QUERIES:
            raise RequestError(503, f"{MOST_QUERIES} queries wait already; ask again later.")
        self._n_queries += 1
        try:
            with self.metrics.queue.track_inprogress():
                yield
        except MeshRefusedError as error:
            name = display_name(file)
            cause = str(error).removeprefix("The file: ").removesuffix(".")
            reason = f"{name} could not be described: {cause}"
            raise RequestError(422, f"{reason}.") from error
        except asyncio.CancelledError as error:
            raise RequestError(503, "The service ends now; ask again later.") from error
        finally:
            self._n_queries -= 1

    async def _answer(
        self, wanted: dict[str, Any], where: Mapping[str, Any] | None, suffix: str, data: bytes
    ) -> Response:
        await self._refresh()
        self.shelf.require_attributes(where)  # before the mesh is described, which takes seconds
        began = perf_counter()
        scan = await self.describers.describe(
            suffix, data, self.shelf.recipe, with_picture=wanted["picture"]
        )
        described = perf_counter()
        self.metrics.describing.observe(described - began)
        answer = await anyio.to_thread.run_sync(
            lambda: self.shelf.query(
                scan.descriptor, wanted["n"], where=where, exact=wanted["exact"]
            ),
            limiter=self._threads,
        )
        answered = perf_counter()
        self.metrics.searching.observe(answered - described)
        return JSONResponse(
            {
                "scan": {
                    "name": display_name(wanted["name"]),
                    "n_vertices": scan.n_vertices,
                    "n_faces": scan.n_faces,
                    "repairs": list(scan.repairs),
                },
                "method": answer.method,
                "n_compared": answer.n_compared,
                "nothing_alike": answer.nothing_alike,
                "seconds": {"describe": described - began, "search": answered - described},
                "matches": [self._match(match) for match in answer.found],
                "picture": scan.picture,
            }
        )

    async def shapes(self, request: Request) -> Response:
        """List shapes."""
        wanted = read_parameters(request, openapi.SHAPES)
        where = _conditions(wanted)
        await self._refresh()
        n_shapes, found = await anyio.to_thread.run_sync(
            self.shelf.shapes, wanted["offset"], wanted["limit"], where, limiter=self._threads
        )
        return JSONResponse({"n_shapes": n_shapes, "shapes": [self._facts(each) for each in found]})

    async def shape(self, request: Request) -> Response:
        """Tell what is known of one shape."""
        read_parameters(request, ())
        await self._refresh()
        return JSONResponse(self._facts(self._shape(request.path_params["name"])))

    async def thumbnail(self, request: Request) -> Response:
        """Return the picture of a shape: the one that the index holds, or else one of its file."""
        wanted = read_parameters(request, openapi.THUMBNAIL)
        await self._refresh()
        shape = self._shape(wanted["name"], wanted["id"])
        image = None if wanted["drawn"] else await self._held_picture(shape)
        if image is None:
            try:
                image = (await self._drawing(shape.source)).image
            except MeshRefusedError as error:
                reason = f"There is no picture of {shape.name[:80]!r}: {error}."
                raise RequestError(404, reason) from error
        kind = "image/png" if image.startswith(b"\x89PNG") else "image/webp"
        return Response(image, media_type=kind)

    async def points(self, request: Request) -> Response:
        """Tell where vertices of a shape lie in its picture."""
        wanted = read_parameters(request, openapi.POINTS)
        await self._refresh()
        shape = self._shape(wanted["name"], wanted["id"])
        address = self._thumbnail_address(shape)
        try:
            drawing = await self._drawing(shape.source)
        except MeshRefusedError:
            # The index may hold a picture, but not where its camera stood.
            held = await self._held_picture(shape)
            hidden = [None] * len(wanted["vertices"])
            return JSONResponse({"thumbnail": address if held else None, "points": hidden})
        places = [drawing.place(vertex) for vertex in wanted["vertices"]]
        return JSONResponse({"thumbnail": f"{address}&drawn=1", "points": places})

    async def health(self, request: Request) -> Response:
        """Say whether the index can be read."""
        read_parameters(request, ())
        try:
            await self._refresh()
        except (es.EigenshapeError, OSError) as error:
            raise RequestError(503, f"The index cannot be read: {error}") from error
        facts = {"status": "ok", "shapes": len(self.shelf), "version": es.__version__}
        return JSONResponse(facts)

    async def show_metrics(self, request: Request) -> Response:
        """Return the counters."""
        read_parameters(request, ())
        return Response(self.metrics.text(), headers={"content-type": CONTENT_TYPE_LATEST})

    async def describe_calls(self, request: Request) -> Response:
        """Return the description of all calls."""
        read_parameters(request, ())
        return JSONResponse(openapi.openapi(self.settings.prefix))

    async def show_page(self, request: Request) -> Response:
        """Return one of the two pages."""
        name, title = PAGES[request.url.path]
        frame = Template((PAGE / "frame.html").read_text(encoding="utf-8"))
        body = (PAGE / f"{name}.html").read_text(encoding="utf-8")
        return HTMLResponse(frame.substitute(title=title, script=f"{name}.js", body=body))

    async def show_file(self, request: Request) -> Response:
        """Return a file of the page."""
        name, kind = FILES[request.url.path]
        return Response((PAGE / name).read_bytes(), media_type=kind)

    async def _refresh(self) -> None:
        await anyio.to_thread.run_sync(self.shelf.refresh, limiter=self._threads)

    async def _drawing(self, source: str | None) -> Picture:
        """Return the picture of a file of the index, drawn again if the file has changed."""
        try:
            if source is None:
                raise MeshRefusedError("it was added to the index without its file")
            key = source, Path(source).stat().st_mtime_ns
        except (OSError, ValueError) as error:
            raise MeshRefusedError("its file is not there any more") from error
        drawing = self._drawings.find(key)
        if drawing is None:
            drawing = await self.describers.draw(Path(source))
            self._drawings.keep(key, drawing)
        return drawing

    async def _held_picture(self, shape: Shape) -> bytes | None:
        try:
            return await anyio.to_thread.run_sync(
                self.shelf.thumbnail, shape.name, shape.id, limiter=self._threads
            )
        except MissingShapeError as error:
            raise _no_shape(shape.name) from error

    def _shape(self, name: str, number: int | None = None) -> Shape:
        try:
            return self.shelf.require(name, number)
        except MissingShapeError as error:
            raise _no_shape(name) from error

    def _facts(self, shape: Shape) -> dict[str, Any]:
        """Return what an answer says of any shape."""
        has_picture = shape.has_thumbnail or shape.source is not None
        return {
            "id": shape.id,
            "name": shape.name,
            "label": shape.label,
            "tags": list(shape.tags),
            "attributes": dict(shape.attributes),
            "source": shape.source if self.settings.show_sources else None,
            "thumbnail": self._thumbnail_address(shape) if has_picture else None,
        }

    def _thumbnail_address(self, shape: Shape) -> str:
        name = quote(shape.name, safe="")
        return f"{self.settings.prefix}/v1/thumbnails?name={name}&id={shape.id}"

    def _match(self, match: Found) -> dict[str, Any]:
        return {
            **self._facts(match.shape),
            "score": match.score,
            "chance": match.chance,
            "mirrored": match.mirrored,
            "n_pairs": len(match.pairs),
            "pairs": match.pairs.tolist(),
        }


def make_app(service: Service, rules: Rules) -> App:
    """Return the application: the page and the calls, behind the guard, and counted."""
    calls: dict[str, dict[str, Endpoint]] = {
        "/v1/query": {"POST": service.query},
        "/v1/shapes": {"GET": service.shapes, "POST": service.add_shape},
        "/v1/shapes/{name:any}": {"GET": service.shape, "DELETE": service.remove_shape},
        "/v1/compact": {"POST": service.compact},
        "/v1/thumbnails": {"GET": service.thumbnail},
        "/v1/points": {"GET": service.points},
        "/health": {"GET": service.health},
        "/metrics": {"GET": service.show_metrics},
        "/openapi.json": {"GET": service.describe_calls},
        **{path: {"GET": service.show_page} for path in PAGES},
        **{path: {"GET": service.show_file} for path in FILES},
    }
    routes = [Route(path, _by_method(by_method)) for path, by_method in calls.items()]
    app = Starlette(
        routes=routes, exception_handlers={HTTPException: _show_http_error, Exception: _show_fault}
    )
    app.router.redirect_slashes = False
    templates = frozenset(path.replace(":any", "") for path in calls)
    return below(count_requests(Guard(app, rules), service.metrics, templates), rules.prefix)


def _by_method(calls: Mapping[str, Endpoint]) -> type[HTTPEndpoint]:
    """Return what answers at one address, by a call for each method; another one is refused."""
    answers = {
        method.lower(): staticmethod(_with_plain_errors(call)) for method, call in calls.items()
    }
    return type("Calls", (HTTPEndpoint,), answers)


def _name_taken(name: str) -> RequestError:
    return RequestError(409, f"The index has a shape {name[:80]!r}; replace=1 replaces it.")


def _no_shape(name: str) -> RequestError:
    return RequestError(404, f"The index holds no shape {name[:80]!r}, or another one now.")


def _suffix(name: str) -> str:
    """Return the suffix of a file of shapes; raise RequestError if it is none."""
    try:
        return shape_suffix(name)
    except es.FileFormatError as error:
        raise RequestError(400, str(error)) from error


def _attributes(text: str) -> dict[str, Any]:
    """Return the attributes of a JSON object; raise RequestError if the text is none."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise RequestError(
            400, f"The parameter attributes must be a JSON object; it is {text[:80]!r}."
        )
    return found


def _conditions(wanted: dict[str, Any]) -> dict[str, Any] | None:
    """Return the conditions of the filters of a request; raise RequestError if one is none."""
    try:
        return parse_filters(wanted["filter"])
    except es.InvalidParameterError as error:
        raise RequestError(400, str(error)) from error


def _error(status: int, reason: str) -> Response:
    headers = {"retry-after": "5"} if status == 503 else None
    return JSONResponse({"error": reason}, status, headers)


def _with_plain_errors(call: Endpoint) -> Endpoint:
    """Return a call whose errors are sentences: of the request, or of the index."""

    @wraps(call)
    async def answer(request: Request) -> Response:
        try:
            return await call(request)
        except RequestError as error:
            return _error(error.status, error.reason)
        except es.InvalidParameterError as error:
            return _error(400, str(error))
        except es.StoreError as error:  # damaged, or being replaced
            return _error(500, f"The index cannot be read: {error}")

    return answer


async def _show_http_error(_request: Request, error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else 500
    texts = {404: "There is no such page or call.", 405: "This call takes another method."}
    return _error(status, texts.get(status, "The request cannot be answered."))


async def _show_fault(_request: Request, _error_: Exception) -> Response:
    return _error(500, "The service has a fault; its log says more.")
