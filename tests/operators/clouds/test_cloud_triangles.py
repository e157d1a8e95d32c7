import numpy as np
import pytest
from scipy.spatial import Delaunay

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.operators.clouds.cloud_triangles import cloud_cover, local_triangles
from eigenshape.operators.robust import robust_laplacian
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.solve import solve_spectrum


def test_on_a_plane_they_are_the_delaunay_triangles():
    points = np.random.default_rng(0).random((300, 2))
    flat = np.column_stack([points, np.zeros(300)])
    found = local_triangles(PointCloud(flat, dim=2), n_neighbors=80)
    wanted = {tuple(sorted(row)) for row in Delaunay(points).simplices.tolist()}
    inner = ((points > 0.2) & (points < 0.8)).all(axis=1)
    ours = {tuple(sorted(row)) for row in found[inner[found[:, 0]]].tolist()}
    theirs = {row for row in wanted if inner[list(row)].any()}
    assert ours == theirs


def test_the_operator_is_that_of_the_sphere():
    points = np.array(fibonacci_sphere(2000).vertices)
    laplacian = robust_laplacian(PointCloud(points, dim=2))
    assert laplacian.mass.sum() == pytest.approx(4 * np.pi, rel=2e-3)
    assert solve_spectrum(laplacian, 4).eigenvalues[1:] == pytest.approx(2.0, rel=5e-3)
    off = laplacian.stiffness.tocoo()
    assert off.data[off.row != off.col].max() <= 0


def test_numbers_of_points_do_not_matter():
    points = np.random.default_rng(3).standard_normal((400, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    order = np.random.default_rng(4).permutation(400)
    one = robust_laplacian(PointCloud(points, dim=2))
    two = robust_laplacian(PointCloud(points[order], dim=2))
    assert abs(one.stiffness[order][:, order] - two.stiffness).max() < 1e-9


@pytest.mark.parametrize("scale", [2.0**-200, 2.0**200])
def test_mass_scales_exactly(scale):
    points = np.array(icosphere(2).vertices)
    one, two = (robust_laplacian(PointCloud(factor * points, dim=2)) for factor in (1, scale))
    assert (two.mass.diagonal() == scale**2 * one.mass.diagonal()).all()
    assert abs(two.stiffness - one.stiffness).max() == 0


def test_bad_input_is_named():
    points = np.array(icosphere(1).vertices)
    cloud = PointCloud(points, dim=2)
    with pytest.raises(InvalidShapeError, match="Triangles need points of a surface"):
        local_triangles(PointCloud(points, dim=1))
    with pytest.raises(InvalidShapeError, match="Triangles need at least 4 points"):
        local_triangles(PointCloud(points[:3], dim=2))
    with pytest.raises(InvalidShapeError, match="Points must differ; points 0"):
        local_triangles(PointCloud(np.vstack([points, points[:1]]), dim=2))
    line = np.column_stack([np.arange(9.0), np.zeros(9), np.zeros(9)])
    with pytest.raises(InvalidShapeError, match="points of a cloud must span 2 dimensions"):
        local_triangles(PointCloud(line, dim=2))
    beside = PointCloud(np.vstack([line, [4.0, 9, 0]]), dim=2)
    with pytest.raises(
        InvalidShapeError, match=r"must have a triangle; .* its 3 neighbors .* Try more n_neighbors"
    ):
        local_triangles(beside, n_neighbors=3)
    assert len(local_triangles(beside, n_neighbors=9)) >= 10
    with pytest.raises(InvalidParameterError, match="n_neighbors must lie in 3"):
        robust_laplacian(cloud, n_neighbors=2)
    with pytest.raises(InvalidParameterError, match="n_neighbors must not be given for a mesh"):
        robust_laplacian(icosphere(1), n_neighbors=30)
    with pytest.raises(InvalidParameterError, match="mollify must be positive and finite for"):
        cloud_cover(cloud, 0.0)
