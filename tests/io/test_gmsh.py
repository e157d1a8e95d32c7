"""Gmsh files of all versions: curved elements, parametric nodes, and what a shape does not keep."""

import meshio
import numpy as np
import pytest

from eigenshape import FileFormatError, TriangleMesh, read_mesh, read_shape

# Two triangles of second order with a common side: corners 1 2 3 4, points between 5 to 9
CURVED = (
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9\n5 0.5 0 0\n1 0 0 0\n2 1 0 0\n6 0.5 0.5 0\n"
    "3 0 1 0\n7 0 0.5 0\n4 1 1 0\n8 1 0.5 0\n9 0.5 1 0\n$EndNodes\n"
    "$Elements\n2\n1 9 2 0 1 1 2 3 5 6 7\n2 9 2 0 1 2 4 3 8 9 6\n$EndElements\n"
)
PARAMETRIC = {
    "2.2": "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$ParametricNodes\n3\n1 0 0 0 0 1\n2 1 0 0 1 1 0.5\n"
    "3 0 1 0 2 1 0 1\n$EndParametricNodes\n$Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n",
    "4.0": "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Nodes\n2 3\n1 1 1 1\n2 1 0 0 0.5\n1 2 1 2\n"
    "1 0 0 0 7 8\n3 0 1 0 0 1\n$EndNodes\n$Elements\n1 1\n1 2 2 1\n1 1 2 3\n$EndElements\n",
    "4.1": "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 3 1 3\n1 1 1 1\n2\n1 0 0 0.5\n2 1 1 2\n"
    "1\n3\n0 0 0 7 8\n0 1 0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n2 1 2 1\n1 1 2 3\n$EndElements\n",
}


def test_curved_triangles_are_read_by_their_corners(tmp_path):
    (tmp_path / "a.msh").write_text(CURVED)
    with pytest.warns(
        UserWarning, match=r"a\.msh: cells with curved sides .* corners \(2\), .* left out \(5\)"
    ):
        mesh = read_mesh(tmp_path / "a.msh")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2]]


def test_a_point_between_corners_that_is_a_corner_elsewhere_stays(tmp_path):
    # A straight triangle stands on half of a curved side.
    text = CURVED.replace("$Elements\n2\n", "$Elements\n3\n3 2 2 0 1 1 5 7\n")
    (tmp_path / "a.msh").write_text(text)
    with pytest.warns(UserWarning, match=r"left out \(3\)"):
        mesh = read_mesh(tmp_path / "a.msh")
    assert mesh.n_vertices == 6
    corners = mesh.vertices[mesh.faces].tolist()
    assert [[0, 0, 0], [0.5, 0, 0], [0, 0.5, 0]] in corners


@pytest.mark.parametrize("version", PARAMETRIC)
def test_places_on_curves_and_surfaces_are_passed_over(tmp_path, version):
    (tmp_path / "a.msh").write_text(PARAMETRIC[version])
    mesh = read_mesh(tmp_path / "a.msh")
    corners = mesh.vertices[mesh.faces[0]].tolist()
    assert corners == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_binary_parametric_nodes_of_version_2_are_refused(tmp_path):
    head = b"$MeshFormat\n2.2 1 8\n\1\0\0\0\n$EndMeshFormat\n$ParametricNodes\n3\n"
    (tmp_path / "a.msh").write_bytes(head)
    with pytest.raises(
        FileFormatError, match=r"parametric ones, too\. Save it without \(Mesh\.Save"
    ):
        read_mesh(tmp_path / "a.msh")


@pytest.mark.data
def test_the_parametric_file_of_everyday(data):
    assert read_mesh(data / "everyday" / "M_parametric.msh").n_faces == 1


def test_names_and_functions_are_named(tmp_path):
    more = '$PhysicalNames\n1\n2 1 "wall"\n$EndPhysicalNames\n$NodeData\n$EndNodeData\n'
    (tmp_path / "a.msh").write_text(PARAMETRIC["4.1"] + more)
    with pytest.warns(
        UserWarning, match="its names of physical groups, fields on nodes are not kept"
    ):
        read_mesh(tmp_path / "a.msh")


@pytest.mark.parametrize("binary", [True, False])
def test_a_mesh_of_ansys_is_named_and_meshio_converts_it(tmp_path, binary):
    points = np.vstack([np.zeros(3), np.eye(3)[:2]])
    mesh = meshio.Mesh(points, [("triangle", [[0, 1, 2]])])
    mesh.write(tmp_path / "a.msh", file_format="ansys", binary=binary)
    with pytest.raises(
        FileFormatError,
        match=r"one is a mesh of Ansys Fluent\. meshio reads it: .*\.write\(\"a\.vtu\"\)",
    ):
        read_shape(tmp_path / "a.msh")
    meshio.read(tmp_path / "a.msh", file_format="ansys").write(tmp_path / "a.vtu")
    assert isinstance(read_shape(tmp_path / "a.vtu"), TriangleMesh)
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.vtu").vertices, points)


@pytest.mark.parametrize("binary", [True, False])
def test_version_4_0(tmp_path, binary):
    # meshio writes 4.0 by a module of its own, which its table of formats does not list.
    from meshio.gmsh import _gmsh40

    rng = np.random.default_rng(0)
    points, cells = rng.normal(size=(9, 3)), np.array([[0, 1, 2], [8, 3, 4], [5, 6, 7]])
    mesh = meshio.Mesh(points, [("triangle", cells)])
    _gmsh40.write(str(tmp_path / "a.msh"), mesh, ".16e", binary)
    found = read_mesh(tmp_path / "a.msh")
    np.testing.assert_array_equal(found.vertices, points)
    np.testing.assert_array_equal(found.faces, cells)
