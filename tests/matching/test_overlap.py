"""Two parts of one shape: the region that both have, the map in it, and none where there is none."""

import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError

CREATURE = es.make_creature("bird", n_vertices=1500)
HEIGHTS = CREATURE.vertices[:, 2]


def cut(keep):
    """Return the part of the creature whose vertices are kept, and their numbers."""
    faces = CREATURE.faces[keep[CREATURE.faces].all(axis=1)]
    numbers, places = np.unique(faces, return_inverse=True)
    rest = es.TriangleMesh(CREATURE.vertices[numbers], places.reshape(-1, 3))
    return rest, numbers


@pytest.fixture(scope="module")
def halves():
    """Return two parts that share half of the creature, their vertices' numbers, and the match."""
    low, high = np.quantile(HEIGHTS, [0.25, 0.75])
    (one, ours), (two, theirs) = cut(high > HEIGHTS), cut(low < HEIGHTS)
    return one, ours, two, theirs, es.match_shapes(one, two, overlap="partial")


@pytest.mark.long
def test_two_copies_overlap_everywhere():
    found = es.match_shapes(CREATURE, CREATURE, overlap="partial")
    assert found.mapped.mean() > 0.95
    assert found.covered.mean() > 0.95
    places = found.pull(CREATURE.vertices)[found.mapped]
    away = np.linalg.norm(places - CREATURE.vertices[found.mapped], axis=1)
    assert away.mean() < 0.02 * np.sqrt(es.geometry.surface_area(CREATURE))


@pytest.mark.long
def test_two_parts_share_what_both_have(halves):
    one, ours, two, theirs, found = halves
    for mesh, mine, others, mask in (
        (one, ours, theirs, found.mapped),
        (two, theirs, ours, found.covered),
    ):
        shared, areas = np.isin(mine, others), es.geometry.dual_volumes(mesh)
        assert areas[shared & mask].sum() > 0.75 * areas[shared | mask].sum()
    assert any("share" in sentence for sentence in found.report)


@pytest.mark.long
def test_vertices_outside_the_overlap_have_no_place(halves):
    _, _, two, _, found = halves
    outside = ~found.mapped
    assert outside.any()
    for numbers in (found.vertices, found.faces, found.corners):
        assert (numbers[outside] == -1).all()
    assert (found.confidence[outside] == 0).all()
    assert np.isnan(found.pull(two.vertices)[outside]).all()
    assert (found.pull(np.arange(two.n_vertices))[outside] == -1).all()
    assert not found.pull(np.ones(two.n_vertices, dtype=bool))[outside].any()


@pytest.mark.long
def test_shapes_without_a_common_region_have_no_map():
    found = es.match_shapes(
        es.make_creature("octopus", n_vertices=800), es.icosphere(3), overlap="partial"
    )
    assert not found.mapped.any()
    assert not found.covered.any()
    assert found.score == 0
    assert "no region" in found.report[-1]


@pytest.fixture(scope="module")
def tetrahedron():
    corners = np.eye(4)[:, 1:] - 0.25
    return es.TriangleMesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


@pytest.fixture(scope="module")
def nothing(tetrahedron):
    return es.match_shapes(tetrahedron, CREATURE, overlap="partial", mirrored=True)


def test_part_that_is_too_coarse_has_no_map(nothing):
    assert not nothing.mapped.any()
    assert nothing.mirrored


def test_part_of_a_map_gives_no_pose(tetrahedron, nothing):
    with pytest.raises(InvalidParameterError, match="it leaves out 4 vertices, first 0"):
        es.matching.take_pose(tetrahedron, CREATURE, match=nothing)


@pytest.mark.long
def test_parts_that_share_nothing_have_no_map():
    middle = np.quantile(HEIGHTS, 0.5)
    (one, _), (two, _) = cut(middle > HEIGHTS), cut(middle < HEIGHTS)
    found = es.match_shapes(one, two, overlap="partial")
    assert not found.mapped.any()


@pytest.mark.long
def test_confidence_in_an_overlap_is_high_where_it_is_right(halves):
    _, ours, _, theirs, found = halves
    inside = found.mapped
    away = np.linalg.norm(
        CREATURE.vertices[theirs[found.vertices[inside]]] - CREATURE.vertices[ours[inside]], axis=1
    )
    right = away < 0.05 * np.sqrt(es.geometry.surface_area(CREATURE))
    assert abs(found.confidence[inside].mean() - right.mean()) < 0.15
    assert found.n_equally_good == 1


@pytest.mark.long
def test_mirror_image_of_a_part_is_mapped_on_request(halves):
    one, _, two, _, found = halves
    image = es.TriangleMesh(one.vertices * [1, -1, 1], one.faces[:, ::-1])
    other = es.match_shapes(image, two, overlap="partial", mirrored=True)
    assert other.mirrored
    assert (other.mapped == found.mapped).mean() > 0.9


def test_overlap_must_be_full_or_partial():
    with pytest.raises(
        InvalidParameterError, match="overlap must be 'full' or 'partial'; it is 'some'"
    ):
        es.match_shapes(CREATURE, CREATURE, overlap="some")


def test_overlapping_parts_must_have_one_unit():
    with pytest.raises(InvalidParameterError, match="one unit of length"):
        es.match_shapes(CREATURE, CREATURE, overlap="partial", scale="unknown")
