"""Modes, groups, growth and symmetry: known answers, scikit-learn, and permutations counted by hand."""

from itertools import combinations, permutations, product

import numpy as np
import pytest
from scipy.stats import linregress
from sklearn.decomposition import PCA

import eigenshape as es

RNG = np.random.default_rng
morpho = es.morphometrics


def some_shapes(n=9, k=6, seed=0):
    return RNG(seed).standard_normal((n, k, 3))


def test_components_are_those_of_scikit_learn():
    shapes = some_shapes()
    found = morpho.principal_components(shapes)
    peer = PCA().fit(shapes.reshape(9, -1))
    np.testing.assert_allclose(found.shares, peer.explained_variance_ratio_[:8], atol=1e-12)
    np.testing.assert_allclose(found.variances, peer.explained_variance_[:8], atol=1e-12)
    scores = peer.transform(shapes.reshape(9, -1))[:, :8]
    np.testing.assert_allclose(np.abs(found.scores), np.abs(scores), atol=1e-9)
    np.testing.assert_allclose(found.scores.var(axis=0, ddof=1), found.variances)
    whole = [found.shape(scores) for scores in found.scores]
    np.testing.assert_allclose(whole, shapes, atol=1e-12)
    np.testing.assert_allclose(found.shape([]), shapes.mean(axis=0))
    assert (found.modes.reshape(8, -1).max(axis=1) == np.abs(found.modes).max(axis=(1, 2))).all()


def test_the_sign_of_a_mode_in_which_sides_move_alike_does_not_depend_on_the_last_digit():
    shape, change = some_shapes(1)[0], np.zeros((6, 3))
    change[[2, 4], 1] = -1.0, 1.0
    for steps in (np.array([-1.0, 0.1, 2.0]), np.array([2.0, 0.1, -1.0])):
        for tilt in (-1e-12, 1e-12):
            uneven = change + tilt * np.sign(change) * (np.arange(6) == 4)[:, None]
            found = morpho.principal_components(shape + steps[:, None, None] * uneven)
            assert found.modes[0, 2, 1] > 0


def test_modes_without_variance_are_left_out():
    change = some_shapes(1)[0]
    shapes = some_shapes(1, seed=1) + np.array([-2.0, 0.0, 1.0, 5.0])[:, None, None] * change
    found = morpho.principal_components(shapes)
    assert found.shares.tolist() == [1.0]
    along = np.abs(np.sum(found.modes[0] * change)) / np.linalg.norm(change)
    np.testing.assert_allclose(along, 1)
    with pytest.raises(es.InvalidParameterError, match="Shapes must differ; there are 1"):
        morpho.principal_components(shapes[:1])
    with pytest.raises(es.InvalidParameterError, match="Shapes must differ; there are 2"):
        morpho.principal_components(shapes[[0, 0]])
    with pytest.raises(es.InvalidParameterError, match="a list of at most 1 numbers"):
        found.shape([1.0, 2.0])


def test_groups_are_compared_by_all_divisions_of_both():
    shapes = some_shapes(11)
    shapes[:4] += 0.4 * some_shapes(1, seed=3)
    groups = ["b"] * 4 + ["a"] * 3 + ["c"] * 4
    found = morpho.compare_groups(shapes, groups)
    assert found.names == ("a", "b", "c")
    np.testing.assert_array_equal(found.means[1], shapes[:4].mean(axis=0))
    observed = np.linalg.norm(shapes[:4].mean(axis=0) - shapes[4:7].mean(axis=0))
    np.testing.assert_allclose(found.distances[0, 1], observed)
    far = []
    for rows in combinations(range(7), 4):
        others = [row for row in range(7) if row not in rows]
        apart = shapes[list(rows)].mean(axis=0) - shapes[others].mean(axis=0)
        far.append(np.linalg.norm(apart) > observed - 1e-9)
    np.testing.assert_allclose(found.p_values[[0, 1], [1, 0]], np.mean(far))
    assert found.p_values[2, 2] == 1
    with pytest.raises(es.InvalidParameterError, match="each of 11 specimens, 2 groups or more"):
        morpho.compare_groups(shapes, groups[1:])
    with pytest.raises(es.InvalidParameterError, match=r"11 entries, and the groups have .'7': 11"):
        morpho.compare_groups(shapes, [7] * 11)
    with pytest.raises(es.InvalidParameterError, match=r"'b': 1. specimens"):
        morpho.compare_groups(shapes[:4], list("aaab"))


@pytest.mark.long
@pytest.mark.parametrize("missing", [None, np.nan])
def test_a_specimen_without_a_group_is_no_group_of_its_own(missing):
    shapes = np.random.default_rng(0).standard_normal((6, 4, 3))
    with pytest.raises(es.InvalidParameterError, match=f"specimen; entry 4 is {missing}"):
        es.morphometrics.compare_groups(shapes, ["a", "a", "b", "b", missing, missing])


def test_groups_that_do_not_differ_have_all_p_values_and_those_that_do_small_ones():
    p_values = []
    for seed in range(12):
        shapes = some_shapes(30, seed=seed)
        p_values.append(morpho.compare_groups(shapes, [0, 1] * 15).p_values[0, 1])
        shapes[::2] += some_shapes(1, seed=99)
        assert morpho.compare_groups(shapes, [0, 1] * 15).p_values[0, 1] == 1 / 10_000
    assert 0.3 < np.mean(p_values) < 0.7
    assert sum(p < 0.1 for p in p_values) <= 4


def test_growth_is_the_line_of_each_coordinate():
    shapes, sizes = some_shapes(6), np.array([1.0, 2, 3, 5, 8, 13])
    shapes += 0.5 * np.log(sizes)[:, None, None] * some_shapes(1, seed=5)
    found = morpho.fit_allometry(shapes, sizes)
    flat = shapes.reshape(6, -1)
    lines = [linregress(np.log(sizes), column) for column in flat.T]
    np.testing.assert_allclose(found.slope.ravel(), [line.slope for line in lines])
    np.testing.assert_allclose(
        found.shapes([2.0, 1.0])[1].ravel(), [line.intercept for line in lines], atol=1e-12
    )
    explained = [line.rvalue**2 * column.var() for line, column in zip(lines, flat.T, strict=True)]
    np.testing.assert_allclose(found.share, np.sum(explained) / flat.var(axis=0).sum())
    fitted = found.shapes(sizes)
    np.testing.assert_allclose(fitted + found.residuals, shapes, atol=1e-12)
    steps = np.log(sizes) - np.log(sizes).mean()
    effects = [np.linalg.norm(np.array(order) @ flat) for order in permutations(steps)]
    np.testing.assert_allclose(found.p_value, np.mean(np.array(effects) >= effects[0] - 1e-9))
    np.testing.assert_allclose(
        linregress(np.log(sizes), found.scores).slope, np.linalg.norm(found.slope)
    )


def test_growth_of_a_known_slope_is_found_in_a_fit():
    rng = RNG(0)
    mean, change = rng.standard_normal((2, 12, 3))
    sizes = np.exp(rng.uniform(-1, 1, 40))
    shapes = mean + 0.02 * np.log(sizes)[:, None, None] * change
    shapes += 0.001 * rng.standard_normal(shapes.shape)
    fit = morpho.fit_procrustes(sizes[:, None, None] * shapes)
    found = morpho.fit_allometry(fit.shapes, fit.sizes)
    assert found.share > 0.9
    assert found.p_value == 1 / 10_000
    # The fitted line is the known one: nothing of it was taken for a motion or for size.
    own = np.linalg.norm(mean - mean.mean(axis=0))
    line = found.shapes(own * np.array([0.5, 2]))
    for size, shape in zip((0.5, 2), line, strict=True):
        known = mean + 0.02 * np.log(size) * change
        assert morpho.fit_procrustes([shape, known]).distances()[0, 1] < 1e-3
    assert morpho.fit_procrustes(line).distances()[0, 1] > 1e-2
    random = morpho.fit_allometry(fit.shapes, rng.permutation(fit.sizes))
    assert random.share < 0.2


def test_wrong_sizes_are_refused():
    with pytest.raises(
        es.InvalidParameterError, match="one for each shape, that differ; there are 8"
    ):
        morpho.fit_allometry(some_shapes(), np.arange(1, 9))
    with pytest.raises(es.InvalidParameterError, match="there are 9, between 2 and 2"):
        morpho.fit_allometry(some_shapes(), np.full(9, 2.0))
    with pytest.raises(
        es.InvalidParameterError, match="sizes must be positive and finite; entry 0 is 0"
    ):
        morpho.fit_allometry(some_shapes(), np.arange(9))


PAIRS = [[0, 1], [2, 3]]


def faces(n=7, spread=0.1, seed=0):
    """Return symmetric shapes: two pairs, and three points in the middle plane."""
    rng = RNG(seed)
    right = [1.0, 0, 0] + spread * rng.standard_normal((n, 2, 3)) + rng.standard_normal((2, 3))
    middle = (rng.standard_normal((3, 3)) + spread * rng.standard_normal((n, 3, 3))) * [0, 1, 1]
    shapes = np.concatenate([right, middle], axis=1)[:, [0, 0, 1, 1, 2, 3, 4]]
    shapes[:, [1, 3], 0] *= -1
    return shapes


def test_symmetric_shapes_have_no_asymmetry():
    found = morpho.symmetric_components(faces() @ some_turn(), PAIRS)
    assert np.abs(found.asymmetric).max() < 1e-9
    np.testing.assert_allclose(found.share_individual, 1)
    assert morpho.symmetric_components(faces(1), PAIRS).p_value == 1


def some_turn():
    return np.linalg.qr(RNG(8).standard_normal((3, 3)))[0]


def test_asymmetry_is_divided_into_that_of_all_and_that_of_each():
    shapes = faces(spread=0.0)
    shapes[:, 0, 1] += 0.3  # all to one side
    found = morpho.symmetric_components(shapes, PAIRS)
    np.testing.assert_allclose(found.share_directional, 1)
    np.testing.assert_allclose(found.p_value, 2 / 2**7)
    np.testing.assert_allclose(found.symmetric, np.stack([found.symmetric[0]] * 7), atol=1e-9)
    shapes = faces(40, spread=0.0)
    shapes[:, [0, 1], 1] += 0.1 * RNG(1).standard_normal((40, 1)) * [1, -1]  # each to its own
    found = morpho.symmetric_components(shapes, PAIRS)
    assert found.share_fluctuating > 0.9
    assert found.share_directional < 0.1
    assert found.p_value > 0.05
    total = found.share_individual + found.share_directional + found.share_fluctuating
    np.testing.assert_allclose(total, 1)


def test_components_add_up_to_shapes_and_the_test_counts_exchanges_of_sides():
    shapes = faces() + 0.1 * some_shapes(7, 7)
    found = morpho.symmetric_components(shapes, PAIRS)
    own = morpho.fit_procrustes([*shapes, *(found.symmetric + found.asymmetric)]).distances()
    assert own[np.arange(7), np.arange(7, 14)].max() < 1e-6
    flat = found.asymmetric.reshape(7, -1)
    effects = [np.linalg.norm(np.array(signs) @ flat) for signs in product([1, -1], repeat=7)]
    np.testing.assert_allclose(found.p_value, np.mean(np.array(effects) >= effects[0] - 1e-9))


def test_wrong_pairs_are_refused():
    for pairs in ([[0, 1], [1, 2]], [0, 1, 2], []):
        with pytest.raises(es.InvalidParameterError, match="pairs must have rows of two landmarks"):
            morpho.symmetric_components(faces(), pairs)
    with pytest.raises(es.InvalidParameterError, match=r"pairs must lie in 0..6; it is 7"):
        morpho.symmetric_components(faces(), [[0, 7]])
