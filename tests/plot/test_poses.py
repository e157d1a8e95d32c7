import numpy as np
import pytest

import eigenshape as es
from eigenshape.plot.sheet import POSES_IN_A_ROW

BALL = es.icosphere(2)
SHARES = (BALL.vertices[:, 2] + 1) / 2


def twice(mesh):
    return es.TriangleMesh(2 * mesh.vertices, mesh.faces)


def pictures(figure, count):
    return [
        np.asarray(axes.get_images()[0].get_array(), dtype=float) for axes in figure.axes[:count]
    ]


def drawn_width(picture):
    """Columns that are not all as the first one."""
    away = np.abs(picture - picture[:1, :1]).max(axis=(0, 2)) > 1e-3
    return np.ptp(np.flatnonzero(away)) + 1


@pytest.mark.long
def test_each_pose_has_its_title_and_one_bar_serves_all(tmp_path):
    figure = es.plot.figure_poses({"rest": BALL, "grown": twice(BALL)}, SHARES)
    assert [axes.get_title() for axes in figure.axes[:2]] == ["rest", "grown"]
    assert figure.axes[-1].get_ylabel() == "share of the motion"
    es.save_figure(figure, tmp_path / "poses.png")


@pytest.mark.long
def test_a_pose_twice_as_large_looks_twice_as_large():
    one, two = pictures(es.plot.figure_poses({"rest": BALL, "grown": twice(BALL)}, SHARES), 2)
    assert one.shape == two.shape
    assert drawn_width(two) / drawn_width(one) == pytest.approx(2, rel=0.05)


@pytest.mark.long
def test_more_poses_than_columns_go_on_in_another_row():
    poses = {f"pose {number}": BALL for number in range(POSES_IN_A_ROW + 1)}
    figure = es.plot.figure_poses(poses, SHARES)
    titles = [axes.get_title() for axes in figure.axes[: POSES_IN_A_ROW + 1]]
    assert titles == list(poses)
    first, last = pictures(figure, POSES_IN_A_ROW + 1)[::POSES_IN_A_ROW]
    np.testing.assert_array_equal(first, last)


@pytest.mark.long
def test_what_moves_more_is_redder():
    cold, warm = (
        pictures(es.plot.figure_poses({"": BALL}, np.full(162, share)), 1)[0]
        for share in (0.0, 1.0)
    )
    seen = np.abs(cold - warm).max(axis=2) > 1e-3
    assert seen.any()
    gray, red = (np.mean(picture[seen], axis=0) for picture in (cold, warm))
    assert np.ptp(gray[:3]) < 0.05 * gray[:3].max()
    assert red[0] > 1.5 * red[2]


@pytest.mark.long
def test_poses_may_be_meshes_of_several_sizes_but_shares_belong_to_one():
    finer = es.icosphere(3)
    figure = es.plot.figure_poses({"coarse": BALL, "fine": finer})
    assert [axes.get_title() for axes in figure.axes] == ["coarse", "fine"]
    with pytest.raises(es.InvalidParameterError, match=r"shares .* per vertex, shape \(642,\)"):
        es.plot.figure_poses({"coarse": BALL, "fine": finer}, SHARES)
    with pytest.raises(es.InvalidParameterError, match="at least one mesh"):
        es.plot.figure_poses({})
