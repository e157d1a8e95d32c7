"""Shapes, a browser, and a tab of the studio that the tests share."""

import pytest
from browser import open_page, serve_studio, start_browser, wait_until

import eigenshape as es


def stretched_ball(level=3):
    """Return a closed shape of distinct axes, so that its modes are not multiple."""
    ball = es.icosphere(level)
    return es.TriangleMesh(ball.vertices * [1.0, 1.7, 0.8], ball.faces)


@pytest.fixture(scope="module")
def browser():
    # Not for the whole session: an event loop runs in this thread while the browser is open.
    with start_browser() as started:
        yield started


@pytest.fixture(scope="module")
def path(request, tmp_path_factory):
    """The file of a quadruped with as many vertices as the module of the test says."""
    path = tmp_path_factory.mktemp("shape") / "quadruped.ply"
    es.write_mesh(es.make_creature("quadruped", n_vertices=request.module.N_VERTICES), path)
    return path


@pytest.fixture(scope="module")
def mesh(path):
    return es.read_mesh(path)


@pytest.fixture(scope="module")
def rig(mesh):
    return es.rig_shape(mesh)


@pytest.fixture(scope="module")
def url(path):
    with serve_studio(path) as url:
        yield url


@pytest.fixture
def page(browser, url):
    """A tab of its own, whose shape can be deformed."""
    with open_page(browser, url) as page:
        wait_until(page, "eigenshape.state.deformation.status === 'ready'")
        yield page
