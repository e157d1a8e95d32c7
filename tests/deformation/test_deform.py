from importlib import import_module

import numpy as np
import pytest
from bent_shapes import bumpy, lump, lump_rig, tube, tube_rig

from certeig.kit.errors import InvalidParameterError
from eigenshape.deformation.binding import bind
from eigenshape.deformation.deform import bend, deform, move_by_shares, require_mode
from eigenshape.deformation.handles import Rotation, Translation
from eigenshape.deformation.region import region_boundary
from eigenshape.deformation.rig import eigen_skeleton, rig_shape
from eigenshape.deformation.session import DeformationSession
from eigenshape.deformation.thesis import (
    blend_details,
    frame_details,
    move_skeleton,
    skeleton_response,
    turn_by_frames,
    turn_by_handles,
)
from eigenshape.geometry.distances.crossings import self_intersections
from eigenshape.geometry.measure import edge_lengths, face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union, edge_table
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.domains import box
from eigenshape.shapes.surfaces import grid, torus

TURN = Rotation([0.6, 0, 0], [0, 1, 2], 1.2)
HEAD = lump().vertices[:, 0] > 0.6
NOTHING = [Rotation([1, 2, 3], [0, 0, 1], 0.0), Translation([0, 0, 0])]


@pytest.mark.parametrize("handle", NOTHING)
def test_what_moves_nothing_leaves_every_digit(handle):
    bent = deform(lump_rig(), HEAD, handle)
    np.testing.assert_array_equal(bent.vertices, lump().vertices)
    np.testing.assert_array_equal(bent.faces, lump().faces)


@pytest.mark.parametrize("handle", NOTHING)
@pytest.mark.parametrize("n_modes", [8, 50, 300])
def test_by_the_thesis_what_moves_nothing_comes_back(handle, n_modes):
    bent = deform(lump_rig(), HEAD, handle, mode="thesis", n_modes=n_modes)
    diagonal = np.linalg.norm(np.ptp(lump().vertices, axis=0))
    assert np.abs(bent.vertices - lump().vertices).max() < 1e-12 * diagonal


@pytest.mark.parametrize("handle", [TURN, Translation([0.3, 0, 0.1])])
def test_what_is_held_is_where_its_handle_takes_it(handle):
    rest, binding = lump().vertices, bind(lump_rig(), [HEAD])
    bent, (shares,) = bend(binding, [handle]).vertices, binding.shares
    stays, follows = binding.held & (shares == 0), binding.held & (shares == 1)
    np.testing.assert_array_equal(bent[stays], rest[stays])
    whole = rest + handle.carry(rest, np.ones(len(rest)))
    assert stays.any()
    assert follows.any()
    np.testing.assert_array_equal(bent[follows], whole[follows])


def test_two_regions_move_at_once():
    rest, tail = lump().vertices, lump().vertices[:, 0] < -0.7
    binding, handles = bind(lump_rig(), [HEAD, tail]), [TURN, Translation([0, 0.4, 0])]
    bent = bend(binding, handles).vertices
    for share, handle in zip(binding.shares, handles, strict=True):
        whole = rest + handle.carry(rest, np.ones(len(rest)))
        follows = binding.held & (share == 1)
        assert follows.any()
        np.testing.assert_array_equal(bent[follows], whole[follows])


def literal_skeleton(rig, regions, handles, n_modes):
    """Equation 6.1 as it stands: cut the region out of K, move it, and fit what results by the low modes."""
    modes = rig.eigenvectors[:, :n_modes]
    skeleton = modes @ np.linalg.lstsq(modes, rig.mesh.vertices, rcond=None)[0]
    target = skeleton.copy()
    for region, handle in zip(regions, handles, strict=True):
        target[region] += handle.carry(skeleton, np.ones(len(skeleton)))[region]
    return skeleton, modes @ np.linalg.lstsq(modes, target, rcond=None)[0]


@pytest.mark.parametrize("n_modes", [8, 50, 300])
def test_the_moved_skeleton_is_the_least_squares_fit_of_the_thesis(n_modes):
    tail = lump().vertices[:, 0] < -0.7
    regions, handles = [HEAD, tail], [TURN, Translation([0, 0.4, 0])]
    response = skeleton_response(bind(lump_rig(), regions, n_modes=n_modes))
    before, after = literal_skeleton(lump_rig(), regions, handles, n_modes)
    np.testing.assert_allclose(response.skeleton, before, atol=1e-12)
    np.testing.assert_allclose(move_skeleton(response, handles), after, atol=1e-12)
    assert np.abs(after - before).max() > 0.1


def literal_normals(points, faces):
    normals = np.zeros_like(points)
    for face in faces:
        a, b, c = points[face]
        for corner in face:
            normals[corner] += np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def literal_frame(points, normals, i, j):
    along = points[j] - points[i]
    along = along - along @ normals[i] * normals[i]
    along = along / np.linalg.norm(along)
    return np.array([normals[i], along, np.cross(normals[i], along)])


def literal_details(faces, before, after, details):
    """The thesis, 6.2.3: coordinates in the frame of the normal and an edge, in the new frame once more."""
    edges, found = edge_table(TriangleMesh(before, faces)).edges, np.empty_like(details)
    old, new = literal_normals(before, faces), literal_normals(after, faces)
    for i in range(len(before)):
        around = [int(b if a == i else a) for a, b in edges if i in (a, b)]
        arms = before[around] - before[i]
        slopes = np.abs(arms @ old[i]) / np.linalg.norm(arms, axis=1)
        j = around[int(np.argmin(slopes))]  # the most tangential
        found[i] = literal_frame(after, new, i, j).T @ (
            literal_frame(before, old, i, j) @ details[i]
        )
    return found


def literal_blend(binding, handle, by_frames, details):
    """The thesis, 6.3.1."""
    (region,), (away,) = binding.regions, binding.distances
    extent, found = max(away[region]), np.empty_like(details)
    turn = (
        handle.carry(np.eye(3), np.ones(3)) + np.eye(3) - handle.carry(np.zeros((1, 3)), np.ones(1))
    )
    for i, (one, detail) in enumerate(zip(by_frames, details, strict=True)):
        two = detail @ turn if region[i] else detail
        near, far = extent / 8, extent / 4
        weight = 1 if away[i] < near else 0 if away[i] > far else (far - away[i]) / (far - near)
        length = np.linalg.norm(one)
        found[i] = (weight * one / length + (1 - weight) * two / np.linalg.norm(two)) * length
    return found


@pytest.fixture(scope="module")
def small():
    """A bumpy torus, with a binding and a handle."""
    mesh = bumpy(torus(24, 12))
    rig = rig_shape(mesh)
    return (
        rig,
        bind(rig, [mesh.vertices[:, 0] > 0.5], n_modes=40),
        Rotation([0.5, 0, 0], [0, 1, 0.3], 0.8),
    )


def test_details_are_those_of_the_thesis_vertex_by_vertex(small):
    rig, binding, handle = small
    before, after = literal_skeleton(rig, binding.regions, [handle], 40)
    faces, details = rig.mesh.faces, rig.mesh.vertices - before
    turned = turn_by_frames(faces, frame_details(faces, before, rig.mesh.vertices), after)
    np.testing.assert_allclose(turned, literal_details(faces, before, after, details), atol=1e-11)
    found = blend_details(binding, turned, turn_by_handles(binding, [handle], details))
    np.testing.assert_allclose(found, literal_blend(binding, handle, turned, details), atol=1e-12)
    assert np.abs(found - turned).max() > 0.01


@pytest.mark.long
def test_the_two_passes_of_the_thesis_by_hand(small):
    """6.3.3, with 288 modes for the 300."""
    rig, binding, handle = small
    faces, most = rig.mesh.faces, rig.n_modes
    before, after = literal_skeleton(rig, binding.regions, [handle], 40)
    fine = eigen_skeleton(rig, most)
    details = fine - before
    first = after + literal_blend(
        binding, handle, literal_details(faces, before, after, details), details
    )
    modes = rig.eigenvectors[:, :most]
    second = modes @ np.linalg.lstsq(modes, first, rcond=None)[0]
    expected = second + literal_details(faces, fine, second, rig.mesh.vertices - fine)
    np.testing.assert_allclose(
        bend(binding, [handle], mode="thesis").vertices, expected, atol=1e-10
    )


def test_with_all_modes_there_is_one_pass(small):
    rig, binding, handle = small
    whole = bind(rig, list(binding.regions), n_modes=rig.n_modes)
    rest = rig.mesh.vertices
    cut = rest + np.where(binding.regions[0][:, None], handle.carry(rest, np.ones(len(rest))), 0)
    np.testing.assert_allclose(bend(whole, [handle], mode="thesis").vertices, cut, atol=1e-10)


def test_details_of_no_length_stay_so():
    rig, details = lump_rig(), np.zeros((642, 3))
    binding = bind(rig, [HEAD])
    before, after = literal_skeleton(rig, [HEAD], [TURN], 50)
    turned = turn_by_frames(rig.mesh.faces, frame_details(rig.mesh.faces, before, before), after)
    np.testing.assert_array_equal(turned, 0)
    np.testing.assert_array_equal(
        blend_details(binding, turned, turn_by_handles(binding, [TURN], details)), 0
    )


def test_details_are_not_turned_where_the_skeleton_has_no_frame():
    rig = lump_rig()
    details = np.random.default_rng(0).standard_normal((642, 3))
    point = np.zeros((642, 3))
    shape, faces = rig.mesh.vertices, rig.mesh.faces
    np.testing.assert_array_equal(
        turn_by_frames(faces, frame_details(faces, point, details), shape), details
    )
    np.testing.assert_allclose(
        turn_by_frames(faces, frame_details(faces, shape, shape + details), point), details
    )


def test_a_region_that_is_its_own_boundary_is_near_itself():
    bent = deform(lump_rig(), [100], Translation([0.1, 0, 0]), mode="thesis")
    assert np.isfinite(bent.vertices).all()
    assert np.abs(bent.vertices - lump().vertices).max() < 0.11


@pytest.fixture(scope="module")
def bar():
    """A closed bar 1 × 1 × 6: the faces of a box of tetrahedra that only one of them has."""
    solid = box(4, 4, 24, sides=[1.0, 1.0, 6.0])
    corners = solid.simplices[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(corners, axis=1), axis=0, return_index=True, return_counts=True
    )
    faces = corners[first[count == 1]]
    used, numbers = np.unique(faces, return_inverse=True)
    return rig_shape(TriangleMesh(solid.points[used], numbers.reshape(-1, 3)))


def twisted(rig, angle, mode, pivot=None):
    z = rig.mesh.vertices[:, 2]
    return deform(
        rig, z >= 4.5, Rotation(pivot or [0.5, 0.5, 0], [0, 0, 1], angle), fixed=z <= 1.5, mode=mode
    )


def test_a_bar_survives_half_a_turn_and_the_thesis_pinches_it(bar):
    before, upper = face_areas(bar.mesh), bar.mesh.vertices[:, 2] >= 3
    assert (face_areas(twisted(bar, np.pi, "graded")) / before).min() > 0.5
    half = deform(bar, upper, Rotation([0.5, 0.5, 0], [0, 0, 1], np.pi), mode="thesis")
    assert (face_areas(half) / before).min() < 0.1
    graded = deform(bar, upper, Rotation([0.5, 0.5, 0], [0, 0, 1], np.pi))
    assert (face_areas(graded) / before).min() > 0.5


@pytest.mark.parametrize("turns", [1, 2])
def test_whole_turns_keep_both_ends(turns):
    """What lies between may unwind: its energy is least where the shape is as it was."""
    rest = tube().vertices
    bent = twisted(tube_rig(), 2 * np.pi * turns, "graded", pivot=[0, 0, 0])
    ends = (rest[:, 2] >= 4.5) | (rest[:, 2] <= 1.5)
    np.testing.assert_allclose(bent.vertices[ends], rest[ends], atol=1e-14)
    assert (face_areas(bent) / face_areas(tube())).min() > 0.3


def test_a_bend_of_a_tube_turns_its_end_as_a_whole():
    rest = tube().vertices
    top, bottom = rest[:, 2] >= 4.5, rest[:, 2] <= 1.5
    handle = Rotation([0, 0, 3], [1, 0, 0], np.pi / 2)
    bent = deform(tube_rig(), top, handle, fixed=bottom).vertices
    np.testing.assert_array_equal(bent[bottom], rest[bottom])
    np.testing.assert_allclose(
        bent[top], np.column_stack([rest[:, 0], 3 - rest[:, 2], 3 + rest[:, 1]])[top], atol=1e-14
    )


@pytest.mark.parametrize("mode", ["graded", "uncrossed", "thesis"])
@pytest.mark.parametrize("gap", [0.02, 0.15])
def test_fixed_vertices_stay_however_near_the_region_lies(gap, mode):
    """The fit is above 0 on them, up to 0.5 here, and the modes move them by up to 0.27."""
    rig = rig_shape(grid(40, 40))
    rest, moved = rig.mesh.vertices, Translation([0.1, 0, 0.2])
    x = rest[:, 0] / rest[:, 0].max()
    region, fixed = x > 0.8, x < 0.8 - gap
    session = DeformationSession(rig, mode=mode)
    session.drag(region, moved, fixed=fixed)
    np.testing.assert_array_equal(session.preview()[fixed], rest[fixed])
    bent = session.commit()
    np.testing.assert_allclose(bent.vertices[fixed], rest[fixed], rtol=0, atol=1e-15)
    # Where fixed vertices are set back alone, edges at their border become up to 6 times as long.
    assert (edge_lengths(bent) / edge_lengths(rig.mesh)).max() < 4.5


def test_the_start_of_a_graded_bend_is_each_vertex_by_its_share():
    binding = bind(lump_rig(), [HEAD])
    rest, (shares,) = lump().vertices, binding.shares
    np.testing.assert_allclose(
        move_by_shares(binding, [TURN]), rest + TURN.carry(rest, shares), atol=1e-15
    )


def test_wrong_modes_and_numbers_of_handles_are_refused():
    with pytest.raises(
        InvalidParameterError, match="mode must be 'graded', 'uncrossed' or 'thesis'; it is 'rigid'"
    ):
        require_mode("rigid")
    with pytest.raises(
        InvalidParameterError,
        match="Each region must have one handle; there are 1 regions and 2 handl",
    ):
        bend(bind(lump_rig(), [HEAD]), [TURN, TURN])


def test_faces_that_would_cross_are_kept_apart(bar):
    upper, half_turn = bar.mesh.vertices[:, 2] >= 3, Rotation([0.5, 0.5, 0], [0, 0, 1], np.pi)
    lower = bar.mesh.vertices[:, 2] <= 1.5  # held close to the region, so that a fold is left
    assert len(self_intersections(deform(bar, upper, half_turn, fixed=lower)))
    apart = deform(bar, upper, half_turn, fixed=lower, mode="uncrossed")
    assert not len(self_intersections(apart))
    assert (face_areas(apart) / face_areas(bar.mesh)).min() > 0.5


@pytest.fixture(scope="module")
def halves():
    """Return a biped and its rig, and its left half as a region."""
    mesh = make_creature("biped", 0, n_vertices=2500)
    middle = float(mesh.vertices[:, 0].min() + mesh.vertices[:, 0].max()) / 2
    left = mesh.vertices[:, 0] <= middle
    return rig_shape(mesh), left, mesh.vertices[region_boundary(mesh, left)].mean(axis=0)


@pytest.mark.long
def test_folds_of_single_edges_take_a_strong_pull(halves):
    """Where shares take the vertices no pair crosses, and a pull is enough to keep them apart."""
    rig, left, pivot = halves
    turn = Rotation(pivot, [1, 0, 0], np.deg2rad(130))
    assert len(self_intersections(deform(rig, left, turn))) > len(self_intersections(rig.mesh))
    apart = deform(rig, left, turn, mode="uncrossed")
    assert not len(self_intersections(apart))


@pytest.mark.long
def test_what_no_pull_keeps_apart_is_said(halves):
    """A half that is turned into the other half: both are held."""
    rig, left, pivot = halves
    binding, turn = bind(rig, [left]), Rotation(pivot, [0, 1, 0], np.deg2rad(100))
    with pytest.warns(
        UserWarning,
        match=r"Faces cross at every strength of the pull; \d+ pairs cross that did not before, ",
    ) as told:
        bent = bend(binding, [turn], mode="uncrossed")
    assert f" {len(self_intersections(bent))} pairs cross" in str(told[0].message)


def test_no_pull_is_tried_if_all_pairs_cross_with_an_infinite_one_too(bar, monkeypatch):
    """The end of a bar is moved through a plate: faces of both are held."""
    plate = TriangleMesh(np.array([[-3, -3, 6.6], [4, -3, 6.6], [0.5, 6, 6.6]]), [[0, 1, 2]])
    both = disjoint_union(bar.mesh, plate)
    upper = both.vertices[:, 2] >= 3
    upper[bar.mesh.n_vertices :] = False
    binding = bind(rig_shape(both), [upper], n_modes=20)
    module = import_module("eigenshape.deformation.deform")
    monkeypatch.setattr(module, "pull_binding", None)  # a call would raise an error
    with pytest.warns(UserWarning, match="Faces cross at every strength"):
        bend(binding, [Translation([0, 0, 1])], mode="uncrossed")


def test_where_no_faces_cross_nothing_is_stiffer():
    turn = Rotation([0.6, 0, 0], [0, 1, 2], 0.3)
    graded, apart = (
        deform(lump_rig(), HEAD, turn, mode=mode).vertices for mode in ("graded", "uncrossed")
    )
    np.testing.assert_array_equal(graded, apart)
