"""Real files read as shapes of any kind; counts were taken from headers and by counting lines."""

import time

import pytest
from test_real_files import MESHES, REFUSED

from certeig.kit.errors import CerteigError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.simplices import simplex_volumes
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.io.shape_files import read_shape

pytestmark = pytest.mark.data

CLOUDS = {
    "openmesh/pointCloudBadEncoding.ply": 10,
    "openmesh/pointCloudGoodEncoding.ply": 10,
    "trimesh/face_in_group_name.obj": 1,
    "trimesh/obj_points.obj": 8,
    "trimesh/ply_points_ascii.ply": 8,
    "trimesh/ply_points_bin.ply": 8,
    "trimesh/points_ascii.ply": 5,
    "trimesh/points_ascii_with_lists.ply": 5,
    "trimesh/points_bin.ply": 5,
    "trimesh/points_emptyface.ply": 1024,
}
CURVES = {"trimesh/obj_wireframe.obj": (8, 12)}
PLANES = {
    "pymesh/polygon.obj": (8, 6),
    "pymesh/quad.obj": (4, 2),
    "pymesh/quad_s1.obj": (9, 8),
    "pymesh/square_2D.obj": (4, 2),
}
SIMPLICIAL = {
    "bunny.mesh": (5433, 34055, 3),
    "octopus-low.mesh": (452, 1140, 3),
    "sphere.mesh": (4505, 24013, 3),
    "track1.binary.vtk": (16267, 16266, 1),
}
SCANS = {
    "bunny16k.pts": 16130,
    "chameleon4k.pts": 4594,
    "fragment_000.ply": 5028,
    "milk.pcd": 12575,
}


@pytest.mark.filterwarnings("ignore:.*are not read")
def test_every_awkward_file_is_a_shape_or_a_named_error_soon(data, capfd):
    read_shape(data / "nasty" / "pymesh" / "polygon.obj")  # loads the kernel that cuts polygons
    for name in MESHES.keys() | REFUSED.keys():
        start = time.perf_counter()
        try:
            shape = read_shape(data / "nasty" / name)
        except CerteigError as error:
            assert name in REFUSED.keys() - (CLOUDS | CURVES | PLANES).keys(), name
            assert name in str(error)  # noqa: PT017 - either way the outcome is checked
        else:
            counts = (
                (shape.n_points, *shape.simplices.shape[:1])
                if not isinstance(shape, PointCloud)
                else None
            )
            if name in MESHES:
                assert isinstance(shape, TriangleMesh), name
            assert counts == (MESHES | CURVES | PLANES).get(name), name
            assert counts or shape.n_points == CLOUDS[name], name
        assert time.perf_counter() - start < 1, name
    assert capfd.readouterr() == ("", "")


def test_tetrahedra_and_curves(data):
    for name, counts in SIMPLICIAL.items():
        shape = read_shape(data / "tets" / name)
        assert isinstance(shape, SimplicialMesh)
        assert (shape.n_points, shape.n_simplices, shape.dim) == counts, name
    with pytest.warns(UserWarning, match="6,816 hexahedra were split into 40,896 tetrahedra"):
        solid = read_shape(data / "tets" / "ellipsoid.mesh")
    assert solid.n_simplices == 6 * 6816
    assert enclosed_volume(boundary_surface(solid)) == pytest.approx(simplex_volumes(solid).sum())


@pytest.mark.filterwarnings("ignore:.*are not read")
def test_scans(data):
    for name, n_points in SCANS.items():
        shape = read_shape(data / "points" / name)
        assert isinstance(shape, PointCloud)
        assert shape.n_points == n_points, name
