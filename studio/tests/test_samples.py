"""What stands there before a file is opened, and which way up shapes are remembered to stand."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape_studio.opening import open_workspace
from eigenshape_studio.shape.samples import SAMPLES
from eigenshape_studio.shape.sides import sides_file
from eigenshape_studio.tab.workspace import Workspace
from eigenshape_studio.wire import decode, encode


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def finish(workspace, **change):
    answer = workspace.answer("finish", encode(change))
    return answer.status, decode(answer.message)[0]


def test_samples_are_offered_where_no_file_was_opened():
    workspace = open_workspace()
    assert workspace.state()["samples"] == list(SAMPLES)
    png = workspace.array("sample/hand").tobytes()
    assert png.startswith(b"\x89PNG")
    status, answer = finish(workspace, kind="open", sample="hand")
    assert (status, answer["state"]["name"]) == (200, "hand")
    status, answer = finish(workspace, kind="open", sample="snake")
    assert status == 400
    assert answer["error"]["message"].startswith("A sample must be one of quadruped, biped, hand")
    workspace.close()
    other = Workspace(es.icosphere(1))
    assert other.state()["samples"] == []
    other.close()


def test_a_corrected_side_is_remembered_for_the_mesh_alone():
    ball = es.icosphere(2)
    workspace = Workspace(ball)
    status, answer = finish(workspace, kind="face", up=[1.0, 0.0, 0.0], towards=[0.0, 1.0, 0.0])
    assert status == 200
    assert answer["state"]["up"] == pytest.approx([1, 0, 0])
    status, answer = finish(workspace, kind="face", up="w")
    assert (status, answer["error"]["kind"]) == (400, "InvalidParameterError")
    workspace.close()
    for mesh, up in ((ball, [1, 0, 0]), (es.icosphere(1), [0, 1, 0])):
        again = Workspace(mesh)
        assert again.state()["up"] == pytest.approx(up)
        again.close()
    requested = Workspace(ball)
    requested.analysis.look_from("auto", "z")
    assert requested.state()["up"] == pytest.approx([0, 0, 1])
    requested.close()


@pytest.mark.parametrize("text", ["", "[1]", "{broken"])
def test_a_spoiled_file_of_sides_is_ignored(text):
    sides_file().parent.mkdir(parents=True, exist_ok=True)
    sides_file().write_text(text)
    workspace = Workspace(es.icosphere(1))
    np.testing.assert_allclose(workspace.state()["up"], [0, 1, 0], atol=1e-12)
    workspace.close()
