"""The service in processes of its own: answers, limits, hostile requests, many clients, its page."""

import http.client
import json
import re
import shlex
import signal
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from urllib.parse import quote, urlsplit

import httpx
import numpy as np
import pytest
from browser import drop_file, find, open_page, wait_until
from test_server import GOOD, HOSTILE, Server, ply_of

import eigenshape as es
from eigenshape.retrieval.store import database as store
from eigenshape.retrieval.store.state import MissingShapeError
from eigenshape_studio.service.openapi import openapi
from eigenshape_studio.service.server import serve
from eigenshape_studio.service.shelf import ShelfReader

ROOT = Path(__file__).parents[2]
TOKEN = "a-token-of-the-tests-0123456789"
WRITE_TOKEN = "a-token-for-writing-0123456789"
LEGS = {"fish": 0, "bird": 2, "biped": 2, "quadruped": 4, "giraffe": 4}
KINDS = tuple(LEGS)
MARKUP = '<img src="x" onerror="alert(1)">'
NAMES = ("../../etc/passwd", "a b%2f?&#\"'é\u202e", "line\nbreak\t\x1b[31m", MARKUP, "long" * 1000)
# The service with limits that tests can reach within a second or two.
SCRIPT = """
import sys
from functools import partial
folder, index, token, timeout, memory, sources, grace, write_token, workers = sys.argv[1:]
sys.path.append(folder)
import misbehaving
from eigenshape.retrieval import Workers
from eigenshape_studio import listening
from eigenshape_studio.service import server
listening.HEADER_SECONDS = 1.0
server.MOST_BYTES, server.GRACE = 1 << 20, int(grace)
server.Rules = partial(server.Rules, pause=0.5, deadline=2.0)
server.serve(
    index, port=0, token=token or None, workers=Workers(int(workers), float(timeout), float(memory)),
    write_token=write_token or None, show_sources=bool(sources), announce=partial(print, flush=True),
    describe=misbehaving.describe_or_misbehave,
)
"""


class ServiceProcess(Server):
    """A service, and requests to it."""

    def __init__(
        self,
        index,
        token=TOKEN,
        timeout=60.0,
        memory=3e9,
        sources="",
        *,
        grace=10,
        write_token="",
        workers=1,
    ):
        folder = Path(__file__).parent
        arguments = [folder, index, token, timeout, memory, sources, grace, write_token, workers]
        command = [sys.executable, "-c", SCRIPT, *map(str, arguments)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()
        parts = urlsplit(self.url)
        self.port = parts.port
        self.token = token or parts.query.removeprefix("token=")
        self.base = f"http://127.0.0.1:{self.port}"
        self.cookie = f"eigenshape-service-{self.port}={self.token}"
        bearer = {"authorization": f"Bearer {self.token}"}
        self.client = httpx.Client(base_url=self.base, timeout=300, headers=bearer)

    def query(self, data, name="scan.ply", client=None, **parameters):
        return (client or self.client).post(
            "/v1/query",
            params={"name": name, **parameters},
            content=data,
            headers={"content-type": "application/octet-stream"},
        )

    def request(self, method="POST", path="/v1/query?name=a.ply", body=None, drop=(), **changes):
        body = ply_of(GOOD) if body is None else body
        return super().request(method, path, body, drop, **changes)

    def opening(self, data, name="a.ply"):
        return self.request(path=f"/v1/query?name={name}", body=data)

    def end(self, number=signal.SIGTERM):
        """Ask the process to end, and return its exit code."""
        self.process.send_signal(number)
        self.process.communicate(timeout=120)
        return self.process.returncode


@contextmanager
def serving(*arguments, **settings):
    """Serve an index, and end the service, which must say that all is well."""
    running = ServiceProcess(*arguments, **settings)
    try:
        yield running
    finally:
        running.client.close()
        code = running.end() if running.process.poll() is None else running.process.returncode
    assert code == 0


def scan_of(kind, comment="", pose=1):
    """Return the bytes of a PLY file of a creature in another pose."""
    mesh = es.make_creature(kind, pose, n_vertices=500)
    lines = ["ply", "format ascii 1.0", *([f"comment {comment}"] if comment else [])]
    lines += [f"element vertex {mesh.n_vertices}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {mesh.n_faces}", "property list uchar int vertex_indices"]
    lines += ["end_header", *(" ".join(map(repr, map(float, row))) for row in mesh.vertices)]
    lines += [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    return ("\n".join(lines) + "\n").encode()


def make_index(folder):
    """Make an index of five creatures, with their files, and of odd names without files."""
    index = es.ShapeIndex.create(folder / "index")
    for kind in KINDS:
        mesh = es.make_creature(kind, n_vertices=500)
        path = folder / f"{kind}.ply"
        es.write_mesh(mesh, path)
        label = "animal" if kind != "biped" else "person"
        facts = {"tags": ["swims"] if kind == "fish" else [], "attributes": {"legs": LEGS[kind]}}
        index.add(f"zoo/{kind}", mesh, label=label, source=str(path), n_views=0, **facts)
    described = index.descriptors("zoo/bird", index.default_recipe())
    for name in NAMES:
        index.add_many([es.retrieval.DescribedShape(name, described, label=MARKUP)])
    return index


@pytest.fixture(scope="module")
def index(tmp_path_factory):
    return make_index(tmp_path_factory.mktemp("service"))


@pytest.fixture(scope="module")
def service(index):
    with serving(index.folder, workers=2) as running:
        yield running


def is_well(service):
    answer = service.client.get("/health")
    return answer.status_code == 200 and answer.json()["status"] == "ok"


def test_a_scan_finds_its_kind(service):
    answer = service.query(scan_of("fish"), n=3)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["scan"] == {"name": "scan.ply", "n_vertices": 500, "n_faces": 996, "repairs": []}
    assert (found["method"], found["picture"]) == ("exact", None)
    first = found["matches"][0]
    assert (first["name"], first["label"], first["source"]) == ("zoo/fish", "animal", None)
    assert len(found["matches"]) == 3
    scores = [match["score"] for match in found["matches"]]
    assert scores == sorted(scores)
    pairs = np.array(first["pairs"])
    assert pairs.shape == (first["n_pairs"], 2)
    assert first["n_pairs"] > 3
    assert 0 <= pairs.min() <= pairs.max() < 500


def test_a_query_can_be_restricted_to_a_class(service):
    found = service.query(scan_of("fish"), n=20, filter="label=person", exact=1).json()["matches"]
    assert [match["name"] for match in found] == ["zoo/biped"]
    assert service.query(scan_of("fish"), filter="label=none").json()["matches"] == []
    # As text of an address, in which the second "=" belongs to the value
    both = "/v1/query?name=a.ply&n=20&filter=label=animal&filter=legs=1..3"
    kind = {"content-type": "application/octet-stream"}
    found = service.client.post(both, content=scan_of("fish"), headers=kind).json()["matches"]
    assert [match["name"] for match in found] == ["zoo/bird"]
    assert (found[0]["tags"], found[0]["attributes"]) == ([], {"legs": 2})


def test_shapes_are_listed_with_what_is_known_and_by_filters(service):
    def listed(*filters, **parameters):
        answer = service.client.get("/v1/shapes", params={"filter": filters, **parameters}).json()
        return answer["n_shapes"], [shape["name"] for shape in answer["shapes"]]

    assert listed("tag=swims") == (1, ["zoo/fish"])
    assert listed("legs=4") == (2, ["zoo/giraffe", "zoo/quadruped"])
    assert listed("legs=2..", limit=1, offset=1) == (4, ["zoo/bird"])
    assert listed("legs=..2", "label=animal,person") == (3, ["zoo/biped", "zoo/bird", "zoo/fish"])
    assert listed("label=nobody") == (0, [])
    fish = service.client.get("/v1/shapes/zoo%2Ffish").json()
    assert (fish["tags"], fish["attributes"]) == (["swims"], {"legs": 0})


def test_points_become_a_surface_and_the_answer_says_so(service):
    mesh = es.make_creature("fish", n_vertices=4000)
    data = "\n".join(f"{x} {y} {z}" for x, y, z in mesh.vertices).encode()
    found = service.query(data, "fish.xyz").json()
    assert "4,000 points" in found["scan"]["repairs"][0]
    assert found["matches"][0]["name"] == "zoo/fish"


def test_a_mesh_is_repaired_and_the_answer_says_so(service):
    mesh = es.make_creature("fish", n_vertices=500)
    lines = [f"v {x} {y} {z}" for x, y, z in [*mesh.vertices, [9.0, 9.0, 9.0]]]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
    found = service.query("\n".join(lines).encode(), "fish.obj").json()
    assert len(found["scan"]["repairs"]) == 1
    assert found["scan"]["n_vertices"] == 500
    assert found["matches"][0]["name"] == "zoo/fish"


def test_shapes_are_listed_shown_and_drawn(service):
    answer = service.client.get("/v1/shapes", params={"limit": 4, "offset": 8}).json()
    assert answer["n_shapes"] == len(KINDS) + len(NAMES)
    assert [shape["name"] for shape in answer["shapes"]] == ["zoo/giraffe", "zoo/quadruped"]
    shape = service.client.get("/v1/shapes/zoo%2Ffish").json()
    assert (shape["name"], shape["label"], shape["source"]) == ("zoo/fish", "animal", None)
    picture = service.client.get(shape["thumbnail"])
    assert picture.headers["content-type"] == "image/png"
    assert picture.content.startswith(b"\x89PNG")
    points = {"name": "zoo/fish", "vertices": ",".join(map(str, range(400)))}
    found = service.client.get("/v1/points", params=points).json()
    assert found["thumbnail"] == shape["thumbnail"] + "&drawn=1"
    seen = np.array([point for point in found["points"] if point])
    assert 50 < len(seen) < 400
    assert 0 <= seen.min() <= seen.max() <= 1


@pytest.mark.parametrize("name", NAMES)
def test_any_name_is_a_name_and_no_path(service, name):
    listed = service.client.get("/v1/shapes", params={"limit": 1000}).json()["shapes"]
    assert name in [shape["name"] for shape in listed]
    # As the bytes that a client sends: some libraries take the dots of a name for a path.
    path = "/v1/shapes/" + quote(name, safe="").replace(".", "%2E")
    connection = http.client.HTTPConnection("127.0.0.1", service.port, timeout=60)
    connection.request("GET", path, headers={"authorization": f"Bearer {TOKEN}"})
    answer = connection.getresponse()
    assert (answer.status, json.loads(answer.read())["name"]) == (200, name)
    connection.close()
    picture = service.client.get("/v1/thumbnails", params={"name": name})
    assert picture.status_code == 404
    assert "added to the index without its file" in picture.json()["error"]
    points = service.client.get("/v1/points", params={"name": name, "vertices": "1,2"}).json()
    assert points == {"thumbnail": None, "points": [None, None]}


def test_the_page_takes_a_cookie_and_programs_a_header(service):
    with httpx.Client(base_url=service.base, timeout=60) as client:
        assert client.get("/").status_code == 403
        assert "Authorization: Bearer TOKEN" in client.get("/v1/shapes").json()["error"]
        entered = client.get(f"/?token={TOKEN}")
        assert (entered.status_code, entered.headers["location"]) == (303, "/")
        assert {"HttpOnly", "SameSite=Strict"} <= set(entered.headers["set-cookie"].split("; "))
        page = client.get("/")
        assert 'data-test="drop"' in page.text
        assert "default-src 'none'" in page.headers["content-security-policy"]
        for name in ("/page.js", "/page.css", "/docs", "/docs.js"):
            assert client.get(name).status_code == 200
    with httpx.Client(base_url=service.base) as client:
        shown = client.get("/v1/shapes", headers={"authorization": f"bearer {TOKEN}"})
        assert shown.status_code == 200
        assert client.get("/health").json()["shapes"] == len(KINDS) + len(NAMES)
    assert service.url == f"{service.base}/"  # a token that was given is not printed


def test_openapi_describes_every_call(service):
    described = service.client.get("/openapi.json").json()
    assert described == openapi()
    text = json.dumps(described)
    for name in re.findall(r"#/components/schemas/(\w+)", text):
        assert name in described["components"]["schemas"]
    for path, calls in described["paths"].items():
        for method, call in calls.items():
            answer = service.client.request(method, path.replace("{name}", "zoo%2Ffish"))
            assert str(answer.status_code) in call["responses"], (path, answer.text)
            if "$ref" in str(call["responses"].get("200")) and answer.status_code == 200:
                schema = call["responses"]["200"]["content"]["application/json"]["schema"]["$ref"]
                schema = described["components"]["schemas"][schema.rpartition("/")[2]]
                assert set(answer.json()) == set(schema["required"])
            required = [each["name"] for each in call["parameters"] if each["required"]]
            if required and "{name}" not in path and method == "get":
                assert f"The parameter {required[0]} must be given." in answer.json()["error"]


def test_answers_are_as_openapi_says(service):
    schemas = openapi()["components"]["schemas"]
    answer = service.query(scan_of("bird"), picture=1).json()
    assert set(answer) == set(schemas["Answer"]["required"])
    assert set(answer["matches"][0]) == set(schemas["Match"]["required"])
    assert answer["picture"]["image"].startswith("data:image/png;base64,")
    vertices = {str(ours) for match in answer["matches"] for ours, _ in match["pairs"]}
    assert vertices <= set(answer["picture"]["points"])
    assert all(
        re.fullmatch("#[0-9a-f]{6}", color) for color in answer["picture"]["colors"].values()
    )


def metrics_of(service):
    """Return the values of all metrics by their names with labels."""
    text = service.client.get("/metrics").text
    lines = [line.rpartition(" ") for line in text.splitlines() if not line.startswith("#")]
    return {name: float(value) for name, _, value in lines}


def test_metrics_count(service):
    before = metrics_of(service)
    assert service.query(scan_of("bird")).status_code == 200
    assert service.query(b"no mesh").status_code == 422
    assert service.client.get("/nonsense").status_code == 404
    after = metrics_of(service)

    def growth(name):
        return after[name] - before.get(name, 0.0)

    assert growth('eigenshape_requests_total{path="/v1/query",status="200"}') == 1
    assert growth('eigenshape_requests_total{path="/v1/query",status="422"}') == 1
    assert growth('eigenshape_requests_total{path="other",status="404"}') == 1
    assert growth("eigenshape_describe_seconds_count") == 1
    assert growth("eigenshape_search_seconds_count") == 1
    assert after["eigenshape_queue"] == 0
    assert after["eigenshape_shapes"] == len(KINDS) + len(NAMES)


WRONG_PARAMETERS = {
    "no name": ("/v1/query", "name must be given"),
    "no suffix": ("/v1/query?name=scan", "must end in .*; scan does not"),
    "another format": ("/v1/query?name=a.exe", "a.exe does not"),
    "a path": ("/v1/query?name=/etc/passwd", "; passwd does not"),
    "no matches": ("/v1/query?name=a.ply&n=0", "n must lie between 1 and 100; it is '0'"),
    "too many": ("/v1/query?name=a.ply&n=101", "n must lie between 1 and 100"),
    "negative": ("/v1/query?name=a.ply&n=-1", "n must be a whole number"),
    "many digits": ("/v1/query?name=a.ply&n=" + "9" * 5000, "n must be a whole number"),
    "other digits": ("/v1/query?name=a.ply&n=%D9%A3", "n must be a whole number"),
    "twice": ("/v1/query?name=a.ply&n=3&n=4", "n must be given once"),
    "unknown": ("/v1/query?name=a.ply&k=3", "no parameter 'k' here; .*: name, n, filter"),
    "maybe exact": ("/v1/query?name=a.ply&exact=maybe", "exact must be 0 or 1"),
    "a long filter": ("/v1/query?name=a.ply&filter=" + "x" * 5000, "filter must have at most 4,0"),
    "no condition": ("/v1/query?name=a.ply&filter=cat", "such as label=cat, .*; it is 'cat'"),
    "no range": ("/v1/query?name=a.ply&filter=legs=a..b", "least and a largest number"),
    "no attribute": ("/v1/query?name=a.ply&filter=height=1", "no shape has 'height'"),
    "two of one": ("/v1/query?name=a.ply&filter=tag=a&filter=tag=b", "'tag' has two"),
}


@pytest.mark.parametrize("what", WRONG_PARAMETERS)
def test_wrong_parameters_are_named(service, what):
    path, message = WRONG_PARAMETERS[what]
    kind = {"content-type": "application/octet-stream"}
    answer = service.client.post(path, content=b"x", headers=kind)
    assert answer.status_code == 400
    assert re.search(message, answer.json()["error"])


def test_parameters_of_other_calls_are_checked(service):
    get = service.client.get
    many = ",".join(["1"] * 501)
    assert "at most 500 numbers" in get(f"/v1/points?name=a&vertices={many}").json()["error"]
    assert "vertices must be a whole" in get("/v1/points?name=a&vertices=1,x").json()["error"]
    assert get("/v1/points?name=a&vertices=").status_code == 404
    assert "limit must lie between" in get("/v1/shapes?limit=1001").json()["error"]
    unknown = get("/v1/shapes?filter=height=1")
    assert (unknown.status_code, "no shape has 'height'" in unknown.text) == (400, True)
    assert "A filter is a condition" in get("/v1/shapes?filter=").json()["error"]
    assert "no shape 'ghost'" in get("/v1/shapes/ghost").json()["error"]


# What the studio refuses and the service does not look at: the number of a tab.
OF_TABS = {"no tab", "a tab with a path", "a tab without end"}
MORE_HOSTILE = {
    "a wrong bearer": lambda s: s.request(drop=("cookie",), authorization="Bearer nonsense"),
    "an empty bearer": lambda s: s.request(drop=("cookie",), authorization="Bearer "),
    "the token as a password": lambda s: s.request(
        drop=("cookie",), authorization=f"Basic {s.token}"
    ),
    "two bearers": lambda s: s.request(
        drop=("cookie",), authorization=[f"Bearer {s.token}", "Bearer x"]
    ),
    "a bearer that is not ASCII": lambda s: s.request(
        drop=("cookie",), authorization="Bearer \xe9\xff"
    ),
    "the token with another page": lambda s: s.request(
        drop=("cookie",), authorization=f"Bearer {s.token}", origin="https://evil.example"
    ),
    "health by another name": lambda s: s.request("GET", "/health", b"", host="evil.example"),
    "metrics without token": lambda s: s.request("GET", "/metrics", b"", drop=("cookie",)),
    "a shape that is a path": lambda s: s.request("GET", "/v1/shapes/../../etc/shadow", b""),
    "a picture of a path": lambda s: s.request("GET", "/v1/thumbnails?name=/etc/passwd", b""),
    "a name with a null byte": lambda s: s.request("GET", "/v1/shapes/a%00b", b""),
    "a name that is no UTF-8": lambda s: s.request("GET", "/v1/thumbnails?name=%ff%fe", b""),
}
SERVICE_HOSTILE = {name: HOSTILE[name] for name in HOSTILE if name not in OF_TABS} | MORE_HOSTILE


def test_there_are_sixty_hostile_requests():
    assert len(SERVICE_HOSTILE) >= 60


@pytest.mark.parametrize("what", SERVICE_HOSTILE)
def test_a_hostile_request_is_refused(service, what):
    status = service.raw(SERVICE_HOSTILE[what](service))
    assert status is None or 400 <= status < 500, status
    assert service.process.poll() is None
    assert is_well(service)


def test_a_slow_sender_is_given_up(service):
    request = service.request(content_length="4000")
    assert service.raw(request, [b"x"], pause=1.0) == 408
    assert service.raw(request, [b"x"] * 10, pause=0.3) == 408
    began = time.monotonic()
    assert service.raw(service.request()[:60], [b"x"] * 8, pause=0.3) in (None, 400)
    assert time.monotonic() - began < 6
    assert is_well(service)


def test_a_large_body_is_refused_before_it_is_read(service):
    answer = service.query(bytes((1 << 20) + 1))
    assert answer.status_code == 413
    assert answer.json() == {"error": "The body may have 1,048,576 bytes."}


def test_a_bad_mesh_is_told_in_words(service):
    answer = service.query(ply_of("nan 0 0\n1 0 0\n0 1 0\n"), "bad scan.ply")
    assert answer.status_code == 422
    text = answer.json()["error"]
    assert text.startswith("bad scan.ply could not be described: ")
    assert "nan" in text
    assert "eigenshape-uploads" not in text  # no path of this machine


@pytest.fixture(scope="module")
def strict(index):
    """Return a service with short limits."""
    limits = {"timeout": 8.0, "memory": 2e9, "workers": 2}
    with serving(index.folder, token="", sources="yes", **limits) as running:
        yield running


def test_a_mesh_that_hangs_dies_or_eats_memory_harms_nobody(strict):
    expected = {
        "hang": "could not be described: it took more than 8 s.",
        "die": "could not be described: it ended its process with exit code 9.",
        "eat": "could not be described: it needs more memory than a worker may use.",
    }
    with ThreadPoolExecutor(5) as threads:
        bad = {what: threads.submit(strict.query, scan_of("fish", what)) for what in expected}
        good = [threads.submit(strict.query, scan_of("fish")) for _ in range(2)]
        for what, text in expected.items():
            answer = bad[what].result()
            assert (answer.status_code, answer.json()) == (422, {"error": f"scan.ply {text}"})
        for answer in good:
            assert answer.result().json()["matches"][0]["name"] == "zoo/fish"
    assert strict.query(scan_of("bird")).status_code == 200
    assert metrics_of(strict)["eigenshape_queue"] == 0


def test_sources_are_shown_if_allowed(strict, index):
    shape = strict.client.get("/v1/shapes/zoo%2Ffish").json()
    assert shape["source"] == str(index.folder.parent / "fish.ply")


def test_a_random_token_is_printed(strict):
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{43}", strict.url)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """Return two services on an index without shapes, of which the first one may write."""
    index = es.ShapeIndex.create(tmp_path_factory.mktemp("changing") / "index")
    writing = serving(index.folder, write_token=WRITE_TOKEN, workers=2)
    with writing as first, serving(index.folder) as second:
        yield index, first, second


def test_shapes_of_other_processes_are_seen_by_several_services(both):
    index, *services = both
    assert services[0].query(scan_of("fish")).json()["matches"] == []
    index.add("fish", es.make_creature("fish", n_vertices=500), n_views=0)
    time.sleep(1.1)
    for running in services:
        assert running.client.get("/health").json()["shapes"] == 1
        assert running.query(scan_of("fish")).json()["matches"][0]["name"] == "fish"
    index.remove("fish")
    time.sleep(1.1)
    assert services[1].query(scan_of("fish")).json()["matches"] == []


def test_shapes_are_added_and_removed_with_a_token_of_its_own(both):
    index, running, _ = both
    with ExitStack() as stack:

        def client_with(**headers):
            headers["content-type"] = "application/octet-stream"
            client = httpx.Client(base_url=running.base, timeout=300, headers=headers)
            return stack.enter_context(client)

        writer = client_with(authorization=f"Bearer {WRITE_TOKEN}")

        def add(kind, name, client=writer, **more):
            parameters = {"name": name, "file": "scan.ply", **more}
            return client.post("/v1/shapes", params=parameters, content=scan_of(kind, pose=0))

        facts = {"label": "animal", "tag": ["wet", "new"], "attributes": '{"legs": 0}'}
        # Who may read may not write, neither by the header nor by the cookie of the page.
        by_header, by_cookie = {"authorization": f"Bearer {TOKEN}"}, {"cookie": running.cookie}
        for client in (client_with(**by_header), client_with(**by_cookie)):
            assert add("fish", "fish", client).status_code == 403
            assert client.delete("/v1/shapes/fish").status_code == 403
        assert is_well(running)

        # Two clients at the same time: an index has one writer, and both wait for their turn.
        with ThreadPoolExecutor(2) as threads:
            first = threads.submit(add, "fish", "zoo/fish", **facts)
            second = threads.submit(add, "bird", "zoo/bird")
        assert (first.result().status_code, second.result().status_code) == (201, 201)
        fish = first.result().json()
        assert (fish["label"], fish["tags"], fish["attributes"]) == (
            "animal",
            ["new", "wet"],
            {"legs": 0},
        )
        assert writer.get(fish["thumbnail"]).status_code == 200
        found = running.query(scan_of("fish")).json()["matches"]
        assert [match["name"] for match in found] == ["zoo/fish", "zoo/bird"]

        assert add("bird", "zoo/fish").status_code == 409
        assert add("bird", "zoo/fish", replace=1).json()["label"] is None
        assert "no NUL" in add("fish", "nul\0").json()["error"]
        assert "JSON object" in add("fish", "x", attributes="[1]").json()["error"]
        assert "finite number" in add("fish", "x", attributes='{"a": null}').json()["error"]
        large = {"params": {"name": "x", "file": "x.ply"}, "content": bytes((1 << 20) + 1)}
        assert writer.post("/v1/shapes", **large).status_code == 413
        bad = writer.post("/v1/shapes", params={"name": "x", "file": "x.ply"}, content=b"no mesh")
        assert (bad.status_code, "could not be described" in bad.text) == (422, True)

        assert writer.delete("/v1/shapes/zoo%2Ffish").json()["name"] == "zoo/fish"
        assert writer.delete("/v1/shapes/zoo%2Ffish").status_code == 404
        assert running.client.get("/health").json()["shapes"] == 1
        assert [record.name for record in index.records()] == ["zoo/bird"]


def test_of_two_that_add_one_name_at_once_the_later_is_refused(both):
    _, running, _ = both
    headers = {"authorization": f"Bearer {WRITE_TOKEN}", "content-type": "application/octet-stream"}

    def answers_of(request):
        with ThreadPoolExecutor(3) as threads:
            return list(threads.map(lambda _: request(), range(3)))

    def add():
        parameters = {"name": "twice", "file": "scan.ply"}
        return httpx.post(
            f"{running.base}/v1/shapes",
            params=parameters,
            content=scan_of("fish"),
            headers=headers,
            timeout=300,
        )

    def remove():
        return httpx.delete(f"{running.base}/v1/shapes/twice", headers=headers, timeout=300)

    answers = answers_of(add)
    assert sorted(answer.status_code for answer in answers) == [201, 409, 409]
    refusals = {answer.text for answer in answers if answer.status_code == 409}
    assert refusals == {'{"error":"The index has a shape \'twice\'; replace=1 replaces it."}'}
    assert sorted(answer.status_code for answer in answers_of(remove)) == [200, 404, 404]
    freed = httpx.post(f"{running.base}/v1/compact", headers=headers, timeout=300)
    assert freed.json()["bytes"] > 0
    headers["authorization"] = f"Bearer {TOKEN}"
    assert httpx.post(f"{running.base}/v1/compact", headers=headers).status_code == 403


def test_an_answer_is_of_one_state(tmp_path):
    """Both shapes that one name stands for in turn are told by score, label, number and picture."""
    recipe = es.retrieval.HeatRecipe(name="test", scales=(1.0, 2.0), n_features=2, n_shifts=0)
    rows = np.random.default_rng(0).random((2, 2, 2))
    described = [es.retrieval.HeatDescriptor(each, np.arange(2), recipe) for each in rows]
    index = es.ShapeIndex.create(tmp_path / "index")
    shelf = ShelfReader(index.folder)

    def replace(turn):
        label = "ab"[turn % 2]
        facts = {"label": label, "tags": [label], "thumbnail": label.encode(), "digest": label}
        shape = es.retrieval.DescribedShape("x", [described[turn % 2]], **facts)
        added = shelf.add(shape, replace=True)
        assert (added.label, added.tags) == (label, (label,))

    replace(0)
    n_pictures = 0
    with ThreadPoolExecutor(2) as threads:
        done = threads.submit(lambda: [replace(turn) for turn in range(1, 60)])
        while not done.done():
            (found,) = shelf.query(described[0], 1).found
            label = "a" if found.score < 1e-6 else "b"
            assert (found.shape.label, found.shape.tags) == (label, (label,))
            with suppress(MissingShapeError):  # replaced by now
                assert shelf.thumbnail("x", found.shape.id) == label.encode()
                n_pictures += 1
        done.result()
    assert n_pictures > 0


def test_a_change_that_cannot_be_written_says_so(both):
    index, running, _ = both
    index.add("zoo/fish", es.make_creature("fish", n_vertices=500), n_views=0)
    time.sleep(1.1)  # a service looks at most once a second
    with store.writing(index.folder):
        bearer = {"authorization": f"Bearer {WRITE_TOKEN}"}
        answer = running.client.delete("/v1/shapes/zoo%2Ffish", headers=bearer)
        assert answer.status_code == 503
        assert "The index was not changed: An index has one writer at a time" in answer.text
        assert is_well(running)
    assert "zoo/fish" in [record.name for record in index.records()]


def test_a_reader_looks_at_most_once_a_second(index, monkeypatch):
    shelf = ShelfReader(index.folder)
    looks = []
    monkeypatch.setattr(shelf._reader, "refresh", lambda: looks.append(1))
    for _ in range(5):
        shelf.refresh()
    assert looks == []
    shelf._due = 0.0
    for _ in range(5):
        shelf.refresh()
    assert looks == [1]


def wait_for_a_query(service):
    while not metrics_of(service)["eigenshape_queue"]:
        time.sleep(0.05)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_end_lets_queries_finish(index, number):
    with serving(index.folder, grace=100) as running, ThreadPoolExecutor(1) as threads:
        asking = threads.submit(running.query, scan_of("fish", "slow"))
        wait_for_a_query(running)
        assert running.end(number) == 0
        assert asking.result().status_code == 200


def test_a_query_that_hangs_does_not_hold_up_the_end_for_ever(index):
    with (
        serving(index.folder, timeout=500.0, grace=1) as running,
        ThreadPoolExecutor(1) as threads,
    ):
        asking = threads.submit(running.query, scan_of("fish", "hang"))
        wait_for_a_query(running)
        assert running.end() == 0
        lost = isinstance(asking.exception(), httpx.RemoteProtocolError)
        assert lost or asking.result().status_code == 503


MIXED_IN = ("no cookie", "host of another site", "no HTTP", "a mesh with NaN", "two lengths")


def test_sixteen_clients_with_some_hostile_requests(service):
    scans = [scan_of(kind) for kind in KINDS]
    hostile = [SERVICE_HOSTILE[name] for name in MIXED_IN]
    wrong = []

    def work(number):
        rng = np.random.default_rng(number)
        n_good = 0
        bearer = {"authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=service.base, timeout=300, headers=bearer) as client:
            for turn in range(8):
                if turn == 4 or (turn == 1 and number < 2):
                    status = service.raw(hostile[rng.integers(len(hostile))](service))
                    if status is not None and not 400 <= status < 500:
                        wrong.append(status)
                which = rng.integers(len(KINDS))
                if rng.random() < 0.8:
                    answer = client.get("/v1/shapes/zoo%2F" + KINDS[which])
                    good = answer.status_code == 200 and answer.json()["name"].endswith(
                        KINDS[which]
                    )
                else:
                    answer = service.query(scans[which], client=client, n=1)
                    good = answer.status_code == 200 and len(answer.json()["matches"]) == 1
                if not good:
                    wrong.append(answer.text)
                n_good += good
        return n_good

    with ThreadPoolExecutor(16) as threads:
        counts = list(threads.map(work, range(16)))
    assert wrong == []
    assert counts == [8] * 16
    assert metrics_of(service)["eigenshape_queue"] == 0


def test_the_page_shows_matches_with_pictures_and_errors_in_words(service, browser, tmp_path):
    scan, bad = tmp_path / "fish.off", tmp_path / "bad.off"
    es.write_mesh(es.make_creature("fish", 1, n_vertices=500), scan)
    bad.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n")
    ready = "document.querySelector('[data-test=index-facts]').textContent !== ''"
    # A card without a picture says so.
    pictures = (
        "document.querySelectorAll('li').length === 8 && "
        "[...document.querySelectorAll('.stage')].every((each) => each.firstChild)"
    )
    url = f"{service.base}/?token={TOKEN}"
    with open_page(browser, url, ready=ready) as page:
        assert "token" not in page.url
        drop_file(page, "drop", scan)
        wait_until(page, pictures)
        wait_until(page, "[...document.images].every((each) => each.naturalWidth > 0)")
        assert "zoo/fish" in find(page, "match-0").inner_text()
        assert find(page, "match-0").locator("circle").count() > 3
        assert find(page, "scan-picture").locator("circle").count() > 3
        # Names are shown as they are, and never read as HTML.
        assert MARKUP in find(page, "matches").inner_text()
    with open_page(browser, url, ready=ready, dark=True) as page:
        drop_file(page, "drop", scan)
        wait_until(page, pictures)
        page.goto(f"{service.base}/docs")
        wait_until(page, "document.querySelectorAll('article').length >= 7")
    # Chromium itself writes a line for each answer with an error.
    context = browser.new_context()
    page = context.new_page()
    page.goto(url)
    wait_until(page, ready)
    drop_file(page, "drop", bad)
    wait_until(page, "document.querySelector('.status.bad') !== null")
    assert "bad.off could not be described: " in find(page, "status").inner_text()
    context.close()


@pytest.mark.parametrize(
    "token", ["short", "x" * 300, "with spaces in the middle", "semi;colon;" * 3]
)
def test_a_token_must_be_long_and_plain(index, token):
    with pytest.raises(es.InvalidParameterError, match="16 to 256 letters"):
        serve(index.folder, token=token)
    with pytest.raises(es.InvalidParameterError, match="must differ from the token for reading"):
        serve(index.folder, token=TOKEN, write_token=TOKEN)


def test_another_address_takes_permission(index):
    with pytest.raises(es.InvalidParameterError, match="The service listens on this machine alone"):
        serve(index.folder, host="0.0.0.0")


def test_a_folder_without_index_is_refused(tmp_path):
    with pytest.raises(es.StoreError):
        serve(tmp_path)


# The container: its steps, without an engine.

CONTAINERFILE = ROOT / "deploy" / "Containerfile"


def steps_of(text):
    """Return instructions and their arguments, of lines joined at their ends."""
    joined = re.sub(r"\\\n\s*", " ", text)
    lines = [line for line in joined.splitlines() if line and not line.startswith("#")]
    return [tuple(line.split(maxsplit=1)) for line in lines]


def test_the_container_copies_what_there_is_and_installs_as_the_readme_says():
    steps = steps_of(CONTAINERFILE.read_text(encoding="utf-8"))
    assert steps[0] == ("FROM", "docker.io/library/python:3.12-slim")
    copied = set()
    for _, text in [step for step in steps if step[0] == "COPY"]:
        *sources, _target = [word for word in text.split() if not word.startswith("--")]
        for source in sources:
            assert (ROOT / source).exists(), source
            copied.add(source.rstrip("/"))
    # What pip needs to build both packages, of each pyproject.
    assert {"pyproject.toml", "certeig", "README.md", "LICENSE", "src", "studio"} <= copied
    # All of it is let through to the builder, and caches are not.
    lines = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    assert {line[1:] for line in lines if line.startswith("!")} == copied
    caches = {"**/__pycache__", "**/_libraries", "studio/front/node_modules"}
    assert {"*", *caches} <= set(lines)
    runs = " && ".join(text for name, text in steps if name == "RUN")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "pip install -c deploy/constraints.txt ./certeig . ./studio" in runs
    assert "pip install ./certeig . ./studio" in readme
    assert [text for name, text in steps if name == "USER"][-1] not in ("root", "0")
    # Versions are locked, of all packages that the two need.
    locked = (ROOT / "deploy" / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = [line.partition("==")[::2] for line in locked if not line.startswith("#")]
    assert all(pinned for _, pinned in pins)
    names_of_pins = {name.lower().replace("_", "-") for name, _ in pins}
    for project in (ROOT, ROOT / "certeig", ROOT / "studio"):
        needed = tomllib.loads((project / "pyproject.toml").read_text())["project"]["dependencies"]
        needed = {re.match(r"[\w-]+", each)[0].lower().replace("_", "-") for each in needed}
        assert needed - {"certeig", "eigenshape"} <= names_of_pins
    # The user owns the folder under the volume.
    names = [name for name, _ in steps]
    volume = json.loads(dict(steps)["VOLUME"])[0]
    owned = f"install -d -o eigenshape -g eigenshape {volume}"
    assert any(name == "RUN" and owned in text for name, text in steps[: names.index("USER")])
    assert {"EXPOSE", "HEALTHCHECK", "VOLUME"} <= set(names)


def test_the_command_of_the_container_serves_and_is_healthy(index):
    steps = dict(steps_of(CONTAINERFILE.read_text(encoding="utf-8")))
    program, *options = [*json.loads(steps["ENTRYPOINT"]), *json.loads(steps["CMD"])]
    assert program == "eigenshape"
    volume = json.loads(steps["VOLUME"])[0]
    port = steps["EXPOSE"]
    assert options[options.index("--port") + 1] == port
    # Another port and folder than in a container, which has its own; all else is the same.
    options = ["0" if word == port else word.replace(volume, str(index.folder)) for word in options]
    command = [sys.executable, "-m", "eigenshape", *options, "--workers", "1"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        line = process.stdout.readline()
        used = re.fullmatch(r"The service is open at http://\S+:(\d+)/\?token=\S+\n", line)[1]
        health = shlex.split(steps["HEALTHCHECK"].rpartition("CMD ")[2])
        assert health[0] == "python"
        for tried, code in ((used, 0), ("1", 1)):
            check = [sys.executable, *(word.replace(port, tried) for word in health[1:])]
            assert subprocess.run(check, capture_output=True, check=False).returncode == code
    finally:
        process.terminate()
        process.communicate(timeout=60)
    assert process.returncode == 0
