import numpy as np

from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import dirichlet_laplacian
from eigenshape.shapes.surfaces import icosphere


def test_without_fixed_points_the_operator_is_the_given_one():
    laplacian = cotangent_laplacian(icosphere(1))
    same, free = dirichlet_laplacian(laplacian, [])
    assert same is laplacian
    np.testing.assert_array_equal(free, np.arange(laplacian.n_points))
