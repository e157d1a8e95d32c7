import numpy as np
import pytest
import scipy.sparse as sp
from pencils import cycle, dense_eigenvalues, graph, path, wild

from eigenshape.geometry.topology import disjoint_union
from eigenshape.operators.clouds.pair_loops import component_labels
from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.operators.laplacian import Laplacian
from eigenshape.shapes.surfaces import icosphere
from eigenshape.spectral.multilevel.aggregation import build_levels, scaled_top
from eigenshape.spectral.multilevel.multilevel_loops import grow_aggregates

pytestmark = pytest.mark.long


def grown(laplacian, size):
    matrix = laplacian.stiffness
    starts, columns = (part.astype(np.int32) for part in (matrix.indptr, matrix.indices))
    return grow_aggregates(starts, columns, matrix.data, size)


def test_a_path_is_cut_into_runs_by_hand():
    labels, count = grown(graph(path(9)), 3)
    assert labels.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    assert count == 3


def test_a_fragment_joins_its_neighbor():
    labels, count = grown(graph(path(9)), 8)  # one point is left over, less than a quarter of eight
    assert labels.tolist() == [0] * 9
    assert count == 1


def test_points_without_neighbors_stay_alone():
    labels, count = grown(Laplacian(sp.csr_array((4, 4)), sp.csr_array(sp.eye_array(4))), 3)
    assert labels.tolist() == [0, 1, 2, 3]
    assert count == 4


def test_aggregates_are_connected_and_of_the_size_asked_for():
    laplacian = cotangent_laplacian(disjoint_union(icosphere(4), icosphere(3)))
    labels, count = grown(laplacian, 16)
    sizes = np.bincount(labels)
    assert len(sizes) == count
    assert 10 < sizes.mean() < 20
    within = laplacian.stiffness.tocoo()
    same = labels[within.row] == labels[within.col]
    inside = sp.csr_array(
        (np.ones(same.sum()), (within.row[same], within.col[same])), shape=laplacian.stiffness.shape
    )
    assert component_labels(inside.indptr, inside.indices).max() + 1 <= 1.2 * count


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize(
    "laplacian", [cotangent_laplacian(icosphere(4)), graph(cycle(500)), wild()]
)
def test_constants_stay_constant_and_symmetry_stays(laplacian, smooth):
    levels, *coarsest = build_levels(
        laplacian.stiffness, laplacian.mass, 30, np.float64, smooth=smooth
    )
    assert levels
    assert levels[0].mass is None
    coarser = [(level.stiffness, level.mass) for level in levels[1:]] + [coarsest]
    for level, (stiffness, mass) in zip(levels, coarser, strict=True):
        np.testing.assert_allclose(level.prolong.sum(axis=1), 1, atol=1e-9)
        largest = stiffness.diagonal().max()
        np.testing.assert_allclose(stiffness.sum(axis=1), 0, atol=1e-9 * largest)
        assert (stiffness != stiffness.T).nnz == 0
        np.testing.assert_allclose(mass.sum(), laplacian.mass.sum(), rtol=1e-12)


@pytest.mark.long
def test_coarse_eigenvalues_are_near_and_above():
    laplacian = cotangent_laplacian(icosphere(4))
    _, *coarse = build_levels(laplacian.stiffness, laplacian.mass, 200, np.float64)
    exact, found = (dense_eigenvalues(each)[:16] for each in (laplacian, Laplacian(*coarse)))
    assert (found > exact - 1e-9).all()  # Rayleigh and Ritz
    np.testing.assert_allclose(found[1:], exact[1:], rtol=0.02)


def test_the_top_is_a_bound():
    for laplacian in (cotangent_laplacian(icosphere(3)), graph(cycle(100)), wild(10)):
        diagonal = sp.csr_array(sp.diags_array(laplacian.stiffness.diagonal()))
        largest = dense_eigenvalues(Laplacian(laplacian.stiffness, diagonal))[-1]
        assert largest <= scaled_top(laplacian.stiffness) * (1 + 1e-12)
