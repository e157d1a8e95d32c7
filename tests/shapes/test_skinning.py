import numpy as np
import pytest

from eigenshape.shapes.creatures import Joints, bend_at_joints, diffuse
from eigenshape.shapes.isosurface import isosurface


def rod(points):
    along = np.clip(points[:, 0], -1, 1)
    return np.linalg.norm(points - along[:, None] * [1.0, 0, 0], axis=1) - 0.2


def two_rods(points):
    """Rods side by side, 0.05 apart, that meet at one end."""
    bridge = (
        np.linalg.norm(
            points - np.clip(points[:, 1], 0, 0.45)[:, None] * [0, 1.0, 0] + [1.0, 0, 0], axis=1
        )
        - 0.2
    )
    return np.minimum(np.minimum(rod(points), rod(points - [0, 0.45, 0])), bridge)


ROD = isosurface(rod, np.array([-1.2, -0.2, -0.2]), np.array([1.2, 0.2, 0.2]), 0.06)


def test_a_step_spreads_to_a_bell_of_the_width_asked_for():
    step = (ROD.vertices[:, :1] > 0).astype(float)
    smooth = diffuse(ROD, np.hstack([step, step]), np.array([0.12, 0.24]))
    x = ROD.vertices[:, 0]
    for column, width in zip(smooth.T, (0.12, 0.24), strict=True):
        before = (x > -0.7) & (x <= 0)
        # From 0 to 1 in the middle of it; a bell of standard deviation s holds s / sqrt(2 pi) before its middle.
        area = np.sum(column[before]) / np.count_nonzero(before) * 0.7
        assert area == pytest.approx(width / np.sqrt(2 * np.pi), rel=0.2)
        assert column.min() > -1e-12
        assert column.max() < 1 + 1e-12


def test_nothing_leaks_to_a_limb_that_is_only_near_in_space():
    mesh = isosurface(two_rods, np.array([-1.3, -0.3, -0.3]), np.array([1.3, 0.75, 0.3]), 0.05)
    x, y, _ = mesh.vertices.T
    share = diffuse(mesh, ((x > 0) & (y < 0.225)).astype(float)[:, None], np.array([0.15]))[:, 0]
    assert share[(x > 0.5) & (y < 0.2)].min() > 0.98
    assert share[(x > -0.5) & (y > 0.25)].max() < 0.02


def test_a_full_share_turns_rigidly_and_none_stays():
    points = np.array([[2.0, 0, 0], [0, 0, 0], [2.0, 0, 0]])
    follows = np.array([[1.0], [1.0], [0.0]])
    joint = Joints(
        np.array([[1.0, 0, 0]]), np.array([[0, 0, 1.0]]), np.array([[-1.0, 1.0]]), follows
    )
    np.testing.assert_allclose(
        bend_at_joints(points, joint, np.array([np.pi / 2])),
        [[1, 1, 0], [1, -1, 0], [2, 0, 0]],
        atol=1e-15,
    )
