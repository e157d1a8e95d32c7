"""Rigid turns decide between rolls of a long bone and places of an irregular stone."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import eigenshape as es
from certeig.kit.errors import InvalidParameterError
from eigenshape.geometry.resolution.subdivision import split_long_edges
from eigenshape.matching.evidence import FittedMap
from eigenshape.matching.fitting import Fit, plan_fit
from eigenshape.matching.growth import most_rigid_first
from eigenshape.matching.match import match_shapes
from eigenshape.matching.pairs import Pairs
from eigenshape.matching.surface import describe_surface
from eigenshape.matching.turns import is_rigid, rolled_turns, settle_map, turned_fit

TURN = Rotation.from_rotvec([0.4, 1.0, 2.0]).as_matrix()


def stone(n_vertices, *, length=1.0):
    """Return a ball with bumps, stretched along x."""
    ball = es.shapes.fibonacci_sphere(n_vertices)
    rng = np.random.default_rng(3)
    heights = np.ones(n_vertices)
    for waves in (2, 2, 3, 4, 5):
        direction, phase = rng.standard_normal(3), rng.uniform(0, 6)
        heights += 0.12 * np.sin(waves * ball.vertices @ direction + phase)
    return es.TriangleMesh(ball.vertices * heights[:, None] * [length, 1, 1], ball.faces)


def turned(mesh):
    return es.TriangleMesh(mesh.vertices @ TURN.T + 2.0, mesh.faces)


def gaps(match, whole, truth):
    unit = np.sqrt(es.geometry.surface_area(whole))
    return np.linalg.norm(match.pull(whole.vertices) - truth, axis=1) / unit


def plan_of(part, whole):
    unit = 1.2 * float(np.sqrt(es.geometry.surface_area(whole)))
    return plan_fit(describe_surface(part, unit, 100), describe_surface(whole, unit, 100))


def test_a_map_of_a_copy_settles_in_the_turn_that_made_it():
    whole = stone(600)
    plan = plan_of(turned(whole), whole)
    turn = settle_map(plan, np.arange(600))
    assert np.allclose(turn.rotation, TURN.T, atol=1e-6)
    assert turn.gap < 1e-6
    assert is_rigid(plan, turn)


def test_a_finer_copy_of_long_thin_triangles_is_rigid():
    # A slab between two outlines of 60 points, which a zigzag from side to side closes above and below
    n = 60
    angles = 2 * np.pi * np.arange(n) / n
    radii = 1 + 0.3 * np.cos(2 * angles + 0.4) + 0.15 * np.cos(3 * angles)
    above = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.full(n, 0.2)])
    low, high = np.arange(n // 2 - 1), n - 1 - np.arange(n // 2 - 1)
    zigzag = np.concatenate(
        [np.column_stack([low, low + 1, high]), np.column_stack([low + 1, high - 1, high])[:-1]]
    )
    here, ahead = np.arange(n), np.roll(np.arange(n), -1)
    walls = [
        np.column_stack([here + n, ahead + n, here]),
        np.column_stack([ahead + n, ahead, here]),
    ]
    points = np.concatenate([above, above * [1, 1, -1]])
    slab = es.TriangleMesh(points, np.concatenate([zigzag, zigzag[:, ::-1] + n, *walls]))
    fine = es.geometry.subdivide(es.geometry.subdivide(slab))
    whole = split_long_edges(slab, 0.3 * float(np.sqrt(es.geometry.surface_area(slab))), 500)[0]
    plan = plan_of(turned(fine), whole)
    turn = settle_map(plan, cKDTree(whole.vertices).query(fine.vertices)[1])
    assert turn.exact
    assert is_rigid(plan, turn)
    fit = turned_fit(plan, turn)
    # The corners of the slab come first in both.
    away = fit.points[: 2 * n] - plan.whole.mesh.vertices[: 2 * n]
    assert np.linalg.norm(away, axis=1).mean() < 0.01
    assert fit.misfit < 1.5 * turn.gap


def test_the_best_roll_of_a_wrong_one_is_the_true_turn():
    whole = stone(600, length=3.0)
    wrong = whole.vertices @ Rotation.from_rotvec([2.0, 0, 0]).as_matrix()
    plan = plan_of(es.TriangleMesh(wrong, whole.faces), whole)
    rolled = rolled_turns(plan, settle_map(plan, np.arange(600)))
    assert np.degrees(Rotation.from_matrix(rolled[0].rotation).magnitude()) == pytest.approx(
        np.degrees(2.0), abs=3
    )
    assert rolled[0].gap < 0.5 * rolled[1].gap


@pytest.mark.parametrize(("misfit", "first"), [(0.0105, 1), (0.012, 0)])
def test_of_maps_that_bend_as_well_the_one_nearest_to_a_turn_comes_first(misfit, first):
    whole = stone(600, length=3.0)
    plan = plan_of(turned(whole), whole)
    back_to_front = whole.vertices * [-1, -1, 1]
    wrong = cKDTree(whole.vertices).query(back_to_front)[1]
    pairs = Pairs(np.arange(3), np.arange(3), np.ones(3))
    maps = [
        FittedMap(pairs, Fit(whole.vertices[places], places, np.zeros(600), each))
        for places, each in ((wrong, 0.01), (np.arange(600), misfit))
    ]
    ordered, turn = most_rigid_first(plan, maps)
    assert ordered[0] is maps[first]
    assert turn.gap == settle_map(plan, maps[first].fit.places).gap


@pytest.mark.long
def test_a_fragment_of_an_irregular_stone_has_one_place():
    whole, other = stone(1500), stone(1300)
    part = es.scans.cut_by_planes(other, [[0, 1, 0, -0.1]]).mesh
    match = match_shapes(turned(part), whole)
    assert (gaps(match, whole, part.vertices) < 0.05).all()
    assert match.n_equally_good == 1
    assert match.confidence.mean() > 0.9


@pytest.mark.long
def test_the_upper_part_of_a_capped_bone_is_not_enlarged():
    whole = stone(1200, length=5.0)
    part = es.scans.cut_by_planes(whole, [[1, 0, 0, -1.7]]).mesh
    match = match_shapes(turned(part), whole)
    assert match.scale == 1.0
    assert (gaps(match, whole, part.vertices) < 0.05).mean() > 0.95


@pytest.mark.long
def test_a_left_hand_is_matched_to_a_right_one_as_its_mirror_image():
    right = es.make_creature("hand", 1, n_vertices=800)
    left = es.TriangleMesh(right.vertices * [-1, 1, 1], right.faces[:, ::-1])
    match = match_shapes(turned(left), right)
    assert match.mirrored
    assert match.report[-1].startswith("the part was matched as its mirror image")
    assert (gaps(match, right, right.vertices) < 0.05).mean() > 0.95
    never = match_shapes(turned(left), right, mirrored=False)
    assert not never.mirrored
    assert never.confidence.mean() < match.confidence.mean()
    always = match_shapes(turned(left), right, mirrored=True)
    assert np.array_equal(always.vertices, match.vertices)


@pytest.mark.data
@pytest.mark.long
def test_a_left_bone_is_a_mirror_image_of_a_right_one(data):
    if not (data / "bones").is_dir():
        pytest.skip(f"no bones in {data}")
    left, right = (es.read_mesh(data / "bones" / f"talus_{side}v.vtp") for side in "lr")
    match = match_shapes(left, right)
    assert match.mirrored
    assert match.confidence.mean() > 0.9
    assert not match_shapes(right, right).mirrored


@pytest.mark.long
def test_a_left_hemisphere_is_a_mirror_image_of_the_right_one():
    data = Path(str(resources.files("neuromodes") / "data"))
    names = (f"sp-human_tpl-fsLR_den-4k_hemi-{side}_midthickness.surf.gii" for side in "LR")
    left, right = (es.read_mesh(data / name) for name in names)
    match = match_shapes(left, right)
    assert match.mirrored
    assert match.confidence.mean() > 0.9
    # Vertex i of one is vertex i of the other.
    assert (gaps(match, right, right.vertices) < 0.05).mean() > 0.95


def test_a_wrong_word_for_mirrored_is_refused():
    with pytest.raises(InvalidParameterError, match='mirrored must be "auto", True or False'):
        match_shapes(es.icosphere(1), es.icosphere(1), mirrored="maybe")
