import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from bent_shapes import lump, lump_rig

from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.deform import deform, move_by_shares
from eigenshape.deformation.edits import Edit, Move
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.region import BoxRegion, BrushRegion
from eigenshape.deformation.rig import rig_shape
from eigenshape.deformation.session import DeformationSession, replay
from eigenshape.deformation.thesis import move_skeleton
from eigenshape.geometry.resolution.subdivision import subdivide

HEAD = np.flatnonzero(lump().vertices[:, 0] > 0.6)
TAIL = lump().vertices[:, 0] < -0.7
TURN, PULL = Rotation([0.6, 0, 0], [0, 1, 2], 0.8), Translation([0, 0.3, 0])


@pytest.fixture
def session():
    return DeformationSession(lump_rig())


def test_a_drag_shows_the_skeleton_and_changes_nothing(session):
    shown = session.drag(HEAD, TURN)
    np.testing.assert_array_equal(shown, move_skeleton(session.response, [TURN]))
    np.testing.assert_array_equal(session.mesh.vertices, lump().vertices)
    assert session.edits == ()


def test_a_commit_bends_as_it_was_dragged_last(session):
    session.drag(HEAD, PULL)
    session.drag(HEAD, TURN, n_modes=40)
    session.commit()
    np.testing.assert_array_equal(
        session.mesh.vertices, deform(lump_rig(), HEAD, TURN, n_modes=40).vertices
    )
    (edit,) = session.edits
    assert (edit.moves[0].handle, edit.n_modes, edit.mode) == (TURN, 40, "graded")


def test_by_the_thesis_if_the_session_is():
    session = DeformationSession(lump_rig(), mode="thesis")
    session.drag(HEAD, TURN)
    expected = deform(lump_rig(), HEAD, TURN, mode="thesis").vertices
    np.testing.assert_array_equal(session.commit().vertices, expected)
    assert session.edits[0].mode == "thesis"


def test_a_preview_moves_by_shares_and_is_nearer_to_the_commit_than_the_skeleton(session):
    skeleton = session.drag(HEAD, TURN)
    shown = session.preview()
    np.testing.assert_array_equal(shown, move_by_shares(session.binding, [TURN]))
    np.testing.assert_array_equal(session.mesh.vertices, lump().vertices)
    bent = session.commit().vertices
    assert np.linalg.norm(shown - bent) < np.linalg.norm(skeleton - bent)


def test_a_commit_in_another_mode_is_an_edit_of_that_mode(session):
    session.drag(HEAD, TURN)
    bent = session.commit(mode="thesis")
    expected = deform(lump_rig(), HEAD, TURN, mode="thesis")
    np.testing.assert_array_equal(bent.vertices, expected.vertices)
    assert [edit.mode for edit in session.edits] == ["thesis"]
    again = replay(lump_rig(), session.edits)
    np.testing.assert_array_equal(again.mesh.vertices, bent.vertices)


def test_undo_and_redo_go_back_and_forth_to_the_last_digit(session):
    poses = [session.mesh.vertices]
    for region, handle in ((HEAD, TURN), (TAIL, PULL), (HEAD, PULL)):
        session.drag(region, handle)
        poses.append(session.commit().vertices)
    for pose in poses[-2::-1]:
        np.testing.assert_array_equal(session.undo().vertices, pose)
    assert (session.n_redoable, len(session.edits)) == (3, 0)
    for pose in poses[1:]:
        np.testing.assert_array_equal(session.redo().vertices, pose)
    assert (session.n_redoable, len(session.edits)) == (0, 3)
    assert len({pose.tobytes() for pose in poses}) == 4


def test_a_new_commit_forgets_what_was_undone(session):
    for handle in (TURN, PULL):
        session.drag(HEAD, handle)
        session.commit()
    session.undo()
    session.drag(TAIL, PULL)
    session.commit()
    assert session.n_redoable == 0
    assert [edit.moves[0].handle for edit in session.edits] == [TURN, PULL]
    assert session.edits[1].moves[0].region.dtype == bool  # the tail's
    with pytest.raises(
        InvalidParameterError, match="There must be an undone edit to redo; there is none"
    ):
        session.redo()


def test_what_is_not_there_cannot_be_done(session):
    with pytest.raises(InvalidParameterError, match="There must be an edit to undo; there is none"):
        session.undo()
    with pytest.raises(InvalidParameterError, match="There must be an undone edit to redo"):
        session.redo()
    for action in (session.commit, lambda: session.response):
        with pytest.raises(InvalidParameterError, match="A region must be dragged first; none is"):
            action()
    with pytest.raises(InvalidParameterError, match=r"n_modes must lie in 1\.\.300; it is 0"):
        session.drag(HEAD, TURN, n_modes=0)


def test_a_drag_that_goes_on_binds_nothing_anew(session):
    box = BoxRegion([0.6, -9, -9], [9, 9, 9])
    session.drag(HEAD, TURN)
    response = session.response
    for again in (HEAD, HEAD.tolist(), lump().vertices[:, 0] > 0.6, box):
        session.drag(again, PULL)
        assert session.response is response
    session.drag(HEAD, PULL, n_modes=30)
    assert session.response is not response
    response = session.response
    session.drag(HEAD, PULL, n_modes=30, fixed=TAIL)
    assert session.response is not response
    session.drag(HEAD[1:], PULL)
    assert session.response.weights.shape == (1, 642, 4)


def test_a_mask_that_changes_between_drags_is_bound_anew_and_the_edit_keeps_the_first(session):
    mask = lump().vertices[:, 0] > 0.6
    session.drag(mask, TURN)
    session.commit()
    response = None
    for _ in range(2):
        session.drag(mask, TURN)
        assert session.response is not response
        response = session.response
        mask[HEAD[:5]] = False
    assert np.sum(session.edits[0].moves[0].region) == len(HEAD)


def test_a_drag_counts_no_more_once_it_is_done_or_dropped(session):
    session.drag(HEAD, TURN)
    session.commit()
    session.drag(HEAD, TURN)
    session.cancel()
    with pytest.raises(InvalidParameterError, match="A region must be dragged first"):
        session.commit()
    for step in (session.undo, session.redo):
        session.drag(HEAD, TURN)
        step()
        with pytest.raises(InvalidParameterError, match="A region must be dragged first"):
            session.commit()


def test_several_regions_are_dragged_at_once(session):
    session.drag_all(Move(region, handle) for region, handle in ((HEAD, TURN), (TAIL, PULL)))
    assert session.response.weights.shape == (2, 642, 4)
    moved = np.abs(session.commit().vertices - lump().vertices).max(axis=1)
    assert (moved[HEAD] > 0).all()
    assert (moved[TAIL] > 0.1).all()


def test_boxes_and_brushes_are_looked_up_where_the_shape_is_now(session):
    session.drag(HEAD, Translation([5, 0, 0]))
    session.commit()
    beyond = BoxRegion([4, -9, -9], [9, 9, 9])
    tip = BrushRegion(session.mesh.vertices[HEAD[0]], 0.2)
    for region in (beyond, tip):
        session.drag(region, PULL)
        session.commit()
    with pytest.raises(InvalidParameterError, match="region 0 holds no vertex"):
        DeformationSession(lump_rig()).drag(beyond, PULL)


def test_replay_does_the_same_to_the_last_digit(session):
    session.drag(HEAD, TURN)
    session.commit()
    session.apply(Edit((Move(TAIL, PULL),), mode="thesis", n_modes=30))
    again = replay(lump_rig(), session.edits)
    np.testing.assert_array_equal(again.mesh.vertices, session.mesh.vertices)
    assert len(again.edits) == 2


def test_replay_on_a_finer_mesh_is_close_to_the_coarse_result():
    mesh = lump(2)
    x = mesh.vertices[:, 0]
    coarse = DeformationSession(rig_shape(mesh))
    for region, handle in ((x > 0.6, TURN), (np.flatnonzero(x < -0.7), PULL)):
        coarse.drag(region, handle)
        coarse.commit()
    finer = replay(rig_shape(subdivide(mesh)), coarse.edits, source=mesh).mesh
    away = np.linalg.norm(finer.vertices[:162] - coarse.mesh.vertices, axis=1)
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    assert finer.n_vertices == 642
    assert away.max() < 0.05 * diagonal
    assert np.median(away) < 0.01 * diagonal


def test_what_four_threads_did_is_what_replay_does(session):
    def change(number):
        for step in range(4):
            lift = Translation([0, 0.02 * (number + 1), 0.01 * step])
            session.apply(Edit((Move(HEAD, lift),)))
            session.undo() if step == 1 else session.drag(TAIL, PULL)

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-4)
    try:
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(change, range(4)))
    finally:
        sys.setswitchinterval(interval)
    assert len(session.edits) == 12
    again = replay(lump_rig(), session.edits)
    np.testing.assert_array_equal(session.mesh.vertices, again.mesh.vertices)
