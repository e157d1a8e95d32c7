"""Ordinary files that once gave a wrong answer without a word: right now, or named with a remedy that works."""

import shutil
import warnings

import numpy as np
import pytest

import eigenshape as es
from eigenshape.geometry import enclosed_volume, surface_area, vertex_components

pytestmark = pytest.mark.data


@pytest.fixture
def everyday(data):
    return data / "everyday"


@pytest.mark.parametrize(
    ("name", "area"), [("A_prism.obj", 14.0), ("A_dart.off", 1.5), ("I_civet.obj", 22.0)]
)
def test_polygons_cover_their_area(everyday, name, area):
    assert surface_area(es.io.read_surface(everyday / name).mesh) == pytest.approx(area)


def test_a_skin_is_placed_by_its_joints(everyday):
    mesh = es.read_mesh(everyday / "B_skin_below_moved_node.glb")
    np.testing.assert_allclose(
        [mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)], [[0] * 3, [1, 2, 3]]
    )
    assert surface_area(mesh) == pytest.approx(22)


def test_all_instances_are_read(everyday):
    mesh = es.io.read_surface(everyday / "B_three_instances.glb", repair=["weld"]).mesh
    assert vertex_components(mesh)[0] == 3


def test_a_ball_in_utm_is_kept_or_refused(everyday, tmp_path):
    ball = es.read_mesh(everyday / "C_ball_in_utm.ply")
    es.write_mesh(ball, tmp_path / "a.glb")
    back = es.read_mesh(tmp_path / "a.glb")
    assert surface_area(back) == pytest.approx(surface_area(ball), rel=1e-6)
    np.testing.assert_allclose(back.vertices.mean(axis=0), ball.vertices.mean(axis=0), atol=1e-6)
    for name in ("a.stl", "a.gii", "a.surf"):
        with pytest.raises(es.FileFormatError, match=r"Write \.ply, which keeps all digits"):
            es.write_mesh(ball, tmp_path / name)
    es.write_mesh(ball, tmp_path / "a.ply")
    assert np.array_equal(es.read_mesh(tmp_path / "a.ply").vertices, ball.vertices)


def test_a_cavity_is_turned_and_stays(everyday):
    hollow = es.read_mesh(everyday / "D_hollow_ball.off")
    assert "orient" in es.suggest_repairs(hollow)
    turned = es.repair(hollow, ["orient"]).mesh
    assert enclosed_volume(turned) == pytest.approx(28.329, abs=1e-3)


def test_a_seam_open_by_rounding_is_a_seam(everyday):
    assert "weld_seams" in es.suggest_repairs(es.read_mesh(everyday / "E_tube.obj"))
    tube = es.io.read_surface(everyday / "E_tube.obj", repair=["auto"]).mesh
    spectrum = es.solve_spectrum(es.cotangent_laplacian(tube), 3)
    assert spectrum.eigenvalues[1] == pytest.approx(1, rel=1e-3)


def test_each_fingertip_follows(everyday):
    hand = es.read_mesh(everyday / "F_hand.ply")
    height = hand.vertices[:, 1]
    region = np.flatnonzero(height > height.min() + 0.8 * np.ptp(height))
    bent = es.deform(es.rig_shape(hand), region, es.Translation([0.0, 0.0, 0.3]))
    moved = np.linalg.norm(bent.vertices - hand.vertices, axis=1)
    inside = np.isin(hand.faces, region).all(axis=1)
    part, kept = es.geometry.topology.submesh(hand, inside)
    n_tips, tips = vertex_components(part)
    assert n_tips == 4
    most = [moved[kept][tips == tip].max() for tip in range(n_tips)]
    np.testing.assert_allclose(most, 0.3, rtol=0.05)


def test_landmarks_in_another_unit_are_converted_or_refused(everyday, tmp_path):
    folder = tmp_path / "metres"
    shutil.copytree(everyday / "G_metres", folder)
    mesh = es.read_mesh(folder / "h0.ply")
    with pytest.warns(UserWarning, match="its points are in m and were converted to mm"):
        landmarks = es.morphometrics.read_landmarks(folder / "h0.mrk.json")
    nearest = es.geometry.closest_points(mesh, landmarks.points).points
    np.testing.assert_allclose(landmarks.points, nearest, atol=1e-3 * np.ptp(mesh.vertices))


def test_faces_of_four_corners_are_read(everyday):
    assert surface_area(es.read_mesh(everyday / "H_quads.npz")) == pytest.approx(22)
    assert surface_area(es.read_mesh(everyday / "I_lh.orig_quad")) == pytest.approx(2)


def test_left_and_right_hand_are_read_alike(everyday):
    left, right = (es.read_mesh(everyday / f"J_{side}_hand.ply") for side in ("left", "right"))
    assert surface_area(left) == pytest.approx(surface_area(right))


def test_the_volume_of_a_surface_is_kept_or_named(everyday, tmp_path):
    mesh, attributes = es.read_mesh(everyday / "K_lh.white", attributes=True)
    es.write_mesh(mesh, tmp_path / "lh.copy", attributes=attributes)
    assert (
        (tmp_path / "lh.copy").read_bytes().endswith((everyday / "K_lh.white").read_bytes()[-100:])
    )
    with pytest.warns(UserWarning, match=r"does not keep: the place of the volume .*\(c_ras\)"):
        es.write_mesh(mesh, tmp_path / "a.ply", attributes=attributes)


def test_landmark_files_of_others_are_read(everyday):
    read = es.morphometrics.read_specimens
    assert [each.points.shape for each in read(everyday / "M_curves.tps").values()] == [(3, 3)]
    with pytest.warns(UserWarning, match="its last line has no line break"):
        assert list(read(everyday / "M_no_end.tps")) == ["a"]
    with pytest.warns(UserWarning, match="labels that occur again got numbers"):
        (found,) = read(everyday / "M_two_lists.mrk.json").values()
    assert found.names == ("F-1", "F-1 (2)")


def test_small_sentences(everyday, tmp_path):
    with pytest.raises(es.FileFormatError, match=r"buffers\[0\], 'a.bin', is not there"):
        es.read_mesh(everyday / "M_outside.gltf")
    assert es.read_mesh(everyday / "M_parametric.msh").n_faces == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning, match="1 of its 3 points have no vertex"):
            es.io.read_parcellation(everyday / "M_points.label", es.icosphere(1))
