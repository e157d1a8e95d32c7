import re

import numpy as np
import pytest
from broken_meshes import moebius, soup, tetrahedra, with_slivers

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.cloud import PointCloud
from eigenshape.geometry.face_turns import inconsistent_edges
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.repairs.orient import orient
from eigenshape.geometry.repairs.repair import REPAIRS, repair, suggest_repairs
from eigenshape.geometry.repairs.repair_names import MESH_REPAIRS
from eigenshape.geometry.repairs.repair_steps import (
    collapse_needles,
    drop_degenerate,
    drop_duplicate_faces,
    drop_unreferenced,
    largest_component,
    weld,
    weld_seams,
)
from eigenshape.geometry.simplicial import SimplicialMesh
from eigenshape.geometry.topology import (
    boundary_edges,
    disjoint_union,
    euler_characteristic,
    is_closed,
    is_manifold,
)
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere
from eigenshape.spectral.comparison.eigenvalues import shape_dna


def test_the_names_that_help_lists_are_those_of_the_repairs():
    assert tuple(REPAIRS) == MESH_REPAIRS


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
    done = weld(
        TriangleMesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0]], [[0, 1, 2], [3, 2, 1]])
    )
    assert done.mesh.n_vertices == 3


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_a_tolerance_joins_chains(scale):
    # Box 1 by 1: the diagonal is 1.414, the tolerance 0.0141; steps of 0.01 chain three points over 0.02.
    points = (
        np.array([[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [1, 0, 0], [0, 1, 0], [0.04, 0, 0]])
        * scale
    )
    mesh = TriangleMesh(points, [[0, 3, 4], [1, 3, 4], [2, 3, 4], [5, 3, 4]])
    done = weld(mesh, tolerance=0.01)
    assert done.source_vertices.tolist() == [0, 3, 4, 5]
    assert done.mesh.faces.tolist() == [[0, 1, 2]] * 3 + [[3, 1, 2]]
    assert weld(mesh).mesh.n_vertices == 6
    assert weld(mesh, tolerance=1e-3).mesh.n_vertices == 6


@pytest.mark.parametrize("tolerance", [-1e-9, 0.11, float("nan"), float("inf")])
def test_a_tolerance_out_of_range_is_refused(tolerance):
    with pytest.raises(
        InvalidParameterError, match=rf"tolerance must lie in 0\.\.0\.1 .* it is {tolerance}"
    ):
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
    assert done.report == (
        "drop_duplicate_faces removed 2 faces with the corners of an earlier one",
    )


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
    assert done.report == ("largest_component removed 1 component with 50 faces",)


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
    done = repair(
        mesh,
        [
            "weld",
            "drop_degenerate",
            "drop_duplicate_faces",
            "largest_component",
            "drop_unreferenced",
        ],
    )
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
    with pytest.raises(
        InvalidParameterError,
        match=r"must be among auto, drop_missing, weld, .*; name 1 is 'polish'",
    ):
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
    assert weld(
        TriangleMesh(points, [[0, 1, 2], [0, 3, 2]]), tolerance=1e-9
    ).source_vertices.tolist() == [0, 1, 2]


def test_seams_are_welded_and_touching_pieces_stay_apart():
    cut = TriangleMesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2], [3, 4, 5]]
    )
    done = weld_seams(cut)
    assert done.mesh.faces.tolist() == [[0, 1, 2], [2, 1, 3]]
    assert done.source_vertices.tolist() == [0, 1, 2, 5]
    assert done.report == ("weld_seams joined 2 vertices along seams",)
    bow = TriangleMesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [-1, 0, 0], [0, -1, 0]], [[0, 1, 2], [3, 4, 5]]
    )
    assert weld_seams(bow).mesh.n_vertices == 6
    ball = icosphere(1)
    touching = disjoint_union(ball, TriangleMesh(ball.vertices + 2 * ball.vertices[0], ball.faces))
    assert weld(touching).mesh.n_vertices < touching.n_vertices
    assert weld_seams(touching).mesh.n_vertices == touching.n_vertices


def test_three_sheets_on_one_edge_are_welded_there():
    points = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0]]
    book = TriangleMesh(points, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    assert weld_seams(soup(book)).mesh.n_vertices == 5


def test_auto_names_what_it_leaves():
    ball = icosphere(1)
    a, b, _ = ball.faces[0]
    fin = TriangleMesh([*ball.vertices, [2, 2, 2]], [*ball.faces, [a, b, ball.n_vertices]])
    done = repair(fin, ["auto"])
    edge = sorted([int(a), int(b)])
    assert done.report == (
        f"auto left 1 edge with more than two faces, the first at vertices {edge}",
    )
    assert np.array_equal(done.mesh.faces, fin.faces)
    (sentence,) = repair(moebius(), ["auto"]).report
    assert re.match(
        r"auto left 3 edges of pieces with one side only \(cut_one_sided opens them\)", sentence
    )
    (cut,) = repair(moebius(), ["cut_one_sided"]).report
    assert cut.startswith("cut_one_sided cut 1 piece with one side only along 3 edges")


def test_tetrahedra_are_repaired_too():
    mesh = tetrahedra()
    points = np.concatenate([soup(mesh).points, [[9.0, 9, 9]]])
    ugly = SimplicialMesh(points, [*soup(mesh).simplices, [0, 1, 2, 2], [3, 2, 1, 0]])
    done = repair(ugly, ["auto"])
    assert (done.mesh.n_points, done.mesh.n_simplices) == (5, 2)
    assert done.report == (
        "drop_duplicate_faces removed 1 tetrahedron with the corners of an earlier one",
        "weld_seams joined 3 vertices along seams",
        "drop_degenerate removed 1 tetrahedron without volume",
        "drop_unreferenced removed 1 vertex without a simplex",
    )
    np.testing.assert_array_equal(done.mesh.points, ugly.points[done.source_vertices])
    with pytest.raises(
        InvalidParameterError,
        match=r"must be among auto, drop_missing, weld, .*; name 0 is 'orient'",
    ):
        repair(mesh, ["orient"])


def test_copies_of_points_go():
    cloud = PointCloud([[0, 0, 0], [1, 0, 0], [0, -0.0, 0], [1, 0, 0], [2, 0, 0]], 1)
    assert suggest_repairs(cloud) == ("drop_duplicate_points",)
    done = repair(cloud, ["auto"])
    assert done.cloud.points.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    assert (done.cloud.dim, done.source_points.tolist()) == (1, [0, 1, 4])
    assert done.report == ("drop_duplicate_points removed 2 points at the places of others",)
    assert suggest_repairs(done.cloud) == ()
    assert repair(cloud, []).cloud is cloud
    with pytest.raises(
        InvalidParameterError,
        match="must be among auto, drop_missing, drop_duplicate_points; name 1 is 'weld'",
    ):
        repair(cloud, ["auto", "weld"])


def test_a_strip_with_one_side_is_named_and_left():
    strip = moebius()
    both = disjoint_union(icosphere(0), strip)
    done = orient(both)
    assert done.report == (
        "orient turned 0 faces over, left 1 piece with one side only, of face 20",
    )
    np.testing.assert_array_equal(done.mesh.faces, both.faces)
    many = orient(disjoint_union(*[moebius(6, 1)] * 11))
    assert (
        "left 11 pieces with one side only, of face 0, 12, 24, 36, 48, 60, 72, 84, 96 and others"
        in many.report[0]
    )
    assert suggest_repairs(both) == ()


def test_what_is_left_of_nothing():
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    assert suggest_repairs(flat) == ()
    with pytest.raises(InvalidShapeError, match="it has 3 vertices and no face"):
        repair(flat, ["auto"])


def test_specks_and_holes_are_suggested_up_to_a_share_of_the_area():
    ball = icosphere(3)
    for radius, count, few in (
        (0.09, 1, True),
        (0.12, 1, False),
        (0.09, 20, True),
        (0.09, 40, False),
    ):
        specks = [
            TriangleMesh(radius * ball.vertices + 5 * i, ball.faces) for i in range(1, count + 1)
        ]
        assert suggest_repairs(disjoint_union(ball, *specks)) == (
            ("largest_component",) if few else ()
        )
    for height, few in ((0.95, True), (0.7, False)):
        open_ball = TriangleMesh(
            ball.vertices, ball.faces[ball.vertices[ball.faces, 2].max(axis=1) < height]
        )
        assert ("fill_holes" in suggest_repairs(open_ball)) == few
    assert suggest_repairs(grid(4, 4)) == ()


@pytest.mark.parametrize(
    ("more", "removed"), [([], "1 face"), ([[0, 0, 1]], "2 faces")], ids=["alone", "twice"]
)
def test_a_face_without_area_leaves_no_slit(more, removed):
    # The middle vertex 3 lies on the edge (0, 1); the face below is split there. A face with a
    # vertex twice, on the same edge, changes nothing.
    points = [[0, 0, 0], [2, 0, 0], [1, 1, 0], [1, 0, 0], [1, -1, 0]]
    mesh = TriangleMesh(points, [[0, 3, 2], [3, 1, 2], [0, 1, 3], [1, 0, 4], *more])
    done = drop_degenerate(mesh)
    assert sorted(map(sorted, done.mesh.faces.tolist())) == [
        [0, 2, 3],
        [0, 3, 4],
        [1, 2, 3],
        [1, 3, 4],
    ]
    assert inconsistent_edges(done.mesh).size == 0
    assert len(boundary_edges(done.mesh)) == 4
    report = (
        f"drop_degenerate removed {removed} without area, and split 1 neighbor at their vertices"
    )
    assert done.report == (report,)


@pytest.mark.parametrize("share", [1e-7, 1e-9])
def test_needles_collapse_to_the_face_that_they_were_cut_from(share):
    ball = icosphere(1)
    a, b, c = ball.faces[0]
    on_edge = ball.vertices[a] + share * (ball.vertices[b] - ball.vertices[a])
    cut = [[a, 42, c], [42, b, c], [a, b, 42]]
    needles = TriangleMesh([*ball.vertices, on_edge], [*cut, *ball.faces[1:]])
    done = collapse_needles(needles)
    np.testing.assert_array_equal(np.sort(done.mesh.faces[0]), np.sort(ball.faces[0]))
    np.testing.assert_array_equal(done.mesh.faces[1:], ball.faces[1:])
    np.testing.assert_array_equal(done.mesh.vertices, ball.vertices)
    assert done.report == (
        "collapse_needles joined 1 vertex to others beside them, and removed 2 faces",
    )


def test_what_is_no_needle_or_nothing_else_stays():
    narrow = TriangleMesh(icosphere(1).vertices * [1, 1, 1e-5], icosphere(1).faces)
    nothing_else = TriangleMesh(grid(2, 2).vertices * [1e8, 1, 1], grid(2, 2).faces)
    for mesh in (narrow, nothing_else):
        np.testing.assert_array_equal(collapse_needles(mesh).mesh.faces, mesh.faces)


def test_a_flip_that_would_make_a_third_face_is_not_done():
    points = [[0, 0, 0], [2, 0, 0], [1, 1, 0], [1, 0, 0], [1, -1, 0], [1, 0, 1]]
    faces = [[0, 3, 2], [3, 1, 2], [0, 1, 3], [1, 0, 4], [3, 4, 5]]
    done = drop_degenerate(TriangleMesh(points, faces))
    assert done.mesh.faces.tolist() == [[0, 3, 2], [3, 1, 2], [1, 0, 4], [3, 4, 5]]
    assert done.report == ("drop_degenerate removed 1 face without area",)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_heat_flows_where_faces_without_area_were(seed):
    whole = make_creature("quadruped", n_vertices=1500)
    mended = repair(with_slivers(whole, np.random.default_rng(seed), 20), ["auto"]).mesh
    assert is_closed(mended)
    assert is_manifold(mended)
    np.testing.assert_allclose(shape_dna(mended), shape_dna(whole), rtol=2e-3)
