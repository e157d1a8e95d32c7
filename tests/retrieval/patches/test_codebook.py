"""Words and vectors of patches beside their definitions."""

import numpy as np
import pytest
from scipy.special import logsumexp
from sklearn.mixture import GaussianMixture

import eigenshape as es
from eigenshape.retrieval.patches import codebook as codes
from eigenshape.retrieval.patches import training
from eigenshape.retrieval.patches.codebook import CLIP, encode_patches, round_codes
from eigenshape.retrieval.patches.distance import (
    SIZE_PRICE,
    packed_distances,
    patch_distances,
)
from eigenshape.retrieval.patches.packing import pack_codes, unpack_codes
from eigenshape.retrieval.patches.patches import Patches, extract_patches, surface_patches
from eigenshape.scans.partial import viewpoint

KINDS = ("quadruped", "hand", "octopus", "biped")


@pytest.fixture(scope="module")
def creatures():
    return {
        (kind, seed): surface_patches(es.make_creature(kind, seed, n_vertices=1200))
        for kind in KINDS
        for seed in (1, 2)
    }


@pytest.fixture(scope="module")
def book(creatures):
    return training.train_codebook(
        [patches for (_, seed), patches in creatures.items() if seed == 1]
    )


@pytest.mark.long
def test_another_pose_is_the_nearest(creatures, book):
    vectors = {
        key: round_codes(encode_patches(patches, book), CLIP) for key, patches in creatures.items()
    }
    known = np.array([vectors[kind, 1] for kind in KINDS])
    for place, kind in enumerate(KINDS):
        assert patch_distances(vectors[kind, 2], known).argmin() == place
        assert patch_distances(vectors[kind, 1], known)[place] == pytest.approx(0, abs=1e-6)


@pytest.mark.long
def test_vectors_are_gradients_of_the_likelihood(creatures, book):
    shape = creatures["hand", 2]
    place, radius, step = 1, codes.BASES[1], 1e-5
    points = codes.standardize(
        shape.numbers[:, radius].astype(float), book.means[place], book.spreads[place]
    )
    points = points @ book.axes[place]
    weights = shape.weights[:, radius] / shape.weights[:, radius].sum(dtype=np.float64)

    middles, spreads = (
        book.centers[place].astype(float),
        np.sqrt(book.variances[place].astype(float)),
    )

    def likelihood(centers, spreads):
        joint = codes.log_joint(points, book.shares[place].astype(float), centers, spreads**2)
        return float(weights @ np.log(np.exp(joint).sum(axis=1)))

    found = codes._fisher(shape, radius, book, place).reshape(2, *book.centers[place].shape)
    for word, axis in ((0, 0), (3, 7), (31, 19)):
        moved, root = np.zeros_like(spreads), np.sqrt(book.shares[place, word])
        moved[word, axis] = step * spreads[word, axis]
        slopes = [
            (likelihood(middles + moved, spreads) - likelihood(middles - moved, spreads)),
            (likelihood(middles, spreads + moved) - likelihood(middles, spreads - moved)),
        ]
        expected = np.array(slopes) / (2 * step) / root / [1, np.sqrt(2)]
        assert found[:, word, axis] == pytest.approx(expected, abs=1e-5)


def test_the_mixture_is_as_likely_as_another_librarys():
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.normal(place, 0.5 + 0.1 * place, (200, 4)) for place in range(8)])
    shares, centers, variances = training._fit_mixture(points, 0)
    ours = np.log(
        np.exp(codes.log_joint(points, shares, centers, variances)).sum(axis=1)
    ).mean() - 2 * np.log(2 * np.pi)
    theirs = GaussianMixture(
        codes.N_ENTRIES,
        covariance_type="diag",
        reg_covar=0,
        tol=1e-5,
        max_iter=2000,
        random_state=0,
    ).fit(points)
    assert shares.sum() == pytest.approx(1)
    assert ours > theirs.score(points) - 0.05


def test_steps_of_size_are_found_and_have_a_price():
    rng = np.random.default_rng(0)
    query = rng.integers(-7, 8, (3, 3, 64)).astype(np.int8)
    larger = np.roll(query, 1, axis=1)  # what one has at a radius the other has at the next
    assert patch_distances(query, query[None]) == pytest.approx(0, abs=1e-6)
    assert patch_distances(query, larger[None]) == pytest.approx(SIZE_PRICE, abs=1e-6)
    assert patch_distances(larger, query[None]) == pytest.approx(SIZE_PRICE, abs=1e-6)


def distances(query, others):
    return packed_distances(query, [pack_codes(other) for other in others])


def test_a_view_counts_by_half():
    query, one, two, seen = np.random.default_rng(1).integers(-7, 8, (4, 3, 1, 64), dtype=np.int8)
    far, near = (
        patch_distances(query, np.array([one, two])),
        patch_distances(query, np.array([seen, query])),
    )
    found = distances(query[None], [np.array([one, seen, query]), np.array([two])])
    assert found == pytest.approx([(far[0] + min(far[0], near.min())) / 2, far[1]])
    without = distances(query[None], [one[None], two[None]])
    assert without == pytest.approx(far)


def test_packed_codes_have_the_same_distances():
    rng = np.random.default_rng(2)
    query, *others = (
        rng.integers(-7, 8, (count, 3, 3, 64), dtype=np.int8) for count in (3, 4, 1, 2)
    )
    packed = [pack_codes(other) for other in others]
    assert [rows.shape for rows in packed] == [(36, 32), (9, 32), (18, 32)]
    expected = []
    for other in others:
        own, *views = patch_distances(query[0], other)
        if len(other) == 1:
            views = patch_distances(other[0], query[1:])
        expected.append((own + min(own, *views)) / 2)
    assert packed_distances(query, packed) == pytest.approx(expected, rel=1e-12)
    for rows, other in zip(packed, others, strict=True):
        assert np.array_equal(unpack_codes(rows), other.reshape(-1, 64))


def test_packed_codes_of_another_width_are_named():
    query = np.ones((1, 3, 3, 64), dtype=np.int8)
    packed = [np.zeros((9, 32), np.uint8), np.zeros((9, 31), np.uint8)]
    with pytest.raises(ValueError, match=r"each_of_others must .*; its shape is \(9, 31\)"):
        packed_distances(query, packed)
    assert packed_distances(query, []).shape == (0,)


def test_distances_are_those_of_cosines():
    query, other = np.random.default_rng(3).integers(-7, 8, (2, 3, 1, 64), dtype=np.int8)
    products = (query.astype(float) * other).sum(axis=2)
    cosines = products / np.linalg.norm(query, axis=2) / np.linalg.norm(other, axis=2)
    assert patch_distances(query, other[None]) == pytest.approx(1 - cosines.mean())
    assert patch_distances(query, 0 * other[None]) == pytest.approx(1)


@pytest.mark.long
def test_a_scan_is_nearest_to_the_view_from_its_side(creatures, book):
    mesh = es.make_creature("hand", 1, n_vertices=4000)  # without long edges, which would be split
    _, *views = extract_patches(mesh, n_views=3, clean=False)
    codes = np.array([round_codes(encode_patches(view, book), CLIP) for view in views])
    for place in range(3):
        scan = es.partial_scan(mesh, viewpoint(place)).mesh
        query = round_codes(encode_patches(surface_patches(scan), book), CLIP)
        found = patch_distances(query, codes)
        assert found.argmin() == place
        assert found[place] == pytest.approx(0, abs=1e-5)
        assert set(views[place].vertices) <= set(range(mesh.n_vertices))
    assert len(extract_patches(scan, n_views=3)) == 1


@pytest.mark.long
def test_the_same_again(creatures):
    one, two = (training.train_codebook(list(creatures.values()), seed=3) for _ in range(2))
    for name in ("means", "spreads", "axes", "shares", "centers", "variances"):
        assert np.array_equal(getattr(one, name), getattr(two, name))


def test_too_few_patches_are_refused():
    few = Patches(
        np.zeros((3, 9, 64), np.float32),
        np.ones((3, 9), np.float32),
        np.arange(3),
        *np.zeros((3, 3, 3), np.float32),
    )
    with pytest.raises(
        es.InvalidParameterError, match="takes at least 64 patches; 2 shapes have 6"
    ):
        training.train_codebook([few, few])


def test_sums_of_logarithms_are_those_of_scipy():
    joint = 40 * np.random.default_rng(5).standard_normal((300, 32))
    wanted = logsumexp(joint, axis=1, keepdims=True)
    np.testing.assert_allclose(codes.log_sums(joint), wanted, rtol=1e-14)
    tied = np.array([[2.0, 2.0, -700.0], [-3000.0, -3000.0, -3000.0]])
    expected = [[2 + np.log(2)], [np.log(3) - 3000]]
    np.testing.assert_allclose(codes.log_sums(tied), expected, rtol=1e-15)
