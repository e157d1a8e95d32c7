"""Verification by matched points: what it takes from distances, and from which."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es
from eigenshape.retrieval.patches import verification
from eigenshape.retrieval.patches.distance import packed_distances, patch_distances
from eigenshape.retrieval.patches.matching import patch_agreement
from eigenshape.retrieval.patches.packing import pack_codes
from eigenshape.retrieval.patches.patches import surface_patches
from eigenshape.retrieval.patches.verification import (
    AGREEMENT_WEIGHT,
    patch_scores,
    shape_agreement,
    verified_scores,
)

KINDS = ("quadruped", "hand", "octopus", "biped")


@pytest.fixture(scope="module")
def book():
    return es.retrieval.train_codebook(
        [surface_patches(es.make_creature(kind, 3, n_vertices=1200)) for kind in KINDS]
    )


@pytest.fixture(scope="module")
def wholes(book):
    return [known(es.make_creature(kind, 1, n_vertices=1200), book) for kind in KINDS]


@pytest.fixture(scope="module")
def scan(book):
    part = es.partial_scan(es.make_creature("hand", 1, n_vertices=1200), [0.0, 0, 1])
    return known(part.mesh, book)


def known(mesh, book):
    return es.retrieval.patch_descriptor(
        es.retrieval.extract_patches(mesh, n_views=3), es.retrieval.PatchRecipe(book)
    )


def test_agreement_lowers_a_distance(monkeypatch):
    descriptor = es.describe(es.make_creature("fish", n_vertices=500))
    monkeypatch.setattr(verification, "shape_agreement", lambda *_: 0.25)
    found = verified_scores(descriptor, lambda _: descriptor, np.array([0.9, 0.3]), n_verified=1)
    assert found == pytest.approx([0.9, 0.3 * np.exp(-0.25 * AGREEMENT_WEIGHT)])


@pytest.mark.long
def test_only_the_nearest_come_nearer(wholes, scan):
    far = np.array([0.9, 0.3, 0.5, 0.8])
    found = verified_scores(scan, wholes.__getitem__, far, n_verified=2)
    assert found[[0, 3]].tolist() == far[[0, 3]].tolist()
    agreements = np.array([shape_agreement(scan, wholes[place]) for place in (1, 2)])
    expected = far[[1, 2]] * np.exp(-AGREEMENT_WEIGHT * agreements)
    assert found[[1, 2]] == pytest.approx(expected)
    assert far.tolist() == [0.9, 0.3, 0.5, 0.8]
    assert verified_scores(scan, wholes.__getitem__, np.ones(4)).argmin() == 1


@pytest.mark.long
def test_the_nearest_view_of_the_query_serves_against_a_part(wholes, scan):
    whole = wholes[1]
    own = patch_agreement(scan.points[0], whole.points[0])
    assert shape_agreement(scan, whole) == own
    back = patch_agreement(whole.points[0], scan.points[0])
    nearest = patch_distances(scan.codes[0], whole.codes[1:]).argmin()
    view = patch_agreement(whole.points[1 + nearest], scan.points[0])
    assert shape_agreement(whole, scan) == pytest.approx((back + max(back, view)) / 2)
    without = replace(whole, points=whole.points[:1])  # as an index keeps it
    assert shape_agreement(without, scan) == back


def test_views_of_the_query_serve_against_parts(wholes, scan):
    whole, other, part = wholes[1].codes, wholes[0].codes, scan.codes
    packed = [pack_codes(codes) for codes in (part, other)]
    found = packed_distances(whole, packed)
    own = patch_distances(whole[0], np.array([part[0], other[0]]))
    nearest = min(own[0], *(patch_distances(view, part)[0] for view in whole[1:]))
    assert nearest < own[0]
    assert found[0] == pytest.approx((own[0] + nearest) / 2)
    assert found[1] == packed_distances(whole[:1], packed[1:])[0]


@pytest.mark.parametrize("name", ["sphere", "torus", "hand"])
def test_the_same_surface_with_other_vertex_numbers_scores_near_0(name, book):
    mesh = {
        "sphere": es.icosphere(3),
        "torus": es.shapes.torus(40, 30),
        "hand": es.make_creature("hand", 1, n_vertices=1200),
    }[name]
    order = np.random.default_rng(0).permutation(mesh.n_vertices)
    other = es.TriangleMesh(mesh.vertices[order], np.argsort(order)[mesh.faces])
    recipe = es.retrieval.PatchRecipe(book)
    one, two = (
        es.retrieval.patch_descriptor(es.retrieval.extract_patches(each, n_views=0), recipe)
        for each in (mesh, other)
    )
    assert patch_scores(one, [two])[0] < 0.1


def test_a_descriptor_takes_patches(book, scan):
    with pytest.raises(
        es.InvalidParameterError,
        match="needs the patches of a shape; the list is empty",
    ):
        es.retrieval.patch_descriptor([], es.retrieval.PatchRecipe(book))
    assert len(scan.points) == len(scan.codes) == 1
    assert not scan.codes.flags.writeable


@pytest.mark.long
def test_noise_and_inward_faces_hardly_matter(wholes):
    mesh = es.make_creature("hand", 2, n_vertices=1500)
    noise = (
        0.1
        * es.geometry.edge_lengths(mesh).mean()
        * np.random.default_rng(0).standard_normal(mesh.vertices.shape)
    )
    spoilt = es.TriangleMesh(mesh.vertices + noise, mesh.faces[:, ::-1])
    recipe = wholes[0].recipe
    assert patch_scores(es.describe(spoilt, recipe), wholes).argmin() == 1
