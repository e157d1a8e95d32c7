"""Distances that are scaled by how isolated a shape is among the others."""

import numpy as np
import pytest
from describers import keep
from search_cases import RECIPE, mixtures

import eigenshape as es
from eigenshape.retrieval.patches.descriptor import PatchDescriptor
from eigenshape.retrieval.patches.distance import (
    N_NEAREST,
    USUAL_ISOLATION,
    measure_isolations,
    patch_distances,
    scale_distances,
)
from eigenshape.retrieval.search import coarse

N_SHAPES = 8


@pytest.fixture(scope="module")
def codes():
    return mixtures(1, N_SHAPES, 1)


@pytest.fixture(scope="module")
def points():
    mesh = es.make_creature("fish", n_vertices=500)
    patches = es.retrieval.extract_patches(mesh, n_samples=20, n_views=0)
    return es.retrieval.patch_descriptor(patches, es.retrieval.PatchRecipe()).points


def test_isolation_is_the_mean_distance_to_the_nearest_others(codes):
    wholes = codes[:, 0]
    found = measure_isolations(wholes.__getitem__, N_SHAPES, np.array([2]))
    distances = np.sort(np.delete(patch_distances(wholes[2], wholes), 2))
    assert found == pytest.approx(distances[:N_NEAREST].mean())


def test_a_shape_without_others_is_as_isolated_as_usual(codes):
    assert measure_isolations(codes[:, 0].__getitem__, 1, np.array([0])) == USUAL_ISOLATION


@pytest.mark.parametrize(("n_views", "share"), [(1, 1.0), (0, 0.5)])
def test_isolated_shapes_come_nearer(codes, n_views, share):
    isolations = np.array([0.4, USUAL_ISOLATION, 0.8])
    found = scale_distances(codes[0][: 1 + n_views], np.ones(3), isolations)
    assert found == pytest.approx(np.exp([0.2 * share, 0, -0.2 * share]))


def test_an_index_scores_as_descriptors_do_in_any_order(codes, points):
    """Also with a copy of a shape, which is no neighbor of it."""
    shapes = [PatchDescriptor(each, points, RECIPE) for each in [*codes, codes[3]]]
    expected = es.retrieval.patch_scores(shapes[0], shapes)
    assert expected[3] == expected[-1]
    for order in (range(len(shapes)), reversed(range(len(shapes)))):
        index = es.ShapeIndex.create(None)
        for number in order:
            keep(index, str(number), [shapes[number]])
        found = {each.name: each.score for each in index.query(shapes[0], n_matches=len(shapes))}
        assert [found[str(number)] for number in range(len(shapes))] == expected.tolist()


def test_what_is_added_removed_or_merged_is_scored_as_in_a_new_index(points, tmp_path, monkeypatch):
    """Isolations are kept in a file, which must follow the index."""
    monkeypatch.setattr(coarse, "FEWEST_TO_KEEP", 1)
    count = 14
    shapes = [
        es.retrieval.DescribedShape(str(number), [PatchDescriptor(each, points, RECIPE)])
        for number, each in enumerate(mixtures(2, count))
    ]
    query = shapes[0].descriptors[0]

    def scores(index):
        return {match.name: match.score for match in index.query(query, n_matches=count)}

    def scores_anew(some):
        index = es.ShapeIndex.create(None)
        index.add_many(some)
        return scores(index)

    index = es.ShapeIndex.create(tmp_path / "index")
    index.add_many(shapes[:-5])
    assert scores(index) == scores_anew(shapes[:-5])
    (kept,) = index.folder.glob("isolation-*.npz")
    index.add_many(shapes[-5:-2])
    assert scores(index) == scores_anew(shapes[:-2])
    index.remove("1", "2")
    assert scores(index) == scores_anew([shapes[0], *shapes[3:-2]])
    other = es.ShapeIndex.create(tmp_path / "other")
    other.add_many(shapes[-2:])
    index.merge([other])
    whole = scores_anew([shapes[0], *shapes[3:]])
    assert scores(index) == whole
    kept.write_bytes(kept.read_bytes()[:1000])
    assert scores(index) == whole
