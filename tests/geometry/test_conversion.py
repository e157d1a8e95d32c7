from pathlib import Path

import numpy as np
import pytest
import pyvista
import trimesh

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.conversion import as_mesh, as_shape, as_simplicial, from_arrays
from eigenshape.geometry.facets import boundary_surface
from eigenshape.geometry.measure import enclosed_volume
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.repair_steps import weld
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import is_closed
from eigenshape.io.bridges import to_pyvista, to_trimesh
from eigenshape.shapes.domains import box, circle
from eigenshape.shapes.surfaces import icosphere

MESH = icosphere(1)
FLAT = SimplicialMesh([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]])
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    "value",
    [
        MESH,
        to_trimesh(MESH),
        to_pyvista(MESH),
        (MESH.vertices, MESH.faces),
        [MESH.vertices.tolist(), MESH.faces.tolist()],
        SimplicialMesh(MESH.vertices, MESH.faces),
    ],
)
def test_what_is_a_mesh_in_all_but_type(value):
    found = as_mesh(value)
    assert type(found) is TriangleMesh
    np.testing.assert_array_equal(found.vertices, MESH.vertices)
    np.testing.assert_array_equal(found.faces, MESH.faces)


def test_a_shape_stays_what_it_is():
    for shape in (MESH, box(1, 1, 1), PointCloud(MESH.vertices)):
        assert as_shape(shape) is shape
    assert as_simplicial(circle(5)).dim == 1
    assert as_shape((FLAT.points, FLAT.simplices)).dim == 2


@pytest.mark.parametrize(
    ("value", "fact"),
    [
        ("cat.ply", r"it is a str \('cat\.ply'\)\. Pass read_mesh\('cat\.ply'\)\."),
        (Path("cat.ply"), r"it is a PosixPath \('cat\.ply'\)\. Pass read_mesh\('cat\.ply'\)\."),
        (
            PointCloud(MESH.vertices),
            r"it is a PointCloud\. A point cloud has no faces; point_cloud_laplacian\(cloud\)",
        ),
        (box(1, 1, 1), r"it is a SimplicialMesh\. Pass boundary_surface\(mesh\)"),
        (FLAT, r"it is a SimplicialMesh\. Pass TriangleMesh\(numpy\.pad"),
        (
            circle(5),
            r"it is a SimplicialMesh\. cotangent_laplacian\(mesh\) and edge_graph\(mesh\) take",
        ),
        (weld(MESH), r"it is a RepairedMesh\. Pass its attribute mesh\."),
        (MESH.vertices, r"it is an ndarray\. Pass PointCloud\(points, dim=2\) if these are points"),
        (trimesh.Scene(to_trimesh(MESH)), r"it is a Scene\. Pass scene\.to_mesh\(\)"),
        (pyvista.Cube(), r"it is a PolyData\. Pass dataset\.extract_surface\(\)\.triangulate\(\)"),
        (pyvista.PolyData(MESH.vertices), r"it is a PolyData\. .* or from_pyvista\(dataset\)"),
        ((MESH.vertices, None), r"it is a tuple that is a PointCloud\(42 points in R\^3, dim=2\)"),
        (None, r"it is None\. Pass a TriangleMesh, a trimesh\.Trimesh"),
        (3, r"it is an int \(3\)\. Pass a TriangleMesh"),
    ],
)
def test_everything_else_is_refused_by_its_type_with_what_to_pass(value, fact):
    with pytest.raises(InvalidParameterError, match=rf"^before must be a triangle mesh; {fact}"):
        as_mesh(value, "before")


def test_shapes_of_other_kinds_are_refused():
    with pytest.raises(
        InvalidParameterError,
        match=r"mesh must be a mesh; it is a PointCloud\. A point cloud has no faces",
    ):
        as_simplicial(PointCloud(MESH.vertices))
    with pytest.raises(
        InvalidParameterError,
        match=r"mesh must be a mesh; it is a str \('a\.msh'\)\. Pass read_shape",
    ):
        as_simplicial("a.msh")
    with pytest.raises(
        InvalidParameterError,
        match=r"shape must be a mesh or a point cloud; it is None\. Pass a",
    ):
        as_shape(None)


def test_what_the_messages_tell_to_pass_is_a_mesh():
    assert as_mesh(TriangleMesh(np.pad(FLAT.points, ((0, 0), (0, 1))), FLAT.simplices)).n_faces == 1
    assert as_mesh(boundary_surface(box(1, 1, 1))).n_faces == 12
    assert as_mesh(pyvista.Cube().extract_surface(algorithm=None).triangulate()).n_faces == 12
    assert as_mesh(trimesh.Scene(to_trimesh(MESH)).to_mesh()).n_faces == MESH.n_faces
    assert as_mesh(weld(MESH).mesh).n_faces == MESH.n_faces


def test_rows_of_four_indices_must_be_said_to_be_tetrahedra_or_quads():
    with pytest.raises(
        InvalidParameterError,
        match=r"cells must be given for rows of four indices; .*cells='tetrahedra'\) or",
    ):
        from_arrays(SQUARE, [[0, 1, 2, 3]])
    with pytest.raises(InvalidParameterError, match="cells must be given for rows of four"):
        as_mesh((SQUARE, [[0, 1, 2, 3]]))
    quads = from_arrays(SQUARE, [[0, 1, 2, 3]], cells="quads")
    assert isinstance(quads, TriangleMesh)
    assert quads.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    dart = [[0, 0, 0], [0.2, 0.2, 0], [1, 0, 0], [0, 1, 0]]
    cut = from_arrays(dart, [[2, 1, 3, 0]], cells="quads")
    assert es.geometry.surface_area(cut) == pytest.approx(0.2)
    solid = box(1, 2, 1)
    assert from_arrays(solid.points, solid.simplices, cells="tetrahedra").dim == 3
    flat = from_arrays(np.array(SQUARE)[:, :2], [[0, 1, 2, 3]], cells="quads")
    assert (type(flat), flat.dim) == (SimplicialMesh, 2)


def test_cells_are_said_of_rows_of_four_alone():
    with pytest.raises(
        InvalidParameterError,
        match=r"cells must be given only for rows of four indices; cells is 'quads' and rows of",
    ):
        from_arrays(MESH.vertices, MESH.faces, cells="quads")
    with pytest.raises(
        InvalidParameterError, match="cells must be 'tetrahedra' or 'quads'; it is 'prisms'"
    ):
        es.geometry.conversion.from_arrays.__wrapped__(SQUARE, [[0, 1, 2, 3]], cells="prisms")
    with pytest.raises(InvalidShapeError, match="the rows differ in length"):
        from_arrays(SQUARE, [[0, 1, 2, 3], [0, 1, 2]])


@pytest.mark.parametrize("scale", [1.0, 1e-90, 1e90])
def test_the_surface_around_tetrahedra_looks_outward(scale):
    solid = box(3, 2, 4)
    turned = np.where(
        np.arange(len(solid.simplices))[:, None] % 2, solid.simplices, solid.simplices[:, ::-1]
    )
    surface = boundary_surface(SimplicialMesh(scale * solid.points, turned))
    assert is_closed(surface)
    assert enclosed_volume(TriangleMesh(surface.vertices / scale, surface.faces)) == pytest.approx(
        1
    )
    assert surface.n_vertices == 4 * 3 * 5 - 2 * 1 * 3


def test_only_tetrahedra_have_a_surface_around_them():
    with pytest.raises(
        InvalidShapeError,
        match=r"boundary_surface must be given tetrahedra in R\^3; the mesh is a",
    ):
        boundary_surface(MESH)
