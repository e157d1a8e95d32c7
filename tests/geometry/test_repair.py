import numpy as np
import pytest

from eigenshape._errors import InvalidParameterError, InvalidShapeError
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repair import (
    REPAIRS,
    drop_degenerate,
    drop_duplicate_faces,
    drop_unreferenced,
    largest_component,
    repair,
    weld,
)
from eigenshape.geometry.surfaces import disjoint_union, grid, icosphere
from eigenshape.geometry.topology import euler_characteristic, is_closed, is_manifold


def soup(mesh):
    """Three vertices of its own for each face."""
    return TriangleMesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * mesh.n_faces).reshape(-1, 3))


def test_a_welded_soup_is_whole_again():
    ball = icosphere(1)
    done = weld(soup(ball))
    assert (done.mesh.n_vertices, done.mesh.n_faces) == (42, 80)
    assert is_closed(done.mesh)
    assert is_manifold(done.mesh)
    assert euler_characteristic(done.mesh) == 2
    np.testing.assert_array_equal(done.mesh.vertices[done.mesh.faces], ball.vertices[ball.faces])
    np.testing.assert_array_equal(done.mesh.vertices, soup(ball).vertices[done.source_vertices])
    assert done.report == ("weld joined 198 vertices to others at the same place",)


def test_welding_keeps_the_order_of_first_appearance():
    done = weld(TriangleMesh([[5, 0, 0], [1, 0, 0], [5, 0, 0], [0, 2, 0]], [[0, 1, 3], [2, 3, 1]]))
    assert done.source_vertices.tolist() == [0, 1, 3]
    assert done.mesh.faces.tolist() == [[0, 1, 2], [0, 2, 1]]


@pytest.mark.parametrize("tolerance", [0.0, 1e-6])
def test_minus_zero_is_zero(tolerance):
    done = weld(TriangleMesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0]], [[0, 1, 2], [3, 2, 1]]))
    assert done.mesh.n_vertices == 3


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_a_tolerance_joins_chains(scale):
    # Box 1 by 1: the diagonal is 1.414, the tolerance 0.0141; steps of 0.01 chain three points over 0.02.
    points = np.array([[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [1, 0, 0], [0, 1, 0], [0.04, 0, 0]]) * scale
    mesh = TriangleMesh(points, [[0, 3, 4], [1, 3, 4], [2, 3, 4], [5, 3, 4]])
    done = weld(mesh, tolerance=0.01)
    assert done.source_vertices.tolist() == [0, 3, 4, 5]
    assert done.mesh.faces.tolist() == [[0, 1, 2]] * 3 + [[3, 1, 2]]
    assert weld(mesh).mesh.n_vertices == 6
    assert weld(mesh, tolerance=1e-3).mesh.n_vertices == 6


@pytest.mark.parametrize("tolerance", [-1e-9, 0.11, float("nan"), float("inf")])
def test_a_tolerance_out_of_range_is_refused(tolerance):
    with pytest.raises(InvalidParameterError, match=rf"tolerance must lie in 0\.\.0\.1 .* it is {tolerance}"):
        weld(icosphere(0), tolerance=tolerance)


def test_faces_without_area_go_and_vertices_stay():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]]
    done = drop_degenerate(TriangleMesh(points, [[0, 1, 3], [0, 1, 2], [2, 2, 1]]))
    assert done.mesh.faces.tolist() == [[0, 1, 2]]
    assert done.mesh.n_vertices == 4
    assert done.report == ("drop_degenerate removed 2 faces without area",)


def test_nothing_left_is_refused():
    with pytest.raises(InvalidShapeError, match="it has 3 vertices and no face"):
        drop_degenerate(TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]]))


def test_the_first_of_equal_faces_stays():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    done = drop_duplicate_faces(TriangleMesh(points, [[1, 2, 0], [0, 1, 2], [2, 1, 3], [2, 1, 0]]))
    assert done.mesh.faces.tolist() == [[1, 2, 0], [2, 1, 3]]
    assert done.report == ("drop_duplicate_faces removed 2 faces that repeat an earlier one",)


def test_loose_vertices_go():
    done = drop_unreferenced(TriangleMesh(np.arange(15.0).reshape(5, 3) ** 2, [[4, 1, 2]]))
    assert done.source_vertices.tolist() == [1, 2, 4]
    assert done.mesh.faces.tolist() == [[2, 0, 1]]
    assert done.report == ("drop_unreferenced removed 2 vertices without a face",)


def test_the_component_with_the_most_area_stays():
    small, large = grid(5, 5), grid(1, 1, width=3.0)
    done = largest_component(disjoint_union(small, large))
    np.testing.assert_array_equal(done.mesh.vertices, large.vertices)
    assert done.source_vertices.tolist() == list(range(36, 40))
    assert done.report == ("largest_component removed 1 components with 50 faces",)


def test_of_equal_components_the_one_with_the_lowest_vertex_stays():
    # The faces of the second component come first.
    mesh = TriangleMesh(np.tile(np.eye(3), (3, 1)), [[6, 7, 8], [3, 4, 5], [0, 1, 2]])
    assert largest_component(mesh).source_vertices.tolist() == [0, 1, 2]


def test_a_loose_vertex_is_no_largest_component():
    mesh = TriangleMesh([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 2, 3]])
    assert largest_component(mesh).source_vertices.tolist() == [1, 2, 3]


def test_repairs_follow_one_another_and_remember_where_vertices_were():
    ball = soup(icosphere(1))
    tiny = TriangleMesh(0.01 * icosphere(0).vertices, icosphere(0).faces)
    mesh = disjoint_union(tiny, ball)
    done = repair(mesh, ["weld", "drop_degenerate", "drop_duplicate_faces", "largest_component", "drop_unreferenced"])
    assert (done.mesh.n_vertices, is_closed(done.mesh)) == (42, True)
    assert [line.split()[0] for line in done.report] == [
        "weld",
        "drop_degenerate",
        "drop_duplicate_faces",
        "largest_component",
        "drop_unreferenced",
    ]
    np.testing.assert_array_equal(done.mesh.vertices, mesh.vertices[done.source_vertices])


def test_no_repair_changes_nothing():
    mesh = icosphere(0)
    done = repair(mesh, [])
    assert done.mesh is mesh
    assert done.report == ()
    assert done.source_vertices.tolist() == list(range(12))


def test_an_unknown_repair_is_refused_before_any_is_done():
    with pytest.raises(InvalidParameterError, match=r"repairs must be among weld, .*; name 1 is 'polish'"):
        repair(icosphere(0), ["weld", "polish"])


@pytest.mark.parametrize("name", sorted(REPAIRS))
def test_a_sound_mesh_is_left_as_it_is(name):
    mesh = icosphere(1)
    done = REPAIRS[name](mesh).mesh
    np.testing.assert_array_equal(done.vertices, mesh.vertices)
    np.testing.assert_array_equal(done.faces, mesh.faces)


@pytest.mark.parametrize("scale", [1e300, 1e-300])
def test_the_largest_component_is_found_where_areas_leave_the_range_of_floats(scale):
    union = disjoint_union(icosphere(0), grid(1, 1, width=30.0))
    mesh = TriangleMesh(np.concatenate([[[0.0, 0, 0]], scale * union.vertices]), union.faces + 1)
    assert largest_component(mesh).source_vertices.tolist() == [13, 14, 15, 16]


def test_a_loose_vertex_is_no_component_of_a_mesh_without_area():
    mesh = TriangleMesh([[9, 9, 9], [0, 0, 0], [0, 0, 0], [0, 0, 0]], [[1, 2, 3]])
    assert largest_component(mesh).source_vertices.tolist() == [1, 2, 3]


def test_a_tolerance_that_reaches_nobody_joins_only_what_is_equal():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]]
    assert weld(TriangleMesh(points, [[0, 1, 2], [0, 3, 2]]), tolerance=1e-9).source_vertices.tolist() == [0, 1, 2]
