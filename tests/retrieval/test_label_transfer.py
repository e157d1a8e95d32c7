import numpy as np
import pytest

from eigenshape._errors import InvalidParameterError
from eigenshape.features.parts import find_parts
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.union import disjoint_union
from eigenshape.plot.sheet import figure_label_transfer
from eigenshape.retrieval import label_transfer as transfer
from eigenshape.retrieval.label_transfer import transfer_labels
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere


def right_share(kind, pose, labels_of):
    rest, posed = (make_creature(kind, each, n_vertices=2000) for each in (0, pose))
    labels = labels_of(rest)
    given = transfer_labels(rest, labels, posed)
    areas = face_areas(
        posed
    )  # poses share their faces, so that labels of the rest pose are right on the other
    return areas[given.labels == labels].sum() / areas.sum(), given


@pytest.mark.long
@pytest.mark.parametrize("kind", ["giraffe", "bird"])
def test_parts_of_a_pose_take_the_labels_of_the_same_parts_in_another(kind):
    share, given = right_share(kind, 3, lambda mesh: find_parts(mesh).parts.labels)
    assert share > 0.95
    assert sorted(given.matches.tolist()) == list(range(len(given.matches)))
    assert (given.confidence > 0.3).any()


@pytest.mark.long
def test_labels_of_a_person_reach_the_quadruped_in_another_pose():
    def named(mesh):
        centers = mesh.vertices[mesh.faces].mean(axis=1)
        _, up, front = centers.T
        return np.select([(front > 0.55) & (up > 0.2), up < -0.2], [7, 3], 5)

    share, given = right_share("quadruped", 3, named)
    assert share > 0.75, "as far as parts and labels have the same borders"
    assert set(given.part_labels.tolist()) == {3, 5, 7}
    assert np.array_equal(given.part_labels[given.target.labels], given.labels)


@pytest.mark.long
def test_a_shape_gives_itself_its_labels_in_any_unit_and_numbering():
    mesh = make_creature("lizard", n_vertices=1200)
    labels = find_parts(mesh).parts.labels
    itself = transfer_labels(mesh, labels, mesh)
    assert np.array_equal(itself.labels, labels)
    order = np.random.default_rng(2).permutation(mesh.n_faces)
    far = TriangleMesh(mesh.vertices * 1e90, mesh.faces[order])
    assert np.array_equal(transfer_labels(mesh, labels, far).labels, labels[order])


def test_parts_without_descriptors_are_told_by_their_distances_alone():
    rng = np.random.default_rng(5)
    for _ in range(20):
        points = rng.normal(size=(5, 3))
        shuffled = rng.permutation(5)
        apart = np.linalg.norm(points[:, None] - points[None], axis=2)
        found = transfer._match_parts(np.zeros((5, 5)), apart, apart[np.ix_(shuffled, shuffled)])
        assert np.array_equal(shuffled[found], np.arange(5))


def test_confidence_is_nothing_where_another_label_fits_as_well():
    prices = np.array([[1.0, 1.0, 9.0], [4.0, 1.0, 9.0], [9.0, 9.0, 0.0]])
    found = transfer._confidence(prices, np.arange(3), np.array([0, 1, 2]))
    np.testing.assert_allclose(found, [0, 0.75, 1])
    one_label = transfer._confidence(prices, np.arange(3), np.array([0, 0, 2]))
    np.testing.assert_allclose(one_label, [1 - 1 / 9, 1 - 1 / 9, 1])


def test_parts_beyond_the_others_number_take_the_nearest():
    ball = icosphere(2)
    apart = disjoint_union(ball, TriangleMesh(ball.vertices * 0.7 + 5, ball.faces))
    given = transfer_labels(ball, np.full(ball.n_faces, 4), apart, n_parts=1)
    assert given.matches.tolist() == [0, 0]
    assert set(given.labels.tolist()) == {4}


@pytest.mark.long
def test_the_picture_gives_matched_parts_one_color_and_says_how_sure():
    mesh = make_creature("lizard", n_vertices=800)
    given = transfer_labels(mesh, find_parts(mesh).parts.labels, mesh)
    left, right = figure_label_transfer(mesh, mesh, given).axes
    assert np.array_equal(np.asarray(left.images[0].get_array()).shape[2:], (4,))
    assert all(text.get_text().startswith("label ") for text in right.texts)
    assert right.texts


def test_at_least_one_part_is_required():
    ball = icosphere(1)
    with pytest.raises(InvalidParameterError, match="n_parts must be at least 1; it is 0"):
        transfer_labels(ball, np.zeros(80, dtype=np.int64), ball, n_parts=0)


def test_one_label_a_face_is_asked_for():
    ball = icosphere(1)
    with pytest.raises(
        InvalidParameterError,
        match=r"labels must hold one whole number per face, shape \(80,\); the shape is \(79,\)",
    ):
        transfer_labels(ball, np.zeros(79, dtype=np.int64), ball)
