"""Local scaling: means of nearest distances, and what they change."""

import numpy as np
import pytest
from search_cases import RECIPE, make_source

from eigenshape.retrieval.patches.distance import patch_distances
from eigenshape.retrieval.search.coarse import coarse_rows
from eigenshape.retrieval.search.local_scaling import crowding, scale_locally


@pytest.mark.parametrize("n_shapes", [40, 5, 1])
def test_crowding_is_the_mean_distance_to_the_nearest(tmp_path, n_shapes):
    source = make_source(tmp_path, n_shapes)
    wholes = source.codes[:, 0]
    expected = np.zeros(n_shapes)
    for place in range(n_shapes):
        others = np.delete(patch_distances(wholes[place], wholes), place)
        expected[place] = np.sort(others)[:10].mean() if n_shapes > 1 else 0
    assert crowding(coarse_rows(source, RECIPE)) == pytest.approx(expected, abs=0.02)


def test_crowded_shapes_are_farther_and_groups_are_centered_apart():
    crowdings = np.array([0.2, 0.4, 0.6, 0.8], dtype=np.float32)
    closed = np.array([True, True, False, False])
    found = scale_locally(np.full(4, 0.5), crowdings, closed)
    assert found == pytest.approx([0.55, 0.45, 0.55, 0.45])
    assert scale_locally(np.zeros(1), crowdings[:1], closed[:1]) == pytest.approx(1e-3)
