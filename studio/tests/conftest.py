"""Shapes, a browser, and a tab of the studio that the tests share."""

import pytest
from browser import build_page, open_page, serve_studio, start_browser, wait_until

import eigenshape as es

N_VERTICES = 1000  # of the quadruped


def pytest_configure(config):
    """Build the page once, before there are workers of pytest-xdist that would do it side by side."""
    if not hasattr(config, "workerinput"):
        build_page()


def stretched_ball(level=3):
    """Return a closed shape of distinct axes, so that its modes are not multiple."""
    ball = es.icosphere(level)
    return es.TriangleMesh(ball.vertices * [1.0, 1.7, 0.8], ball.faces)


# One browser, and one studio whose shape is analyzed once: each page is a tab of its own there.


@pytest.fixture(scope="session")
def browser():
    # From now on an event loop runs in this thread, so a test that needs another one starts a thread.
    with start_browser() as started:
        yield started


@pytest.fixture(scope="session")
def path(tmp_path_factory):
    """The file of a quadruped."""
    path = tmp_path_factory.mktemp("shape") / "quadruped.ply"
    es.write_mesh(es.make_creature("quadruped", n_vertices=N_VERTICES), path)
    return path


@pytest.fixture(scope="session")
def mesh(path):
    return es.read_mesh(path)


@pytest.fixture(scope="session")
def rig(mesh):
    return es.rig_shape(mesh)


@pytest.fixture(scope="session")
def url(path):
    with serve_studio(path) as url:
        yield url


@pytest.fixture
def page(browser, url):
    """A tab of its own, whose shape can be deformed."""
    with open_page(browser, url) as page:
        wait_until(page, "eigenshape.state.deformation.status === 'ready'")
        yield page
