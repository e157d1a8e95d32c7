import numpy as np
import pytest

from certeig.kit.errors import InvalidParameterError
from eigenshape._errors import InvalidShapeError
from eigenshape.features.parts import find_parts
from eigenshape.geometry.measure import face_areas
from eigenshape.geometry.mesh import TriangleMesh
from eigenshape.geometry.topology import disjoint_union
from eigenshape.io.labeled_shapes import read_labeled_shape
from eigenshape.io.mesh_files import write_mesh
from eigenshape.plot.sheet import figure_label_transfer
from eigenshape.retrieval.labels import transfer
from eigenshape.retrieval.labels.labeled_shape import LabeledShape
from eigenshape.retrieval.labels.transfer import labels_from_votes, transfer_labels
from eigenshape.shapes.creatures import make_creature
from eigenshape.shapes.surfaces import icosphere


def labeled(kind, pose=0, n_vertices=1200):
    mesh = make_creature(kind, pose, n_vertices=n_vertices)
    rest = make_creature(kind, 0, n_vertices=n_vertices)
    # Poses share their faces, so that labels of the rest pose are right on every other.
    return LabeledShape(mesh, named(rest))


def named(mesh):
    """Label what lies in front, below, and the rest."""
    _, up, front = mesh.vertices[mesh.faces].mean(axis=1).T
    return np.select([(front > 0.55) & (up > 0.2), up < -0.2], [7, 3], 5)


def right_share(found, truth):
    areas = face_areas(truth.mesh)
    return areas[found.labels == truth.labels].sum() / areas.sum()


@pytest.mark.long
@pytest.mark.parametrize("kind", ["giraffe", "quadruped"])
def test_another_pose_takes_the_labels_of_the_rest_pose_where_they_end(kind):
    truth = labeled(kind, 3)
    found = transfer_labels(labeled(kind), truth.mesh)
    assert right_share(found, truth) > 0.93
    assert set(found.part_labels.tolist()) == {3, 5, 7}


@pytest.mark.long
def test_a_shape_gives_itself_its_labels_in_any_unit_and_numbering():
    mesh = make_creature("lizard", n_vertices=1200)
    source = LabeledShape(mesh, find_parts(mesh).parts.labels)
    itself = transfer_labels(source, mesh)
    assert right_share(itself, source) > 0.95
    order = np.random.default_rng(2).permutation(mesh.n_faces)
    far = TriangleMesh(mesh.vertices * 1e90, mesh.faces[order])
    moved = transfer_labels(source, far).labels
    assert (moved == itself.labels[order]).mean() > 0.99


@pytest.mark.long
def test_the_shape_that_is_more_alike_weighs_more():
    truth = labeled("giraffe", 3)
    octopus = make_creature("octopus", n_vertices=1200)
    wrong = LabeledShape(octopus, np.full(octopus.n_faces, 9))
    found = transfer_labels([wrong, labeled("giraffe")], truth.mesh)
    assert found.weights[1] > 2 * found.weights[0]
    assert found.weights.sum() == pytest.approx(1)
    assert right_share(found, truth) > 0.85


@pytest.mark.long
def test_what_is_said_of_a_part_follows_from_its_faces():
    truth = labeled("giraffe", 3)
    found = transfer_labels(labeled("giraffe"), truth.mesh)
    assert np.array_equal(found.part_labels[found.parts], found.labels)
    areas = face_areas(truth.mesh)
    for part, confidence in enumerate(found.part_confidence):
        inside = found.parts == part
        mean = np.average(found.confidence[inside], weights=areas[inside])
        assert confidence == pytest.approx(mean)
        assert found.part_vertices[part] in truth.mesh.faces[inside]


def capsule():
    ball = icosphere(3)
    return TriangleMesh(ball.vertices * [3, 1, 1], ball.faces)


def votes_at_ends(mesh):
    votes = np.zeros((mesh.n_vertices, 2))
    votes[mesh.vertices[:, 0].argmin(), 0] = 1
    votes[mesh.vertices[:, 0].argmax(), 1] = 1
    return votes


def test_labels_meet_halfway_between_two_votes():
    mesh = capsule()
    found = labels_from_votes(mesh, votes_at_ends(mesh), [4, -2])
    centers = mesh.vertices[mesh.faces, 0].mean(axis=1)
    away = np.abs(centers) > 0.2
    assert np.array_equal(found.labels[away], np.where(centers > 0, -2, 4)[away])
    assert sorted(found.part_labels.tolist()) == [-2, 4]
    assert found.confidence[away].min() > found.confidence[~away].min()


def test_a_single_wrong_vote_drowns():
    mesh = capsule()
    votes = np.zeros((mesh.n_vertices, 2))
    votes[::5, 0] = 1
    votes[10] = [0, 1]
    assert set(labels_from_votes(mesh, votes, [0, 1]).labels.tolist()) == {0}


def test_a_component_without_votes_takes_those_of_the_nearest_point():
    mesh = capsule()
    small = TriangleMesh(icosphere(1).vertices * 0.1 + [4, 0, 0], icosphere(1).faces)
    both = disjoint_union(mesh, small)
    votes = np.vstack([votes_at_ends(mesh), np.zeros((small.n_vertices, 2))])
    found = labels_from_votes(both, votes, [0, 1])
    assert set(found.labels[mesh.n_faces :].tolist()) == {1}


def test_a_speck_joins_the_neighbor_with_the_longest_common_boundary():
    mesh = icosphere(4)
    centers = mesh.vertices[mesh.faces, 0].mean(axis=1)
    labels = (centers > 0).astype(np.int64)
    specked = labels.copy()
    specked[centers.argmin()] = 1
    specked[centers.argmax()] = 2
    assert np.array_equal(transfer._join_small_pieces(mesh, specked), labels)


@pytest.mark.parametrize(
    ("votes", "labels", "message"),
    [
        (np.ones(42), [1], "votes must have a column for each label"),
        (-np.ones((42, 1)), [1], "no entry below 0"),
        (np.zeros((42, 1)), [1], "and one above"),
        (np.ones((42, 2)), [1], r"one for each of the \(2,\) columns of votes"),
        (np.ones((42, 2)), [1, 1], "labels must differ; label 1 stands in columns 0 and 1"),
    ],
)
def test_votes_and_labels_are_checked(votes, labels, message):
    with pytest.raises(InvalidParameterError, match=message):
        labels_from_votes(icosphere(1), votes, labels)


def test_at_least_one_labeled_shape_is_required():
    with pytest.raises(InvalidParameterError, match="labeled must hold at least one labeled shape"):
        transfer_labels([], icosphere(1))


def test_a_labeled_shape_with_a_face_without_area_is_left_out_by_its_number():
    fish = make_creature("fish", n_vertices=500)
    a, b, _ = fish.faces[0]
    corner = len(fish.vertices)
    middle = fish.vertices[[a, b]].mean(axis=0)
    torn = TriangleMesh(np.vstack([fish.vertices, middle]), [*fish.faces, [a, b, corner]])
    broken = LabeledShape(torn, np.append(named(fish), 7))
    sound = LabeledShape(fish, named(fish))
    with pytest.warns(UserWarning, match=r"labeled\[1\] was left out: Faces must have area"):
        found = transfer_labels([sound, broken], fish)
    alone = transfer_labels(sound, fish)
    assert found.weights.tolist() == [1, 0]
    assert np.array_equal(found.labels, alone.labels)
    np.testing.assert_allclose(found.confidence, alone.confidence, rtol=1e-12)  # sums of two shapes
    with pytest.raises(InvalidShapeError, match="Faces must have area"):
        transfer_labels([broken, broken], fish)


def test_the_remedy_for_a_labeled_shape_repairs_its_labels_too(tmp_path):
    ball = icosphere(2)
    torn = TriangleMesh(ball.vertices, [*ball.faces, ball.faces[0]])
    broken = LabeledShape(torn, np.append(np.arange(ball.n_faces), 0))
    with pytest.raises(
        InvalidShapeError, match=r"must differ.* Try es\.io\.read_labeled_shape\(path"
    ):
        transfer_labels(broken, ball)
    path = tmp_path / "torn.ply"
    write_mesh(torn, path, face_labels=broken.labels)
    repaired = read_labeled_shape(path, repair=["auto"])
    assert repaired.labels.tolist() == list(range(ball.n_faces))
    assert len(repaired.points.vertices) > 0


def test_one_label_a_face_is_required():
    with pytest.raises(
        InvalidParameterError,
        match=r"labels must hold one whole number per face, shape \(80,\); the shape is \(79,\)",
    ):
        LabeledShape(icosphere(1), np.zeros(79, dtype=np.int64))


@pytest.mark.long
def test_the_picture_names_labels_and_says_how_sure():
    source = labeled("lizard", n_vertices=800)
    found = transfer_labels(source, source.mesh)
    names = ["zero", "one", "two", "leg", "four", "rest", "six"]
    left, right = figure_label_transfer(source, source.mesh, found, names=names).axes
    assert np.array_equal(np.asarray(left.images[0].get_array()).shape[2:], (4,))
    texts = [text.get_text() for text in right.texts]
    assert len(texts) == len(found.part_labels)
    assert any(text.startswith("rest, ") for text in texts)
