"""Shapes and calls that the tests share."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape_studio.wire import decode, encode
from eigenshape_studio.workspace import Workspace


def stretched_ball(level=3):
    """Return a closed shape of distinct axes, so that its modes are not multiple."""
    ball = es.icosphere(level)
    return es.TriangleMesh(ball.vertices * [1.0, 1.7, 0.8], ball.faces)


class Page:
    """What a page does: calls a workspace by messages."""

    def __init__(self, workspace):
        self.workspace = workspace

    def call(self, name, meta=None, /, _arrays=None, **more):
        answer = self.workspace.answer(name, encode((meta or {}) | more, _arrays))
        found, arrays = decode(answer.message)
        assert answer.status == 200, found
        return found, arrays

    def error(self, name, meta=None, /, _arrays=None, **more):
        answer = self.workspace.answer(name, encode((meta or {}) | more, _arrays))
        found, arrays = decode(answer.message)
        assert answer.status == 400, found
        assert not arrays
        return found["error"]

    def array(self, name, **more):
        return self.call("array", name=name, **more)[1][name]


@pytest.fixture(scope="session")
def ball_workspace():
    workspace = Workspace(stretched_ball(), "ball.ply", shared=True)
    assert workspace.analysis.rig.wait(120)
    assert workspace.analysis.health.wait(120)
    return workspace


@pytest.fixture
def page(ball_workspace):
    """Return a page of a tab of its own; the modes are computed once."""
    return Page(ball_workspace.fork())


@pytest.fixture
def top(page):
    return np.flatnonzero(page.workspace.mesh.vertices[:, 1] > 0.9).astype("<u4")
