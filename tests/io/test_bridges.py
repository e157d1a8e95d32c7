import sys

import numpy as np
import pytest
import pyvista
import trimesh

from eigenshape._errors import InvalidShapeError, MissingExtraError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import from_arrays
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io.bridges import from_pyvista, from_trimesh, to_pyvista, to_trimesh
from eigenshape.shapes.domains import box, circle, interval
from eigenshape.shapes.spheres import projective_plane
from eigenshape.shapes.surfaces import icosphere


def same(one, two):
    assert type(one) is type(two)
    np.testing.assert_array_equal(one.points, two.points)
    if not isinstance(one, PointCloud):
        np.testing.assert_array_equal(one.simplices, two.simplices)


@pytest.mark.parametrize(
    "shape",
    [
        icosphere(1),
        box(1, 2, 1),
        interval(4),
        projective_plane(1),
        PointCloud(icosphere(1).vertices),
    ],
)
def test_arrays_there_and_back(shape):
    points = shape.points.copy()
    simplices = None if isinstance(shape, PointCloud) else shape.simplices
    same(
        from_arrays(
            points, simplices, cells="tetrahedra" if np.shape(simplices)[1:] == (4,) else None
        ),
        shape,
    )
    points[0] = 7
    assert shape.points[0, 0] != 7


def test_trimesh_there_and_back():
    seam = TriangleMesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [5, 5, 5]], [[0, 1, 2], [3, 1, 2]]
    )
    for shape in (icosphere(1), seam, PointCloud(icosphere(1).vertices)):
        same(from_trimesh(to_trimesh(shape)), shape)  # nothing is merged or dropped
    assert isinstance(to_trimesh(seam), trimesh.Trimesh)


@pytest.mark.parametrize("shape", [icosphere(1), box(1, 2, 1), PointCloud(icosphere(1).vertices)])
def test_pyvista_there_and_back(shape):
    same(from_pyvista(to_pyvista(shape)), shape)


def test_curves_and_flat_shapes_in_pyvista():
    found = from_pyvista(to_pyvista(circle(5)))
    assert isinstance(found, SimplicialMesh)
    assert (found.dim, found.points.shape) == (1, (5, 3))
    assert not found.points[:, 2].any()


def test_what_does_not_fit_is_refused():
    with pytest.raises(
        InvalidShapeError, match=r"trimesh holds triangle meshes and point clouds in R\^3"
    ):
        to_trimesh(box(1, 1, 1))
    with pytest.raises(
        InvalidShapeError,
        match=r"PyVista holds shapes in up to three dimensions; this shape lies in R\^5",
    ):
        to_pyvista(projective_plane(1))
    with pytest.raises(
        InvalidShapeError, match="mesh must be a Trimesh or a PointCloud of trimesh; it is a list"
    ):
        from_trimesh([])
    with pytest.raises(
        InvalidShapeError, match="dataset must be a PolyData or an UnstructuredGrid; it is a list"
    ):
        from_pyvista([])
    angles = np.arange(5) * 2 * np.pi / 5
    ring = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = np.vstack([ring, ring])
    points[5:, 2] = 1
    prism = pyvista.UnstructuredGrid([10, *range(10)], [15], points)
    with pytest.raises(InvalidShapeError, match=r"simplices, .*; it holds pentagonal prism"):
        from_pyvista(prism)
    surface = prism.extract_surface(algorithm="dataset_surface")
    assert from_pyvista(surface).n_faces == 2 * 3 + 5 * 2  # the remedy


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(
        MissingExtraError, match=r"trimesh must be installed; .* pip install 'eigenshape\[bridges\]"
    ):
        to_trimesh(icosphere(1))


def test_polylines_of_pyvista_become_segments():
    found = from_pyvista(pyvista.Line(resolution=3))
    assert isinstance(found, SimplicialMesh)
    assert found.simplices.tolist() == [[0, 1], [1, 2], [2, 3]]
    two = from_pyvista(pyvista.PolyData(np.eye(3), lines=[2, 2, 0, 3, 0, 1, 2]))
    assert two.simplices.tolist() == [[2, 0], [0, 1], [1, 2]]


def test_strips_polygons_and_voxels_of_pyvista_are_split():
    sphere = pyvista.Sphere()
    strips = from_pyvista(sphere.strip())
    assert isinstance(strips, TriangleMesh)
    rows = [
        np.sort(np.sort(faces, axis=1), axis=0)
        for faces in (strips.faces, from_pyvista(sphere).faces)
    ]
    np.testing.assert_array_equal(*rows)
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 0.5, 0]])
    assert from_pyvista(pyvista.PolyData(square, [5, *range(5)])).n_faces == 3
    assert from_pyvista(pyvista.PolyData(square, [4, *range(4)])).faces.tolist() == [
        [0, 1, 2],
        [0, 2, 3],
    ]
    with pytest.warns(UserWarning, match="1 hexahedra were split into 6 tetrahedra"):
        cube = from_pyvista(pyvista.ImageData(dimensions=(2, 2, 2)).cast_to_unstructured_grid())
    assert cube.simplices.shape == (6, 4)
    corners = cube.points[cube.simplices]
    assert np.isclose(np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6, 1)


def test_curved_cells_of_pyvista_are_read_by_their_corners():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0.0]])
    grid = pyvista.UnstructuredGrid([6, *range(6)], [22], points)
    with pytest.warns(UserWarning, match=r"by their corners \(1\), .* left out \(3\)"):
        assert from_pyvista(grid).faces.tolist() == [[0, 1, 2]]
