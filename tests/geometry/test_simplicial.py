import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.shapes.surfaces import grid

CUBE = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]


def test_a_tetrahedron():
    mesh = SimplicialMesh(CUBE, [[0, 1, 2, 3]])
    assert (mesh.n_points, mesh.n_simplices, mesh.dim) == (4, 1, 3)
    assert repr(mesh) == "SimplicialMesh(4 points in R^3, 1 simplices of dimension 3)"
    for array in (mesh.points, mesh.simplices):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_a_triangle_mesh_has_the_same_names():
    mesh = grid(2, 2)
    assert mesh.points is mesh.vertices
    assert mesh.simplices is mesh.faces
    assert (mesh.n_points, mesh.dim) == (9, 2)


@pytest.mark.parametrize(
    ("points", "simplices", "match"),
    [
        ([], [[0, 1]], "A mesh must have points; it has none"),
        (CUBE, [], "A mesh must have simplices; it has 4 points and no simplex"),
        (
            CUBE,
            [[0], [1]],
            r"Simplices in R\^3 must have dimension 1\.\.3; these have 1 corners, which is dimension 0",
        ),
        (
            [[0.0, 0], [1, 0], [0, 1], [1, 1]],
            [[0, 1, 2, 3]],
            r"in R\^2 must have dimension 1\.\.2; these have 4 corners",
        ),
        (CUBE, [[0, 1], [2, 4]], r"simplices must index points 0\.\.3; simplex 1 is \[2, 4\]"),
        (CUBE, [[0, 1], [2]], r"simplices must have shape \(n, d\); the rows differ in length"),
        (CUBE, [[0, 1.5]], r"simplices must be whole numbers; simplex 0 is \[0.0, 1.5\]"),
        ([[0.0, 1], [np.nan, 2]], [[0, 1]], r"points must be finite; point 1 is \[nan, 2.0\]"),
        ([1.0, 2.0], [[0, 1]], r"points must have shape \(n, d\); the shape is \(2,\)"),
    ],
)
def test_what_is_no_mesh_is_refused(points, simplices, match):
    with pytest.raises(InvalidShapeError, match=match):
        SimplicialMesh(points, simplices)


def test_a_cloud():
    cloud = PointCloud(CUBE)
    assert (cloud.n_points, cloud.dim, repr(cloud)) == (4, 2, "PointCloud(4 points in R^3, dim=2)")


def test_a_cloud_needs_points():
    with pytest.raises(InvalidShapeError, match="A point cloud must have points; it has none"):
        PointCloud([])


@pytest.mark.parametrize("dim", [0, 4])
def test_a_cloud_cannot_be_larger_than_the_space_around_it(dim):
    with pytest.raises(InvalidParameterError, match=rf"dim must lie in 1\.\.3; it is {dim}"):
        PointCloud(CUBE, dim)
