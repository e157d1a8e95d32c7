"""Shapes, a browser, and a tab of the studio that the tests share."""

from contextlib import ExitStack
from functools import cache

import pytest
from browser import build_page, open_page, serve_studio, start_browser, wait_until

import eigenshape as es


def pytest_configure(config):
    """Build the page once, before there are workers of pytest-xdist that would do it side by side."""
    if not hasattr(config, "workerinput"):
        build_page()


def stretched_ball(level=3):
    """Return a closed shape of distinct axes, so that its modes are not multiple."""
    ball = es.icosphere(level)
    return es.TriangleMesh(ball.vertices * [1.0, 1.7, 0.8], ball.faces)


# One browser, and one studio for each shape, which is analyzed once: each page is a tab of its own.


@pytest.fixture(scope="session")
def browser():
    # From now on an event loop runs in this thread, so a test that needs another one starts a thread.
    with start_browser() as started:
        yield started


@pytest.fixture(scope="session")
def studio_of(tmp_path_factory):
    """Return a function that starts a studio with a quadruped of so many vertices, or returns the one that runs."""
    with ExitStack() as running:

        @cache
        def start(n_vertices):
            path = tmp_path_factory.mktemp("shape") / "quadruped.ply"
            es.write_mesh(es.make_creature("quadruped", n_vertices=n_vertices), path)
            return path, running.enter_context(serve_studio(path))

        yield start


@pytest.fixture(scope="module")
def path(request, studio_of):
    """The file of a quadruped with as many vertices as the module of the test says."""
    return studio_of(request.module.N_VERTICES)[0]


@pytest.fixture(scope="module")
def mesh(path):
    return es.read_mesh(path)


@pytest.fixture(scope="module")
def rig(mesh):
    return es.rig_shape(mesh)


@pytest.fixture(scope="module")
def url(request, studio_of):
    return studio_of(request.module.N_VERTICES)[1]


@pytest.fixture
def page(browser, url):
    """A tab of its own, whose shape can be deformed."""
    with open_page(browser, url) as page:
        wait_until(page, "eigenshape.state.deformation.status === 'ready'")
        yield page
