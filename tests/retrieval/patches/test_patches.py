"""Patches on surfaces whose discs are known, and what must not change them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import eigenshape as es
from eigenshape.geometry.resolution.subdivision import split_long_edges
from eigenshape.retrieval.patches import patches as patches_module
from eigenshape.retrieval.patches.patch_loops import (
    HEIGHT_BINS,
    RING_NUMBERS,
    RINGS,
    TURN_BINS,
    sort_by_distance,
)
from eigenshape.retrieval.patches.patches import RADII, extract_patches, surface_patches
from eigenshape.scans.partial import viewpoint


def rings(patches):
    """Return turns, heights, logarithms of area and straightness, of all points, radii and rings."""
    parts = patches.numbers.reshape(*patches.numbers.shape[:2], -1, RING_NUMBERS)
    return np.split(parts, np.cumsum([TURN_BINS, HEIGHT_BINS, 1]), axis=3)


def sheet(n=41):
    """A flat square of side 1."""
    axis = np.linspace(0, 1, n)
    points = np.array([[x, y, 0.0] for y in axis for x in axis])
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate(
        [np.column_stack([a, a + 1, a + n + 1]), np.column_stack([a, a + n + 1, a + n])]
    )
    return es.TriangleMesh(points, faces)


def test_a_flat_disc():
    mesh = sheet()
    found = surface_patches(mesh)
    turns, heights, areas, straight = rings(found)
    assert turns[..., -1] == pytest.approx(1)
    assert turns[..., :-1] == pytest.approx(0)
    assert heights[..., HEIGHT_BINS // 2 - 1 : HEIGHT_BINS // 2 + 1] == pytest.approx(np.sqrt(0.5))
    inner = np.abs(mesh.vertices[found.vertices, :2] - 0.5).max(axis=1) < 0.12
    assert areas[inner][:, 3:, -1].ravel() == pytest.approx(
        0, abs=0.15
    )  # of a disc, but for whole vertices
    assert straight[inner].ravel() == pytest.approx(1, abs=1e-4)
    assert found.weights[inner] == pytest.approx(
        np.repeat(found.weights[inner, :1], len(RADII), axis=1)
    )
    rim = (np.abs(mesh.vertices[found.vertices, :2] - 0.5) == 0.5).any(axis=1)
    assert rim.any()
    assert found.weights[rim].max() < 0.03 * found.weights[inner].max()


def test_discs_of_a_ball():
    found = surface_patches(es.icosphere(5))
    turns, heights, areas, straight = rings(found)
    ring, radius = 3, 5
    middle = RADII[radius] * np.linspace(0.75, 1, 9)  # on a ball of radius .5: angles of twice that
    cosines = (turns[:, radius, ring] ** 2) @ ((np.arange(TURN_BINS) + 0.5) / TURN_BINS)
    height = (heights[:, radius, ring] ** 2) @ (
        (np.arange(HEIGHT_BINS) + 0.5) / HEIGHT_BINS * 2 - 1
    )
    assert cosines == pytest.approx(np.cos(2 * middle).mean(), abs=0.02)
    assert height == pytest.approx(
        (0.5 * (np.cos(2 * middle) - 1) / RADII[radius]).mean(), abs=0.02
    )
    cap = 0.5 * np.pi * (1 - np.cos(2 * RADII[radius]))
    assert areas[:, radius, ring, 0] == pytest.approx(
        np.log(1e-3 + cap / (np.pi * RADII[radius] ** 2)), abs=0.06
    )
    assert straight[:, radius, ring, 0] == pytest.approx((np.sin(middle) / middle).mean(), abs=0.01)


def test_what_faces_away_does_not_count():
    front, back = sheet(), sheet()
    thin = es.TriangleMesh(
        np.concatenate([front.vertices, back.vertices - [0, 0, 0.01]]),
        np.concatenate([front.faces, back.faces[:, ::-1] + front.n_vertices]),
    )
    one, two = surface_patches(front, n_samples=20), surface_patches(thin, n_samples=40)
    assert two.numbers.mean(axis=0) == pytest.approx(one.numbers.mean(axis=0), abs=0.2)


@pytest.mark.parametrize("scale", [1e-100, 1.0, 1e100])
def test_size_and_rigid_motion_change_nothing(scale):
    mesh = es.make_creature("quadruped", 1, n_vertices=1500)
    half_turn = np.diag([-1.0, -1.0, 1.0])  # keeps the box, whose sides are the unit
    moved = es.TriangleMesh(scale * (mesh.vertices @ half_turn + [3, 0, 1]), mesh.faces)
    one, two = surface_patches(mesh), surface_patches(moved)
    assert np.array_equal(one.vertices, two.vertices)
    assert two.numbers == pytest.approx(one.numbers, abs=2e-3)
    assert two.weights == pytest.approx(one.weights, abs=1e-6)


def test_weights_are_shares_of_the_surface():
    mesh = es.make_creature("hand", n_vertices=1500)
    found = surface_patches(mesh, n_samples=60)
    assert found.numbers.shape == (60, len(RADII), RINGS * RING_NUMBERS)
    assert found.weights.sum(axis=0) == pytest.approx(1)
    assert np.isfinite(found.numbers).all()
    assert not found.numbers.flags.writeable


def test_few_vertices_have_few_patches():
    assert len(surface_patches(es.icosphere(0)).vertices) == 12
    assert np.isfinite(surface_patches(es.icosphere(0)).numbers).all()


def test_each_piece_is_sampled():
    one, two = es.icosphere(2), es.icosphere(2)
    pair = es.geometry.disjoint_union(one, es.TriangleMesh(two.vertices + 3, two.faces))
    found = surface_patches(pair, n_samples=30)
    assert (found.vertices < one.n_vertices).sum() == pytest.approx(15, abs=2)


def test_two_triangles_are_enough():
    mesh = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    found = surface_patches(mesh)
    assert len(found.vertices) == 4
    assert np.isfinite(found.numbers).all()
    assert (found.weights > 0).all()


def test_bad_input_is_named():
    ball = es.icosphere(1)
    with pytest.raises(es.InvalidParameterError, match="n_samples must be at least 1; it is 0"):
        extract_patches(ball, n_samples=0)
    with pytest.raises(es.InvalidParameterError, match="n_views must be at least 0; it is -1"):
        extract_patches(ball, n_views=-1)
    loose = es.TriangleMesh(np.concatenate([ball.vertices, [[2, 0, 0]]]), ball.faces)
    with pytest.raises(es.InvalidShapeError, match="42"):
        surface_patches(loose)
    line = es.TriangleMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    with pytest.raises(
        es.InvalidShapeError,
        match="must have an area to be described by patches; all its faces have none",
    ):
        surface_patches(line)


def test_a_closed_shape_is_also_described_as_a_depth_camera_sees_it():
    ball = es.icosphere(3)
    whole, _view, *frames = extract_patches(ball, n_samples=40, n_views=1, n_frames=2)
    assert len(frames) == 2
    assert np.ptp(whole.weights, axis=1).max() == 0
    for number, frame in enumerate(frames):
        # The camera is in front of the viewpoint, and what it sees faces it.
        heights = ball.vertices[frame.vertices] @ viewpoint(number)
        assert heights.min() > 0
        assert np.ptp(frame.weights, axis=1).max() > 0  # it has a boundary
    same = extract_patches(ball, n_samples=40, n_views=0, n_frames=1)[1]
    assert same.numbers.tobytes() == frames[0].numbers.tobytes()
    part = es.partial_scan(ball, [0, 0, 1]).mesh
    assert len(extract_patches(part, n_samples=40, n_views=1, n_frames=2)) == 1
    with pytest.raises(es.InvalidParameterError, match="n_frames must be at least 0; it is -1"):
        extract_patches(ball, n_frames=-1)


def test_vertices_are_sorted_by_distance_and_equals_by_index():
    rng = np.random.default_rng(2)
    cases = [
        rng.random(700),
        np.round(rng.random(700), 1),  # many equals
        np.where(rng.random(700) < 0.5, np.inf, 0.01 * rng.random(700)),  # one bucket
        np.zeros(5),
    ]
    for distances in cases:
        order = np.empty(len(distances), dtype=np.int64)
        total = sort_by_distance(distances, 0.6, order)
        near = np.flatnonzero(distances <= 0.6)
        expected = near[np.argsort(distances[near], kind="stable")]
        np.testing.assert_array_equal(order[:total], expected)


@pytest.mark.long
def test_a_large_surface_is_described_by_a_thin_one(monkeypatch):
    coarse = es.make_creature("giraffe", n_vertices=2000)
    fine = es.geometry.subdivide(es.geometry.subdivide(coarse))  # 32,000 vertices
    assert fine.n_vertices > patches_module.MOST_VERTICES
    found = es.describe(fine)
    # Points are vertices of the surface that was given, on all sides of it.
    points = fine.vertices[found.vertices]
    box = np.ptp(fine.vertices, axis=0)
    assert (np.ptp(points, axis=0) > 0.9 * box).all()
    others = [es.describe(es.make_creature(kind, n_vertices=2000)) for kind in ("bird", "lizard")]
    own, *rest = es.retrieval.patch_scores(found, [es.describe(coarse), *others])
    assert own < 0.1
    assert own < 0.3 * min(rest)
    monkeypatch.setattr(patches_module, "MOST_VERTICES", fine.n_vertices)
    whole = es.retrieval.patch_descriptor(extract_patches(fine, n_views=0), found.recipe)
    thin = es.retrieval.patch_descriptor(extract_patches(coarse, n_views=0), found.recipe)
    assert es.retrieval.patch_scores(whole, [thin])[0] < 0.1


def bracket(length: float) -> es.TriangleMesh:
    """An L of flat faces, with edges up to a length."""
    flat = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 4), (0, 4)]
    points = np.array([(x, y, z) for z in (0.0, 1.5) for x, y in flat])
    bottom = [(0, 3, 2), (0, 2, 1), (0, 4, 3), (0, 5, 4)]
    top = [(a + 6, c + 6, b + 6) for a, b, c in bottom]
    sides = [
        face for i in range(6) for j in [(i + 1) % 6] for face in [(i, j, j + 6), (i, j + 6, i + 6)]
    ]
    return split_long_edges(es.TriangleMesh(points, bottom + top + sides), length, 10_000)[0]


def test_large_flat_faces_are_described_like_small_ones():
    recipe = es.retrieval.PatchRecipe()
    whole, fine = (es.describe(bracket(length), recipe) for length in (9.0, 0.15))
    cube = es.describe(es.geometry.boundary_surface(es.shapes.box(1, 1, 1)), recipe)
    scores = es.retrieval.patch_scores(whole, [fine, cube])
    assert scores[0] < 0.25  # 0.57 if discs hold the corners alone
    assert scores[1] > 2 * scores[0]
    assert whole.vertices.max() < 12  # vertices of the mesh that was given
    # A moved copy in another unit is a double: lengths are measured by the area, not by the box.
    part = bracket(9.0)
    turn = Rotation.from_rotvec([0.4, 1.0, 2.0]).as_matrix()
    moved = es.describe(es.TriangleMesh(25.4 * part.vertices @ turn, part.faces), recipe)
    assert es.retrieval.patch_scores(whole, [moved])[0] < 0.05
