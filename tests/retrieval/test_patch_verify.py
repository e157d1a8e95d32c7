"""Verification by matched points: what it takes from distances, and from which."""

from dataclasses import replace

import numpy as np
import pytest

import eigenshape as es
from eigenshape.retrieval import patch_verify
from eigenshape.retrieval.patch_matching import patch_agreement
from eigenshape.retrieval.patch_score import patch_distances, view_distances

KINDS = ("quadruped", "hand", "octopus", "biped")


@pytest.fixture(scope="module")
def book():
    return es.train_codebook([es.describe_patches(es.make_creature(kind, 3, n_vertices=1200)) for kind in KINDS])


@pytest.fixture(scope="module")
def wholes(book):
    return [known(es.make_creature(kind, 1, n_vertices=1200), book) for kind in KINDS]


@pytest.fixture(scope="module")
def scan(book):
    part = es.partial_scan(es.make_creature("hand", 1, n_vertices=1200), [0.0, 0, 1])
    return known(part.mesh, book)


def known(mesh, book):
    return es.patched_shape([es.describe_patches(mesh), *es.describe_patch_views(mesh, n_views=3)], book)


def test_only_the_nearest_come_nearer(wholes, scan):
    far = np.array([0.9, 0.3, 0.5, 0.8])
    found = es.verify_distances(scan, wholes, far, n_verified=2)
    assert found[[0, 3]].tolist() == far[[0, 3]].tolist()
    expected = [far[place] - patch_verify.WORTH * es.shape_agreement(scan, wholes[place]) for place in (1, 2)]
    assert found[[1, 2]] == pytest.approx(expected)
    assert far.tolist() == [0.9, 0.3, 0.5, 0.8]
    assert es.verify_distances(scan, wholes, np.ones(4)).argmin() == 1


def test_the_nearest_view_of_either_serves(wholes, scan):
    whole = wholes[1]
    own = patch_agreement(scan.points[0], whole.points[0])
    nearest = patch_distances(scan.codes[0], whole.codes[1:]).argmin()
    view = patch_agreement(scan.points[0], whole.points[1 + nearest])
    assert es.shape_agreement(scan, whole) == pytest.approx((own + max(own, view)) / 2)
    back = patch_agreement(whole.points[0], scan.points[0])
    view = patch_agreement(whole.points[1 + nearest], scan.points[0])
    assert es.shape_agreement(whole, scan) == pytest.approx((back + max(back, view)) / 2)
    assert es.shape_agreement(scan, scan) == pytest.approx(patch_agreement(scan.points[0], scan.points[0]))


def test_views_of_the_query_serve_against_parts(wholes, scan):
    whole, other = wholes[1], wholes[0]
    shapes, of = np.array([scan.codes[0], other.codes[0]]), np.array([1, 1, 1])
    found = view_distances(whole.codes[0], shapes, other.codes[1:], of, query_views=whole.codes[1:])
    own = patch_distances(whole.codes[0], shapes)
    nearest = min(own[0], *(patch_distances(view, shapes[:1])[0] for view in whole.codes[1:]))
    assert nearest < own[0]
    assert found[0] == pytest.approx((own[0] + nearest) / 2)
    assert found[1] == view_distances(whole.codes[0], shapes, other.codes[1:], of)[1]


def test_a_shape_takes_patches(book, scan):
    with pytest.raises(es.InvalidParameterError, match="takes patches of the shape, then of its views; there are none"):
        es.patched_shape([], book)
    assert len(scan.points) == len(scan.codes) == 1
    assert not replace(scan).codes.flags.writeable
