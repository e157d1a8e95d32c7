import numpy as np
import pytest
from broken_meshes import everted, flipped, moebius
from each_creature import KINDS

from eigenshape._errors import InvalidShapeError
from eigenshape.geometry.measure import enclosed_volume, vertex_normals
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.orientation import orient_outward, outward_vote
from eigenshape.geometry.repairs.orient import orient
from eigenshape.geometry.repairs.repair import repair
from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.cotangent import mean_curvature
from eigenshape.retrieval.patches.patches import surface_patches
from eigenshape.scans.partial import (
    cut_by_planes,
    partial_scan,
    random_planes,
    rotation_towards,
    viewpoint,
)
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import grid, icosphere, torus


def require_out(mesh):
    assert orient_outward(mesh) is mesh
    np.testing.assert_array_equal(orient_outward(everted(mesh)).faces, mesh.faces)


@pytest.mark.parametrize("mesh", [icosphere(2), torus()])
def test_closed_surfaces_face_out(mesh):
    require_out(mesh)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_parts_and_scans_of_creatures_face_out(kind):
    whole = make_creature(kind, n_vertices=1500)
    require_out(whole)
    for number in range(6):
        require_out(partial_scan(whole, viewpoint(number)).mesh)
        rng = np.random.default_rng(number)
        require_out(cut_by_planes(whole, random_planes(whole, rng, n_planes=2, share=0.2)).mesh)


def test_a_cap_that_is_mostly_open_faces_out_where_its_signed_volume_says_nothing():
    require_out(cut_by_planes(icosphere(4), [[0, 0, -1, -0.8]]).mesh)


def test_neither_rotation_nor_unit_matters():
    scan = partial_scan(make_creature("quadruped", n_vertices=1500), viewpoint(1)).mesh
    turn = rotation_towards(np.array([0.36, 0.48, 0.8]))
    require_out(TriangleMesh(scan.vertices @ turn.T + [5.0, 6.0, -7.0], scan.faces))
    for scale in (1e-100, 1e100):
        require_out(TriangleMesh(scan.vertices * scale, scan.faces))


def test_the_vote_is_near_one_where_the_hull_is_the_surface_and_changes_its_sign():
    ball = icosphere(3)
    assert 0.99 < outward_vote(ball) <= 1 + 1e-12
    assert outward_vote(everted(ball)) == pytest.approx(-outward_vote(ball))
    assert 0.3 < outward_vote(torus()) < 1


def test_what_is_flat_has_no_outside():
    flat = grid(3, 3)
    assert outward_vote(flat) == 0
    assert orient_outward(flat) is flat
    assert orient_outward(everted(flat)).faces.tolist() == everted(flat).faces.tolist()


@pytest.mark.parametrize(
    "make", [lambda: icosphere(2), torus, lambda: make_creature("quadruped", n_vertices=500)]
)
@pytest.mark.parametrize("seed", range(3))
def test_faces_turned_at_random_are_turned_back(make, seed):
    mesh = make()
    done = orient(flipped(mesh, np.random.default_rng(seed))).mesh
    np.testing.assert_array_equal(done.faces, mesh.faces)


def test_a_cavity_turns_with_what_is_around_it():
    hollow = disjoint_union(
        icosphere(2), everted(TriangleMesh(0.5 * icosphere(1).vertices, icosphere(1).faces))
    )
    assert orient(hollow).report == ("orient turned 0 faces over",)
    np.testing.assert_array_equal(orient(everted(hollow)).mesh.faces, hollow.faces)
    assert enclosed_volume(hollow) < enclosed_volume(icosphere(2)) - 0.4


def test_pieces_beside_each_other_all_face_out():
    ball, far = (
        icosphere(2),
        TriangleMesh(icosphere(1).vertices + np.array([2.5, 0, 0]), icosphere(1).faces),
    )
    done = orient(disjoint_union(everted(ball), far))
    np.testing.assert_array_equal(done.mesh.faces, disjoint_union(ball, far).faces)
    assert done.report == ("orient turned 320 faces over",)


def test_a_speck_of_any_size_has_a_side():
    ball = icosphere(1)
    speck = TriangleMesh(1e-110 * ball.vertices + np.array([3.0, 0, 0]) * 1e-110, ball.faces)
    done = orient(disjoint_union(ball, everted(speck)))
    np.testing.assert_array_equal(
        done.mesh.faces, disjoint_union(ball, everted(speck)).faces
    )  # inside: a cavity
    alone = orient(
        disjoint_union(
            TriangleMesh(ball.vertices + np.array([5.0, 0, 0]), ball.faces), everted(speck)
        )
    )
    assert alone.report == ("orient turned 80 faces over",)


def test_an_open_piece_is_turned_only_where_its_faces_disagreed():
    cap = cut_by_planes(icosphere(3), [[0, 0, -1, 0.2]]).mesh
    assert orient(everted(cap)).report == ("orient turned 0 faces over",)
    np.testing.assert_array_equal(
        orient(flipped(everted(cap), np.random.default_rng(0))).mesh.faces, cap.faces
    )


def test_a_pillow_without_volume_is_left():
    sheet = grid(3, 3)
    both = TriangleMesh(sheet.vertices, np.concatenate([sheet.faces, sheet.faces[:, ::-1]]))
    assert orient(both).report == ("orient turned 0 faces over",)


def test_faces_that_disagree_have_no_outside():
    ball = flipped(icosphere(2), np.random.default_rng(0))
    for needs in (
        orient_outward,
        enclosed_volume,
        vertex_normals,
        mean_curvature,
        surface_patches,
    ):
        with pytest.raises(
            InvalidShapeError, match=r"faces must be turned the same way; .* Try repair\(mesh,"
        ):
            needs(ball)
        needs(repair(ball, ["auto"]).mesh)
    with pytest.raises(
        InvalidShapeError,
        match=r"The piece of face 0 has one side only, .* \[\"auto\", \"cut_one_sided\"\]",
    ):
        vertex_normals(moebius())
    # Other pieces are turned before the cut, which "auto" would weld.
    both = disjoint_union(moebius(), ball)
    vertex_normals(repair(both, ["auto", "cut_one_sided"]).mesh)
