"""Small real meshes, awkward ones first: each bend is finite or refused by name."""

import numpy as np
import pytest

from certeig.kit.errors import CerteigError, InvalidParameterError
from eigenshape.deformation.deform import deform
from eigenshape.deformation.handles import Rotation
from eigenshape.deformation.rig import rig_shape
from eigenshape.geometry.topology import boundary_edges
from eigenshape.io.mesh_files import read_mesh

# Two of the files have seams, which are named: see `test_seams_are_named`.
pytestmark = [pytest.mark.data, pytest.mark.filterwarnings("ignore:Both sides of a seam")]

MESHES = [  # several components, boundary loops, non-manifold edges, four vertices
    "geometrycentral/platonic_shelf.obj",
    "geometrycentral/fan3.obj",
    "geometrycentral/moebius.obj",
    "geometrycentral/hourglass_ico.obj",
    "geometrycentral/tet.obj",
    "geometrycentral/fox.ply",
    "trimesh/cubevt.obj",
    "trimesh/not_convex.obj",
]


def regions(mesh):
    along = mesh.vertices[:, int(np.argmax(np.ptp(mesh.vertices, axis=0)))]
    numbers = np.arange(mesh.n_vertices)
    return [
        along > np.median(along),
        numbers % 2 == 0,
        numbers == 0,
        np.unique(boundary_edges(mesh)).astype(int),
    ]


@pytest.mark.parametrize("mode", ["graded", "thesis"])
@pytest.mark.parametrize("name", MESHES)
def test_each_bend_is_finite_or_refused_by_name(name, mode, data):
    mesh = read_mesh(data / "nasty" / name)
    rig, bent = rig_shape(mesh), 0
    for region in regions(mesh):
        try:
            found = deform(
                rig, region, Rotation(mesh.vertices.mean(axis=0), [1, 2, 3], 1.0), mode=mode
            )
        except CerteigError:
            continue
        assert np.isfinite(found.vertices).all()
        bent += 1
    assert bent >= 1


@pytest.mark.parametrize("name", ["trimesh/cubevt.obj", "trimesh/not_convex.obj"])
def test_loose_parts_that_nothing_holds_are_refused(name, data):
    mesh = read_mesh(data / "nasty" / name)
    rig = rig_shape(mesh)
    first = np.flatnonzero(rig.components == 0)
    with pytest.raises(
        InvalidParameterError, match="Each component must have a vertex that is fixed"
    ):
        deform(rig, first[:1], Rotation([0, 0, 0], [0, 0, 1], 1.0), fixed=first[1:])
