"""Distances that a cohort of other shapes normalizes."""

import numpy as np
import pytest

import eigenshape as es
from eigenshape.retrieval.patches.cohort import (
    FEWEST_MEMBERS,
    ISOLATION_STEP,
    isolation,
    normalized_distances,
)
from eigenshape.retrieval.patches.distance import patch_distances, view_distances

pytestmark = pytest.mark.long

KINDS = ("quadruped", "hand", "octopus", "biped", "fish", "bird")


@pytest.fixture(scope="module")
def lessons():
    return [
        patches
        for kind in KINDS
        for patches in es.retrieval.extract_patches(
            es.make_creature(kind, 3, n_vertices=600), n_views=1
        )
    ]


@pytest.fixture(scope="module")
def recipe(lessons):
    return es.retrieval.PatchRecipe(es.retrieval.train_codebook(lessons))


@pytest.fixture(scope="module")
def shapes(recipe):
    meshes = [es.make_creature(kind, 1, n_vertices=600) for kind in KINDS]
    return [
        es.retrieval.patch_descriptor(es.retrieval.extract_patches(mesh, n_views=1), recipe)
        for mesh in meshes
    ]


def test_the_cohort_is_of_the_closed_shapes(recipe, lessons):
    cohort = recipe.codebook.cohort
    wholes = [es.retrieval.patch_descriptor([each], recipe) for each in lessons[::2]]
    assert cohort.tolist() == [whole.codes[0].tolist() for whole in wholes]


def test_too_few_closed_shapes_are_no_cohort(lessons):
    codebook = es.retrieval.train_codebook(lessons[: 2 * (FEWEST_MEMBERS - 1)])
    assert codebook.cohort.shape[0] == 0
    descriptor = es.retrieval.patch_descriptor(lessons[:1], es.retrieval.PatchRecipe(codebook))
    assert descriptor.isolation == 0.0


@pytest.mark.parametrize(("is_closed", "usual"), [(True, 0.77), (False, 0.84)])
def test_the_nearest_member_does_not_count(recipe, is_closed, usual):
    cohort = recipe.codebook.cohort
    distances = np.sort(patch_distances(cohort[0], cohort))
    assert distances[0] == 0
    found = isolation(cohort[0], recipe.codebook, is_closed=is_closed)
    assert found == pytest.approx(distances[1:].mean() - usual, abs=ISOLATION_STEP)


def test_isolated_shapes_come_nearer_to_closed_queries_alone(shapes):
    isolations = np.array([shape.isolation for shape in shapes])
    assert isolations == pytest.approx(np.rint(isolations / ISOLATION_STEP) * ISOLATION_STEP)
    query = shapes[0]
    distances = view_distances(query.codes, [shape.codes for shape in shapes])
    found = normalized_distances(query.codes, distances, isolations)
    assert found[0] == 0.0
    ratios = found[1:] / distances[1:]
    assert (np.argsort(ratios) == np.argsort(-isolations[1:])).all()
    assert normalized_distances(query.codes[:1], distances, isolations) is distances


def test_an_index_scores_as_descriptors_do(shapes):
    index = es.ShapeIndex.create(None)
    for kind, shape in zip(KINDS, shapes, strict=True):
        index.add_descriptors(kind, [shape])
    scores = es.retrieval.patch_scores(shapes[0], shapes)
    found = {match.name: match.score for match in index.query(shapes[0], n_matches=len(KINDS))}
    assert [found[kind] for kind in KINDS] == scores.tolist()
