"""The retrieval experiment: draws, scores and the store are what they say, and so is the README."""

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import eigenshape as es

FOLDER = Path(__file__).resolve().parents[2] / "experiments" / "ch5_retrieval"
sys.path[:0] = [str(FOLDER), str(FOLDER.parent)]
import describing  # noqa: E402
import draws  # noqa: E402
import run  # noqa: E402
import scores  # noqa: E402


class Size:
    """A method for tests: a shape is known by the number of its vertices, and some cannot be described."""

    name = "size"

    def __repr__(self):
        return "Size()"

    def describe(self, mesh):
        if mesh.n_vertices == 12:
            raise es.InvalidShapeError("Twelve is too few.")
        return mesh.n_vertices

    def distances(self, query, described):
        return np.abs(np.array(described) - query)


def shape(number, label="ant"):
    return draws.Shape(number, f"{number}.ply", label, f"{label}/{number}")


@pytest.fixture
def made(monkeypatch, tmp_path):
    """Let versions be spheres, of a level that the shape's number gives, with files of their own."""
    spheres = [es.icosphere(level) for level in range(3)]
    for number in range(7):
        (tmp_path / f"{number}.ply").write_text(str(number))
    monkeypatch.setattr(describing, "DATA", tmp_path)
    monkeypatch.setattr(describing, "make", lambda version: spheres[version.shape.number % 3])
    monkeypatch.setattr(describing, "ProcessPoolExecutor", Here)
    describing.digest.cache_clear()
    return describing.Store(tmp_path / "store")


class Here:
    """An executor that works in this process."""

    def __init__(self, *args, **kwargs):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *args):
        pass

    def submit(self, work, *args):
        future = describing.Future()
        future.set_result(work(*args))
        return future


@pytest.mark.data
def test_no_individual_is_in_both_halves():
    everything = draws.shapes()
    halves = [draws.half_of(everything, half) for half in draws.HALVES]
    assert sorted(one.number for half in halves for one in half) == list(range(len(everything)))
    tuning, reporting = ({one.identity for one in half} for half in halves)
    assert not tuning & reporting
    assert {one.identity for one in everything if "michael" in one.path} == {"human/tosca_michael"}
    assert {one.identity for one in everything if "sumner_lion" in one.path} == {"lion/sumner_lion"}
    assert abs(len(halves[0]) - len(halves[1])) < 10


@pytest.mark.data
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_draw_asks_for_fifty_poses_that_its_databases_lack(seed):
    some = draws.half_of(draws.shapes(), "reporting")
    drawn = draws.draw(some, seed)
    assert Counter(query.kind == "complete" for query in drawn.queries) == {True: 18, False: 32}
    asked, mixed, complete = (
        {version.shape for version in part} for part in (drawn.queries, drawn.mixed, drawn.complete)
    )
    assert not asked & mixed
    assert mixed == complete
    assert asked | mixed == set(some)
    assert {version.kind for version in drawn.complete} == {"complete"}
    assert {version.kind for version in drawn.mixed} == set(draws.KINDS)
    assert min(Counter(one.label for one in mixed).values()) >= draws.LEFT
    assert draws.draw(some[::-1], seed).queries == drawn.queries[::-1]


@pytest.mark.data
def test_versions_are_what_they_are_called():
    one = next(one for one in draws.shapes() if one.path.endswith("psb122.ply"))
    for kind in draws.KINDS:
        version = draws.Version(one, kind, 1)
        mesh = draws.make(version)
        assert np.array_equal(mesh.vertices, draws.make(version).vertices)
        assert es.geometry.is_closed(mesh) == (kind == "complete")
        assert es.geometry.vertex_components(mesh)[0] == 1
        upright = draws.make(version, turned=False)
        assert np.ptp(upright.vertices, axis=0).max() == pytest.approx(1)
        assert not np.allclose(mesh.vertices, upright.vertices)
        np.testing.assert_allclose(
            es.geometry.edge_lengths(mesh), es.geometry.edge_lengths(upright), rtol=1e-9
        )


@pytest.mark.long
def test_planes_keep_a_piece_of_the_wanted_size():
    whole = es.make_creature("quadruped", n_vertices=900)
    for seed in range(5):
        piece = draws.incomplete(whole, np.random.default_rng(seed))
        assert (
            draws.KEPT[0]
            <= es.geometry.surface_area(piece) / es.geometry.surface_area(whole)
            <= draws.KEPT[1]
        )
        assert es.geometry.vertex_components(piece)[0] == 1
    with pytest.raises(es.InvalidShapeError, match="An incomplete version must keep"):
        draws.incomplete(es.TriangleMesh(np.eye(3), [[0, 1, 2]]), np.random.default_rng(0))


def test_a_rotation_is_one():
    turn = draws.rotation(np.random.default_rng(4))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(turn) == pytest.approx(1)


def test_scores_by_hand():
    outcome = scores.Outcome("partial", "ant", ("cat", "ant", "cup", "ant"))
    assert scores.measured(outcome).tolist() == [0, 1, 1, (1 / 2 + 2 / 4) / 2]
    assert scores.measured(scores.Outcome("partial", "ant", ())).tolist() == [0, 0, 0, 0]
    found = scores.rates([outcome, scores.Outcome("complete", "cat", ("lion",))])
    assert found["all"]["top3"] == [50.0, 0.0, 100.0]
    assert found["incomplete"]["top3"] == [100.0, 100.0, 100.0]
    assert (
        scores.measured(scores.four_legged_as_one(scores.Outcome("complete", "cat", ("lion",))))[0]
        == 1
    )


def test_differences_pair_the_queries():
    right, wrong = (scores.Outcome("partial", "ant", (label,)) for label in ("ant", "cat"))
    one, two = [right, wrong, wrong], [right, right, wrong]
    assert scores.differences(one, one)["all"]["top1"] == [0.0, 0.0, 0.0]
    found = scores.differences(one, two)["all"]["top1"]
    assert found[0] == -33.3
    assert found[1] >= -100.0
    assert found[2] == 0.0


def test_nothing_is_described_twice_and_failures_are_named(made, monkeypatch):
    versions = [draws.complete(shape(number)) for number in range(3)]
    assert describing.describe_all(made, [Size()], versions, 1) == {
        "ant/0, complete (draw 0), size": "Twelve is too few."
    }
    monkeypatch.setattr(describing, "make", None)
    assert len(describing.describe_all(made, [Size()], versions, 1)) == 1
    assert made.load(Size(), versions[2]) == 162


def test_a_version_that_cannot_be_made_is_named(made, monkeypatch):
    def refuse(version):
        raise es.InvalidShapeError("No planes will do.")

    monkeypatch.setattr(describing, "make", refuse)
    found = describing.describe_all(made, [Size()], [draws.Version(shape(1), "incomplete", 2)], 1)
    assert found == {
        "ant/1, incomplete (draw 2), size": "there is no such version: No planes will do."
    }


def test_outcomes_are_in_order_of_distance_and_failures_no_answers(made):
    database = [
        draws.complete(shape(number, label))
        for number, label in ((1, "cat"), (2, "ant"), (3, "cup"))
    ]
    query, lost = draws.complete(shape(5, "ant")), draws.complete(shape(6, "ant"))
    describing.describe_all(made, [Size()], [*database, query, lost], 1)
    found = run.outcomes(Size(), made, [query, lost], database)
    assert [one.ranking for one in found] == [("ant", "cat"), ()]


def test_a_method_may_learn(made, monkeypatch):
    class Learner(Size):
        def train(self, meshes):
            return [mesh.n_vertices for mesh in meshes]

    monkeypatch.setattr(run, "make", describing.make)
    for _ in range(2):
        assert run.ready(Learner(), [shape(0), shape(1)], made) == [12, 42]
        monkeypatch.setattr(run, "make", None)  # what was learnt is kept
    size = Size()
    assert run.ready(size, [shape(0)], made) is size


@pytest.mark.long
@pytest.mark.data
def test_the_number_of_workers_changes_no_descriptor(tmp_path):
    glasses = [one for one in draws.shapes() if one.label == "glasses"][:3]
    versions = [draws.Version(one, kind, 0) for one in glasses for kind in ("complete", "partial")]
    method = run.METHODS["ShapeDNA"]
    one, two = (describing.Store(tmp_path / name) for name in ("one", "two"))
    assert describing.describe_all(one, [method], versions, 1) == {}
    assert describing.describe_all(two, [method], versions, 2) == {}
    for version in versions:
        np.testing.assert_array_equal(one.load(method, version), two.load(method, version))


@pytest.mark.long
@pytest.mark.data
def test_patches_find_parts_better_than_the_thesis_recipe(quick_form):
    rates = quick_form("ch5_retrieval/run.py")["mixed"]
    assert (
        rates["patches, default codebook"]["all"]["top3"][0]
        >= rates["thesis, cotangent"]["all"]["top3"][0]
    )


def test_each_is_asked_for_among_all_others(made):
    some = [shape(number, "ant") for number in (1, 2, 4, 5)]
    one = run.among_all(draws.Draw(0, (), (), ()), some)
    assert (
        [version.shape for version in one.mixed]
        == [version.shape for version in one.complete]
        == some
    )
    assert one.mixed == draws.draw(some, 0, 0, 0).mixed
    database = [draws.complete(each) for each in some]
    describing.describe_all(made, [Size()], database, 1)
    for found, asked in zip(run.answers(Size(), made, database, database), some, strict=True):
        assert sorted(version.shape.number for version in found) == [
            n for n in (1, 2, 4, 5) if n != asked.number
        ]
