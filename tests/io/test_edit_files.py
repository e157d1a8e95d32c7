import numpy as np
import pytest

from certeig.kit.errors import FileFormatError, InvalidParameterError
from eigenshape.deformation.edits import Edit, Move, mesh_fingerprint
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.region import BoxRegion
from eigenshape.deformation.rig import rig_shape
from eigenshape.deformation.session import replay
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.io.edit_files import read_edits, write_edits
from eigenshape.shapes.surfaces import icosphere

BALL = icosphere(2)
EDITS = [
    Edit(
        (Move(BALL.vertices[:, 2] > 0.5, Rotation([0, 0, 0.5], [1, 1 / 3, 0], 0.7)),), mode="thesis"
    ),
    Edit(
        (
            Move(
                BoxRegion([-np.inf, -np.inf, -9], [np.inf, np.inf, -0.5]),
                Translation([0, 0.1, -1 / 3]),
            ),
        )
    ),
]


def test_edits_from_a_file_give_the_same_vertices_to_the_last_digit(tmp_path):
    write_edits(EDITS, BALL, tmp_path / "edits.json")
    back = read_edits(tmp_path / "edits.json", BALL)
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
    assert read_edits(str(tmp_path / "none.json"), BALL) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "must hold JSON"),
        (b'{"kind": ', "must hold JSON"),
        (b"\xff\xfe", "must hold JSON"),
        (b"[" * 100_000, "must hold JSON"),
        (b"1" * 5000, "must hold JSON"),
        (b"[1, 2]", "Edits must be a JSON object"),
        (
            b'{"kind": "eigenshape edits", "version": 2, "mesh": {"n_vertices": 3, "n_faces": 1, "digest": ""}, '
            b'"edits": [{}]}',
            "Edit 0 cannot be read",
        ),
    ],
)
def test_what_holds_no_edits_is_refused(tmp_path, text, message):
    (tmp_path / "bad.json").write_bytes(text)
    with pytest.raises(FileFormatError, match=message):
        read_edits(tmp_path / "bad.json", BALL)


def test_what_is_not_there_is_said_by_the_system(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_edits(tmp_path / "none.json", BALL)


def test_edits_of_another_mesh_are_refused_and_carried_where_asked(tmp_path):
    """A ball with its vertices in another order has as many: only the digest tells."""
    order = np.random.default_rng(0).permutation(BALL.n_vertices)
    other = TriangleMesh(BALL.vertices[order], np.argsort(order)[BALL.faces])
    write_edits(EDITS, BALL, tmp_path / "edits.json")
    with pytest.raises(
        InvalidParameterError,
        match=r"that has 162 vertices and 320 faces \(\w{8}\), and this mesh has 162 vertices and 320 faces \(\w{8}\)",
    ):
        read_edits(tmp_path / "edits.json", other)
    edits = read_edits(tmp_path / "edits.json", BALL)
    carried = replay(rig_shape(other), edits, source=BALL).edits[0].moves[0].region
    np.testing.assert_array_equal(carried, (BALL.vertices[:, 2] > 0.5)[order])


def test_a_mesh_is_known_by_its_numbers_and_faces():
    found = mesh_fingerprint(BALL)
    assert (found.n_vertices, found.n_faces) == (162, 320)
    negative_zeros = np.where(BALL.vertices == 0, -0.0, BALL.vertices)
    assert found == mesh_fingerprint(TriangleMesh(negative_zeros, BALL.faces))
    assert found != mesh_fingerprint(TriangleMesh(BALL.vertices, BALL.faces[:, [1, 2, 0]]))
    assert found != mesh_fingerprint(TriangleMesh(BALL.vertices * (1 + 1e-15), BALL.faces))
