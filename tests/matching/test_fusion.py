"""Scans of one shape: where they fit together, and the surface of all."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.matching.fusion import LEAST_SCORE, _meshes_of
from eigenshape.matching.registration import Registration

VIEWS = ([0, 0, 1], [0.6, 0, 1], [1, 0.1, 0.6])


@pytest.fixture(scope="module")
def whole():
    return es.make_creature("quadruped", n_vertices=4000)


@pytest.fixture(scope="module")
def motions():
    rng = np.random.default_rng(0)
    return [
        Registration(Rotation.random(rng=rng).as_matrix(), 5 * rng.standard_normal(3), 1.0)
        for _ in VIEWS
    ]


@pytest.fixture(scope="module")
def frames(whole, motions):
    found = []
    for number, view in enumerate(VIEWS):
        scan = es.scans.simulate_scan(whole, np.random.default_rng(number), view=view).mesh
        found.append(es.TriangleMesh(motions[number].move(scan.vertices), scan.faces))
    return found


@pytest.mark.long
def test_a_frame_is_placed_on_the_next(frames, motions, whole):
    found = es.matching.register_scans(frames[0], frames[1])
    assert found.score > LEAST_SCORE
    truth = motions[1].after(motions[0].inverse())
    error = found.move(frames[0].vertices) - truth.move(frames[0].vertices)
    size = np.ptp(whole.vertices, axis=0).max()
    assert np.linalg.norm(error, axis=1).mean() < 0.01 * size
    assert np.linalg.det(found.rotation) == pytest.approx(1)
    there_and_back = found.inverse().move(found.move(frames[0].vertices))
    assert there_and_back == pytest.approx(frames[0].vertices)


@pytest.mark.long
def test_motions_do_not_depend_on_unit_or_place(frames):
    small = [es.TriangleMesh(1e-6 * mesh.vertices + 3e-3, mesh.faces) for mesh in frames[:2]]
    one, two = es.matching.register_scans(*frames[:2]), es.matching.register_scans(*small)
    assert two.score == pytest.approx(one.score, abs=0.05)
    assert two.rotation == pytest.approx(one.rotation, abs=0.01)


@pytest.mark.long
def test_frames_become_one_surface_and_what_fits_nowhere_is_left_out(frames, motions, whole):
    stranger = es.TriangleMesh(es.icosphere(4).vertices + 9, es.icosphere(4).faces)
    fused = es.matching.fuse_scans([*frames, stranger])
    assert fused.joined.tolist() == [True, True, True, False]
    assert fused.motions[3] is None
    assert fused.scores == pytest.approx(fused.scores.T)
    assert fused.scores[:3, 3].max() < LEAST_SCORE
    back = motions[0].inverse().move(fused.mesh.vertices)
    near = es.geometry.closest_points(whole, back).points
    size = np.ptp(whole.vertices, axis=0).max()
    assert np.linalg.norm(near - back, axis=1).mean() < 0.01 * size
    # It shows more of the whole than any frame does. Areas would not tell: noise adds to those of frames.
    shown = [
        es.TriangleMesh(motion.inverse().move(frame.vertices), frame.faces)
        for motion, frame in zip(motions, frames, strict=True)
    ]
    shares = []
    for mesh in (*shown, es.TriangleMesh(back, fused.mesh.faces)):
        gaps = es.geometry.closest_points(mesh, whole.vertices).points - whole.vertices
        shares.append((np.linalg.norm(gaps, axis=1) < 0.02 * size).mean())
    assert shares[3] > 1.1 * max(shares[:3])
    assert set(fused.source_scans.tolist()) == {0, 1, 2}
    for number, frame in enumerate(frames):
        own = fused.source_scans == number
        placed = fused.motions[number].move(frame.vertices[fused.source_vertices[own]])
        gaps = np.linalg.norm(placed - fused.mesh.vertices[own], axis=1)
        assert np.median(gaps) < 0.02 * size


@pytest.mark.long
def test_scans_of_two_poses_become_one_surface_in_the_pose_of_the_first():
    poses = [es.make_creature("quadruped", pose, n_vertices=3000) for pose in (0, 3)]
    low, high = np.quantile(poses[0].vertices[:, 0], [0.2, 0.8])
    heights = poses[0].vertices[:, 0]
    scans = []
    for pose, kept in zip(poses, (heights < high, heights > low), strict=True):
        faces = pose.faces[kept[pose.faces].all(axis=1)]
        scans.append(es.repair(es.TriangleMesh(pose.vertices, faces), ["drop_unreferenced"]).mesh)
    fused = es.matching.fuse_scans(scans)
    assert fused.joined.tolist() == [True, True]
    assert fused.motions[1] is None
    assert set(fused.source_scans.tolist()) == {0, 1}
    whole, first, both = map(es.geometry.surface_area, (poses[0], scans[0], fused.mesh))
    assert both > 1.05 * first  # what the second scan adds is a fifth of the whole
    near = es.geometry.closest_points(fused.mesh, poses[0].vertices).points
    away = np.linalg.norm(near - poses[0].vertices, axis=1)
    # What only the second scan shows stands in another pose, bent by as little as possible.
    assert away[heights < high].mean() < 0.01 * np.sqrt(whole)
    assert away.mean() < 0.04 * np.sqrt(whole)


@pytest.mark.long
def test_one_scan_is_its_own_surface_and_none_is_refused(frames):
    fused = es.matching.fuse_scans(frames[:1])
    assert fused.joined.tolist() == [True]
    assert fused.motions[0].rotation == pytest.approx(np.eye(3))
    with pytest.raises(es.InvalidParameterError, match="scans must hold at least one scan; it is"):
        es.matching.fuse_scans([])
    with pytest.raises(es.InvalidParameterError, match="scans must be a list of meshes; it is a T"):
        _meshes_of(frames[0])
