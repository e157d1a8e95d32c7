import numpy as np
import pytest

from eigenshape._errors import FileFormatError
from eigenshape.deformation.edits import Edit, Move
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.region import Box
from eigenshape.deformation.rig import rig_shape
from eigenshape.deformation.session import replay
from eigenshape.geometry.surfaces import icosphere
from eigenshape.io.edits import read_edits, write_edits

BALL = icosphere(2)
EDITS = [
    Edit((Move(BALL.vertices[:, 2] > 0.5, Rotation([0, 0, 0.5], [1, 1 / 3, 0], 0.7)),), mode="thesis"),
    Edit((Move(Box([-np.inf, -np.inf, -9], [np.inf, np.inf, -0.5]), Translation([0, 0.1, -1 / 3])),)),
]


def test_edits_from_a_file_give_the_same_vertices_to_the_last_digit(tmp_path):
    write_edits(EDITS, BALL, tmp_path / "edits.json")
    n_vertices, back = read_edits(tmp_path / "edits.json")
    assert n_vertices == 162
    rig = rig_shape(BALL)
    one, two = replay(rig, EDITS), replay(rig, back)
    np.testing.assert_array_equal(one.mesh.vertices, two.mesh.vertices)
    assert np.abs(one.mesh.vertices - BALL.vertices).max() > 0.3


def test_the_file_is_plain_json(tmp_path):
    write_edits(EDITS, BALL, tmp_path / "edits.json")
    text = (tmp_path / "edits.json").read_text()
    assert "Infinity" not in text
    assert text.endswith("}\n")
    write_edits([], BALL, str(tmp_path / "none.json"))
    assert read_edits(str(tmp_path / "none.json")) == (162, [])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "must hold JSON"),
        (b'{"kind": ', "must hold JSON"),
        (b"\xff\xfe", "must hold JSON"),
        (b"[" * 100_000, "must hold JSON"),
        (b"1" * 5000, "must hold JSON"),
        (b"[1, 2]", "Edits are kept as a JSON object"),
        (b'{"kind": "eigenshape edits", "version": 1, "n_vertices": 3, "edits": [{}]}', "Edit 0 cannot be read"),
    ],
)
def test_what_holds_no_edits_is_refused(tmp_path, text, message):
    (tmp_path / "bad.json").write_bytes(text)
    with pytest.raises(FileFormatError, match=message):
        read_edits(tmp_path / "bad.json")


def test_what_is_not_there_is_said_by_the_system(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_edits(tmp_path / "none.json")
