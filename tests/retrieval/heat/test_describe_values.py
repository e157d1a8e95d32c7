import numpy as np
import pytest

import eigenshape as es
from certeig.kit.errors import InvalidParameterError


@pytest.mark.parametrize(
    "function", [es.geometry.average_geodesic_distance, es.geometry.gaussian_curvature]
)
def test_features_are_the_maxima_of_the_function_and_vectors_those_of_heat(function):
    mesh = es.make_creature("quadruped", 1, n_vertices=800)
    values = function(mesh)
    found = es.retrieval.find_heat_features(mesh, es.retrieval.SCALE_FREE, values=values)
    features = es.segment(es.merge_tree(mesh, values), n_regions=15).features
    expected = es.retrieval.heat_descriptor(found.spectrum, features)
    assert np.array_equal(found.descriptor.vertices, expected.vertices)
    assert np.array_equal(found.descriptor.vectors, expected.vectors)
    assert np.array_equal(found.heat, values)
    assert not np.array_equal(
        found.descriptor.vertices, es.retrieval.find_heat_features(mesh).descriptor.vertices
    )


def test_values_are_checked():
    mesh = es.icosphere(1)
    with pytest.raises(
        InvalidParameterError, match=r"values must hold one number per vertex, shape \(42,\)"
    ):
        es.retrieval.find_heat_features(mesh, values=np.ones(3))
