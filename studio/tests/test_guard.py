"""What stands between a request and the service: paths of a proxy, packed bodies, checks that need no token."""

import asyncio
import gzip
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route

import eigenshape as es
from eigenshape_studio.guard import Guard, Rules, below
from eigenshape_studio.service.server import serve

TOKEN = "a-token-of-the-tests-0123456789"
BEARER = {"authorization": f"Bearer {TOKEN}", "content-type": "application/octet-stream"}
MOST = 10_000


async def echo(request: Request) -> PlainTextResponse:
    return PlainTextResponse(f"{request.url.path} {len(await request.body())}")


def ask(method, path, prefix="", host="shapes.example", **request):
    routes = [
        Route(path, echo, methods=["GET", "POST"])
        for path in ("/", "/health", "/v1/query", "/v1/a%2Fb")
    ]
    rules = Rules(
        TOKEN,
        {host},
        80,
        most_bytes=MOST,
        open_paths=("/health",),
        json_errors=True,
        prefix=prefix,
        proxied={"shapes.example"},
    )
    app = below(Guard(Starlette(routes=routes), rules), prefix)

    async def send():
        transport = httpx.ASGITransport(app=app)
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{host}") as client:
            return await client.request(method, path, **request)

    # In a thread: a browser of other tests may keep a loop of its own in this one.
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, send()).result()


def test_health_takes_no_token_by_any_method_that_reads():
    assert ask("GET", "/health").status_code == 200
    head = ask("HEAD", "/health")
    assert (head.status_code, head.content) == (200, b"")
    assert ask("POST", "/health").status_code == 403
    assert ask("HEAD", "/v1/query").status_code == 403


def test_a_packed_body_is_unpacked():
    data = bytes(5000)
    packed = {**BEARER, "content-encoding": "gzip"}
    assert ask("POST", "/v1/query", content=data, headers=BEARER).text == "/v1/query 5000"
    answer = ask("POST", "/v1/query", content=gzip.compress(data), headers=packed)
    assert answer.text == "/v1/query 5000"


@pytest.mark.parametrize(
    ("encoding", "body", "status", "reason"),
    [
        ("gzip", gzip.compress(bytes(MOST + 1)), 413, "may have 10,000 bytes"),
        ("gzip", b"ply", 400, "packed by gzip, as its header says"),
        ("gzip", gzip.compress(b"ply")[:-3], 400, "packed by gzip, as its header says"),
        ("br", b"ply", 415, "packed by gzip, and not by br"),
    ],
)
def test_a_body_that_cannot_be_unpacked_is_refused(encoding, body, status, reason):
    headers = {**BEARER, "content-encoding": encoding}
    answer = ask("POST", "/v1/query", content=body, headers=headers)
    assert answer.status_code == status
    assert reason in answer.json()["error"]


def test_a_proxy_may_pass_its_path_on_or_leave_it_out():
    for path in ("/v1/query", "/shapes/v1/query"):
        assert ask("GET", path, "/shapes", headers=BEARER).text == "/v1/query 0"
    assert ask("GET", "/shapes/health", "/shapes").status_code == 200
    assert ask("GET", "/shapesque/health", "/shapes").status_code == 403  # another path
    bare = ask("GET", "/shapes?token=x", "/shapes")
    assert (bare.status_code, bare.headers["location"]) == (307, "/shapes/?token=x")


def test_the_entrance_leads_back_below_the_path():
    entered = ask("GET", f"/shapes/?token={TOKEN}", "/shapes")
    assert entered.status_code == 303
    assert entered.headers["location"] == "/shapes/"
    assert "Path=/shapes/;" in entered.headers["set-cookie"]


def test_the_page_may_come_by_https_through_a_proxy():
    for scheme, status in (("http", 200), ("https", 200), ("ftp", 403)):
        headers = {**BEARER, "origin": f"{scheme}://shapes.example"}
        assert ask("POST", "/v1/query", content=b"x", headers=headers).status_code == status
        local = {**BEARER, "origin": f"{scheme}://localhost:8000"}
        sent = ask("POST", "/v1/query", content=b"x", headers=local, host="localhost:8000")
        assert sent.status_code == (200 if scheme == "http" else 403)
    foreign = {**BEARER, "origin": "https://evil.example"}
    assert ask("POST", "/v1/query", content=b"x", headers=foreign).status_code == 403


@pytest.mark.parametrize("prefix", ["shapes", "/shapes/", "/a b", "//", "/sh?x"])
def test_a_prefix_must_be_a_path(tmp_path, prefix):
    with pytest.raises(es.InvalidParameterError, match="A prefix must be a path"):
        serve(tmp_path, prefix=prefix)
